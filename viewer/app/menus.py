"""The table of all commands: where each stands in the menus and on the toolbar, and what it is bound to."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import partial
from typing import Any

from imgui_bundle import icons_fontawesome_6 as icons

from ..errors import InputError, unknown_name
from .commands import Command, Entry, Listing, Menu, Toolbar
from .keys import chords
from .part import WindowPart, part_classes

# Names of commands and listings, as the parts declare them; a star stands for all that begin so.
_FROM = Menu("Look from", (("view_*",),))
_TURNTABLE = Menu("Turntable", (("turntable",), ("turntable_seconds",)))
_BOOKMARKS = Menu("Bookmarks", (("bookmark_add", "bookmark_next", "bookmark_previous"), ("bookmarks",)))
_PLAYBACK = Menu("Playback", (
    ("play", "next", "back", "first", "last"),
    ("slower", "faster", "speed_1"),
    ("span_first", "span_last", "span_all"),
    ("loop", "reverse", "every_frame"),
))  # fmt: skip
_RENDERER = Menu("Renderer", (
    ("renderers",),
    ("backend", "backend_before", "renderer_for_all", "automatic",
     Menu("Renderer options", (("switch_*",),), when="renderer options")),
))  # fmt: skip
_MENUS = (
    Menu("File", (
        ("open", "open_recent", "scans", "next_scan", "previous_scan"),
        ("read_table", "read_folder"),
        ("save_session", "save_session_as", "screenshot", "record", "replay", "export"),
        ("quit",),
    )),
    Menu("Edit", (("undo", "redo"),)),
    Menu("View", (
        ("fit", "opening_view", "center", "follow", _FROM,
         Menu("Move", (("orbit_*",), ("pan_*",), ("zoom_*",))),
         "ups", "set_front", "orthographic", _TURNTABLE, _BOOKMARKS),
        ("full_screen", "panels", "next_part", "part_before", "cube", "glide", "point_details"),
        ("scale_bar", "color_bar", "marks_in_files"),
        ("look_*", "reset"),
        ("themes", "theme"),
        ("text_larger", "text_smaller", "text_usual"),
    )),
    Menu("Tools", ((_RENDERER,), (_PLAYBACK,))),
    Menu("Help", (("keys", "edit_keys"), ("messages", "about"))),
)  # fmt: skip
# Before what tools put there, and after it.
_TOOLBAR_BEGIN: Toolbar = (
    (
        "open",
        "fit",
        Menu("View", (("opening_view",), *_FROM.groups, (_TURNTABLE, _BOOKMARKS)), icon=icons.ICON_FA_EYE),
        replace(_RENDERER, icon=icons.ICON_FA_CUBE),
    ),
)
_TOOLBAR_END: Toolbar = (("switch_*",), ("screenshot", "export", "record"), ("undo", "redo"))
_MOUSE = (
    ("Left drag", "Orbit"),
    ("Middle drag, Shift+left drag", "Pan"),
    ("Wheel, right drag", "Zoom"),
    ("Double click", "Orbit about the clicked point"),
)


class Commands:
    """The table: the commands of all parts of the window, and those of tools.

    mouse: how, and what it does. of: name -> command, those of the window first. tool_of: name of a tool's
    command -> the tool's name. conditions: the names that `Command.when` may have.
    """

    def __init__(self) -> None:
        self.mouse: tuple[tuple[str, str], ...] = _MOUSE
        self.tool_of: Mapping[str, str] = {}
        self._table = list(_MENUS)
        self._toolbar_of_tools: Toolbar = ()
        self._entries: dict[str, Command | Listing] = {
            entry.name: entry for part in part_classes().values() for entry in part.COMMANDS
        }
        self.conditions = {name for part in part_classes().values() for name in part.CONDITIONS}
        self._conditions: dict[str, Callable[[], bool]] = {}
        self._expand()

    def _expand(self) -> None:
        """Put the entries where their names stand."""
        self.menus = tuple(map(self._expanded, self._table))
        bar = (*_TOOLBAR_BEGIN, *self._toolbar_of_tools, *_TOOLBAR_END)
        self.toolbar: Toolbar = tuple(tuple(self._of_toolbar(group)) for group in bar)
        of = [command for menu in self.menus for command in menu.commands()]
        # Those of backends come last: they have those keys that are left.
        added = {name: number for number, name in enumerate(self.tool_of)}  # of two tools the first has a key
        of.sort(key=lambda one: (added.get(one.name, -1), one.name.startswith("switch_")))
        self.of: Mapping[str, Command] = {command.name: command for command in of}

    def _of_toolbar(self, group: Sequence[str | Menu]) -> Iterator[str | Menu]:
        """A group of the toolbar, with all short commands in place of a name that ends with a star."""
        for one in group:
            if isinstance(one, Menu):
                yield self._expanded(one)
            elif one.endswith("*"):
                yield from (of.name for of in self._found(one) if isinstance(of, Command) and of.short)
            else:
                yield one

    def _expanded(self, menu: Menu) -> Menu:
        """A menu with entries for names. Raises KeyError where nobody declares one."""
        groups = (tuple(found for one in group for found in self._found(one)) for group in menu.groups)
        return replace(menu, groups=tuple(groups))

    def _found(self, entry: str | Entry) -> Iterator[Entry]:
        if isinstance(entry, Menu):
            yield self._expanded(entry)
        elif isinstance(entry, str) and entry.endswith("*"):
            yield from (one for name, one in self._entries.items() if fnmatchcase(name, entry))
        else:
            yield self._entries[entry] if isinstance(entry, str) else entry

    def add(self, menu: str, entries: Sequence[Entry], tool: str) -> None:
        """Add a group of a tool's to a menu, and to the toolbar what has a `short` title.

        Under Tools it comes first, in other menus last. Raises InputError for a menu, a condition or keys
        that are none, and for names of commands that are taken.
        """
        titles = [there.title for there in self._table]
        if menu not in titles:
            raise unknown_name("menu", menu, titles)
        group = Menu("", (tuple(entries),))
        for command in group.commands():
            chords(command.key)
            if command.when and command.when not in self.conditions:
                raise unknown_name("condition", command.when, list(self.conditions))
            if command.name in self.of:
                raise InputError(f"a command '{command.name}' exists already", hint="Give it another name")
        named = self._named(group, tool)
        for number, there in enumerate(self._table):
            if there.title == menu:
                both = named.groups + there.groups if menu == "Tools" else there.groups + named.groups
                self._table[number] = replace(there, groups=both)
        if short := tuple(command.name for command in group.commands() if command.short):
            more = tuple(entry for entry in named.entries() if isinstance(entry, Menu))
            drop = (Menu("", tuple(group for menu in more for group in menu.groups)),) if more else ()
            self._toolbar_of_tools = (*self._toolbar_of_tools, (*short, *drop))
        self._expand()

    def _named(self, menu: Menu, tool: str) -> Menu:
        """A tool's menu with names for entries, which are in the table from now on."""

        def named(entry: str | Entry) -> str | Entry:
            if isinstance(entry, Menu):
                return self._named(entry, tool)
            if isinstance(entry, str):
                return entry
            name = entry.name or f"{tool}: {entry.title}"
            self._entries[name] = entry
            self.tool_of = {**self.tool_of, name: tool}
            return name

        return replace(menu, groups=tuple(tuple(map(named, group)) for group in menu.groups))

    # --- who does it ------------------------------------------------------------------

    def bind_parts(self, parts: Iterable[WindowPart]) -> None:
        """Bind the commands of the window to its parts, and its conditions."""
        parts = list(parts)
        for part in parts:
            self._conditions |= {name: partial(holds, part) for name, holds in part.CONDITIONS.items()}
        for part in parts:
            self.bind([entry.name for entry in part.COMMANDS], partial(_bound, part))

    def bind_tool(self, tool: str, bound: Callable[[Command | Listing], Command | Listing]) -> None:
        """Bind the commands of a tool. bound: gives each as it is when it is bound."""
        self.bind([name for name, of in self.tool_of.items() if of == tool], bound)

    def bind(self, names: Iterable[str], bound: Callable[[Command | Listing], Command | Listing]) -> None:
        """Bind entries."""
        for name in names:
            entry = bound(self._entries[name])
            if isinstance(entry, Command) and entry.when:
                entry = replace(entry, can=partial(self._can, entry))
            self._entries[name] = entry
        self._expand()

    def _can(self, command: Command) -> bool:
        return self.holds(command.when) and command.can()

    def holds(self, condition: str) -> bool:
        """Whether a condition of the window holds; no condition always does."""
        return not condition or self._conditions[condition]()


def _bound(part: WindowPart, entry: Command | Listing) -> Command | Listing:
    """An entry whose functions take the part."""
    functions: dict[str, Any] = {
        name: partial(value, part)
        for name, value in vars(entry).items()
        if callable(value) and name != "titles"
    }
    return replace(entry, **functions)
