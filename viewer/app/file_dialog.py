"""The dialog that asks for a file to open or to save, or for a folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from imgui_bundle import ImVec2, imgui

from ..errors import InputError
from ..files import absolute, printable
from ..scan.listing import Listed
from ..scan.times import natural_key
from . import widgets
from .files.folder_view import FolderView

_SIZE = ImVec2(52.0, 30.0)  # in heights of the font
_KNOWN_WIDTH = 9.5  # of the list of known folders, likewise
_MOST = 1000  # files of a folder
_QUESTION = "Replace the file?"


def named_file(text: str, suffix: str, *others: str) -> Path:
    """The file that a user's text names: ~ is the user's folder. A name without one of the suffixes gets the
    first.

    Raises InputError if the text names a folder, or a file in a folder that does not exist.
    """
    typed = os.path.expanduser(text.strip())
    path = Path(absolute(typed))
    if not typed or os.path.isdir(path):
        raise InputError("is a folder", path, "Name a file in it")
    if not os.path.isdir(path.parent):
        hint = "Create this folder first, or choose another folder"
        raise InputError("this folder does not exist", path.parent, hint)
    return path if path.name.lower().endswith((suffix, *others)) else path.with_name(f"{path.name}{suffix}")


def present_file(text: str, *_: str) -> Path:
    """The file that a user's text names, where ~ is the user's folder. Raises InputError if it does not
    exist."""
    path = Path(absolute(os.path.expanduser(text.strip())))
    if not path.is_file():
        raise InputError("this file does not exist", path, "Choose a file or folder from the list")
    return path


def present_folder(text: str, *_: str) -> Path:
    """The folder that a user's text names, where ~ is the user's folder. Raises InputError if it does not
    exist."""
    path = Path(absolute(os.path.expanduser(text.strip())))
    if not path.is_dir():
        raise InputError("this folder does not exist", path, "Choose a file or folder from the list")
    return path


class Purpose(NamedTuple):
    """Task of a dialog. verb: on the button that takes the file. named: the path that a text names, by
    the suffixes of the dialog; raises InputError for one that cannot be used."""

    verb: str
    named: Callable[..., Path]


OPEN = Purpose("Open", present_file)
SAVE = Purpose("Save", named_file)
FOLDER = Purpose("Choose", present_folder)


class FileDialog:
    """Names a file: by a row of its folder, or by the field. Arrows go through the rows, Enter takes.

    A dialog that saves asks before it replaces a file.

    is_open: whether the dialog is.
    """

    def __init__(
        self,
        purpose: Purpose,
        title: str,
        about: str,
        suffixes: Sequence[str],
        use: Callable[[Path], object],
        redraw: Callable[[], None],
    ) -> None:
        """purpose: `OPEN`, `SAVE` or `FOLDER`. about: what the file is for, a line. suffixes: of the files
        that are listed; none for folders. use: takes the file, or raises InputError where that cannot be.
        redraw: has the window drawn again."""
        self._purpose, self._title, self._about = purpose, title, about
        self._suffixes, self._use_file, self._redraw = tuple(suffixes), use, redraw
        self._name = ""
        self._takes_keyboard = False
        self._existing: Path | None = None  # file that the question is about
        self.is_open = False
        listed = f"{' or '.join(suffixes)} file" if suffixes else "other folder"
        self._view = FolderView(
            lambda folder: files_of(folder, self._suffixes), self._take, choose=self._choose,
            nothing=f"No {listed} in this folder.",
        )  # fmt: skip

    def ask(self, path: Path) -> None:
        """Open the dialog on a folder, or on that of a file whose name is offered."""
        is_folder = path.is_dir()
        self._view.show(path if is_folder else path.parent)
        self._name, self._existing = "" if is_folder else path.name, None
        self.is_open = self._takes_keyboard = True

    def draw(self) -> None:
        """Declare the dialog, while it is open."""
        em, display = imgui.get_font_size(), imgui.get_io().display_size
        size = ImVec2(min(_SIZE.x * em, 0.94 * display.x), min(_SIZE.y * em, 0.9 * display.y))
        with widgets.modal(self._title, self.is_open, size) as is_drawn:
            if is_drawn:
                self._draw_inside()
                self._draw_question()
                if not self.is_open:
                    imgui.close_current_popup()

    def _take(self, text: str) -> None:
        """Use the file that a text names, and close the dialog; where that cannot be, say why."""
        try:
            file = self._purpose.named(text, *self._suffixes)
        except InputError as error:
            self._refuse(error)
        else:
            if self._purpose is SAVE and os.path.exists(file):
                self._existing = file
            else:
                self._use(file)

    def _use(self, file: Path) -> None:
        try:
            self._use_file(file)
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
        if not typed:
            return str(self._view.folder) if self._purpose is FOLDER else ""
        return os.path.join(self._view.folder, os.path.expanduser(typed))

    # --- widgets ----------------------------------------------------------------------

    def _draw_inside(self) -> None:
        if self._view.advance() or self._view.waits:
            self._redraw()
        if self._existing is None:
            self._view.take_keys(field=True)
        imgui.text_wrapped(self._about)
        self._view.draw_path()
        foot = 2 * imgui.get_frame_height_with_spacing() + imgui.get_style().item_spacing.y
        if self._view.refusal:
            foot += 2 * imgui.get_text_line_height_with_spacing()
        known = ImVec2(_KNOWN_WIDTH * imgui.get_font_size(), -foot)
        imgui.begin_child("known", known, imgui.ChildFlags_.borders)
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
        imgui.same_line(_KNOWN_WIDTH * imgui.get_font_size() + 2 * imgui.get_style().item_spacing.x)
        imgui.set_next_item_width(-1)
        if self._takes_keyboard:
            imgui.set_keyboard_focus_here()
            self._takes_keyboard = False
        changed, self._name = widgets.edit_path("##name", self._name)
        widgets.tooltip("Name or path of the file. The arrow keys select a row of the list")
        if changed:
            self._view.refusal = ""
        if imgui.is_item_deactivated() and imgui.is_key_pressed(imgui.Key.enter):
            self._take(self._path)

    def _draw_buttons(self) -> None:
        row = self._view.row
        is_folder = row is not None and not row.frames
        goes = self._purpose is not FOLDER and is_folder and not self._name.strip()
        if imgui.button(widgets.labelled("Go" if goes else self._purpose.verb, "take")):
            if goes and row is not None:
                self._view.take(row)
            else:
                self._take(self._path)
        imgui.same_line()
        leaves = imgui.button("Cancel") or imgui.is_key_pressed(imgui.Key.escape)
        if leaves and self._existing is None:
            self.is_open = False

    def _draw_question(self) -> None:
        """Declare the question whether to replace a file, while there is one."""
        file = self._existing
        with widgets.modal(_QUESTION, file is not None) as is_drawn:
            if not is_drawn or file is None:
                return
            imgui.text_wrapped(printable(f"{file.name} exists already. Replace it?"))
            replaces = imgui.button("Replace")
            imgui.same_line()
            leaves = imgui.button("Keep") or imgui.is_key_pressed(imgui.Key.escape)
            imgui.set_item_default_focus()
            if replaces or leaves:
                self._existing, self._takes_keyboard = None, leaves
                imgui.close_current_popup()
            if replaces:
                self._use(file)


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
