"""All that the user can do: one table for the menus, the toolbar, the keys and the list of keys."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from ..backends import backends
from . import theme
from .scene import legend, navigation
from .scene.levels import LEVELS

if TYPE_CHECKING:
    from .app import App

Item = tuple[str, Callable[[], object], bool]  # title, what it does, whether it is ticked


def _always(app: App) -> bool:
    return True


@dataclass(frozen=True)
class Command:
    """Something to do. name: in the file of keys. title: in menus. short: on the toolbar.

    key: its usual keys, such as "Ctrl+1", several with a space between; empty: none. repeats: again and again
    while they are held. is_on: whether to tick it, None for what is not on or off. can: whether it can be
    done now. title_now: what the menu says where that changes.
    """

    name: str
    title: str
    act: Callable[[App], object]
    key: str = ""
    repeats: bool = False
    is_on: Callable[[App], bool] | None = None
    can: Callable[[App], bool] = _always
    short: str = ""
    title_now: Callable[[App], str] | None = None


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


def _has_scans(app: App) -> bool:
    return len(app.scans.listed) > 1


def _has_camera(app: App) -> bool:
    return app.document.camera is not None


def _has_bookmarks(app: App) -> bool:
    return bool(app.document.bookmarks)


def _can_undo(app: App) -> bool:
    return app.measuring.begun is not None or app.session.history.undoes is not None


def _can_redo(app: App) -> bool:
    return app.session.history.redoes is not None


def _measured(name: str, title: str, act: Callable[[App], None]) -> Command:
    """Does something with all measurements."""
    return Command(f"{name}_measurements", title, act, can=lambda app: bool(app.measuring.made.all))


def _pace(name: str, title: str, key: str) -> Command:
    """Switches a field of the `Pace`."""
    return Command(
        name, title, lambda app: app.toggle_pace(name), key,
        is_on=lambda app: getattr(app.session.pace, name), can=_has_frames,
    )  # fmt: skip


def _view(number: int, side: str) -> Command:
    title = side.capitalize()
    return Command(
        f"view_{side}", title, lambda app: app.steering.look_from(*navigation.VIEWS[side]), f"Ctrl+{number}",
        can=_has_camera, short=title,
    )  # fmt: skip


def _level(number: int) -> Command:
    title = f"Level {number}" if number else "Native level"
    return Command(
        f"level_{number}", title, lambda app: app.rendering.toggle_level(number), str(number),
        is_on=lambda app: app.rendering.levels.get(number, False),
        can=lambda app: number in app.rendering.levels,
    )  # fmt: skip


def _mark(name: str, title: str, key: str) -> Command:
    """Shows one of the marks over the view."""
    return Command(
        name, title, lambda app: legend.toggle(app, name), key, is_on=lambda app: getattr(app.marks, name)
    )


def _renderers(app: App) -> Iterator[Item]:
    for name, backend in backends().items():
        yield backend.title, partial(app.rendering.choose, name), name == app.rendering.backend


def _themes(app: App) -> Iterator[Item]:
    for name in theme.PALETTES:
        yield name.capitalize(), partial(app.set_theme, name), name == app.theme


_FILE = Menu("File", (
    (
        Command("open", "Open...", lambda app: app.browser.show(), "Ctrl+O", short="Open"),
        Listing("Open recent", lambda app: app.scans.items(app.scans.lately)),
        Listing("Scans", lambda app: app.scans.items(app.scans.listed)),
        Command("next_scan", "Next scan", lambda app: app.scans.step(1), "PageDown", can=_has_scans),
        Command("previous_scan", "Previous scan", lambda app: app.scans.step(-1), "PageUp", can=_has_scans),
        Command("scans", "Back to the list of scans", lambda app: app.browser.show(), "Q"),
    ),
    (
        Command("screenshot", "Screenshot", lambda app: app.capture.screenshot(), "P", short="Screenshot"),
        Command(
            "record", "Record", lambda app: app.capture.toggle_recording(), "R",
            is_on=lambda app: app.capture.recorder is not None, short="Record",
        ),
        Command(
            "replay", "Replay the recording", lambda app: app.capture.replay_last(), "Shift+R",
            can=lambda app: app.capture.last is not None,
        ),
        Command(
            "export", "Export...", lambda app: app.exporting.ask(), "Ctrl+E",
            can=lambda app: app.exporting.can,
        ),
    ),
    (Command("quit", "Quit", lambda app: app.quit(), "Ctrl+Q"),),
))  # fmt: skip
_EDIT = Menu("Edit", (
    (
        Command(
            "undo", "Undo", lambda app: app.undo(), "Ctrl+Z", repeats=True, can=_can_undo,
            title_now=lambda app: f"Undo {app.session.history.undoes or ''}",
        ),
        Command(
            "redo", "Redo", lambda app: app.redo(), "Ctrl+Y Ctrl+Shift+Z", repeats=True, can=_can_redo,
            title_now=lambda app: f"Redo {app.session.history.redoes or ''}",
        ),
    ),
))  # fmt: skip
_TURNTABLE = Menu("Turntable", (
    (
        Command(
            "turntable", "Turn", lambda app: app.steering.toggle_turntable(), "Y",
            is_on=lambda app: app.steering.turntable.is_on, can=_has_camera,
        ),
    ),
    (Listing("Time for a turn", lambda app: app.steering.turntable.items()),),
))  # fmt: skip
_BOOKMARKS = Menu("Bookmarks", (
    (
        Command("bookmark_add", "Add this view", lambda app: app.bookmarks.add(), "Ctrl+B", can=_has_camera),
        Command("bookmark_next", "Next", lambda app: app.bookmarks.step(1), "N", can=_has_bookmarks),
        Command(
            "bookmark_previous", "Previous", lambda app: app.bookmarks.step(-1), "Shift+N",
            can=_has_bookmarks,
        ),
    ),
    (Listing("Go to", lambda app: app.bookmarks.items()),),
))  # fmt: skip
_VIEW = Menu("View", (
    (
        Command("fit", "Fit", lambda app: app.steering.fit(), "F", can=_has_camera, short="Fit"),
        Command("center", "Centre the point", lambda app: app.steering.center(), "Z", can=_has_camera),
        Menu("From", (tuple(_view(number, side) for number, side in enumerate(navigation.VIEWS, 1)),)),
        Command(
            "orthographic", "Orthographic", lambda app: app.steering.switch_projection(), "O",
            is_on=lambda app: app.steering.is_orthographic, can=_has_camera,
        ),
        _TURNTABLE,
        _BOOKMARKS,
    ),
    (
        Command(
            "full_screen", "Full screen", lambda app: app.full_view.toggle_screen(), "F11",
            is_on=lambda app: app.full_view.on_screen,
        ),
        Command(
            "panels", "Panels", lambda app: app.full_view.toggle(), "Tab",
            is_on=lambda app: not app.full_view.is_on,
        ),
        Command(
            "cube", "Orientation cube", lambda app: app.steering.cube.toggle(),
            is_on=lambda app: app.steering.cube.is_shown,
        ),
    ),
    (_mark("scale_bar", "Scale bar", "S"), _mark("color_bar", "Colour bar", "C")),
    (Listing("Theme", _themes), Command("theme", "Next theme", lambda app: app.next_theme(), "T")),
    (
        Command("text_larger", "Larger text", lambda app: app.change_text(1), "Ctrl+="),
        Command("text_smaller", "Smaller text", lambda app: app.change_text(-1), "Ctrl+-"),
        Command("text_usual", "Usual text", lambda app: app.change_text(0), "Ctrl+0"),
    ),
))  # fmt: skip
_LEVELS = Menu("Pyramid levels", (
    tuple(_level(number) for number in LEVELS),
    (
        Command(
            "fill", "Fill all holes", lambda app: app.rendering.toggle_filling(), "H",
            is_on=lambda app: app.rendering.is_filling, can=lambda app: bool(app.rendering.levels),
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
_MEASURING = (
    Command(
        "measure", "Measure", lambda app: app.measuring.toggle(), "M",
        is_on=lambda app: app.measuring.active, can=_has_camera,
    ),
    Menu("Measurements", (
        (
            _measured("copy", "Copy as table", lambda app: app.measuring.copy()),
            _measured("save", "Save CSV...", lambda app: app.measuring.ask_to_save()),
            _measured("clear", "Clear", lambda app: app.measuring.clear()),
        ),
    )),
)  # fmt: skip
_TOOLS = Menu("Tools", (
    _MEASURING,
    (
        Listing("Renderer", _renderers),
        Command("backend", "Next renderer", lambda app: app.rendering.step(1), "B"),
        Command("backend_before", "Renderer before", lambda app: app.rendering.step(-1), "Shift+B"),
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
MENUS = (_FILE, _EDIT, _VIEW, _TOOLS, _HELP)


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
    ("open",), ("fit",), tuple(f"view_{side}" for side in navigation.VIEWS), ("screenshot", "record"),
)  # fmt: skip
MOUSE = (
    ("Left drag", "Orbit"),
    ("Middle drag, Shift+left drag", "Pan"),
    ("Wheel, right drag", "Zoom"),
    ("Double click", "Turn about what is there"),
    ("Click while measuring", "Set an end"),
)
