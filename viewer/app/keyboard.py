"""Which part of the window has the keyboard: the 3D view, or widgets that arrows and Tab go through.

ImGui leads the keyboard through the widgets of one window at a time. Here only the part that the user went to
lets it; all others leave arrows, Tab, Space and Enter to the commands of the window.
"""

from __future__ import annotations

from imgui_bundle import imgui

from .commands import Command
from .part import WindowPart

VIEW = "view"
NO_KEYS = imgui.WindowFlags_.no_nav_inputs.value
_BUTTONS = 3  # of a mouse


class Keyboard(WindowPart):
    """Leads the keyboard from part to part. part: the one that has it, by name: `VIEW` at first, and whenever
    the mouse is pressed."""

    name = "keyboard"
    layer = 50

    def __init__(self) -> None:
        self.part = VIEW
        self._there: list[str] = []  # parts with widgets, in the last frame
        self._drawn: list[str] = []  # the same in this one
        self._enters = False  # the part is to take the keyboard when it is drawn

    def begin_frame(self) -> None:
        """Let go of a part that is gone, or that the mouse went away from."""
        self._there, self._drawn = self._drawn, []
        is_pressed = any(imgui.is_mouse_clicked(button) for button in range(_BUTTONS))
        if is_pressed or self.part not in (VIEW, *self._there):
            self.part = VIEW

    def go(self, by: int) -> None:
        """Go to the next part, 1, or the one before, -1, round the end."""
        parts = [VIEW, *self._there]
        self.part = parts[(parts.index(self.part) + by) % len(parts)]
        self._enters = self.part != VIEW
        if not self._enters:
            imgui.set_window_focus(VIEW)

    def on_escape(self) -> bool:
        """Go back to the view; whether the keyboard was elsewhere."""
        was_elsewhere = self.part != VIEW
        if was_elsewhere:
            self.part = VIEW
            imgui.set_window_focus(VIEW)
        return was_elsewhere

    def flags(self, part: str) -> int:
        """Flags for the ImGui window of a part with widgets, which is drawn now."""
        self._drawn.append(part)
        return 0 if part == self.part else NO_KEYS

    def take(self, part: str) -> None:
        """Lead the keyboard to the first widget of a part, or the one it was at, when the user goes there;
        in its ImGui window, before its widgets."""
        if part != self.part:
            return
        if self._enters:
            self._enters = False
            imgui.set_window_focus()
            imgui.internal.nav_init_window(imgui.internal.get_current_window(), False)
            imgui.set_nav_cursor_visible(True)
        elif not _is_here():
            self.part = VIEW

    COMMANDS = (
        Command("next_part", "Focus next area", lambda keyboard: keyboard.go(1), "F6 Ctrl+F6"),
        Command("part_before", "Focus previous area", lambda keyboard: keyboard.go(-1), "Shift+F6"),
    )


def _is_here() -> bool:
    """Whether the current ImGui window has the focus, or a list that hangs on it."""
    whole = imgui.FocusedFlags_.root_and_child_windows.value
    is_list_open = imgui.is_popup_open("", imgui.PopupFlags_.any_popup)
    return is_list_open or imgui.is_window_focused(whole)
