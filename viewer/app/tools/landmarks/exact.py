"""Landmarks of a scan of one topology, followed exactly by the points around them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from ....analysis.landmarks import Landmark
from ....analysis.spot import Spot, followed
from ....analysis.track import Known, Track
from ....errors import InputError
from ....scan.timeline import Timeline
from ....task import checkpoint


class ExactTracker:
    """Follows landmarks frame by frame. tracks: as far as they are known, by name."""

    def __init__(
        self,
        timeline: Timeline,
        landmarks: Sequence[Landmark],
        *,
        first: int = 0,
        known: ExactTracker | None = None,
    ) -> None:
        self._timeline, self._next = timeline, first
        self._landmarks = {one.name: one for one in landmarks if one.keys}
        before = known._landmarks if known else {}
        self.tracks: Mapping[str, Track] = {
            name: known.tracks[name] if known and before.get(name) is one else _placed(one, timeline)
            for name, one in self._landmarks.items()
        }
        self.progress = 0.0

    def look_at(self, frame: int) -> None:
        """Have a frame done next."""
        self._next = frame

    def run(self) -> Iterator[int]:
        """Go through the frames in the order of need; yields each that has something new."""
        left = set(range(len(self._timeline)))
        while left:
            frame = min(left, key=lambda one: (abs(one - self._next), one))
            left.remove(frame)
            self.progress = 1 - len(left) / len(self._timeline)
            checkpoint(self.progress)
            try:
                pose = self._timeline.visit(frame)
            except InputError as error:
                self._note(frame, {}, str(error))
                yield frame
                continue
            if self._timeline.one_topology is None and len(self._timeline) > 1:
                self._timeline.pose((frame + 1) % len(self._timeline))
            if self._timeline.one_topology is False:
                return
            spots = {
                name: followed(_nearest(one, frame), pose)
                for name, one in self._landmarks.items()
                if self.tracks[name].known[frame] == Known.PENDING
            }
            self._note(frame, spots, "its point is missing")
            yield frame

    def _note(self, frame: int, spots: Mapping[str, Spot | None], reason: str) -> None:
        tracks = dict(self.tracks)
        for name, spot in spots.items():
            tracks[name] = _with(tracks[name], frame, spot, Known.TRACKED, reason)
        self.tracks = tracks


def _nearest(landmark: Landmark, frame: int) -> Spot:
    return min(landmark.keys, key=lambda key: (abs(key.frame - frame), key.frame))


def _placed(landmark: Landmark, timeline: Timeline) -> Track:
    track = Track.pending(timeline.times)
    for key in landmark.keys:
        track = _with(track, key.frame, key, Known.PLACED)
    for frame in landmark.missing:
        track = _with(track, frame, None, Known.GAP, "missing")
    return track


def _with(track: Track, frame: int, spot: Spot | None, known: Known, reason: str = "") -> Track:
    positions, covariances, how = track.positions.copy(), track.covariances.copy(), track.known.copy()
    if spot is None:
        how[frame] = Known.GAP
        return replace(track, known=how, reasons={**track.reasons, frame: reason})
    positions[frame], how[frame] = spot.position, known
    if spot.spread is not None:
        covariances[frame] = spot.spread
    return replace(track, positions=positions, covariances=covariances, known=how)
