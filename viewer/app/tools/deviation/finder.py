"""Has the statistics of deviations found beside the window, and keeps them for the next time."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .... import __version__
from ....analysis.deviation.chosen import Deviations, ReferenceChoice, moved_to_reference
from ....analysis.deviation.over_time import FrameDeviation, FramePlace, KeptDeviations, frame_deviation
from ....analysis.deviation.statistics import DeviationStatistics
from ....document.recording import fingerprint
from ....errors import InputError
from ....scan.timeline import Timeline
from ....task import announce, checkpoint, over
from ...tool_context import ToolContext
from .._painting import Sphere
from .._resumed import Resumed

_SAVING = 2.0  # seconds between two times that statistics are kept
_NONE = DeviationStatistics.of(np.empty(0))


@dataclass(eq=False)
class DeviationWork:
    """Deviations as far as a thread of its own has found them.

    places: of the frames whose motion is known; the window replaces them. deviations: None before the
    reference was read. found: statistics by frame and the key of its place, so that those of the recorded
    and of the stabilised scan stay side by side. problem: why there are none.
    """

    timeline: Timeline
    reference: ReferenceChoice
    spheres: tuple[Sphere, ...]
    places: Mapping[int, FramePlace]
    deviations: Deviations | None = None
    found: dict[tuple[int, str], FrameDeviation] = field(default_factory=dict)
    problem: str = ""

    @property
    def left(self) -> list[int]:
        """The frames that are not known, with a motion."""
        return [frame for frame, place in self.places.items() if (frame, place.key) not in self.found]

    @property
    def known(self) -> dict[int, FrameDeviation]:
        """The statistics of the frames where they are shown, none before the reference was read."""
        places = {} if self.deviations is None else self.places
        keys = {frame: (frame, place.key) for frame, place in places.items()}
        return {frame: self.found[key] for frame, key in keys.items() if key in self.found}

    @property
    def is_whole(self) -> bool:
        """Whether all frames with a motion are known."""
        return self.deviations is not None and not self.left

    def find(self) -> None:
        """Find what is not known yet. Raises Cancelled, and InputError."""
        try:
            self._find()
        except InputError as error:
            self.problem = str(error)
            raise

    def _find(self) -> None:
        file = self.reference.file
        key = {
            "version": __version__,
            "scan": fingerprint(self.timeline.files) or self.timeline.name,
            "times": len(self.timeline),
            "unit": self.timeline.unit,
            "reference": [
                self.reference.first,
                self.reference.last,
                file and (fingerprint((Path(file),)) or file),
            ],
            "spheres": self.spheres,
        }
        kept = KeptDeviations(key)
        if self.deviations is None:
            announce("Reading the reference")
            deviations = self.reference.read(self.timeline)
            over()
            self.found |= kept.read()
            self.deviations = deviations
        spheres = np.array(self.spheres, np.float64).reshape(-1, 4)
        places, left, saved = self.places, self.left, time.monotonic()
        try:
            for number, frame in enumerate(left):
                checkpoint(number / len(left))
                place = places[frame]
                try:
                    cloud = self.timeline.pose(frame).cloud
                    found = frame_deviation(self.deviations, cloud, spheres, place)
                except InputError:  # the frame cannot be read, which the window says where it shows it
                    found = FrameDeviation(_NONE, _NONE if self.spheres else None)
                self.found[frame, place.key] = found
                if time.monotonic() - saved > _SAVING:
                    kept.save(self.found)
                    saved = time.monotonic()
        finally:
            if left:
                kept.save(self.found)


class DeviationFinder(Resumed[DeviationWork]):
    """Has the deviations of the open scan found. known: statistics by frame, as far as the window has taken
    them in; another object after each change."""

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context, "Measuring deviations")
        self.known: Mapping[int, FrameDeviation] = {}
        self._places: tuple[tuple[object, ...], dict[int, FramePlace]] = (), {}

    def advance(
        self, reference: ReferenceChoice | None, spheres: tuple[Sphere, ...], is_wanted: bool
    ) -> bool:
        """Have deviations from a reference found; whether there is something new. reference: None: none is
        chosen. is_wanted: see `take`."""
        timeline = self._context.timeline
        places = self.places(reference) if reference is not None and is_wanted else {}

        def is_same(work: DeviationWork) -> bool:
            asked = timeline, reference, spheres
            return asked == (work.timeline, work.reference, work.spheres)

        def make() -> DeviationWork:
            assert reference is not None
            return DeviationWork(timeline, reference, spheres, places)

        if self.work is not None and is_wanted:
            self.work.places = places
        has_changed = self.take(is_same, make, is_wanted and reference is not None)
        known = {} if self.work is None or not is_wanted else self.work.known
        if has_changed or known != self.known:
            self.known, has_changed = known, True
        return has_changed

    def places(self, reference: ReferenceChoice) -> Mapping[int, FramePlace]:
        """The places of the frames whose motion is known, as the scan is shown."""
        context, count = self._context, len(self._context.timeline)
        ends = [context.motion_of(frame) for frame in (0, count - 1)]
        matrices = [None if one is None else one.matrix.tobytes() for one in ends]
        of = context.timeline, context.followed.still, reference, *matrices
        if of != self._places[0]:
            start, found = context.motion_of(reference.first), {}
            for frame in range(count):
                shown = context.motion_of(frame)
                moved = moved_to_reference(reference, shown, start)
                if shown is not None and moved is not None:
                    painted = moved if start is None else start.inverse.after(shown)
                    found[frame] = FramePlace(moved, painted)
            self._places = of, found
        return self._places[1]
