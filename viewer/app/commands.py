"""All that the user can do: one table for the menus, the toolbar, the keys and the list of keys."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from ..backends import backends
from . import navigation, theme
from .levels import LEVELS

if TYPE_CHECKING:
    from .app import App

Item = tuple[str, Callable[[], object], bool]  # title, what it does, whether it is ticked


def _always(app: App) -> bool:
    return True


@dataclass(frozen=True)
class Command:
    """Something to do. name: in the file of keys. title: in menus. short: on the toolbar.

    key: its usual keys, such as "Ctrl+1"; empty: none. repeats: again and again while they are held.
    is_on: whether to tick it, None for what is not on or off. can: whether it can be done now.
    """

    name: str
    title: str
    act: Callable[[App], object]
    key: str = ""
    repeats: bool = False
    is_on: Callable[[App], bool] | None = None
    can: Callable[[App], bool] = _always
    short: str = ""


@dataclass(frozen=True)
class Listing:
    """A menu of what is there at the moment."""

    title: str
    items: Callable[[App], Iterable[Item]]


@dataclass(frozen=True)
class Menu:
    """Groups of entries, with a line between them."""

    title: str
    groups: tuple[tuple[Command | Listing | Menu, ...], ...]


def _has_frames(app: App) -> bool:
    return len(app.playback.timeline) > 1


def _has_camera(app: App) -> bool:
    return app.session.camera is not None


def _pace(name: str, title: str, key: str) -> Command:
    """Switches a field of the `Pace`."""
    return Command(
        name, title, lambda app: app.toggle_pace(name), key,
        is_on=lambda app: getattr(app.session.pace, name), can=_has_frames,
    )  # fmt: skip


def _view(number: int, side: str) -> Command:
    title = side.capitalize()
    return Command(
        f"view_{side}", title, lambda app: app.look_from(side), f"Ctrl+{number}", can=_has_camera, short=title
    )


def _level(number: int) -> Command:
    title = f"Level {number}" if number else "Native level"
    return Command(
        f"level_{number}", title, lambda app: app.toggle_level(number), str(number),
        is_on=lambda app: app.levels.get(number, False), can=lambda app: number in app.levels,
    )  # fmt: skip


def _renderers(app: App) -> Iterator[Item]:
    for name, backend in backends().items():
        yield backend.title, partial(app.choose_backend, name), name == app.backend


def _themes(app: App) -> Iterator[Item]:
    for name in theme.PALETTES:
        yield name.capitalize(), partial(app.set_theme, name), name == app.theme


_FILE = Menu("File", (
    (
        Command("screenshot", "Save picture", lambda app: app.screenshot(), "P", short="Screenshot"),
        Command(
            "record", "Record", lambda app: app.toggle_recording(), "R",
            is_on=lambda app: app.recorder is not None, short="Record",
        ),
    ),
    (Command("quit", "Quit", lambda app: app.quit(), "Ctrl+Q"),),
))  # fmt: skip
_VIEW = Menu("View", (
    (
        Command("fit", "Fit", lambda app: app.fit(), "F", can=_has_camera, short="Fit"),
        Menu("From", (tuple(_view(number, side) for number, side in enumerate(navigation.VIEWS, 1)),)),
        Command(
            "orthographic", "Orthographic", lambda app: app.switch_projection(), "O",
            is_on=lambda app: app.is_orthographic, can=_has_camera,
        ),
    ),
    (Listing("Theme", _themes), Command("theme", "Next theme", lambda app: app.next_theme(), "T")),
))  # fmt: skip
_LEVELS = Menu("Pyramid levels", (
    tuple(_level(number) for number in LEVELS),
    (
        Command(
            "fill", "Fill all holes", lambda app: app.toggle_filling(), "H",
            is_on=lambda app: app.is_filling, can=lambda app: bool(app.levels),
        ),
    ),
))  # fmt: skip
_PLAYBACK = Menu("Playback", (
    (
        Command(
            "play", "Play", lambda app: app.toggle_play(), "Space",
            is_on=lambda app: app.playback.player.playing, can=_has_frames,
        ),
        Command("next", "Next frame", lambda app: app.step(1), "Right", repeats=True, can=_has_frames),
        Command("back", "Previous frame", lambda app: app.step(-1), "Left", repeats=True, can=_has_frames),
        Command("first", "First frame", lambda app: app.seek(0), "Home", can=_has_frames),
        Command("last", "Last frame", lambda app: app.seek(-1), "End", can=_has_frames),
    ),
    (
        Command("slower", "Slower", lambda app: app.change_speed(-1), "[", repeats=True, can=_has_frames),
        Command("faster", "Faster", lambda app: app.change_speed(1), "]", repeats=True, can=_has_frames),
        Command("speed_1", "Speed 1x", lambda app: app.change_pace(speed=1.0), "Backspace", can=_has_frames),
    ),
    (
        _pace("loop", "Loop", "L"),
        _pace("reverse", "Backward", "Shift+Space"),
        _pace("every_frame", "Every frame", "E"),
    ),
))  # fmt: skip
_TOOLS = Menu("Tools", (
    (
        Listing("Renderer", _renderers),
        Command("backend", "Next renderer", lambda app: app.next_backend(), "B"),
        _LEVELS,
    ),
    (_PLAYBACK,),
))  # fmt: skip
_HELP = Menu("Help", (
    (
        Command("keys", "Keys and mouse", lambda app: app.help.toggle("Keys and mouse"), "F1"),
        Command("edit_keys", "Change keys", lambda app: app.write_keys()),
    ),
    (
        Command("messages", "Messages", lambda app: app.help.toggle("Messages")),
        Command("about", "About", lambda app: app.help.toggle("About")),
    ),
))  # fmt: skip
MENUS = (_FILE, _VIEW, _TOOLS, _HELP)


def _commands(entry: Any) -> Iterator[Command]:
    """The commands of a menu and of those in it, in order."""
    if isinstance(entry, Command):
        yield entry
    elif isinstance(entry, Menu):
        for group in entry.groups:
            for inner in group:
                yield from _commands(inner)


COMMANDS = {command.name: command for menu in MENUS for command in _commands(menu)}
TOOLBAR = (
    ("fit",), tuple(f"view_{side}" for side in navigation.VIEWS), ("screenshot", "record"),
)  # fmt: skip
MOUSE = (
    ("Left drag", "Orbit"),
    ("Middle drag, Shift+left drag", "Pan"),
    ("Wheel, right drag", "Zoom"),
    ("Double click", "Turn about what is there"),
)
