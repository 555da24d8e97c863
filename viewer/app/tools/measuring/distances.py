"""The distances of the open scan in one frame: value, ends, and the words for them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ....analysis.landmarks import Landmark
from ....analysis.measures import Measure
from ....analysis.measures.distances import distance_in_words
from ....analysis.pick import SURE
from ....analysis.spot import Spot, slack_before
from ....analysis.track import KNOWN_WORDS, Known
from ....document.landmarks import Landmarks
from ....geometry import vector
from ....output.overlays import LINE_COLOR, DrawnPath
from ....scan.times import frame_in_words
from ....scan.units import Scale
from ...tool_context import ToolContext


@dataclass(frozen=True, eq=False)
class Distance:
    """A distance in one frame.

    positions: (2, 3), scan coordinates, NaN where not known. value: scan units, NaN where not known. sigma:
    its standard deviation, NaN or 0 where not known. known, reasons: of both ends together. ends: where each
    was placed, in this frame or else first. sure: how far off the worse end is at most with 95 %.
    """

    measure: Measure
    positions: NDArray[np.float64]
    value: float
    sigma: float
    known: Known
    reason: str
    ends: tuple[Spot, Spot]
    sure: float

    @property
    def label(self) -> str:
        """The name, or the number of one that has no other name."""
        return self.measure.name.removeprefix("Distance ")

    def words(self, scale: Scale) -> str:
        """The distance and its uncertainty; why it is not known, where it is not."""
        if np.isfinite(self.value):
            return distance_in_words(self.value, self.sigma, scale.unit, scale.factor)
        return self.state

    @property
    def state(self) -> str:
        """Whether its ends were placed or tracked in the frame, in words, or why they are not known."""
        words = KNOWN_WORDS[self.known]
        return f"{words}: {self.reason}" if self.known is Known.GAP and self.reason else words

    def slack(self, radius: float) -> float:
        """How far before its ends the surface may be that is their own, scan units. radius: of the scan."""
        spacing = max(end.spacing or 0.0 for end in self.ends)
        return float(slack_before(spacing, self.sure, radius))

    def drawn(self, scale: Scale, radius: float) -> DrawnPath:
        """The line, which is known, for pictures that are saved. radius: of the scan."""
        ends = tuple(map(vector, self.positions))
        return DrawnPath(
            ends, (LINE_COLOR,), name=self.label, value=self.words(scale), has_ends=True,
            slack=self.slack(radius),
        )  # fmt: skip


def distances_in(context: ToolContext, frame: int) -> Iterator[Distance]:
    """The distances of the open scan in a frame, as far as they are found."""
    made, tracks, series = context.document.part(Landmarks), context.followed.tracks, context.followed.series
    for measure in made.distances:
        ends = [made.named(name) for name in measure.landmarks]
        found = series.get(measure.name)
        if (
            found is None
            or frame >= len(found.times)
            or not all(name in tracks for name in measure.landmarks)
        ):
            continue
        own = [tracks[name] for name in measure.landmarks]
        yield Distance(
            measure,
            np.array([track.positions[frame] for track in own]),
            float(found.values[frame]),
            float(found.sigmas[frame]),
            Known(int(found.known[frame])),
            next(filter(None, (track.reasons.get(frame, "") for track in own)), ""),
            (_key(ends[0], frame), _key(ends[1], frame)),
            SURE * float(np.nan_to_num([track.sigmas[frame] for track in own]).max()),
        )


def _key(landmark: Landmark | None, frame: int) -> Spot:
    """The key of a landmark in a frame, or its first one."""
    assert landmark is not None
    return landmark.key_at(frame) or landmark.keys[0]


def snap_words(ends: tuple[Spot, Spot]) -> str:
    """The points that the ends are at, or the surface, such as "at points 12 and 345"."""
    ids = [end.id for end in ends if end.id is not None]
    if len(ids) == 2:
        return f"at points {ids[0]} and {ids[1]}"
    return f"at point {ids[0]} and on the surface" if ids else "on the surface"


def end_words(end: Spot, scale: Scale) -> str:
    """The key of an end, in full."""
    what = "surface" if end.id is None else f"at point {end.id}"
    place = ", ".join(f"{scale.factor * v:.9g}" for v in end.position)
    spacing = "unknown" if end.spacing is None else f"{scale.factor * end.spacing:.3g} {scale.unit}"
    seen = f", filled from level {end.level}" if end.level else ""
    seen += ", at an outline: it may lie on the surface in front or behind" if end.at_outline else ""
    sure = "" if end.uncertainty is None else f" ± {scale.factor * end.uncertainty:.2g}"
    return f"{what}, {frame_in_words(end.frame)}: {place}{sure} {scale.unit}, spacing {spacing}{seen}"
