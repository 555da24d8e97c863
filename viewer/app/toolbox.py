"""The toolbox: all tools, made when the window opens; one that fails is reported and switched off."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from imgui_bundle import ImVec2

from ..analysis.measures.kinds import measure_kinds
from ..backends import backends
from ..document.part import Part
from ..document.schema import Values, is_object, structured, unread, usable
from ..errors import InputError, reason
from ..extensions import extension_problems, installed_extensions, package_of
from ..output.labels import Box, LabelPlaces
from ..output.overlays import NOTHING_DRAWN, DrawnMarks
from ..rigid import STILL, Rigid
from ..scan.formats import known_suffixes
from ..scan.layers import Layers
from ..scan.pose import Pose
from ..scan.timeline import Timeline
from ..task import Cancelled, Task
from . import tools
from .clicks import Clicks
from .commands import Command, Item, Listing, Menu
from .failures import Failures, widgets_ended
from .followed import Followed
from .laid import MotionOf, Numbers, NumbersOf
from .menus import Commands
from .notices import Problem
from .part import ViewArea, WindowPart, chosen
from .playing.playback import Playback
from .scene.canvas import Canvas, ScreenView
from .scene.viewport import Viewport
from .session import Session
from .tool_context import FrameSpan, ToolContext
from .ui import Ui

_BUDGET_MS = 5.0  # that a tool may take in one turn of the window's loop


class Slot:
    """One tool, guarded: it fails here and nowhere else.

    title: as users read it. tool: None while it is switched off. mistakes: hook that declares widgets -> the
    user's mistake that these led to when they were declared last.
    """

    def __init__(
        self,
        context: ToolContext,
        note: Callable[[str], None],
        switched_off: Callable[[Slot, BaseException], None],
    ) -> None:
        """note: shows the user a message. switched_off: takes in that the tool has failed."""
        self.context, self._note, self._switched_off = context, note, switched_off
        package = package_of(tools.tool_modules()[context.name])
        self.title = f"{context.name} of {package}" if package else context.name
        self.rank = 0
        self.tool: Any = None
        self.mistakes: dict[str, str] = {}

    def has(self, hook: str) -> bool:
        """Whether the tool is on and does something there."""
        return getattr(self.tool, hook, None) is not None

    def ask(self, function: Callable[[Any], Any], tell: Callable[[str], object] | None = None) -> Any:
        """The answer of a function of the tool; None where that is off or fails.

        tell: tells the user of an InputError, the user's mistake; None: it is the tool's, as any other.
        """
        if self.tool is None:
            return None
        try:
            with widgets_ended():
                return function(self.tool)
        except (Exception, Cancelled) as error:
            if tell is not None and isinstance(error, InputError):
                tell(str(error))
            else:
                self.switch_off(error)
        return None

    def do(self, function: Callable[[Any], Any]) -> Any:
        """Do something of the tool that the user has asked for; the user's mistake is reported."""
        return self.ask(function, self._note)

    def call(self, hook: str, *arguments: Any) -> Any:
        """The answer of a hook; None where the tool is off, lacks it or fails."""
        return self.ask(lambda tool: getattr(tool, hook)(*arguments)) if self.has(hook) else None

    def declare(self, hook: str, *arguments: Any) -> None:
        """Have the tool declare its widgets; a mistake of their user's is reported once while it lasts."""
        if self.has(hook):
            mistakes: list[str] = []
            self.ask(lambda tool: getattr(tool, hook)(*arguments), mistakes.append)
            before, self.mistakes[hook] = self.mistakes.get(hook), "".join(mistakes)
            if mistakes and mistakes[0] != before:
                self._note(mistakes[0])

    def switch_off(self, error: BaseException) -> None:
        """Do without the tool until the next start."""
        self.tool = None
        self.context.cancel_work()
        self._switched_off(self, error)

    def bound(self, entry: Command | Listing) -> Command | Listing:
        """An entry of a menu that speaks to the tool, and does nothing while that is off."""
        if isinstance(entry, Listing):
            return replace(entry, items=partial(self._items, entry))
        is_on = entry.is_on
        return replace(
            entry,
            act=partial(self.do, entry.act),
            is_on=None if is_on is None else lambda: bool(self.ask(is_on)),
            can=lambda: bool(self.ask(entry.can)),
            is_there=lambda: bool(self.ask(entry.is_there)),
        )

    def _items(self, listing: Listing) -> Iterator[Item]:
        for title, act, is_on in self.ask(lambda tool: list(listing.items(tool))) or ():
            yield title, partial(self.do, _of_any(act)), is_on


class ToolModules:
    """The modules of all tools of `tools.tool_names`. of: by name. problems: why one is not there."""

    def __init__(self, commands: Commands) -> None:
        """commands: takes in those of the tools."""
        self.of: dict[str, Any] = {}
        self.problems: dict[str, BaseException] = {}
        for name in tools.tool_names():
            try:
                self.of[name] = self._added(name, commands)
            except Exception as error:  # whatever a tool's folder holds, the window stays
                self.problems[name] = error

    def _added(self, name: str, commands: Commands) -> Any:
        module = _imported(name)
        for menu, entries in getattr(module, "COMMANDS", {}).items():
            if isinstance(entries, (Command, Listing, Menu)):
                what = f"COMMANDS['{menu}'] must be a tuple of commands, not a {type(entries).__name__}"
                raise TypeError(f"{what}: a comma is missing after it")
            commands.add(menu, entries, name)
        commands.mouse = (*commands.mouse, *getattr(module, "MOUSE", ()))
        return module


@dataclass(eq=False)
class Toolbox(WindowPart):
    """All tools.

    stored: the values of all parts that came back. is_dragging: whether the drag in the view is that of the
    tool that has the clicks. label_places: of labels over the view.
    """

    name = "tools"
    doing = "Updating tools"
    layer = 40
    shows = "Dialogs of tools"
    OFFERS = {
        "take_file": "take_file", "take_arrow": "arrow", "abandon": "abandon", "drawn": "drawn",
        "label_places": "label_places",
    }  # fmt: skip
    session: Session
    playback: Playback
    viewport: Viewport
    failures: Failures
    commands: Commands
    modules: ToolModules
    stored: Mapping[str, Any]
    note_of_scan: Callable[[str], None]
    redraw: Callable[[], None]

    def __post_init__(self) -> None:
        self.clicks = Clicks(self.viewport)
        self.followed = Followed()
        self.label_places = LabelPlaces()
        self.is_dragging = False
        self._is_declined = False  # the last click, by the tool that had it
        self._remembered = _values_by_tool(self.stored.get(self.name))
        self._slots = {
            name: Slot(self._context(name), self.note_of_scan, self._switched_off)
            for name in tools.tool_names()
        }
        for name, slot in self._slots.items():
            self.commands.bind_tool(name, slot.bound)
            try:
                self._open(slot)
            except Exception as error:
                slot.switch_off(error)
        for problem in _problems_of_packages():
            self.note_of_scan(problem)

    def _context(self, name: str) -> ToolContext:
        return ToolContext(
            name, self.session, self.playback, self.viewport, self.clicks, self.followed,
            partial(self._lay, name), self.note_of_scan, self.redraw,
        )  # fmt: skip

    def _open(self, slot: Slot) -> None:
        name = slot.context.name
        if name in self.modules.problems:
            raise self.modules.problems[name]
        module = self.modules.of[name]
        slot.title, slot.rank = module.TITLE, getattr(module, "RANK", 0)
        if hasattr(module, "Settings"):
            slot.context.settings = usable(module.Settings(), self._remembered.get(name, {}))
        slot.tool = module.Tool(slot.context)

    @property
    def clicking(self) -> str | None:
        """The name of the tool that clicks in the view go to; None where they only move the view."""
        return self.clicks.owner

    def _tell_problem(self, text: str) -> None:
        """Tell what stays until the user sends it away: the dialog that asked for it is gone by then."""
        self.note_of_scan(Problem(text))

    def _switched_off(self, slot: Slot, error: BaseException) -> None:
        self.session.laid.take_away(slot.context.name)
        if self.clicking == slot.context.name:
            self.clicks.owner = None
        words = f"Scan4D switched off {slot.title} until the next start: {reason(error)}"
        self.failures.report(f"The tool '{slot.context.name}'", error, words)

    def _lay(self, name: str, numbers: NumbersOf | None = None, motion: MotionOf | None = None) -> None:
        """Lay over the open scan what a tool gives, or nothing; what it gives wrong switches it off."""
        if numbers is None and motion is None:
            self.session.laid.take_away(name)
        else:
            slot = self._slots[name]

            def numbers_of(pose: Pose) -> Numbers:
                return slot.ask(lambda _: _checked(numbers(pose), pose)) or {} if numbers else {}

            def motion_of(index: int) -> Rigid:
                return slot.ask(lambda _: _checked_motion(motion(index))) or STILL if motion else STILL

            self.session.laid.lay(name, numbers_of, motion_of)
        self.redraw()

    # --- in the window ----------------------------------------------------------------

    def sections(self) -> Iterator[tuple[str, bool, Callable[[Ui], object]]]:
        """The sections of the panel: title, whether to open it and scroll to its end, what declares it."""
        for name, slot in sorted(self._slots.items(), key=lambda item: item[1].rank):
            if slot.has("panel"):
                is_revealed, slot.context.is_revealed = slot.context.is_revealed, False
                yield f"{slot.title}###{name}", is_revealed, partial(slot.declare, "panel")

    def drawn_below(self) -> Iterator[tuple[str, Callable[[Ui], object]]]:
        """Find what tools show under the timeline now: the tool's name, and what declares it."""
        for name, slot in self._slots.items():
            if slot.has("below") and slot.call("is_below"):
                yield name, partial(slot.declare, "below")

    @property
    def is_below_bare(self) -> bool:
        """Whether all that tools show under the timeline is a few words."""
        slots = [slot for slot in self._slots.values() if slot.has("below") and slot.call("is_below")]
        return all(slot.call("is_bare") for slot in slots)

    def draw_over(self, view: ScreenView, taken: Sequence[Box]) -> None:
        """Have the tools draw over the picture. taken: boxes in the view where labels would cover
        something."""
        canvas = Canvas(view, self.viewport)
        for slot in self._slots.values():
            slot.call("overlay", canvas, view)
        canvas.draw_labels(self.label_places, taken)

    def drawn(self, frame: int) -> DrawnMarks:
        """Find what the tools draw over a frame in pictures that are saved."""
        found = NOTHING_DRAWN
        for slot in self._slots.values():
            found = found.with_more(slot.call("drawn", frame) or NOTHING_DRAWN)
        return found

    def dialog(self, view: ViewArea) -> None:
        """Have the tools declare windows of their own."""
        for slot in self._slots.values():
            slot.declare("dialog")

    @property
    def _first(self) -> Slot | None:
        """The slot whose tool has the clicks."""
        return None if self.clicking is None else self._slots[self.clicking]

    @property
    def prompt(self) -> str:
        """The words to show at the top of the view; empty: none."""
        return str(self._first.call("prompt") or "") if self._first else ""

    @property
    def takes_clicks(self) -> bool:
        """Whether a click is a tool's, so that it must not move the view."""
        return self.clicking is not None and not self._is_declined

    def click(self, pixel: tuple[int, int]) -> None:
        """Give the tool that has the clicks what a pixel of the view shows."""
        self.viewport.finish()
        click = self.clicks.at(pixel)
        if self._first is not None and click is not None:
            self._is_declined = self._first.do(lambda tool: tool.on_click(click)) is False

    def press(self, mouse: ImVec2) -> None:
        """Ask the tool that has the clicks whether a drag that begins there is its own."""
        self.is_dragging = self._first is not None and bool(self._first.call("on_press", mouse))

    def drag(self, pixel: tuple[int, int], *, ends: bool) -> None:
        """Give the tool whose drag it is what a pixel of the view shows. ends: whether the button is let go
        of there."""
        slot, self.is_dragging = self._first, not ends
        if ends:
            self.viewport.finish()
        click = self.clicks.at(pixel, in_full=ends)
        if slot is not None and click is not None:
            slot.do(lambda tool: tool.on_drag(click, ends))

    def arrow(self, right: int, up: int) -> bool:
        """Whether an arrow key was for the tool that has the clicks, which takes it."""
        slot = self._first
        if slot is None or not slot.has("on_arrow"):
            return False
        return bool(slot.do(lambda tool: tool.on_arrow(right, up)))

    @property
    def spans(self) -> list[FrameSpan]:
        """Marks of all tools on the timeline."""
        return [span for slot in self._slots.values() for span in slot.call("spans") or ()]

    def take_file(self, path: Path) -> bool:
        """Whether a file that the user opens or drops is a tool's, which takes it."""
        return any(
            slot.do(lambda tool: tool.on_file(path)) for slot in self._slots.values() if slot.has("on_file")
        )

    @property
    def is_under_way(self) -> bool:
        """Whether something is that undo would take back first."""
        return any([slot.call("is_under_way") for slot in self._slots.values()])

    def begin_scan(self, timeline: Timeline) -> None:
        """Let go of what is under way."""
        self.abandon()

    def abandon(self) -> None:
        """Let go of what is under way, since the document or the scan changes."""
        for slot in self._slots.values():
            slot.call("abandon")

    def on_escape(self) -> bool:
        """End one thing of a tool's, of the one that has the clicks first; whether there was any."""
        in_order = sorted(self._slots.values(), key=lambda slot: slot is not self._first)
        if any(slot.call("on_escape") for slot in in_order):
            return True
        had_clicks, self.clicks.owner = self.clicking is not None, None
        return had_clicks

    # --- in the loop ------------------------------------------------------------------

    @property
    def tasks(self) -> list[Task]:
        """Work that runs beside the window for tools."""
        return [work.task for slot in self._slots.values() for work in slot.context.works]

    def advance(self, now: float) -> bool:
        """Let tools take in what was done for them, and go on; whether there is something to show."""
        changed = False
        for slot in self._slots.values():
            for work in slot.context.take_done():
                changed = True
                slot.ask(_of_any(work.finish), self._tell_problem)
            if slot.call("advance", _BUDGET_MS):
                changed = True
                slot.context.redraw()
        return changed

    def remembered(self) -> dict[str, Mapping[str, Any]]:
        """Tool's name -> values of its `Settings` that are not the defaults, as they were where it is off."""
        kept = dict(self._remembered)
        for name, slot in self._slots.items():
            if slot.context.settings is not None:
                kept[name] = chosen(slot.context.settings)
        return {name: values for name, values in kept.items() if values}

    def finish(self) -> None:
        """Cancel what runs for tools."""
        for slot in self._slots.values():
            slot.context.cancel_work()


def _of_any(act: Callable[[], object]) -> Callable[[Any], object]:
    """A function that is handed a tool and does not need it."""
    return lambda _: act()


def _values_by_tool(data: Any) -> dict[str, Any]:
    """Tool's name -> values of its `Settings`, as far as the file has any; each tool reads its own."""
    found = {}
    for name, values in data.items() if is_object(data) else ():
        with suppress(InputError):
            found[name] = unread(structured(Values, values))
    return found


def _checked(numbers: Numbers, pose: Pose) -> Numbers:
    """The numbers, which are as many as the pose's points. Raises InputError where they are not."""
    Layers(numbers).check(pose)
    return numbers


def _checked_motion(motion: Rigid) -> Rigid:
    """The motion. Raises TypeError where it is none."""
    if not isinstance(motion, Rigid):
        raise TypeError(f"a motion is a viewer.rigid.Rigid, not a {type(motion).__name__}")
    return motion


def _problems_of_packages() -> list[str]:
    """Messages on backends, readers, measures and tools of other packages that cannot be used."""
    if installed_extensions():
        backends(), known_suffixes(), measure_kinds()
    return list(extension_problems().values())


def _imported(name: str) -> Any:
    """The module of a tool. Raises TypeError where a part of the document is not declared as it has to be;
    no file is read by the parts of a module that fails.
    """
    before = dict(Part.kinds)
    try:
        module = importlib.import_module(tools.tool_modules()[name])
        for part_name in Part.kinds.keys() - before:
            Part.kinds[part_name].check_declared()
    except BaseException:
        Part.kinds.clear()
        Part.kinds.update(before)
        raise
    return module
