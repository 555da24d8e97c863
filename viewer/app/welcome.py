"""What somebody who starts Scan4D for the first time needs to know, on a card over the demo."""

from __future__ import annotations

from dataclasses import dataclass

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from ..scan.open import DEMO
from . import widgets
from .part import ViewArea, WindowPart, remembered
from .session import Session

_LINES = (
    (icons.ICON_FA_FOLDER_OPEN, "Drag a scan here, or press Ctrl+O"),
    (icons.ICON_FA_ROTATE, "Drag with the left button to turn the view"),
    (icons.ICON_FA_RULER, "M measures between two points"),
    (icons.ICON_FA_KEYBOARD, "F1 shows all keys"),
)
_FLAGS = widgets.FLOATING | imgui.WindowFlags_.no_inputs | imgui.WindowFlags_.no_nav
_TEXT_AT = 2.2  # in heights of the font


@dataclass(eq=False)
class Welcome(WindowPart):
    """The card."""

    name = "welcome"
    layer = 70
    shows = "The welcome card"
    session: Session
    is_over: bool = remembered(False)  # whether it was seen, in this window or one before

    @property
    def _is_shown(self) -> bool:
        return not self.is_over and self.session.scan == DEMO

    def on_escape(self) -> bool:
        """Send the card away; whether it was there."""
        was_shown = self._is_shown
        self.is_over = self.is_over or was_shown
        return was_shown

    def dialog(self, view: ViewArea) -> None:
        """Declare it at the top of the 3D view, where the demo is shown, until the first act, which is done
        as without it."""
        if not self._is_shown:
            return
        if _is_act():
            self.is_over = True
            return
        left, top, width, _ = view
        em = imgui.get_font_size()
        imgui.set_next_window_pos(ImVec2(left + width / 2, top + em), imgui.Cond_.always, ImVec2(0.5, 0.0))
        imgui.begin("welcome", None, _FLAGS)
        for icon, text in _LINES:
            imgui.text_disabled(icon)
            imgui.same_line(_TEXT_AT * em)
            imgui.push_text_wrap_pos(max(width - 2 * em, 12 * em))
            imgui.text_unformatted(text)
            imgui.pop_text_wrap_pos()
        imgui.end()


def _is_act() -> bool:
    """Whether a button, the wheel or a key was used just now."""
    buttons = range(imgui.MouseButton_.count.value)
    if imgui.get_io().mouse_wheel or any(imgui.is_mouse_clicked(button) for button in buttons):
        return True
    keys = range(imgui.Key.named_key_begin.value, imgui.Key.gamepad_start.value)
    return any(imgui.is_key_pressed(imgui.Key(key)) for key in keys)
