"""A part of the window: what every part may have. `App` finds all parts by their folder and drives them.

A part is a dataclass. Its fields without a default name what it needs: another part, something that `App`
brings (the window, the renderer, …), or a request that another part offers. Each has the type that it says.

    @dataclass(eq=False)
    class Switching(WindowPart):
        name = "switching"
        rendering: Rendering
        note: Callable[[str], None]  # a request: `Notices` answers it

Whatever a part may do beyond that is a hook below, and each hook has a default.
"""

from __future__ import annotations

import importlib
import inspect
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import MISSING, field, fields, is_dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from ..document.schema import is_object, plain, structured, usable
from ..errors import InputError
from ..params import describe

if TYPE_CHECKING:
    from ..scan.timeline import Timeline
    from .commands import Command, Listing
    from .ui import Ui

_REMEMBERED = "remembered"  # in the metadata of a field
ViewArea = tuple[float, float, float, float]  # left, top, width, height in ImGui's coordinates


class Section(NamedTuple):
    """A section of the panel. rank: sections stand in its order. needs_pose: whether it is there only once a
    frame was shown. is_open: at first."""

    title: str
    rank: int
    needs_pose: bool = True
    is_open: bool = True


class WindowPart:
    """The base of all parts.

    name: other parts, the settings and `App` know it by this. doing, shows: what `advance` does and `dialog`
    shows, as the message of a failure says it. COMMANDS: what the user can do with it. CONDITIONS: name ->
    whether it holds, for `Command.when`. OFFERS: requests that it answers -> its methods, or values. SECTION:
    of the panel, which `panel` declares. layer: how far above the view it lies; dialogs are drawn from the
    lowest layer up, and Escape asks from the highest down. turn: the loop advances parts in this order, those
    of one turn each after the parts that they need.
    """

    name: ClassVar[str] = ""
    doing: ClassVar[str] = ""
    shows: ClassVar[str] = ""
    COMMANDS: ClassVar[Sequence[Command | Listing]] = ()
    CONDITIONS: ClassVar[Mapping[str, Callable[[Any], bool]]] = {}
    OFFERS: ClassVar[Mapping[str, str]] = {}
    SECTION: ClassVar[Section | None] = None
    layer: ClassVar[int] = 0
    turn: ClassVar[int] = 0

    def remembered(self) -> dict[str, Any]:
        """The values that come back at the next start, as JSON has them: those of fields that `remembered`
        declares."""
        own: Any = fields(self) if is_dataclass(self) else ()
        return {of.name: plain(getattr(self, of.name)) for of in own if _REMEMBERED in of.metadata}

    # --- a scan -----------------------------------------------------------------------

    def leave_scan(self) -> None:
        """The open scan is about to go."""

    def begin_scan(self, timeline: Timeline) -> None:
        """Another scan is open."""

    def refused(self, problem: str) -> bool:
        """Nothing could be opened; whether this part shows the user why."""
        return False

    # --- the loop ---------------------------------------------------------------------

    def advance(self, now: float) -> bool | None:
        """Take in what time and workers have brought; whether there is something to show. now: by the clock,
        seconds."""
        return False

    @property
    def waits(self) -> bool:
        """Whether a worker is about to bring something."""
        return False

    def next_change(self, now: float) -> float:
        """Seconds until there is something to do; infinite where nothing is due."""
        return math.inf

    # --- the window -------------------------------------------------------------------

    def panel(self, ui: Ui) -> None:
        """Declare the widgets of the section."""

    def dialog(self, view: ViewArea) -> None:
        """Declare windows of its own. view: where the 3D view is."""

    def on_escape(self) -> bool:
        """End one thing that goes on, since Escape was pressed; whether there was any."""
        return False

    def enders(self) -> Iterable[tuple[int, Callable[[], bool]]]:
        """Functions that Escape asks, and the layer of each: the highest is asked first."""
        return ((self.layer, self.on_escape),)

    @property
    def mark(self) -> str:
        """Words on why the header of the section has a mark; empty where it has none."""
        return ""

    # --- the end ----------------------------------------------------------------------

    def finish(self) -> None:
        """Bring to its end what the user would be sorry to lose, while the window is still there."""

    def close(self) -> None:
        """Let go of everything."""


def remembered(default: Any = MISSING, factory: Any = MISSING) -> Any:
    """Declare a field of a part that comes back at the next start. default, factory: as of `field`."""
    if factory is not MISSING:
        return field(default_factory=factory, kw_only=True, metadata={_REMEMBERED: True})
    return field(default=default, kw_only=True, metadata={_REMEMBERED: True})


def stored_values(cls: Any, stored: Any) -> dict[str, Any]:
    """The values of a part's fields that `remembered` declares, by name, of those that a file has for it.
    Each value is read by itself; one that cannot be used is left out."""
    found: dict[str, Any] = {}
    declared = [of for of in (fields(cls) if is_dataclass(cls) else ()) if _REMEMBERED in of.metadata]
    for of in declared if is_object(stored) else ():
        if of.name not in stored:
            continue
        if of.default_factory is not MISSING and is_dataclass(now := of.default_factory()):
            found[of.name] = usable(now, stored[of.name])
            continue
        with suppress(InputError, RecursionError):
            hint = inspect.get_annotations(cls, eval_str=True)[of.name]
            found[of.name] = structured(hint, stored[of.name])
    return found


def chosen(values: Any) -> dict[str, Any]:
    """The values of a declaration that are not its defaults."""
    read = {parameter.name: getattr(values, parameter.name) for parameter in describe(type(values))}
    return {name: value for name, value in read.items() if value != getattr(type(values)(), name)}


def part_classes() -> dict[str, type[WindowPart]]:
    """Name -> class, of all parts in the folder of the window; a tool is none, `Toolbox` holds them."""
    folder = Path(__file__).parent
    for file in sorted(folder.rglob("*.py")):
        *above, stem = file.relative_to(folder).with_suffix("").parts
        if above[:1] != ["tools"] and not stem.startswith("_"):
            name = ".".join([*above, stem])
            importlib.import_module(f"{__package__}.{name}")
    found: dict[str, type[WindowPart]] = {}
    for cls in _below(WindowPart):
        is_own = cls.name and cls.__module__.startswith(f"{__package__}.")
        if is_own and found.setdefault(cls.name, cls) is not cls:
            raise TypeError(f"two parts have the name '{cls.name}': {found[cls.name]} and {cls}")
    return dict(sorted(found.items()))


def _below(cls: type[WindowPart]) -> Iterator[type[WindowPart]]:
    for one in cls.__subclasses__():
        yield one
        yield from _below(one)


class Parts:
    """All parts, in the order in which the loop advances them. of: by name."""

    def __init__(self, given: Mapping[str, Any], stored: Mapping[str, Any]) -> None:
        """given: what parts may need beside each other, by name; a part that is among these is not made.
        stored: name of a part -> the values that come back, as JSON has them.

        Raises TypeError where parts need each other in a circle, or something that nobody has.
        """
        self._given, self._stored = {**given, "parts": self}, stored
        self._classes = part_classes()
        self._offered = {
            request: (cls.name, method)
            for cls in self._classes.values()
            for request, method in cls.OFFERS.items()
        }
        self.of: dict[str, Any] = {}
        for name, cls in self._classes.items():
            if isinstance(given.get(name), cls):
                self.of[name] = given[name]
        for name in self._classes:
            self._part(name, ())
        self.of = dict(sorted(self.of.items(), key=lambda named: named[1].turn))

    def __iter__(self) -> Iterator[Any]:
        return iter(self.of.values())

    def _part(self, name: str, users: tuple[str, ...]) -> Any:
        if name in users:
            raise TypeError(f"parts need each other: {' -> '.join((*users, name))}")
        if name not in self.of:
            cls = self._classes[name]
            self.of[name] = cls(**self._needs(cls, (*users, name)) if is_dataclass(cls) else {})
        return self.of[name]

    def _needs(self, cls: Any, users: tuple[str, ...]) -> dict[str, Any]:
        found = stored_values(cls, self._stored.get(cls.name))
        for of in fields(cls):
            need = of.name
            if not of.init or _REMEMBERED in of.metadata:
                continue
            if need in self._given:
                found[need] = self._given[need]
            elif need in self._classes:
                found[need] = self._part(need, users)
            elif need in self._offered:
                found[need] = partial(self._answer, *self._offered[need])
            elif of.default is MISSING and of.default_factory is MISSING:
                raise TypeError(f"the part '{cls.name}' needs '{need}', which no part provides")
        return found

    def _answer(self, name: str, method: str, *arguments: Any, **more: Any) -> Any:
        """Pass a request on to the part that answers it, by a method or a value that it has."""
        answer = getattr(self.of[name], method)
        return answer(*arguments, **more) if callable(answer) else answer

    def remembered(self) -> dict[str, dict[str, Any]]:
        """The values of all parts that come back at the next start."""
        return {part.name: values for part in self if (values := part.remembered())}
