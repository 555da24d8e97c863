"""A dialog that asks under which name something is to be saved."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

from imgui_bundle import imgui

from ..errors import InputError
from ..files import absolute
from .path_dialog import PathDialog


class SaveDialog(PathDialog):
    """Asks for the name, and says where a file of that name is there already."""

    def __init__(
        self, title: str, about: str, suffix: str, save: Callable[[Path], None], others: Sequence[str] = ()
    ) -> None:
        """about: what is saved, a line. suffix: of the file, added where it has neither that nor one of the
        others. save: writes the file; it raises InputError where that cannot be."""
        super().__init__(title, about)
        self._suffixes, self._save = (suffix, *others), save

    def ask(self, path: Path) -> None:
        """Open the dialog. path: that is offered."""
        self._open(str(path))

    def _draw_below(self, is_entered: bool) -> None:
        exists = self._exists
        self._draw_problem("This file exists already." if exists else "")
        if imgui.button("Replace" if exists else "Save") or (is_entered and not exists):
            self._try(self._save, lambda text: named_file(text, *self._suffixes))

    @property
    def _exists(self) -> bool:
        try:
            return os.path.exists(named_file(self._path, *self._suffixes))
        except InputError:
            return False


def named_file(text: str, suffix: str, *others: str) -> Path:
    """The file that a user's text names: ~ is the user's folder, and the suffix is added where it has neither
    that nor one of the others.

    Raises InputError where there is no folder for it, or no name.
    """
    typed = os.path.expanduser(text.strip())
    path = Path(absolute(typed))
    if not typed or os.path.isdir(path):
        raise InputError("is a folder", path, "Name a file in it")
    if not os.path.isdir(path.parent):
        raise InputError("this folder does not exist", path.parent, "Create it first, or name another")
    return path if path.name.lower().endswith((suffix, *others)) else path.with_name(f"{path.name}{suffix}")
