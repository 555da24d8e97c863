"""A dialog that asks under which name something is to be saved."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from imgui_bundle import imgui

from ..errors import InputError
from ..files import absolute, printable
from . import widgets


class SaveDialog:
    """is_open: whether the dialog is."""

    def __init__(self, title: str, about: str, suffix: str, save: Callable[[Path], None]) -> None:
        """about: what is saved, a line. suffix: of the file, added where it is missing. save: writes the
        file; it raises InputError where that cannot be."""
        self._title, self._about, self._suffix, self._save = title, about, suffix, save
        self._path = ""
        self._problem = ""  # why it could not be saved under that name
        self._takes_keyboard = False
        self.is_open = False

    def ask(self, path: Path) -> None:
        """Open the dialog. path: that is offered."""
        self._path, self._problem = str(path), ""
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
        exists = self._exists
        imgui.text_wrapped(printable(self._problem) or ("This file is there already." if exists else ""))
        if imgui.button("Replace" if exists else "Save") or (is_entered and not exists):
            self._try_to_save()
        imgui.same_line()
        if imgui.button("Cancel") or imgui.is_key_pressed(imgui.Key.escape):
            self.is_open = False

    @property
    def _exists(self) -> bool:
        try:
            return os.path.exists(named_file(self._path, self._suffix))
        except InputError:
            return False

    def _try_to_save(self) -> None:
        try:
            self._save(named_file(self._path, self._suffix))
        except InputError as error:
            self._problem, self._takes_keyboard = str(error), True
        else:
            self.is_open = False


def named_file(text: str, suffix: str) -> Path:
    """The file that a user's text names: ~ is the user's folder, and the suffix is added where it is missing.

    Raises InputError where there is no folder for it, or no name.
    """
    typed = os.path.expanduser(text.strip())
    path = Path(absolute(typed))
    if not typed or os.path.isdir(path):
        raise InputError("is a folder", path, "Name a file in it")
    if not os.path.isdir(path.parent):
        raise InputError("there is no such folder", path.parent, "Create it first, or name another")
    return path if path.name.lower().endswith(suffix) else path.with_name(f"{path.name}{suffix}")
