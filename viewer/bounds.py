"""Boxes around what a scan holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

_ASTRAY = 8.0  # times as far out as usual: frames that reach farther are mistakes
_IS_HIGH = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], bool)  # of each corner


@dataclass(frozen=True)
class Bounds:
    """An axis-aligned box in scan units. low, high: (3,) float64."""

    low: NDArray[np.float64]
    high: NDArray[np.float64]

    @classmethod
    def around(cls, several: Sequence[Bounds]) -> Bounds:
        """The smallest box around some, at least one."""
        return cls(
            np.min([one.low for one in several], axis=0), np.max([one.high for one in several], axis=0)
        )

    @classmethod
    def of_frames(cls, shown: Bounds, known: Sequence[Bounds]) -> Bounds:
        """The smallest box around a frame that is shown and those of its sequence that are known, but such as
        are astray."""
        known = [shown, *known]
        centers = np.array([one.center for one in known])
        off = np.linalg.norm(centers - np.median(centers, axis=0), axis=1)
        sizes = np.array([one.radius for one in known])
        is_near = off + sizes <= _ASTRAY * (np.median(off) + np.median(sizes))
        return cls.around([shown, *(one for one, near in zip(known, is_near, strict=True) if near)])

    @cached_property
    def center(self) -> NDArray[np.float64]:
        """(3,) float64."""
        return (self.low + self.high) / 2

    @cached_property
    def radius(self) -> float:
        """Half of the diagonal."""
        return float(np.linalg.norm(self.high - self.low) / 2)

    def corners(self) -> NDArray[np.float64]:
        """(8, 3) float64."""
        return np.where(_IS_HIGH, self.high, self.low)

    def grown(self, margin: float) -> Bounds:
        """Larger by a margin on every side."""
        return Bounds(self.low - margin, self.high + margin)
