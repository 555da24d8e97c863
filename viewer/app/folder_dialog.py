"""A dialog that asks for a folder."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from ..errors import InputError
from ..files import absolute
from .path_dialog import PathDialog


class FolderDialog(PathDialog):
    """Names a folder that is there: the one that the dialog shows, unless the user types another."""

    _goes_in = False

    def __init__(
        self, title: str, about: str, choose: Callable[[Path], None], redraw: Callable[[], None]
    ) -> None:
        """about: what the folder is for, a line. choose: takes it."""
        super().__init__(title, about, (), "Choose", redraw)
        self._choose_folder = choose

    def ask(self, folder: Path) -> None:
        """Open the dialog. folder: that is shown first."""
        self._open(folder, "")

    def _named(self, text: str) -> Path:
        path = Path(absolute(os.path.expanduser(text.strip()))) if text.strip() else self._view.folder
        if not path.is_dir():
            raise InputError("this folder does not exist", path, "Choose one from the list")
        return path

    def _use(self, file: Path) -> None:
        self._choose_folder(file)
