"""What dialogs that ask for a file share: a field for its path, what is wrong with that, and two buttons."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path

from imgui_bundle import imgui

from ..errors import InputError
from ..files import printable
from . import widgets


class PathDialog(ABC):
    """Names a file by a field.

    is_open: whether the dialog is.
    """

    def __init__(self, title: str, about: str) -> None:
        """about: what the file is for, a line."""
        self._title, self._about = title, about
        self._path, self._problem = "", ""  # what is typed; why that could not be used
        self._takes_keyboard = False
        self.is_open = False

    def _open(self, path: str) -> None:
        """Show the dialog. path: that is offered."""
        self._path, self._problem = path, ""
        self.is_open = self._takes_keyboard = True

    def draw(self) -> None:
        """Declare the dialog, while it is open."""
        with widgets.modal(self._title, self.is_open) as is_drawn:
            if is_drawn:
                self._draw_inside()
                if not self.is_open:
                    imgui.close_current_popup()

    @abstractmethod
    def _draw_below(self, is_entered: bool) -> None:
        """Declare what is between the field and the button that closes. is_entered: the field, by Enter."""

    def _draw_inside(self) -> None:
        imgui.text(self._about)
        if self._takes_keyboard:
            imgui.set_keyboard_focus_here()
            self._takes_keyboard = False
        imgui.set_next_item_width(-1)
        changed, self._path = widgets.edit_path("##path", self._path)
        if changed:
            self._problem = ""
        self._draw_below(imgui.is_item_deactivated() and imgui.is_key_pressed(imgui.Key.enter))
        imgui.same_line()
        if imgui.button("Cancel") or imgui.is_key_pressed(imgui.Key.escape):
            self.is_open = False

    def _draw_problem(self, note: str = "") -> None:
        """Declare what is wrong, else a note."""
        imgui.text_wrapped(printable(self._problem) or note)

    def _try(self, use: Callable[[Path], None], name: Callable[[str], Path]) -> None:
        """Use the file that the field names, and close the dialog; where either raises InputError, say it."""
        try:
            use(name(self._path))
        except InputError as error:
            self._problem, self._takes_keyboard = str(error), True
        else:
            self.is_open = False
