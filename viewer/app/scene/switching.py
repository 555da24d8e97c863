"""Switches that have a key, of the renderer and of the look: what was switched, and whether that shows."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...backends import Backend, backends
from ...drawing.request import Request
from ...errors import InputError
from ...look import Look
from ...params import Parameter, describe
from ..commands import Command
from ..keys import Keys, chords
from ..notices import Offer
from ..part import WindowPart
from ..playing.playback import Playback
from .rendering import Rendering
from .viewport import Viewport

_SECONDS = 1.5  # that a caption stays, from the first picture that shows what it names
_FEW = 0.01  # of the pixels that show the subject: a change of fewer is easily missed
_ABOUT = "switch"  # what the offers are about


def switch_commands(several: Iterable[Backend]) -> tuple[Command, ...]:
    """Commands that switch the parameters with a key that backends declare; one name has one key in all."""
    found: dict[str, Command] = {}
    for one, parameter in ((each, p) for each in several for p in each.parameters if p.key):
        there = found.setdefault(parameter.name, _switch(one, parameter))
        if there.key != parameter.key:
            raise InputError(
                f"'{parameter.name}' has different keys, {there.key} and {parameter.key}",
                one.name,
                "Give this parameter the same key in all backends",
            )
    return tuple(found.values())


def _switch(one: Backend, parameter: Parameter) -> Command:
    name = parameter.name
    try:
        chords(parameter.key)
    except InputError as error:
        raise InputError(error.what, f"{one.name}.{name}, key={parameter.key!r}", error.hint) from error
    return Command(
        f"switch_{name}", parameter.switch_title, lambda switching: switching.switch(name), parameter.key,
        is_on=lambda switching: switching.rendering.is_on(name),
        can=lambda switching: name in switching.rendering.switches,
        why_not=lambda switching: switching.why_not(name),
        is_there=lambda switching: switching.is_on_toolbar(name),
        short=parameter.short,
    )  # fmt: skip


def _look_switch(parameter: Parameter) -> Command:
    """Switches a field of the look."""
    name = parameter.name
    return Command(
        f"look_{name}", parameter.title, lambda switching: switching.switch_look(parameter), parameter.key,
        is_on=lambda switching: getattr(switching.rendering.session.document.look, name),
    )  # fmt: skip


class _Switched(NamedTuple):
    """A switch that was switched. request, seen: the picture before, and `_seen` of it. number: of that
    picture."""

    parameter: Parameter
    request: Request
    seen: tuple[NDArray, ...]
    number: int


@dataclass(eq=False)
class Switching(WindowPart):
    """Switches what has a key, and steps through renderers; a caption over the view says what changed.

    A message reports a switch that changed hardly anything, and offers the switch that makes its effect
    visible.
    caption: over the view, None where there is none.
    """

    name = "switching"
    doing = "Comparing pictures"
    rendering: Rendering
    viewport: Viewport
    playback: Playback
    keys: Keys
    note_of_scan: Callable[[str], None]
    end_offers: Callable[[str], None]

    def __post_init__(self) -> None:
        self._ends = -math.inf  # by the clock; infinite while the first picture is awaited
        self._text = ""
        self._switched: _Switched | None = None
        self.caption: str | None = None

    def step(self, by: int) -> None:
        """Draw with the next renderer, 1, or the one before, -1."""
        self.rendering.step(by)
        self._say(self.rendering.title)

    def switch_look(self, parameter: Parameter) -> None:
        """Switch a field of the look."""
        self.rendering.switch_look(parameter.name)
        look = self.rendering.session.document.look
        self._say(_state(parameter, look))

    def switch(self, name: str) -> None:
        """Switch one of the renderer's switches, and find out whether that changes the picture."""
        viewport, parameter = self.viewport, self.rendering.switches[name]
        is_whole = viewport.is_there and viewport.is_complete and not viewport.is_preview
        self._switched = None
        self.end_offers(_ABOUT)
        if is_whole and not self.playback.player.playing:
            assert viewport.request is not None
            self._switched = _Switched(parameter, viewport.request, self._seen(), viewport.number)
        self.rendering.switch(name)
        self._say(_state(parameter, self.rendering.params))

    def _seen(self) -> tuple[NDArray, ...]:
        """Depth, row and level of each pixel of the picture."""
        surface = self.viewport.surface
        assert surface is not None
        return surface.depth, surface.row, surface.level

    def why_not(self, name: str) -> str:
        """Why the renderer cannot switch a parameter now, for its user; empty before the first pose."""
        drawn_by = self.rendering.backend
        if drawn_by is None:
            return ""
        own = {parameter.name: parameter for parameter in backends()[drawn_by].parameters}
        if name in own:
            met = (one for one in own[name].when if not one.holds(self.rendering.params))
            others = [own[one.parameter] for one in met]
            listed = " and ".join(f"'{one.title}'" for one in others)
            keys = ", ".join(filter(None, (self._key(one.name) for one in others)))
            return f"'{own[name].switch_title}' has no effect with this value of {listed}" + (
                f". Press {keys} to change it." if keys else "."
            )
        of_others = [one for one in backends().values() if any(p.name == name for p in one.parameters)]
        title = next(p.switch_title for p in of_others[0].parameters if p.name == name)
        having = " or ".join(f"'{one.title}'" for one in of_others)
        return f"The renderer '{self.rendering.title}' has no switch '{title}'. Choose the renderer {having}."

    def _key(self, name: str) -> str:
        return self.keys.of.get(f"switch_{name}", "")

    def is_on_toolbar(self, name: str) -> bool:
        """Whether the toolbar shows a switch: the scan has range views, and the renderer has the switch."""
        pose, drawn_by = self.playback.pose, self.rendering.backend
        if pose is None or not pose.views or drawn_by is None:
            return False
        return any(parameter.name == name for parameter in backends()[drawn_by].parameters)

    def _say(self, text: str) -> None:
        self._text, self._ends = text, math.inf

    def advance(self, now: float) -> bool:
        """Look at what is drawn; whether the caption has changed. now: by the clock."""
        before = self.caption
        if math.isinf(self._ends) and self._ends > now and self._is_shown:
            self._ends = now + _SECONDS
        self.caption = self._text if now < self._ends else None
        if self._switched is not None:
            self._compare(self._switched)
        return self.caption != before

    @property
    def _is_shown(self) -> bool:
        """Whether the picture is drawn as the document says."""
        request = self.viewport.request
        if request is None or not self.viewport.is_there:
            return False
        return (request.backend.name, request.params) == (self.rendering.backend, self.rendering.params)

    def _compare(self, switched: _Switched) -> None:
        """Report that hardly anything changed with a switch, once the picture is complete."""
        viewport, before = self.viewport, switched.request
        if viewport.number == switched.number or not viewport.is_complete or viewport.request is None:
            return
        self._switched = None
        now = viewport.request
        is_comparable = (now.pose, now.camera, now.layers) == (before.pose, before.camera, before.layers)
        if not (is_comparable and self._is_shown):
            return
        differs = [one != other for one, other in zip(self._seen(), switched.seen, strict=True)]
        changed = int(np.count_nonzero(np.logical_or.reduce(differs)))
        if changed <= _FEW * np.count_nonzero(np.isfinite(switched.seen[0])):
            self.note_of_scan(self._unseen(switched.parameter, changed))

    def _unseen(self, parameter: Parameter, changed: int) -> str:
        """Words on a switch that changed few pixels or none, with the switch that helps, if any."""
        params, pose = self.rendering.params, self.playback.pose
        effect = f"Only {changed:,} pixels changed" if changed else "The picture did not change"
        text, obstacle = f"{_state(parameter, params)}. {effect}", parameter.obstacle
        helps = self.rendering.switches.get(obstacle.switch) if obstacle else None
        is_range = pose is not None and bool(pose.views)
        if obstacle is None or helps is None or helps.is_on(params) or not is_range:
            return text + "."
        key = self._key(helps.name)
        title = helps.switch_title + (f" ({key})" if key else "")
        return Offer(f"{text}: {obstacle.why}.", {title: lambda: self.switch(helps.name)}, _ABOUT)

    def next_change(self, now: float) -> float:
        """Seconds until the caption goes; infinite where it does not by itself."""
        return self._ends - now if now < self._ends else math.inf

    COMMANDS = (
        Command("backend", "Next renderer", lambda switching: switching.step(1), "B"),
        Command("backend_before", "Previous renderer", lambda switching: switching.step(-1), "Shift+B"),
        *(_look_switch(parameter) for parameter in describe(Look) if parameter.key),
        *switch_commands(backends().values()),
    )


def _state(parameter: Parameter, values: Any) -> str:
    """A switch and its state, such as "Fill holes: off"."""
    return f"{parameter.switch_title}: {'on' if parameter.is_on(values) else 'off'}"
