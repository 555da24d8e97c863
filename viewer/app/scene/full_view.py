"""The 3D view alone: without panels, in the window or on the whole screen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..commands import Command
from ..keys import Keys
from ..part import WindowPart
from ..window import Window


@dataclass(eq=False)
class FullView(WindowPart):
    """Hides the panels, and takes the whole screen. is_on: whether the panels are hidden."""

    name = "full_view"
    window: Window
    keys: Keys
    note: Callable[[str], None]

    def __post_init__(self) -> None:
        self.is_on: bool = False

    @property
    def on_screen(self) -> bool:
        """Whether the window takes the whole screen."""
        return self.window.fullscreen

    def toggle(self) -> None:
        """Hide the panels, or show them again."""
        self.is_on = not self.is_on
        self._tell("panels")

    def toggle_screen(self) -> None:
        """Show the view alone on the whole screen; or the window with its panels as it was."""
        self.is_on = self.window.fullscreen = not self.on_screen
        self._tell("full_screen")

    def on_escape(self) -> bool:
        """Go back to the window with its panels; whether it was not that."""
        was_on, self.is_on = self.is_on, False
        if self.on_screen:
            self.window.fullscreen = False
        return was_on

    def _tell(self, command: str) -> None:
        """Say how to come back, as no menu does."""
        if self.is_on:
            keys = self.keys.of[command]
            self.note((f"{keys} or " if keys else "") + "Escape shows the panels again.")
        self.window.touch()

    COMMANDS = (
        Command("full_screen", "Full screen", toggle_screen, "F11", is_on=lambda view: view.on_screen),
        Command("panels", "Panels", toggle, "Tab", is_on=lambda view: not view.is_on),
    )
