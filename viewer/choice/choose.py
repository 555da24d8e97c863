"""The choice itself: of all ways that draw a scan, the one that keeps a bound and is best otherwise."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from ..scan.pose import Pose
from ..view import View
from .goal import PIXELS, Goal
from .model import Expected, Law, Model
from .seen import ScanInView
from .ways import SCALES, DrawingWay, ways


@dataclass(frozen=True)
class Automatic:
    """Reason that a renderer was chosen for, and what it was expected to take, as pictures tell it.

    kind, bound, unit: of the `Goal`. expected_ms: of a picture. expected_error: pixels.
    """

    kind: str
    bound: float
    unit: str
    expected_ms: float
    expected_error: float


@dataclass(frozen=True)
class Choice:
    """The way that was chosen for a goal, and what it is expected to take. footprint: the edge of a pixel
    where the scan is, scan units. keeps: whether it is expected to keep the bound; if not, nothing does, and
    it comes nearest."""

    goal: Goal
    way: DrawingWay
    expected: Expected
    footprint: float
    keeps: bool

    @property
    def told(self) -> Automatic:
        """Reason and expectation, as pictures and statistics tell them."""
        goal, expected = self.goal, self.expected
        return Automatic(goal.kind, goal.bound, goal.unit, round(expected.ms, 2), round(expected.error, 4))

    def __str__(self) -> str:
        return f"expected {self.expected.ms:.0f} ms, off by {self.expected.error:.2g} px"


def choose_way(
    pose: Pose, view: View, goal: Goal, model: Model, scales: tuple[float, ...] = SCALES
) -> Choice | None:
    """The way to draw a pose in a view; None where the model knows no way that can.

    Within a time: the least error, of those that are late in few pictures; within an error: the least time,
    likewise. Where none keeps the bound, the one that comes nearest.
    """
    known = [way for way in ways(pose, scales) if way.key in model]
    if not known:
        return None
    return best(known, ScanInView.of(pose, view), goal, model)


def best(known: Iterable[DrawingWay], seen: ScanInView, goal: Goal, model: Model) -> Choice:
    """The best of some ways, at least one, all of which the model knows. A goal in a unit of length is in the
    scan's."""
    tries = []
    for way in known:
        law = model[way.key]
        expected = law.expect(seen, way.scale)
        bounded = _bounded(expected, law, goal, seen)
        other = expected.error if goal.kind == "time" else expected.ms
        missed = bounded > goal.bound
        rank = (missed, bounded if missed else other, other, bounded)
        tries.append((rank, way, expected, not missed))
    _, way, expected, keeps = min(tries, key=lambda each: each[0])
    return Choice(goal, way, expected, seen.footprint, keeps)


def _bounded(expected: Expected, law: Law, goal: Goal, seen: ScanInView) -> float:
    """The number that is bounded, as large as it may be expected to become."""
    if goal.kind == "time":
        return law.most_ms(expected)
    return law.most_error(expected) * (1.0 if goal.unit == PIXELS else seen.footprint)
