"""The field that gives a measure another name."""

from __future__ import annotations

from imgui_bundle import imgui


class Renaming:
    """name: of the measure that is given another one, None where none is."""

    def __init__(self) -> None:
        self.name: str | None = None
        self._text = ""
        self._is_asked = False

    def begin(self, name: str) -> None:
        """Have the name of a measure typed."""
        self.name, self._text, self._is_asked = name, name, True

    def draw(self, width: float) -> str | None:
        """Declare the field; the new name once it is typed. Enter or a click elsewhere keeps it, Escape does
        not."""
        imgui.set_next_item_width(width)
        if self._is_asked:
            imgui.set_keyboard_focus_here()
            self._is_asked = False
        _, self._text = imgui.input_text("##name", self._text, imgui.InputTextFlags_.auto_select_all.value)
        if not imgui.is_item_deactivated():
            return None
        self.name = None
        return None if imgui.is_key_pressed(imgui.Key.escape) else self._text
