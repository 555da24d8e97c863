"""Which key does what. One table: for handling, and for the list that the panel shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from . import navigation

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


def _view(number: int, side: str) -> Command:
    chord = imgui.Key.mod_ctrl | getattr(imgui.Key, f"_{number}")
    return Command(f"Ctrl+{number}", chord, f"{side} view", lambda app: app.look_from(side))


COMMANDS = (
    Command("Space", imgui.Key.space, "play, pause", lambda app: app.toggle_play()),
    Command("Right", imgui.Key.right_arrow, "next frame", lambda app: app.step(1), repeats=True),
    Command("Left", imgui.Key.left_arrow, "previous frame", lambda app: app.step(-1), repeats=True),
    Command("Home", imgui.Key.home, "first frame", lambda app: app.seek(0)),
    Command("End", imgui.Key.end, "last frame", lambda app: app.seek(len(app.playback.timeline) - 1)),
    Command("L", imgui.Key.l, "loop on, off", lambda app: app.toggle_pace("loop")),
    Command(
        "Shift+Space", imgui.Key.mod_shift | imgui.Key.space, "play backward, forward",
        lambda app: app.toggle_pace("reverse"),
    ),
    Command("[", imgui.Key.left_bracket, "slower", lambda app: app.change_speed(-1), repeats=True),
    Command("]", imgui.Key.right_bracket, "faster", lambda app: app.change_speed(1), repeats=True),
    Command("Backspace", imgui.Key.backspace, "speed 1x", lambda app: app.change_pace(speed=1.0)),
    Command("E", imgui.Key.e, "every frame, real time", lambda app: app.toggle_pace("every_frame")),
    Command("T", imgui.Key.t, "light, dark theme", lambda app: app.next_theme()),
    Command("F", imgui.Key.f, "fit the view", lambda app: app.fit()),
    *(_view(number, side) for number, side in enumerate(navigation.VIEWS, 1)),
    Command("O", imgui.Key.o, "orthographic, perspective", lambda app: app.switch_projection()),
    Command("B", imgui.Key.b, "next renderer", lambda app: app.next_backend()),
    Command("P", imgui.Key.p, "save the picture", lambda app: app.screenshot()),
    Command("R", imgui.Key.r, "record, stop recording", lambda app: app.toggle_recording()),
    Command("Ctrl+Q", imgui.Key.mod_ctrl | imgui.Key.q, "quit", lambda app: app.quit()),
)  # fmt: skip
MOUSE = (
    ("Double click", "turn about what is there"),
    ("Left drag", "orbit"),
    ("Middle drag, Shift+left", "pan"),
    ("Wheel, right drag", "zoom"),
)


def key_of(does: str) -> str:
    """The key of what a command does."""
    return next(command.key for command in COMMANDS if command.does == does)


def handle(app: App) -> None:
    """Do what the keys pressed since the last frame say; keys typed into a text go there."""
    for command in COMMANDS:
        flags = imgui.InputFlags_.route_global | (imgui.InputFlags_.repeat if command.repeats else 0)
        if imgui.shortcut(command.chord, flags):
            command.act(app)
