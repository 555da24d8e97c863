"""What dialogs that ask for a file share: a folder to go through, a field for the name, and two buttons."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path

from imgui_bundle import ImVec2, imgui

from ..errors import InputError
from ..scan.listing import Listed
from ..scan.times import natural_key
from . import widgets
from .files.folder_view import FolderView

_SIZE = ImVec2(52.0, 30.0)  # in heights of the font
_PLACES = 9.5  # width, likewise
_MOST = 1000  # files of a folder


class PathDialog(ABC):
    """Names a file: by a row of its folder, or by the field. Arrows go through the rows, Enter takes.

    is_open: whether the dialog is.
    """

    _goes_in = True  # whether its button goes into a folder that is chosen in the list

    def __init__(
        self, title: str, about: str, suffixes: Sequence[str], verb: str, redraw: Callable[[], None]
    ) -> None:
        """about: what the file is for, a line. suffixes: of the files that are listed. verb: on the button
        that takes the file. redraw: has the window drawn again."""
        self._title, self._about, self._suffixes = title, about, tuple(suffixes)
        self._verb, self._redraw = verb, redraw
        self._name = ""
        self._takes_keyboard = False
        self.is_open = False
        listed = f"{' or '.join(suffixes)} file" if suffixes else "other folder"
        self._view = FolderView(
            lambda folder: files_of(folder, self._suffixes), self._take, choose=self._choose,
            nothing=f"No {listed} in this folder.",
        )  # fmt: skip

    def _open(self, folder: Path, name: str) -> None:
        """Show the dialog on a folder. name: that is offered."""
        self._view.show(folder)
        self._name = name
        self.is_open = self._takes_keyboard = True

    def draw(self) -> None:
        """Declare the dialog, while it is open."""
        em, display = imgui.get_font_size(), imgui.get_io().display_size
        size = ImVec2(min(_SIZE.x * em, 0.94 * display.x), min(_SIZE.y * em, 0.9 * display.y))
        with widgets.modal(self._title, self.is_open, size) as is_drawn:
            if is_drawn:
                self._draw_inside()
                if not self.is_open:
                    imgui.close_current_popup()

    @abstractmethod
    def _use(self, file: Path) -> None:
        """Do with a file what the dialog is for. Raises InputError where that cannot be."""

    @abstractmethod
    def _named(self, text: str) -> Path:
        """The file of a path that the user has typed. Raises InputError where it cannot be used."""

    def _take(self, text: str) -> None:
        """Use the file that a text names, and close the dialog; where that cannot be, say why."""
        try:
            file = self._named(text)
        except InputError as error:
            self._refuse(error)
        else:
            self._take_file(file)

    def _take_file(self, file: Path) -> None:
        try:
            self._use(file)
        except InputError as error:
            self._refuse(error)
        else:
            self.is_open = False

    def _refuse(self, error: InputError) -> None:
        self._view.refusal, self._takes_keyboard = str(error), True

    def _choose(self, row: Listed) -> None:
        if row.frames:
            self._name = os.path.basename(row.path)

    @property
    def _path(self) -> str:
        """The path that the field names, in the folder that is shown unless it says another."""
        typed = self._name.strip()
        return os.path.join(self._view.folder, os.path.expanduser(typed)) if typed else ""

    @property
    def _is_asking(self) -> bool:
        """Whether a question stands over the dialog."""
        return False

    # --- widgets ----------------------------------------------------------------------

    def _draw_inside(self) -> None:
        if self._view.advance() or self._view.waits:
            self._redraw()
        if not self._is_asking:
            self._view.take_keys(field=True)
        imgui.text_wrapped(self._about)
        self._view.draw_path()
        foot = 2 * imgui.get_frame_height_with_spacing() + imgui.get_style().item_spacing.y
        if self._view.refusal:
            foot += 2 * imgui.get_text_line_height_with_spacing()
        imgui.begin_child("places", ImVec2(_PLACES * imgui.get_font_size(), -foot), imgui.ChildFlags_.borders)
        self._view.draw_known_folders()
        imgui.end_child()
        imgui.same_line()
        imgui.begin_child("rows", ImVec2(0, -foot), imgui.ChildFlags_.borders)
        self._view.draw_rows()
        imgui.end_child()
        self._draw_name()
        self._view.draw_refusal()
        self._draw_buttons()

    def _draw_name(self) -> None:
        imgui.align_text_to_frame_padding()
        imgui.text("Name")
        imgui.same_line(_PLACES * imgui.get_font_size() + 2 * imgui.get_style().item_spacing.x)
        imgui.set_next_item_width(-1)
        if self._takes_keyboard:
            imgui.set_keyboard_focus_here()
            self._takes_keyboard = False
        changed, self._name = widgets.edit_path("##name", self._name)
        widgets.tooltip("Name of the file, or a path. Up and Down move through the rows")
        if changed:
            self._view.refusal = ""
        if imgui.is_item_deactivated() and imgui.is_key_pressed(imgui.Key.enter):
            self._take(self._path)

    def _draw_buttons(self) -> None:
        row = self._view.row
        goes = self._goes_in and not self._name.strip() and row is not None and not row.frames
        if imgui.button(widgets.labelled("Go" if goes else self._verb, "take")):
            if goes and row is not None:
                self._view.take(row)
            else:
                self._take(self._path)
        imgui.same_line()
        leaves = imgui.button("Cancel") or imgui.is_key_pressed(imgui.Key.escape)
        if leaves and not self._is_asking:
            self.is_open = False


def files_of(folder: Path, suffixes: Sequence[str]) -> list[Listed]:
    """The folders in a folder, in natural order, then its files with one of the suffixes, those changed last
    first. Raises OSError where it cannot be read."""
    with os.scandir(folder) as entries:
        found = [entry for entry in entries if not entry.name.startswith(".")]
    folders = sorted((entry for entry in found if entry.is_dir()), key=lambda entry: natural_key(entry.name))
    named = [entry for entry in found if entry.name.lower().endswith(tuple(suffixes)) and entry.is_file()]
    files = sorted(((entry.stat(), entry) for entry in named), key=lambda one: -one[0].st_mtime)
    return [
        *(Listed(entry.path, entry.name, "folder", 0) for entry in folders),
        *(Listed(entry.path, entry.name, "file", 1, stat.st_size, stat.st_mtime) for stat, entry in files),
    ][:_MOST]
