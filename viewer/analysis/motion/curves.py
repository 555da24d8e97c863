"""The motion of a region over time: three turns, three shifts, and how far the region is off; and its mean
path."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...rigid import STILL, Rigid
from ..measures import Quantity, Series
from ..track import Known
from ..words import SURE
from .axes import NAMES
from .displacements import MeanPath
from .stabilise import FrameMotion

TURNS = tuple(f"Rotation, {name}" for name in NAMES)
SHIFTS = tuple(f"Translation, {name}" for name in NAMES)
RESIDUAL = "Residual (RMS)"
PATH = (*(f"Region path, {name}" for name in NAMES), "Region path, distance")

LOST = "dense tracking lost the points of the region"

Float = NDArray[np.float64]


def motion_curves(
    known: Mapping[int, FrameMotion], times: Float, middle: Float, axes: Float
) -> dict[str, Series]:
    """The motions from the reference to each frame, by name: TURNS, degrees, SHIFTS and RESIDUAL, scan units.

    times: (T,) seconds. middle: (3,), of the region in the reference, whose shift that is. axes: (3, 3) by
    row. Turns are the components of the rotation vector: its direction is the axis, its length the angle.
    The standard deviation of the residual is not known.
    """
    values, sigmas = np.full((2, 7, len(times)), np.nan)
    states = np.full(len(times), Known.PENDING, np.uint8)
    reasons = {}
    for frame, found in known.items():
        states[frame] = Known.GAP if found.motion is None else Known.TRACKED
        if found.motion is None:
            reasons[frame] = found.reason
            continue
        values[:, frame] = *_along(found.motion, middle, axes), found.residual
        sigmas[:6, frame] = found.spread(axes) / SURE
    return {
        name: Series(name, quantity, times, values[row], sigmas[row], states, reasons=reasons)
        for row, (name, quantity) in enumerate(_names())
    }


def path_curves(
    path: MeanPath, start: int, times: Float, axes: Float, still: Sequence[Rigid | None] | None = None
) -> dict[str, Series]:
    """How far the mean of a region is from where it was in a frame: PATH, along axes (3, 3) by row and
    straight, scan units.

    start: that frame. times: (T,) seconds. still: a motion of each frame that the path is seen after; where
    there is none, it has a gap.
    """
    positions, reasons = path.positions.copy(), {}
    for frame, position in enumerate(path.positions):
        motion = STILL if still is None else still[frame]
        if np.isnan(position).any():
            reasons[frame] = LOST
        elif motion is None:
            reasons[frame], positions[frame] = "the frame is not stabilised", np.nan
        else:
            positions[frame] = motion.points(position)
    moved = (positions - positions[start]) @ axes.T
    lengths = np.sqrt((moved**2).sum(axis=1))
    states = np.where(np.isfinite(lengths), Known.CARRIED, Known.GAP).astype(np.uint8)
    sigmas = np.where(np.isfinite(lengths), path.sigma, np.nan)
    return {
        name: Series(name, "length", times, values, sigmas, states, reasons=reasons)
        for name, values in zip(PATH, (*moved.T, lengths), strict=True)
    }


def _names() -> Sequence[tuple[str, Quantity]]:
    lengths = (*SHIFTS, RESIDUAL)
    return [*((name, "angle") for name in TURNS), *((name, "length") for name in lengths)]


def _along(motion: Rigid, middle: Float, axes: Float) -> Float:
    """The turn, degrees, and the shift of a middle, along axes: (6,)."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_matrix(motion.rotation).as_rotvec(degrees=True)
    return np.concatenate([axes @ turn, axes @ (motion.points(middle) - middle)])
