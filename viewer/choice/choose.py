"""The choice: of all configurations that draw a scan, the one that meets a bound and is best otherwise."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from ..scan.pose import Pose
from ..view import View
from .configurations import SCALES, Configuration, configurations
from .goal import PIXELS, Goal
from .model import Expected, Law, Model
from .seen import ScanInView

_CLEARLY = 1.2  # times as good: what is expected is off by 10 to 25 % of what a picture takes
_ROOM = 0.9  # share of the bound; a configuration within it replaces one that also meets the bound


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
    """The configuration chosen for a goal, and what it is expected to take. footprint: the edge of a pixel
    where the scan is, scan units. meets_limit: whether it probably meets the bound; if not, none does, and
    it comes nearest."""

    goal: Goal
    configuration: Configuration
    expected: Expected
    footprint: float
    meets_limit: bool

    @property
    def report(self) -> Automatic:
        """Reason and expectation, for pictures and statistics."""
        goal, expected = self.goal, self.expected
        return Automatic(goal.kind, goal.bound, goal.unit, round(expected.ms, 2), round(expected.error, 4))

    def __str__(self) -> str:
        return f"expected time {self.expected.ms:.0f} ms, with an error of {self.expected.error:.2g} px"


@dataclass(frozen=True)
class Candidate:
    """A configuration that may draw a view, and its expected time. bounded: the number that the goal bounds,
    as large as it may be expected to become; other: the one that it does not, where less is better."""

    configuration: Configuration
    expected: Expected
    bounded: float
    other: float


@dataclass(frozen=True)
class Comparison:
    """All configurations that may draw a view, at least one, and a goal, whose unit is the scan's if it is a
    length. footprint: as of `Choice`."""

    goal: Goal
    footprint: float
    candidates: tuple[Candidate, ...]

    @classmethod
    def of(cls, known: Iterable[Configuration], seen: ScanInView, goal: Goal, model: Model) -> Comparison:
        """The comparison of some configurations, all of which the model knows."""
        candidates = []
        for one in known:
            law = model[one.key]
            expected = law.expect(seen.of_share(one.share), one.scale)
            other = expected.error if goal.kind == "time" else expected.ms
            candidates.append(Candidate(one, expected, _bounded(expected, law, goal, seen), other))
        return cls(goal, seen.footprint, tuple(candidates))

    def best(self) -> Choice:
        """The choice of the best one: see `choose_configuration`."""
        return self._choice(min(self.candidates, key=self._rank))

    def settled(self, present: Configuration | None) -> Choice:
        """The choice where one is drawn with already: that stays, unless it misses the bound or another one
        is clearly better and meets the bound with room to spare; where none meets it, unless another one is
        clearly nearer. So a view that moves to and fro is not drawn now so, now so."""
        now = next((each for each in self.candidates if each.configuration == present), None)
        if now is None:
            return self.best()
        best = min(self.candidates, key=self._rank)
        if self._meets_limit(now):
            roomy = [each for each in self.candidates if each.bounded <= _ROOM * self.goal.bound]
            best = min(roomy, key=self._rank, default=now)
            is_clear = now.other > _CLEARLY * best.other
        else:
            is_clear = self._meets_limit(best) or now.bounded > _CLEARLY * best.bounded
        return self._choice(best if is_clear else now)

    def _meets_limit(self, candidate: Candidate) -> bool:
        return candidate.bounded <= self.goal.bound

    def _rank(self, candidate: Candidate) -> tuple[float, ...]:
        missed = not self._meets_limit(candidate)
        first = candidate.bounded if missed else candidate.other
        return missed, first, candidate.other, candidate.bounded

    def _choice(self, candidate: Candidate) -> Choice:
        return Choice(
            self.goal,
            candidate.configuration,
            candidate.expected,
            self.footprint,
            self._meets_limit(candidate),
        )


def choose_configuration(
    pose: Pose, view: View, goal: Goal, model: Model, scales: tuple[float, ...] = SCALES
) -> Choice | None:
    """The configuration to draw a pose with in a view; None if the model knows none that can.

    Within a time: the least error, of those that are late in few pictures; within an error: the least time,
    likewise. Where none meets the bound, the one that comes nearest.
    """
    known = known_configurations(pose, model, scales)
    return Comparison.of(known, ScanInView.of(pose, view), goal, model).best() if known else None


def known_configurations(pose: Pose, model: Model, scales: tuple[float, ...] = SCALES) -> list[Configuration]:
    """The configurations for a pose that a model knows."""
    return [one for one in configurations(pose, scales) if one.key in model]


def best(known: Iterable[Configuration], seen: ScanInView, goal: Goal, model: Model) -> Choice:
    """The best of some configurations, at least one, all of which the model knows. A goal in a unit of length
    is in the scan's."""
    return Comparison.of(known, seen, goal, model).best()


def _bounded(expected: Expected, law: Law, goal: Goal, seen: ScanInView) -> float:
    """The number that is bounded, as large as it may be expected to become."""
    if goal.kind == "time":
        return law.most_ms(expected)
    return law.most_error(expected) * (1.0 if goal.unit == PIXELS else seen.footprint)
