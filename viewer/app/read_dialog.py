"""A dialog that asks which file is to be read."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path

from imgui_bundle import ImVec2, imgui

from ..errors import InputError
from ..files import absolute, printable
from ..task import Task, in_background
from . import widgets

_ROWS = 8  # of the list, that are shown at once
_MOST = 200  # files


class ReadDialog:
    """Names a file, by a field or by the list of those in its folder, the newest first.

    is_open: whether the dialog is.
    """

    def __init__(self, title: str, about: str, suffix: str, read: Callable[[Path], None]) -> None:
        """about: what is read, a line. suffix: of the files in the list. read: takes the file, or raises
        InputError where it cannot."""
        self._title, self._about, self._suffix, self._read = title, about, suffix, read
        self._path, self._problem = "", ""
        self._listed = ""  # folder
        self._files: list[str] = []  # their names
        self._listing: Future[list[str]] | None = None
        self._takes_keyboard = False
        self.is_open = False

    def ask(self, folder: Path) -> None:
        """Open the dialog. folder: whose files are offered."""
        self._path, self._problem, self._listed = os.path.join(folder, ""), "", ""
        self.is_open = self._takes_keyboard = True

    def draw(self) -> None:
        """Declare the dialog, while it is open."""
        with widgets.modal(self._title, self.is_open) as is_drawn:
            if is_drawn:
                self._draw_inside()
                if not self.is_open:
                    imgui.close_current_popup()

    def _draw_inside(self) -> None:
        imgui.text(self._about)
        if self._takes_keyboard:
            imgui.set_keyboard_focus_here()
            self._takes_keyboard = False
        imgui.set_next_item_width(-1)
        changed, self._path = widgets.edit_path("##path", self._path)
        if changed:
            self._problem = ""
        is_entered = imgui.is_item_deactivated() and imgui.is_key_pressed(imgui.Key.enter)
        self._draw_files()
        imgui.text_wrapped(printable(self._problem))
        if imgui.button("Read") or is_entered:
            self._try_to_read()
        imgui.same_line()
        if imgui.button("Cancel") or imgui.is_key_pressed(imgui.Key.escape):
            self.is_open = False

    def _draw_files(self) -> None:
        """Declare the list of the files in the folder of the field; one that is chosen is read."""
        self._list()
        height = _ROWS * imgui.get_text_line_height_with_spacing()
        flags = imgui.ChildFlags_.borders | imgui.ChildFlags_.nav_flattened  # Tab and arrows go through it
        imgui.begin_child("files", ImVec2(0, height), flags)
        for name in self._files:
            chosen = imgui.selectable(
                printable(name), False, imgui.SelectableFlags_.no_auto_close_popups.value
            )
            if chosen[0]:
                self._path = os.path.join(self._listed, name)
                self._try_to_read()
        if not self._files:
            told = "Reading ..." if self._listing else f"There is no {self._suffix} file in this folder."
            imgui.text_disabled(told)
        imgui.end_child()

    def _list(self) -> None:
        """Have the folder of the field listed where it is another; beside the window, which does not wait."""
        folder = os.path.dirname(self._typed)
        if folder != self._listed:
            self._listed, self._files, suffix = folder, [], self._suffix
            self._listing = in_background(Task("Listing files"), lambda: newest(folder, suffix))
        if self._listing is not None and self._listing.done():
            self._files, self._listing = self._listing.result(), None

    @property
    def _typed(self) -> str:
        """The text of the field, where ~ is the user's folder."""
        return os.path.expanduser(self._path.strip())

    def _try_to_read(self) -> None:
        path = Path(absolute(self._typed))
        try:
            if not os.path.isfile(path):
                raise InputError("there is no such file", path, "Choose one of the list")
            self._read(path)
        except InputError as error:
            self._problem, self._takes_keyboard = str(error), True
        else:
            self.is_open = False


def newest(folder: str, suffix: str) -> list[str]:
    """The names of a folder's files with a suffix, those changed last first; none of one that cannot be
    read."""
    try:
        with os.scandir(folder or ".") as entries:
            found = [
                (entry.stat().st_mtime, entry.name)
                for entry in entries
                if entry.name.lower().endswith(suffix) and entry.is_file()
            ]
    except OSError:
        return []
    return [name for _, name in sorted(found, reverse=True)[:_MOST]]
