"""Facts about the motions of a region: how well it fits, what it leaves open, and which frames are gaps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .axes import WeakDirection, weak_directions
from .stabilise import FrameMotion, WeakLimits

_RIGID = 0.95  # of distances: a region of which fewer are close changes its shape


@dataclass(frozen=True)
class RegionFit:
    """How a region fits the frames other than its reference, as far as these have a motion.

    mean, least: the shares of its distances that are close (`FrameMotion.within`). frame: of the least one.
    """

    mean: float
    least: float
    frame: int

    @property
    def is_rigid(self) -> bool:
        """Whether the region keeps its shape in all frames."""
        return self.least >= _RIGID


@dataclass(frozen=True)
class MotionFacts:
    """Facts about the motions of a region.

    fit: None where no frame but the reference has a motion. weak: the weakest direction first. gaps: the
    reasons by frame, in the order of frames.
    """

    fit: RegionFit | None
    weak: tuple[WeakDirection, ...]
    gaps: Mapping[int, str]

    @classmethod
    def of(
        cls,
        known: Mapping[int, FrameMotion],
        reference: int | None,
        axes: NDArray[np.float64],
        limits: WeakLimits,
    ) -> MotionFacts:
        """The facts of motions by frame. reference: that frame, whose own fit says nothing; None: it is none
        of them. axes: (3, 3), see `anatomical_axes`."""
        shares = {i: one.within for i, one in known.items() if one.motion is not None and i != reference}
        fit = None
        if shares:
            least = min(shares, key=lambda frame: shares[frame])
            fit = RegionFit(float(np.mean(list(shares.values()))), shares[least], least)
        gaps = {frame: known[frame].reason for frame in sorted(known) if known[frame].motion is None}
        return cls(fit, tuple(weak_directions(known, axes, limits)), gaps)
