"""Has the measures of the open scan found over time: those of landmarks at once, those of surfaces beside."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ....analysis.measures import Measure, Series
from ....analysis.measures.kinds import kind_of
from ....analysis.measures.series import all_series, series_of
from ....analysis.track import Track
from ....document.landmarks import Landmarks
from ....errors import InputError
from ....task import Task
from ...tool_context import ToolContext


@dataclass(frozen=True, eq=False)
class Inputs:
    """The inputs of a series. tracks: of the measure's landmarks, each once. noise: of the scanner."""

    measure: Measure
    tracks: tuple[Track, ...]
    noise: float

    def is_like(self, other: Inputs | None) -> bool:
        """Whether others are the very same."""
        if other is None or (self.measure, self.noise) != (other.measure, other.noise):
            return False
        return all(a is b for a, b in zip(self.tracks, other.tracks, strict=True))

    @property
    def named(self) -> dict[str, Track]:
        """The tracks by the names of their landmarks."""
        return dict(zip(dict.fromkeys(self.measure.landmarks), self.tracks, strict=True))


Found = dict[str, tuple[Inputs, Series]]  # by the name of the measure


class Measurer:
    """Finds the series of measures, each again where its landmarks were tracked anew, and tells all tools
    (`context.followed`). is_running: whether measures of surfaces are being found."""

    def __init__(self, context: ToolContext) -> None:
        self._context = context
        self._found: Found = {}
        self._asked: dict[str, Inputs] = {}  # those of surfaces that were asked for last, found or not
        self._begun: Found = {}  # of those that are being found, as far as they are
        self._task: Task | None = None
        self._refused: set[str] = set()

    @property
    def is_running(self) -> bool:
        """Whether measures of surfaces are being found."""
        return any(work.task is self._task for work in self._context.works)

    def advance(self, budget: float, noise: float) -> bool:
        """Find what is left to find, for so many milliseconds; whether there is something new, or left.

        While landmarks are being tracked, measures of them stand as they were until they are found anew.
        """
        ends = time.perf_counter() + budget / 1e3
        wanted = self._wanted(self._context.document.part(Landmarks).measures, noise)
        self._take_over(wanted)
        missing = [one for name, one in wanted.items() if not one.is_like(self._inputs(name))]
        quick = [one for one in missing if not kind_of(one.measure).needs_surface]
        while quick and time.perf_counter() < ends:
            one = quick.pop(0)
            self._found[one.measure.name] = one, series_of(one.measure, one.named, None, noise)
        self._measure_surfaces([one for one in missing if kind_of(one.measure).needs_surface], noise)
        self._context.followed.is_measuring = self.is_running
        self._found = {
            name: known for name, known in self._found.items()
            if name in wanted and (wanted[name].is_like(known[0]) or wanted[name] in quick)
        }  # fmt: skip
        begun, known = self._begun, self._found
        begun = {name: one for name, one in begun.items() if name in wanted and wanted[name].is_like(one[0])}
        found = {name: (known | begun)[name][1] for name in wanted if name in known or name in begun}
        return self._context.followed.take_series(found) or bool(quick)

    def _inputs(self, name: str) -> Inputs | None:
        known = self._found.get(name)
        return None if known is None else known[0]

    def _take_over(self, wanted: Mapping[str, Inputs]) -> None:
        """Let measures that were given another name have what was found of them before."""
        for name, one in wanted.items():
            if name in self._found:
                continue
            for known, series in list(self._found.values()):
                if (known.measure.kind, known.measure.landmarks) == (one.measure.kind, one.measure.landmarks):
                    renamed = replace(known, measure=replace(known.measure, name=name))
                    if one.is_like(renamed):
                        self._found[name] = one, replace(series, name=name)

    def _wanted(self, measures: Sequence[Measure], noise: float) -> dict[str, Inputs]:
        """The measures whose landmarks are all placed, with their tracks. Reports unknown kinds once."""
        tracks, wanted = self._context.followed.tracks, {}
        for measure in measures:
            names = dict.fromkeys(measure.landmarks)
            if names and all(name in tracks for name in names) and self._is_one(measure):
                wanted[measure.name] = Inputs(measure, tuple(tracks[name] for name in names), noise)
        return wanted

    def _is_one(self, measure: Measure) -> bool:
        try:
            kind_of(measure)
        except InputError as error:
            if measure.name not in self._refused:
                self._refused.add(measure.name)
                self._context.note(str(error))
            return False
        return True

    def _measure_surfaces(self, missing: Sequence[Inputs], noise: float) -> None:
        """Have measures of surfaces found beside the window, once their landmarks are known in all frames;
        those that the user has cancelled, when something is added or changed. The frame that the user is at
        comes first, then those beside it, and each is shown as soon as it is found."""
        ready = [one for one in missing if all(track.is_whole for track in one.tracks)]
        if all(one.is_like(self._asked.get(one.measure.name)) for one in ready):
            return
        if self._task is not None:
            self._task.cancel()
        self._asked = {one.measure.name: one for one in ready}
        timeline, measures = self._context.timeline, [one.measure for one in ready]
        tracks = {name: track for one in ready for name, track in one.named.items()}
        now = self._context.index
        frames = sorted(range(len(timeline)), key=lambda frame: (abs(frame - now), frame))

        def tell(found: Mapping[str, Series]) -> None:
            self._begun = {one.measure.name: (one, found[one.measure.name]) for one in ready}

        def take(found: Mapping[str, Series]) -> None:
            self._found |= {one.measure.name: (one, found[one.measure.name]) for one in ready}
            self._begun = {}

        def measure() -> Mapping[str, Series]:
            return all_series(measures, tracks, timeline, noise, frames, tell, keep=True)

        self._begun = {}
        self._task = self._context.run("Measuring surfaces", measure, take)
