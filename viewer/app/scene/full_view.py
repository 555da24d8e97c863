"""The 3D view alone: without panels, in the window or on the whole screen."""

from __future__ import annotations

from collections.abc import Callable

from ..keys import Keys
from ..window import Window


class FullView:
    """Hides the panels, and takes the whole screen. is_on: whether the panels are hidden."""

    def __init__(self, window: Window, keys: Keys, note: Callable[[str], None]) -> None:
        """keys: that bring the panels back. note: tells the user of them."""
        self._window, self._keys, self._note = window, keys, note
        self.is_on: bool = False

    @property
    def on_screen(self) -> bool:
        """Whether the window takes the whole screen."""
        return self._window.fullscreen

    def toggle(self) -> None:
        """Hide the panels, or show them again."""
        self.is_on = not self.is_on
        self._tell("panels")

    def toggle_screen(self) -> None:
        """Show the view alone on the whole screen; or the window with its panels as it was."""
        self.is_on = self._window.fullscreen = not self.on_screen
        self._tell("full_screen")

    def on_escape(self) -> bool:
        """Go back to the window with its panels; whether it was not that."""
        was_on, self.is_on = self.is_on, False
        if self.on_screen:
            self._window.fullscreen = False
        return was_on

    def _tell(self, command: str) -> None:
        """Say how to come back, as no menu does."""
        if self.is_on:
            keys = self._keys.of[command]
            self._note((f"{keys} or " if keys else "") + "Escape shows the panels again.")
        self._window.touch()
