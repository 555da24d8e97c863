"""Landmarks as they stand in one frame: where they are, how sure that is, and what is said of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ....analysis.landmarks import Landmark
from ....analysis.surface_point import SurfacePoint
from ....analysis.track import KNOWN_WORDS, Known, Track
from ....analysis.words import SURE
from ....geometry import vector
from ....output.overlays import DrawnLandmark

MISSING = "not visible in this frame"
_UNKNOWN = (np.nan,) * 6
_ROWS = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])  # of a covariance's six numbers, as a matrix


@dataclass(frozen=True, eq=False)
class ShownLandmarks:
    """The landmarks of a document in one frame.

    positions: (N, 3) scan coordinates, NaN where they are not known. known: (N,) uint8 of `Known`; GAP also
    where the user says that it is not there. sure: (N,) how far off a position is at most with 95 %, along
    the line on which that is worst, scan units; NaN where not known. spacings: (N,) at their keys, 0 where
    not known.
    """

    frame: int
    landmarks: Sequence[Landmark]
    positions: NDArray[np.float64]
    known: NDArray[np.uint8]
    sure: NDArray[np.float64]
    spacings: NDArray[np.float64]
    reasons: Mapping[int, str]

    @classmethod
    def of(cls, landmarks: Sequence[Landmark], tracks: Mapping[str, Track], frame: int) -> ShownLandmarks:
        """The landmarks in a frame: as they were set there, else as they were tracked."""
        count, gap = len(landmarks), int(Known.GAP)
        positions, spreads = np.full((count, 3), np.nan), np.full((count, 3, 3), np.nan)
        known, spacings = np.zeros(count, np.uint8), np.zeros(count)
        keyed: dict[int, SurfacePoint] = {}
        tracked: dict[int, Track] = {}
        for number, landmark in enumerate(landmarks):
            if not landmark.keys:
                continue
            spacings[number] = landmark.keys[0].spacing or 0.0
            if frame in landmark.missing:
                known[number] = gap
            elif (key := landmark.key_at(frame)) is not None:
                keyed[number] = key
            elif (track := tracks.get(landmark.name)) is not None:
                tracked[number] = track
        if keyed:
            at = list(keyed)
            known[at], positions[at] = Known.PLACED, [key.position for key in keyed.values()]
            spreads[at] = np.array([key.covariance or _UNKNOWN for key in keyed.values()])[:, _ROWS]
        if tracked:
            at = list(tracked)
            known[at] = [track.known[frame] for track in tracked.values()]
            positions[at] = [track.positions[frame] for track in tracked.values()]
            spreads[at] = [track.covariances[frame] for track in tracked.values()]
        reasons = {
            number: track.reasons.get(frame, "") for number, track in tracked.items() if known[number] == gap
        }
        return cls(frame, landmarks, positions, known, _largest(spreads), spacings, reasons)

    @property
    def is_there(self) -> NDArray[np.bool_]:
        """(N,): which have a position in the frame."""
        return self.known >= Known.TRACKED

    def number(self, name: str) -> int | None:
        """Find a landmark in the arrays by its name; None where there is none."""
        return next((n for n, landmark in enumerate(self.landmarks) if landmark.name == name), None)

    def state(self, number: int) -> str:
        """Tell how one stands, in words."""
        landmark, known = self.landmarks[number], Known(int(self.known[number]))
        if self.frame in landmark.missing:
            return MISSING
        if not landmark.keys:
            return landmark.state
        if known is Known.GAP:
            reason = self.reasons.get(number, "")
            return f"no data: {reason}" if reason else "no data"
        return KNOWN_WORDS[known]


def names_over(shown: ShownLandmarks, regions: Mapping[str, str]) -> dict[int, str]:
    """Find the names that stand over a picture, by number: that of a region at the first of its corners that
    is there, and those of all other landmarks. regions: names of corners -> of their regions."""
    names: dict[int, str] = {}
    for number in np.flatnonzero(shown.is_there).tolist():
        name = shown.landmarks[number].name
        region = regions.get(name)
        if region is None or region not in names.values():
            names[number] = name if region is None else region
    return names


def drawn_landmarks(
    shown: ShownLandmarks, has_names: bool, regions: Mapping[str, str]
) -> tuple[DrawnLandmark, ...]:
    """Give those that are there to pictures that are saved. regions: as of `names_over`."""
    names = names_over(shown, regions) if has_names else {}
    return tuple(
        DrawnLandmark(
            vector(shown.positions[number]),
            names.get(number, ""),
            bool(shown.known[number] == Known.PLACED),
            float(np.nan_to_num(shown.sure[number])),
            float(shown.spacings[number]),
            shown.landmarks[number].name in regions,
        )
        for number in np.flatnonzero(shown.is_there).tolist()
    )


def _largest(spreads: NDArray[np.float64]) -> NDArray[np.float64]:
    """The deviations that 95 % do not exceed, along the lines on which they are largest, (N,)."""
    found = np.full(len(spreads), np.nan)
    there = np.isfinite(spreads).all(axis=(1, 2))
    found[there] = SURE * np.sqrt(np.maximum(np.linalg.eigvalsh(spreads[there])[:, -1], 0))
    return found
