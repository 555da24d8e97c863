"""A dialog that asks which file is to be read."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from pathlib import Path

from imgui_bundle import ImVec2, imgui

from ..errors import InputError
from ..files import absolute, printable
from ..task import Task, in_background
from . import widgets
from .path_dialog import PathDialog

_ROWS = 8  # of the list, that are shown at once
_MOST = 200  # files


class ReadDialog(PathDialog):
    """Names a file, by the field or by the list of those in its folder, the newest first."""

    def __init__(
        self, title: str, about: str, suffix: str, read: Callable[[Path], None], others: Sequence[str] = ()
    ) -> None:
        """about: what is read, a line. suffix, others: of the files in the list. read: takes the file, or
        raises InputError where it cannot."""
        super().__init__(title, about)
        self._suffixes, self._read = (suffix, *others), read
        self._listed = ""  # folder
        self._files: list[str] = []  # their names
        self._listing: Future[list[str]] | None = None

    def ask(self, folder: Path) -> None:
        """Open the dialog. folder: whose files are offered."""
        self._open(os.path.join(folder, ""))
        self._listed = ""

    def _draw_below(self, is_entered: bool) -> None:
        self._draw_files()
        self._draw_problem()
        if imgui.button("Read") or is_entered:
            self._try(self._read, present_file)

    def _draw_files(self) -> None:
        """Declare the list of the files in the folder of the field; one that is chosen is read."""
        self._list()
        height = _ROWS * imgui.get_text_line_height_with_spacing()
        flags = imgui.ChildFlags_.borders | imgui.ChildFlags_.nav_flattened  # Tab and arrows go through it
        imgui.begin_child("files", ImVec2(0, height), flags)
        for name in self._files:
            chosen = imgui.selectable(
                widgets.unhidden(printable(name)), False, imgui.SelectableFlags_.no_auto_close_popups.value
            )
            if chosen[0]:
                self._path = os.path.join(self._listed, name)
                self._try(self._read, present_file)
        if not self._files:
            known = " or ".join(self._suffixes)
            told = "Reading ..." if self._listing else f"There is no {known} file in this folder."
            imgui.text_disabled(told)
        imgui.end_child()

    def _list(self) -> None:
        """Have the folder of the field listed where it is another; beside the window, which does not wait."""
        folder = os.path.dirname(_typed(self._path))
        if folder != self._listed:
            self._listed, self._files, suffixes = folder, [], self._suffixes
            self._listing = in_background(Task("Listing files"), lambda: newest(folder, *suffixes))
        if self._listing is not None and self._listing.done():
            self._files, self._listing = self._listing.result(), None


def present_file(text: str) -> Path:
    """The file that a user's text names, where ~ is the user's folder. Raises InputError where it is not
    there."""
    path = Path(absolute(_typed(text)))
    if not path.is_file():
        raise InputError("this file does not exist", path, "Choose one from the list")
    return path


def _typed(text: str) -> str:
    return os.path.expanduser(text.strip())


def newest(folder: str, *suffixes: str) -> list[str]:
    """The names of a folder's files with one of the suffixes, those changed last first; none of one that
    cannot be read."""
    try:
        with os.scandir(folder or ".") as entries:
            found = [
                (entry.stat().st_mtime, entry.name)
                for entry in entries
                if entry.name.lower().endswith(suffixes) and entry.is_file()
            ]
    except OSError:
        return []
    return [name for _, name in sorted(found, reverse=True)[:_MOST]]
