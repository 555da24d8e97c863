"""Goals of the suite "surface": bounds on errors, and which of the measured rows meet them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from .metrics import defined_mean

ESTIMATED = "estimate"  # the contender whose normals are those of the points, not of a picture
STATIC = "static, noise 0.1"
STATIC_AVERAGE = f"{STATIC}, average of 8"
_STATIC = (STATIC, STATIC_AVERAGE)
_NOISY = ("noise 0.1", "noise 0.3", "noise 0.6", "noise 0.3, with normals")
_EVEN = ("even", "even, with normals", "blue noise", "random")
_THINNED = ("thinned 1:10", "thinned 1:10, with normals")
_UNEVEN = ("ramp 1:10", "ramp 1:100", "stretched grid", "stretched grid, with normals")
_BODIES = (*_EVEN, "ramp 1:10", *_THINNED)


@dataclass(frozen=True)
class SurfaceGoal:
    """A bound on an error. error: its name in the rows. low, high: the values that meet the goal. conditions:
    the scans that it is for. size: whether the sign of the error does not count. relative: whether the error
    is divided by that of the normals that Scan4D estimates before any picture (`ESTIMATED`)."""

    error: str
    title: str
    unit: str
    high: float
    conditions: tuple[str, ...]
    low: float = -math.inf
    size: bool = False
    relative: bool = False

    def meets(self, value: float) -> bool:
        """Whether a value meets the goal; an undefined one does not."""
        return self.low <= value <= self.high

    @property
    def bound(self) -> str:
        """The bound in words."""
        if math.isinf(self.high):
            return self.unit
        return f"{'≤' if math.isinf(self.low) else f'{self.low:g} to'} {self.high:g} {self.unit}"


GOALS = (
    SurfaceGoal("bias", "distance from the surface, mean", "spacings", 0.05, (*_EVEN, *_NOISY), size=True),
    SurfaceGoal(
        "rms", "distance from the surface, root mean square", "spacings", math.inf, ("even", *_NOISY)
    ),
    SurfaceGoal("open_percent", "holes and see-through", "%", 1.0, (*_BODIES, *_UNEVEN[1:], *_NOISY)),
    SurfaceGoal("wrong_layer_percent", "wrong layer", "%", 0.4, (*_EVEN, "two sheets")),
    SurfaceGoal("wrong_layer_percent", "wrong layer", "%", 1.0, ("ramp 1:10", *_THINNED)),
    SurfaceGoal("spill_p95", "spill, 95th percentile", "px", 3.0, (*_EVEN, "two sheets")),
    SurfaceGoal("spill_p95", "spill, 95th percentile", "px", 4.0, ("ramp 1:10", *_THINNED)),
    SurfaceGoal("normal_mean", "normals, mean", "of the estimate", 1.1, (*_NOISY[:3], "even"), relative=True),
    SurfaceGoal("normal_p95", "normals, 95th percentile", "°", 20.0, _NOISY[:2]),
    SurfaceGoal("slit_percent", "slits", "%", 0.0, ("face", *_EVEN)),
    SurfaceGoal("open_percent", "holes and see-through", "%", 0.0, ("face",)),
    SurfaceGoal("held_percent", "true within ±", "%", 98.0, (*_EVEN, *_THINNED, *_NOISY), low=93.0),
    SurfaceGoal("off_percent", "picks off without a warning", "%", 0.5, (*_EVEN, *_THINNED, *_NOISY)),
    SurfaceGoal("refused_percent", "picks refused", "%", 5.0, _EVEN),
    SurfaceGoal(
        "flipped_percent", "flipped normals", "%", 0.2, ("even", "random", "thinned 1:10", "moving body")
    ),
    SurfaceGoal("flipped_percent", "flipped normals", "%", 1.0, ("thin legs",)),
    SurfaceGoal("wander_depth", "static: depth, standard deviation", "spacings", 0.04, _STATIC),
    SurfaceGoal("wander_normal", "static: normals wander", "°", 1.2, _STATIC),
    SurfaceGoal("wander_shading", "static: change of shading", "levels", 1.5, _STATIC),
)


class Line(NamedTuple):
    """A line of the table: a goal for one condition, and the value of each backend that has one."""

    goal: SurfaceGoal
    condition: str
    found: Mapping[str, float]


def table(rows: Sequence[Mapping[str, Any]]) -> list[Line]:
    """The lines of all goals. rows: of the suite; the value of a backend is the mean over the scenes."""
    lines = []
    for goal in GOALS:
        for condition in goal.conditions:
            of_condition = [row for row in rows if row["condition"] == condition]
            found = _by_backend(of_condition, goal)
            if found:
                lines.append(Line(goal, condition, found))
    return lines


def _by_backend(rows: Iterable[Mapping[str, Any]], goal: SurfaceGoal) -> dict[str, float]:
    rows = list(rows)
    values = {(row["scene"], row["backend"]): _number(row["errors"].get(goal.error)) for row in rows}
    means = {}
    for name in dict.fromkeys(row["backend"] for row in rows):
        if goal.relative and name == ESTIMATED:
            continue
        known = []
        for scene in dict.fromkeys(row["scene"] for row in rows):
            value = values.get((scene, name), math.nan)
            if goal.relative:
                value /= values.get((scene, ESTIMATED), math.nan) or math.nan
            known.append(abs(value) if goal.size else value)
        mean = defined_mean(known)
        if not math.isnan(mean):
            means[name] = mean
    return means


def table_lines(lines: Sequence[Line], shown: Callable[[float], str]) -> list[str]:
    """The table as text, a line each: `*` marks what meets its goal. shown: writes a number."""
    names = list(dict.fromkeys(name for line in lines for name in line.found))
    width = max((len(f"{line.goal.title}, {line.condition}") for line in lines), default=0)
    cells = [
        [
            f"{shown(line.found[name])}{'*' if line.goal.meets(line.found[name]) else ' '}"
            if name in line.found
            else "-"
            for name in names
        ]
        for line in lines
    ]
    head = f"{'goal':{width}}  {'bound':>16}  " + "  ".join(f"{name:>11}" for name in names)
    return [
        head,
        *(
            f"{f'{line.goal.title}, {line.condition}':{width}}  {line.goal.bound:>16}  "
            + "  ".join(f"{cell:>{max(11, len(name))}}" for cell, name in zip(row, names, strict=True))
            for line, row in zip(lines, cells, strict=True)
        ),
    ]


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float) else math.nan
