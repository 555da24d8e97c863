"""Undo and redo, and where one step of the history ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from .commands import Command
from .keys import Keys
from .part import WindowPart
from .scene.steering import Steering
from .session import Session
from .toolbox import Toolbox


@dataclass(eq=False)
class Editing(WindowPart):
    """Takes changes of the document back, and makes them again."""

    name = "editing"
    doing = "Recording the undo history"
    session: Session
    tools: Toolbox
    steering: Steering
    keys: Keys
    is_replaying: Callable[[], bool]

    def undo(self) -> None:
        """Take back the last change of the document; first of all what a tool has begun."""
        if self.tools.is_under_way:
            self.tools.abandon()
        else:
            self._step(self.session.history.undo)

    def redo(self) -> None:
        """Make the change again that was undone last."""
        self.tools.abandon()
        self._step(self.session.history.redo)

    def _step(self, step: Callable[[], object]) -> None:
        """Go to another document of the history. Tools lay numbers for the colours that this one shows."""
        before = self.session.document.look.color_by
        step()
        if self.session.document.look.color_by != before:
            self.session.laid.ask_anew()

    def advance(self, now: float) -> None:
        """End the step of the history that a drag or typing is, once it is over."""
        goes_on = imgui.is_any_item_active() or self.keys.is_arrow_held
        if self.steering.rests(now) and not self.is_replaying() and not goes_on:
            self.session.history.settle()

    COMMANDS = (
        Command(
            "undo", "Undo", undo, "Ctrl+Z", short="Undo", icon=icons.ICON_FA_ARROW_ROTATE_LEFT,
            can=lambda editing: editing.tools.is_under_way or editing.session.history.undoes is not None,
            title_now=lambda editing: f"Undo {editing.session.history.undoes or ''}",
        ),
        Command(
            "redo", "Redo", redo, "Ctrl+Y Ctrl+Shift+Z", short="Redo", icon=icons.ICON_FA_ARROW_ROTATE_RIGHT,
            can=lambda editing: editing.session.history.redoes is not None,
            title_now=lambda editing: f"Redo {editing.session.history.redoes or ''}",
        ),
    )  # fmt: skip
