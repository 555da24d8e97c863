"""The 3D view alone: without panels, in the window or on the whole screen."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..app import App


class FullView:
    """is_on: whether the panels are hidden."""

    def __init__(self, app: App) -> None:
        self._app = app
        self.is_on = False

    @property
    def on_screen(self) -> bool:
        """Whether the window takes the whole screen."""
        return self._app.window.fullscreen

    def toggle(self) -> None:
        """Hide the panels, or show them again."""
        self.is_on = not self.is_on
        self._tell("panels")

    def toggle_screen(self) -> None:
        """The view alone on the whole screen; or the window with its panels as it was."""
        self.is_on = self._app.window.fullscreen = not self.on_screen
        self._tell("full_screen")

    def on_escape(self) -> bool:
        """Back to the window with its panels; whether it was not that."""
        was_on, self.is_on = self.is_on, False
        if self.on_screen:
            self._app.window.fullscreen = False
        return was_on

    def _tell(self, command: str) -> None:
        """How to come back, as no menu says so."""
        if self.is_on:
            keys = self._app.keys.of[command]
            self._app.note((f"{keys} or " if keys else "") + "Escape brings the panels back.")
        self._app.window.touch()
