"""Where a landmark is in each frame, how sure that is, and in which frames nobody knows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .surface_point import SurfacePoint


class Known(IntEnum):
    """How well a place is known in a frame; the higher, the better.

    PENDING: nobody has looked yet. GAP: it was looked for and not found, or its place is not sure. TRACKED:
    it was followed from where it was set. CARRIED: densely tracked points carried it from there. PLACED: it
    was set there.
    """

    PENDING = 0
    GAP = 1
    TRACKED = 2
    CARRIED = 3
    PLACED = 4


STATES = {
    Known.PENDING: "",
    Known.GAP: "gap",
    Known.TRACKED: "tracked",
    Known.CARRIED: "densely tracked",
    Known.PLACED: "placed",
}  # in tables
KNOWN_WORDS = STATES | {Known.PENDING: "not tracked yet", Known.GAP: "no data"}


@dataclass(frozen=True, eq=False)
class Track:
    """A landmark through time.

    times: (T,) seconds. positions: (T, 3) scan units, NaN where not known. covariances: (T, 3, 3) squared
    scan units, of how the place may lie off the position; NaN where not known. known: (T,) uint8 of `Known`.
    reasons: frame -> why it is a gap, in words.
    """

    times: NDArray[np.float64]
    positions: NDArray[np.float64]
    covariances: NDArray[np.float64]
    known: NDArray[np.uint8]
    reasons: Mapping[int, str] = field(default_factory=dict)

    @classmethod
    def pending(cls, times: NDArray[np.float64]) -> Track:
        """One of which nothing is known yet, at these times, (T,) seconds."""
        count = len(times)
        return cls(
            times,
            np.full((count, 3), np.nan),
            np.full((count, 3, 3), np.nan),
            np.full(count, Known.PENDING, np.uint8),
        )

    @classmethod
    def of(cls, point: SurfacePoint) -> Track:
        """One of a single frame, in which the landmark was placed at a point of the surface."""
        spread = np.full((3, 3), np.nan) if point.spread is None else point.spread
        known = np.array([Known.PLACED], np.uint8)
        return cls(np.array([point.time]), np.array([point.position]), spread[None], known)

    @property
    def is_whole(self) -> bool:
        """Whether all frames were looked at."""
        return not (self.known == Known.PENDING).any()

    @property
    def sigmas(self) -> NDArray[np.float64]:
        """(T,) standard deviations along the lines on which they are largest, scan units; NaN where not
        known."""
        largest = np.full(len(self.times), np.nan)
        there = np.isfinite(self.covariances).all(axis=(1, 2))
        largest[there] = np.linalg.eigvalsh(self.covariances[there])[:, -1]
        return np.sqrt(np.maximum(largest, 0))
