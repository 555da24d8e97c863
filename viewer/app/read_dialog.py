"""A dialog that asks which file is to be read."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

from ..errors import InputError
from ..files import absolute
from .path_dialog import PathDialog


class ReadDialog(PathDialog):
    """Names a file that is there."""

    def __init__(
        self, title: str, about: str, suffix: str, read: Callable[[Path], None], redraw: Callable[[], None],
        others: Sequence[str] = (),
    ) -> None:  # fmt: skip
        """about: what is read, a line. suffix, others: of the files in the list. read: takes the file, or
        raises InputError where it cannot."""
        super().__init__(title, about, (suffix, *others), "Read", redraw)
        self._read = read

    def ask(self, folder: Path) -> None:
        """Open the dialog. folder: whose files are offered."""
        self._open(folder, "")

    def _named(self, text: str) -> Path:
        return present_file(text)

    def _use(self, file: Path) -> None:
        self._read(file)


def present_file(text: str) -> Path:
    """The file that a user's text names, where ~ is the user's folder. Raises InputError where it is not
    there."""
    path = Path(absolute(os.path.expanduser(text.strip())))
    if not path.is_file():
        raise InputError("this file does not exist", path, "Choose one from the list")
    return path
