"""Which key does what. One table: for handling, and for the list that the panel shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from imgui_bundle import imgui

if TYPE_CHECKING:
    from .app import App


@dataclass(frozen=True)
class Command:
    """A key and what it does. repeats: again and again while it is held."""

    key: str
    chord: int
    does: str
    act: Callable[[App], None]
    repeats: bool = False


COMMANDS = (
    Command("Space", imgui.Key.space, "play, pause", lambda app: app.toggle_play()),
    Command("Right", imgui.Key.right_arrow, "next frame", lambda app: app.step(1), repeats=True),
    Command("Left", imgui.Key.left_arrow, "previous frame", lambda app: app.step(-1), repeats=True),
    Command("Home", imgui.Key.home, "first frame", lambda app: app.seek(0)),
    Command("End", imgui.Key.end, "last frame", lambda app: app.seek(len(app.playback.timeline) - 1)),
    Command("L", imgui.Key.l, "loop on, off", lambda app: app.toggle_loop()),
    Command("F", imgui.Key.f, "fit the view", lambda app: app.fit()),
    Command("B", imgui.Key.b, "next renderer", lambda app: app.next_backend()),
    Command("P", imgui.Key.p, "save the picture", lambda app: app.screenshot()),
    Command("Ctrl+Q", imgui.Key.mod_ctrl | imgui.Key.q, "quit", lambda app: app.quit()),
)
MOUSE = (
    ("Left drag", "orbit"),
    ("Middle drag, Shift+left", "pan"),
    ("Wheel, right drag", "zoom"),
)


def handle(app: App) -> None:
    """Do what the keys pressed since the last frame say; keys typed into a text go there."""
    for command in COMMANDS:
        flags = imgui.InputFlags_.route_global | (imgui.InputFlags_.repeat if command.repeats else 0)
        if imgui.shortcut(command.chord, flags):
            command.act(app)
