"""All that the user can do: one table for the menus, the toolbar, the keys and the list of keys.

What a tool can do is declared in its folder and added to the table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from imgui_bundle import icons_fontawesome_6 as icons

from ..backends import Backend, backends
from ..errors import InputError, unknown_name
from ..look import Look
from ..params import Parameter, describe
from . import theme
from .keys import chords
from .scene import navigation

if TYPE_CHECKING:
    from .app import App

T = TypeVar("T")
Item = tuple[str, Callable[[], object], bool]  # title, what it does, whether it is ticked


def _always(doer: Any) -> bool:
    return True


@dataclass(frozen=True)
class Command(Generic[T]):
    """Something to do. T is who does it: the app, or a tool.

    name: in the file of keys. title: in menus. short: on the toolbar. icon: beside that.
    key: its usual keys, such as "Ctrl+1", several with a space between; empty: none. repeats: again and again
    while they are held. is_on: whether to tick it, None for what is not on or off. can: whether it can be
    done now. title_now: what the menu says where that changes.
    """

    name: str
    title: str
    act: Callable[[T], object]
    key: str = ""
    repeats: bool = False
    is_on: Callable[[T], bool] | None = None
    can: Callable[[T], bool] = _always
    short: str = ""
    icon: str = ""
    title_now: Callable[[T], str] | None = None


@dataclass(frozen=True)
class Listing(Generic[T]):
    """A menu of what is there at the moment; without a title its items stand in the menu that it is in."""

    title: str
    items: Callable[[T], Iterable[Item]]


@dataclass(frozen=True)
class Menu(Generic[T]):
    """Groups of entries, with a line between them. is_there: whether it is shown. icon: on the toolbar.
    title_now: what the toolbar calls it where that changes, one of `titles`."""

    title: str
    groups: tuple[tuple[Command[T] | Listing[T] | Menu[T], ...], ...]
    is_there: Callable[[T], bool] = _always
    icon: str = ""
    title_now: Callable[[T], str] | None = None
    titles: Callable[[], Iterable[str]] = tuple


Entry = Command[T] | Listing[T] | Menu[T]
Toolbar = tuple[tuple["str | Menu[App]", ...], ...]  # groups of names of commands, and of menus


def _has_frames(app: App) -> bool:
    return len(app.playback.timeline) > 1


def _has_scans(app: App) -> bool:
    return len(app.scans.listed) > 1


def _has_camera(app: App) -> bool:
    return app.document.camera is not None


def _has_bookmarks(app: App) -> bool:
    return bool(app.document.bookmarks)


def _can_undo(app: App) -> bool:
    return app.tools.is_under_way or app.session.history.undoes is not None


def _can_redo(app: App) -> bool:
    return app.session.history.redoes is not None


def _pace(name: str, title: str, key: str) -> Command[App]:
    """Switches a field of the `Pace`."""
    return Command(
        name, title, lambda app: app.toggle_pace(name), key,
        is_on=lambda app: getattr(app.session.pace, name), can=_has_frames,
    )  # fmt: skip


def _end(name: str, title: str, key: str, is_last: bool) -> Command[App]:
    """Chooses the frame that is shown as the first or the last that is played."""
    return Command(
        name, title, lambda app: app.playback.set_end(is_last, app.session.index), key, can=_has_frames
    )


def _view(number: int, side: str) -> Command[App]:
    title = side.capitalize()
    return Command(
        f"view_{side}", title, lambda app: app.steering.look_from(*navigation.VIEWS[side]), f"Ctrl+{number}",
        can=_has_camera,
    )  # fmt: skip


_WAYS = {"left": (-1, 0), "right": (1, 0), "up": (0, 1), "down": (0, -1)}


def _nudge(gesture: str, title: str, side: str, key: str) -> Command[App]:
    """Moves the view as a short drag to a side does."""
    return Command(
        f"{gesture}_{side}", title, lambda app: app.steering.nudge(gesture, *_WAYS[side]), key, repeats=True,
        can=_has_camera,
    )  # fmt: skip


def switch_commands(several: Iterable[Backend]) -> tuple[Command[App], ...]:
    """Commands that switch the parameters with a key that backends declare; one name has one key in all."""
    found: dict[str, Command[App]] = {}
    for one, parameter in ((each, p) for each in several for p in each.parameters if p.key):
        there = found.setdefault(parameter.name, _switch(one, parameter))
        if there.key != parameter.key:
            raise InputError(
                f"'{parameter.name}' has different keys, {there.key} and {parameter.key}",
                one.name,
                "Give it the same key in all backends",
            )
    return tuple(found.values())


def _switch(backend: Backend, parameter: Parameter) -> Command[App]:
    name = parameter.name
    try:
        chords(parameter.key)
    except InputError as error:
        raise InputError(error.what, f"{backend.name}.{name}, key={parameter.key!r}", error.hint) from error
    return Command(
        f"switch_{name}", parameter.title, lambda app: app.rendering.switch(name), parameter.key,
        is_on=lambda app: app.rendering.switches.get(name, False),
        can=lambda app: name in app.rendering.switches,
    )  # fmt: skip


def _mark(name: str, title: str, key: str) -> Command[App]:
    """Shows one of the marks over the view."""
    return Command(
        name, title, lambda app: app.marks.toggle(name), key, is_on=lambda app: getattr(app.marks.shown, name)
    )


def _look_switch(parameter: Parameter) -> Command[App]:
    """Switches a field of the look."""
    name = parameter.name
    return Command(
        f"look_{name}", parameter.title, lambda app: app.rendering.switch_look(name), parameter.key,
        is_on=lambda app: getattr(app.document.look, name),
    )  # fmt: skip


def _renderers(app: App) -> Iterator[Item]:
    """The renderers, each with what it is good for."""
    for name in app.rendering.choices:
        words = f"{backends()[name].title}: {backends()[name].good_for}"
        yield words, partial(app.rendering.choose, name), name == app.rendering.backend


_NO_RENDERER = "Renderer"  # is known yet


def _renderer_name(app: App) -> str:
    """The name of the renderer that draws."""
    return _NO_RENDERER if app.rendering.backend is None else backends()[app.rendering.backend].title


def _themes(app: App) -> Iterator[Item]:
    for name in theme.PALETTES:
        yield name.capitalize(), partial(app.set_theme, name), name == app.theme


_FILE: Menu[App] = Menu("File", (
    (
        Command(
            "open", "Open a scan...", lambda app: app.browser.show(), "Ctrl+O Q", short="Open",
            icon=icons.ICON_FA_FOLDER_OPEN,
        ),
        Listing("Open recent", lambda app: app.scans.items(app.scans.lately)),
        Listing("Scans", lambda app: app.scans.items(app.scans.listed)),
        Command("next_scan", "Next scan", lambda app: app.scans.step(1), "PageDown", can=_has_scans),
        Command("previous_scan", "Previous scan", lambda app: app.scans.step(-1), "PageUp", can=_has_scans),
    ),
    (
        Command(
            "save_session", "Save session", lambda app: app.sessions.save(), "Ctrl+S", can=_has_camera,
        ),
        Command(
            "save_session_as", "Save session as...", lambda app: app.sessions.ask_to_save(), "Ctrl+Shift+S",
            can=_has_camera,
        ),
        Command(
            "screenshot", "Screenshot", lambda app: app.capture.screenshot(), "P", short="Screenshot",
            icon=icons.ICON_FA_CAMERA,
        ),
        Command(
            "record", "Record", lambda app: app.capture.toggle_recording(app.keys.of["record"]), "R",
            is_on=lambda app: app.capture.recorder is not None, short="Record",
            icon=icons.ICON_FA_CIRCLE_DOT,
        ),
        Command(
            "replay", "Replay the recording", lambda app: app.replayer.replay_last(), "Shift+R",
            can=lambda app: app.capture.last is not None,
        ),
        Command(
            "export", "Export...", lambda app: app.exporting.ask(), "Ctrl+E",
            can=lambda app: app.exporting.can, short="Export", icon=icons.ICON_FA_FILM,
        ),
    ),
    (Command("quit", "Quit", lambda app: app.quit(), "Ctrl+Q"),),
))  # fmt: skip
_EDIT: Menu[App] = Menu("Edit", (
    (
        Command(
            "undo", "Undo", lambda app: app.undo(), "Ctrl+Z", can=_can_undo, short="Undo",
            icon=icons.ICON_FA_ARROW_ROTATE_LEFT,
            title_now=lambda app: f"Undo {app.session.history.undoes or ''}",
        ),
        Command(
            "redo", "Redo", lambda app: app.redo(), "Ctrl+Y Ctrl+Shift+Z", can=_can_redo, short="Redo",
            icon=icons.ICON_FA_ARROW_ROTATE_RIGHT,
            title_now=lambda app: f"Redo {app.session.history.redoes or ''}",
        ),
    ),
))  # fmt: skip
_TURNTABLE: Menu[App] = Menu("Turntable", (
    (
        Command(
            "turntable", "Turn", lambda app: app.steering.toggle_turntable(), "Y",
            is_on=lambda app: app.steering.turntable.is_on, can=_has_camera,
        ),
    ),
    (Listing("Seconds per turn", lambda app: app.steering.turntable.items()),),
))  # fmt: skip
_BOOKMARKS: Menu[App] = Menu("Bookmarks", (
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
_FROM: Menu[App] = Menu(
    "Look from", (tuple(_view(number, side) for number, side in enumerate(navigation.VIEWS, 1)),)
)
_MOVE: Menu[App] = Menu("Move", (
    tuple(_nudge("orbit", f"Turn {side}", side, f"Ctrl+{side.capitalize()}") for side in _WAYS),
    tuple(_nudge("pan", f"Shift {side}", side, f"Shift+{side.capitalize()}") for side in _WAYS),
    (_nudge("zoom", "Nearer", "up", "="), _nudge("zoom", "Farther", "down", "-")),
))  # fmt: skip
_OPENING_VIEW: Command[App] = Command(
    "opening_view", "Opening view", lambda app: app.steering.open_view(), "Home", can=_has_camera
)
_VIEW: Menu[App] = Menu("View", (
    (
        Command(
            "fit", "Fit", lambda app: app.steering.fit(), "F", can=_has_camera, short="Fit",
            icon=icons.ICON_FA_EXPAND,
        ),
        _OPENING_VIEW,
        Command("center", "Centre on the point under the mouse",
            lambda app: app.steering.center(), "Z", can=_has_camera),
        Command(
            "follow", "Follow the subject", lambda app: app.steering.toggle_following(), "Shift+F",
            is_on=lambda app: app.steering.follows, can=_has_frames,
        ),
        _FROM,
        _MOVE,
        Listing("Up", lambda app: app.steering.ups()),
        Command(
            "set_front", "Set current view as front", lambda app: app.steering.set_front(), can=_has_camera
        ),
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
        Command("next_part", "Focus next area", lambda app: app.keyboard.go(1), "F6 Ctrl+F6"),
        Command("part_before", "Focus previous area", lambda app: app.keyboard.go(-1), "Shift+F6"),
        Command(
            "cube", "Orientation cube", lambda app: app.steering.cube.toggle(),
            is_on=lambda app: app.steering.cube.is_shown,
        ),
        Command(
            "glide", "Animate view changes", lambda app: app.glide.toggle(),
            is_on=lambda app: app.glide.is_wanted,
        ),
        Command(
            "point_details", "Point details in status bar", lambda app: app.pointer.toggle_details(),
            is_on=lambda app: app.pointer.has_details,
        ),
    ),
    (
        _mark("scale_bar", "Scale bar", "S"), _mark("color_bar", "Colour bar", "C"),
        Command(
            "marks_in_files", "Include overlays in screenshots",
            lambda app: app.marks.toggle_in_files(), is_on=lambda app: app.marks.in_files,
        ),
    ),
    (
        *(_look_switch(parameter) for parameter in describe(Look) if parameter.key),
        Command(
            "reset", "Reset appearance", lambda app: app.rendering.reset(), "Ctrl+R",
            can=lambda app: not app.rendering.is_default,
        ),
    ),
    (Listing("Theme", _themes), Command("theme", "Switch theme", lambda app: app.next_theme(), "T")),
    (
        Command("text_larger", "Larger text", lambda app: app.change_text(1), "Ctrl+="),
        Command("text_smaller", "Smaller text", lambda app: app.change_text(-1), "Ctrl+-"),
        Command("text_usual", "Default text size", lambda app: app.change_text(0), "Ctrl+0"),
    ),
))  # fmt: skip
_SWITCHES: Menu[App] = Menu(
    "Renderer options", (switch_commands(backends().values()),), lambda app: bool(app.rendering.switches)
)
_PLAYBACK: Menu[App] = Menu("Playback", (
    (
        Command(
            "play", "Play", lambda app: app.toggle_play(), "Space",
            is_on=lambda app: app.playback.player.playing, can=_has_frames,
        ),
        Command("next", "Next frame", lambda app: app.step(1), "Right .", repeats=True, can=_has_frames),
        Command("back", "Previous frame", lambda app: app.step(-1), "Left ,", repeats=True, can=_has_frames),
        Command("first", "First frame", lambda app: app.seek(0), "Ctrl+Home", can=_has_frames),
        Command("last", "Last frame", lambda app: app.seek(-1), "Ctrl+End End", can=_has_frames),
    ),
    (
        Command("slower", "Slower", lambda app: app.change_speed(-1), "[", repeats=True, can=_has_frames),
        Command("faster", "Faster", lambda app: app.change_speed(1), "]", repeats=True, can=_has_frames),
        Command("speed_1", "Speed 1x", lambda app: app.change_pace(speed=1.0), "Backspace", can=_has_frames),
    ),
    (
        _end("span_first", "Set start of playback", "I", is_last=False),
        _end("span_last", "Set end of playback", "Shift+I", is_last=True),
        Command(
            "span_all", "Play all frames", lambda app: app.playback.clear_span(), "Alt+I",
            can=lambda app: app.document.span is not None,
        ),
    ),
    (
        _pace("loop", "Loop", "L"),
        _pace("reverse", "Backward", "Shift+Space"),
        _pace("every_frame", "Every frame", "E"),
    ),
))  # fmt: skip
_RENDERER: Menu[App] = Menu("Renderer", (
    (
        Listing("", _renderers),
    ),
    (
        Command("backend", "Next renderer", lambda app: app.naming.step(1), "B"),
        Command("backend_before", "Previous renderer", lambda app: app.naming.step(-1), "Shift+B"),
        Command(
            "renderer_for_all", "Use renderer for all scans", lambda app: app.rendering.toggle_for_all(),
            is_on=lambda app: app.rendering.is_for_all,
        ),
        Command(
            "automatic", "Automatic renderer", lambda app: app.rendering.switch_automatic(),
            is_on=lambda app: app.document.goal is not None,
            can=lambda app: not app.choosing.why_not or app.document.goal is not None,
        ),
        _SWITCHES,
    ),
))  # fmt: skip
_TOOLS: Menu[App] = Menu("Tools", (
    (_RENDERER,),
    (_PLAYBACK,),
))  # fmt: skip
_HELP: Menu[App] = Menu("Help", (
    (
        Command("keys", "Keys and mouse", lambda app: app.help.toggle("Keys and mouse"), "F1"),
        Command("edit_keys", "Edit keys file", lambda app: app.write_keys()),
    ),
    (
        Command("messages", "Messages", lambda app: app.help.toggle("Messages")),
        Command("about", "About", lambda app: app.help.toggle("About")),
    ),
))  # fmt: skip
_MENUS: tuple[Menu[App], ...] = (_FILE, _EDIT, _VIEW, _TOOLS, _HELP)
# Before what tools put there, and after it.
_TOOLBAR_BEGIN: Toolbar = (
    (
        "open",
        "fit",
        Menu("View", ((_OPENING_VIEW,), *_FROM.groups, (_TURNTABLE, _BOOKMARKS)), icon=icons.ICON_FA_EYE),
        Menu(
            "Renderer",
            _RENDERER.groups,
            icon=icons.ICON_FA_CUBE,
            title_now=_renderer_name,
            titles=lambda: [_NO_RENDERER, *(one.title for one in backends().values())],
        ),
    ),
)
_TOOLBAR_END: Toolbar = (("screenshot", "export", "record"), ("undo", "redo"))
_MOUSE: tuple[tuple[str, str], ...] = (
    ("Left drag", "Orbit"),
    ("Middle drag, Shift+left drag", "Pan"),
    ("Wheel, right drag", "Zoom"),
    ("Double click", "Orbit about the clicked point"),
)


def _commands(entry: Entry[T]) -> Iterator[Command[T]]:
    """The commands of a menu and of those in it, in order."""
    if isinstance(entry, Command):
        yield entry
    elif isinstance(entry, Menu):
        for group in entry.groups:
            for inner in group:
                yield from _commands(inner)


def first_command(entry: Entry[T]) -> Command[T]:
    """Find the first command of a menu. Raises StopIteration where it has none."""
    return next(_commands(entry))


class Commands:
    """The table: the window's own commands, and those that were added to it.

    menus: in their order. mouse: how, and what it does. of: name -> command, the
    window's own first. tool_of: name -> the name of the tool that it is of; without the window's own.
    """

    def __init__(self) -> None:
        self.menus = _MENUS
        self._tools_bar: Toolbar = ()
        self.mouse = _MOUSE
        own = [command for menu in _MENUS for command in _commands(menu)]
        own.sort(key=lambda command: command in _SWITCHES.groups[0])  # which have those keys that are left
        self.of = {command.name: command for command in own}
        self.tool_of: dict[str, str] = {}

    def add(self, menu: str, entries: Sequence[Entry[App]], tool: str) -> None:
        """Add a group of a tool's to a menu, and to the toolbar what has a `short` title.

        Under Tools it comes first, in other menus last. Raises InputError for a menu or keys that are none,
        and for names of commands that are taken.
        """
        titles = [there.title for there in self.menus]
        if menu not in titles:
            raise unknown_name("menu", menu, titles)
        added = [command for entry in entries for command in _commands(entry)]
        for command in added:
            chords(command.key)
            if command.name in self.of:
                raise InputError(f"a command '{command.name}' exists already", hint="Give it another name")
        self.of |= {command.name: command for command in added}
        self.tool_of |= {command.name: tool for command in added}
        group = (tuple(entries),)
        self.menus = tuple(
            there if there.title != menu
            else Menu(menu, group + there.groups if menu == _TOOLS.title else there.groups + group)
            for there in self.menus
        )  # fmt: skip
        if short := tuple(command.name for command in added if command.short):
            more = tuple(entry for entry in entries if isinstance(entry, Menu))
            drop = (Menu("", tuple(group for menu in more for group in menu.groups)),) if more else ()
            self._tools_bar = (*self._tools_bar, (*short, *drop))

    @property
    def toolbar(self) -> Toolbar:
        """The toolbar: groups of names of commands, and menus; one without a title drops from the command
        before it."""
        return (*_TOOLBAR_BEGIN, *self._tools_bar, *_TOOLBAR_END)
