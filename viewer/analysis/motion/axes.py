"""The anatomical axes of a subject, and words for the directions that a region leaves open."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...geometry import front_vector, up_vector
from ...rigid import rotation_about
from .stabilise import FrameMotion, WeakLimits

NAMES = ("left-right", "vertical", "front-back")

Float = NDArray[np.float64]


@dataclass(frozen=True)
class WeakDirection:
    """A direction that a region does not determine. plus_minus: 1.96 standard deviations, the median over
    frames: degrees of a turn, scan units of a shift. frames: in how many it is weak."""

    axis: str
    is_turn: bool
    plus_minus: float
    frames: int

    def in_words(self, unit: str) -> str:
        """A sentence for the user."""
        what, amount = (
            ("rotation about", f"{self.plus_minus:.2g}°")
            if self.is_turn
            else ("translation along", f"{self.plus_minus:.2g} {unit}")
        )
        return f"This region does not determine {what} the {self.axis} axis: ±{amount}"


def anatomical_axes(up: str, front: float = 0.0) -> Float:
    """The left, up and front axes of a subject in the world, (3, 3) by row. up, front: as of an `Upright`."""
    above = np.array(up_vector(up), np.float64)
    ahead = rotation_about(np.radians(front) * above) @ np.array(front_vector(up), np.float64)
    return np.stack([np.cross(above, ahead), above, ahead])


def weak_directions(
    motions: Mapping[int, FrameMotion], axes: Float, limits: WeakLimits
) -> list[WeakDirection]:
    """The directions along and about axes (3, 3) that are weak in any frame, the weakest first."""
    spreads = np.array([found.spread(axes) for found in motions.values() if found.motion is not None])
    if not len(spreads):
        return []
    found, exceeded = {}, limits.exceeded(spreads)
    for number in np.flatnonzero((exceeded > 1).any(axis=0)):
        is_weak = exceeded[:, number] > 1
        amount = float(np.median(spreads[is_weak, number]))
        one = WeakDirection(NAMES[number % 3], bool(number < 3), amount, int(is_weak.sum()))
        found[one] = float(np.median(exceeded[is_weak, number]))
    return sorted(found, key=lambda one: -found[one])
