"""Measures of landmarks over time, computed anew where something that they are of has changed."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence

from ....analysis.measures import Measure, Series
from ....analysis.measures.kinds import MeasureKind, kind_of
from ....analysis.measures.series import all_series
from ....analysis.track import Track
from ....document.landmarks import Landmarks
from ....errors import InputError
from ....scan.timeline import Timeline
from ....task import Task
from ...desk import Desk

_PACE = 0.1  # seconds from one time to the next, as tracks may change with each turn of the window's loop
_BUDGET = 0.005  # seconds at one time, for measures of landmarks alone

_Inputs = tuple[Measure, tuple[Track | None, ...]]


class Computing:
    """Has the measures of the open scan computed, and tells all tools (`desk.followed`).

    Those of landmarks alone are computed at once, those along the surface beside the window, when their
    landmarks are tracked.
    """

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._timeline: Timeline | None = None
        self._found: dict[str, tuple[_Inputs, Series | None]] = {}  # by measure; None: it tells nothing
        self._task: Task | None = None
        self._next_at = 0.0  # by the clock

    def advance(self, is_tracking: bool) -> bool:
        """Compute what has changed; whether there is something new. is_tracking: whether landmarks are."""
        now = time.monotonic()
        if now < self._next_at or any(work.task is self._task for work in self._desk.works):
            return False
        self._next_at = now + _PACE
        if self._timeline is not self._desk.timeline:
            self._timeline, self._found = self._desk.timeline, {}
        tracks, measures = self._desk.followed.tracks, self._desk.document.part(Landmarks).measures
        on_surface: list[Measure] = []
        ends = 0.0  # the first one is computed, however long it takes
        for measure in measures:
            kind = self._kind(measure, tracks) if self._is_stale(measure, tracks) else None
            if kind is not None and kind.needs_surface:
                on_surface.append(measure)
            elif kind is not None and (not ends or time.monotonic() < ends):
                self._take([measure], tracks, all_series([measure], tracks))
                ends = now + _BUDGET
        if on_surface and not is_tracking:
            self._compute(on_surface, tracks)
        listed = {one.name: self._found[one.name][1] for one in measures if one.name in self._found}
        return self._desk.followed.take_series({name: one for name, one in listed.items() if one is not None})

    def _is_stale(self, measure: Measure, tracks: Mapping[str, Track]) -> bool:
        """Whether it was not computed of what there is now."""
        found = self._found.get(measure.name)
        if found is None:
            return True
        (before, own), now = found[0], _inputs(measure, tracks)[1]
        return before != measure or any(one is not other for one, other in zip(own, now, strict=True))

    def _kind(self, measure: Measure, tracks: Mapping[str, Track]) -> MeasureKind | None:
        """The kind of one that can be computed; what is no measure is told once."""
        if all(name not in tracks for name in measure.landmarks):
            self._found.pop(measure.name, None)
            return None
        try:
            return kind_of(measure)
        except InputError as error:
            self._desk.note(str(error))
            self._take([measure], tracks, {})
            return None

    def _compute(self, measures: Sequence[Measure], tracks: Mapping[str, Track]) -> None:
        timeline = self._desk.timeline
        before = {one.name: found[1] for one in measures if (found := self._found.get(one.name))}
        known = {name: series for name, series in before.items() if series is not None}
        self._take(measures, tracks, known)  # it stays so where it is cancelled, until something changes

        def take(series: Mapping[str, Series]) -> None:
            if timeline is self._desk.timeline:
                self._take(measures, tracks, series)

        self._task = self._desk.run("Measuring", lambda: all_series(measures, tracks, timeline), take)

    def _take(
        self, measures: Sequence[Measure], tracks: Mapping[str, Track], series: Mapping[str, Series]
    ) -> None:
        for measure in measures:
            self._found[measure.name] = _inputs(measure, tracks), series.get(measure.name)


def _inputs(measure: Measure, tracks: Mapping[str, Track]) -> _Inputs:
    return measure, tuple(tracks.get(name) for name in measure.landmarks)
