"""A dialog that asks under which name something is to be saved."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

from imgui_bundle import imgui

from ..errors import InputError
from ..files import absolute, printable
from . import widgets
from .path_dialog import PathDialog

_QUESTION = "Replace the file?"


class SaveDialog(PathDialog):
    """Asks for the name, and whether to replace a file that is there already."""

    def __init__(
        self, title: str, about: str, suffix: str, save: Callable[[Path], None], redraw: Callable[[], None],
        others: Sequence[str] = (),
    ) -> None:  # fmt: skip
        """about: what is saved, a line. suffix: of the file, added where it has neither that nor one of the
        others. save: writes the file; it raises InputError where that cannot be."""
        super().__init__(title, about, (suffix, *others), "Save", redraw)
        self._save = save
        self._existing: Path | None = None  # file that the question is about

    def ask(self, path: Path) -> None:
        """Open the dialog. path: that is offered."""
        self._existing = None
        self._open(path.parent, path.name)

    def _named(self, text: str) -> Path:
        return named_file(text, *self._suffixes)

    def _use(self, file: Path) -> None:
        self._save(file)

    def _take_file(self, file: Path) -> None:
        if os.path.exists(file):
            self._existing = file
        else:
            super()._take_file(file)

    @property
    def _is_asking(self) -> bool:
        return self._existing is not None

    def _draw_inside(self) -> None:
        super()._draw_inside()
        with widgets.modal(_QUESTION, self._is_asking) as is_drawn:
            if is_drawn:
                self._draw_question()
                if not self._is_asking:
                    imgui.close_current_popup()

    def _draw_question(self) -> None:
        file = self._existing
        assert file is not None
        imgui.text_wrapped(printable(f"{file.name} exists already. Replace it?"))
        replaces = imgui.button("Replace")
        imgui.same_line()
        keeps = imgui.button("Keep") or imgui.is_key_pressed(imgui.Key.escape)
        imgui.set_item_default_focus()
        if replaces or keeps:
            self._existing, self._takes_keyboard = None, keeps
        if replaces:
            super()._take_file(file)


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
