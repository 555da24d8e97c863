"""Ways of landmarks through time, in the scan's coordinates or held still by others that are anchors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..rigid import Rigid, best_rotation, rigid_matrix
from .curves import Smoothing, smoothed
from .track import Known, Track

_FLAT = 1e-6  # of the longest spread of anchors: in less across they lie on one line, round which all turns


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The way of a landmark.

    times: (T,) seconds. positions: (T, 3) scan units, NaN in gaps. covariances: (T, 3, 3) of these, NaN where
    not known. smoothing: of the curve that its speed is of.
    """

    times: NDArray[np.float64]
    positions: NDArray[np.float64]
    covariances: NDArray[np.float64]
    smoothing: Smoothing

    def pace(self, order: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The speed, 1, or the acceleration, 2: how long the derivative of the smoothed way is, (T,) scan
        units a second (squared), and its standard deviation, (T,); NaN where not known. Noise makes it
        longer: it is not 0 at rest."""
        vectors, spread = smoothed(self.times, self.positions, self.covariances, self.smoothing, order)
        lengths = np.sqrt((vectors**2).sum(axis=1))
        with np.errstate(invalid="ignore", divide="ignore"):
            along = vectors / lengths[:, None]
        variances = np.einsum("ti,tij,tj->t", along, spread, along)
        return lengths, np.sqrt(np.maximum(variances, 0))

    @cached_property
    def speeds(self) -> NDArray[np.float64]:
        """(T,) scan units a second, NaN where not known."""
        return self.pace(1)[0]


def trajectory_of(
    track: Track, smoothing: Smoothing, still: Sequence[Rigid | None] | None = None
) -> Trajectory:
    """The way of a landmark. still: a motion for each frame that it is seen after, see `stabilising`; where
    there is none, it has a gap."""
    if still is not None:
        track = held_still(track, still)
    return Trajectory(track.times, track.positions, track.covariances, smoothing)


def held_still(track: Track, still: Sequence[Rigid | None]) -> Track:
    """A landmark as it is after a motion of each frame, see `stabilising`; where there is none, it has a
    gap."""
    nowhere = np.full((4, 4), np.nan)
    motions = np.stack([nowhere if motion is None else motion.matrix for motion in still])
    turns = motions[:, :3, :3]
    positions = np.einsum("tij,tj->ti", turns, track.positions) + motions[:, :3, 3]
    covariances = turns @ track.covariances @ turns.transpose(0, 2, 1)
    known = np.where([motion is None for motion in still], np.minimum(track.known, Known.GAP), track.known)
    return replace(track, positions=positions, covariances=covariances, known=known.astype(np.uint8))


def stabilising(tracks: Mapping[str, Track], anchors: Sequence[str]) -> tuple[Rigid | None, ...]:
    """Find the motion of each frame that brings the anchors best to where they are in a reference frame.

    Best in least squares over the anchors that both frames know. The reference is the first frame that
    knows most of them. None where fewer than three are known, or those lie on one line. Raises InputError
    where less than three landmarks are named, where one has no track, and where no frame knows three.
    """
    unknown = [name for name in anchors if name not in tracks]
    if unknown:
        raise InputError(
            f"the rigid reference '{unknown[0]}' is not placed",
            hint="Place the landmark first, or remove it from the rigid references",
        )
    if len(set(anchors)) < 3:
        hint = (
            "Choose landmarks that keep their distances from each other, such as the inner corners of "
            "the eyes"
        )
        raise InputError("removing head motion needs at least three rigid references", hint=hint)
    places = np.stack([tracks[name].positions for name in dict.fromkeys(anchors)], axis=1)  # (T, A, 3)
    known = np.logical_and.reduce(np.isfinite(places), axis=2)
    reference = int(np.argmax(known.sum(axis=1)))
    motions = tuple(
        _kabsch(places[frame][both], places[reference][both])
        for frame, both in enumerate(known & known[reference])
    )
    if motions[reference] is None:
        raise InputError(
            "no frame has three rigid references that do not lie on one line",
            hint="Place the rigid references, or choose other landmarks as rigid references",
        )
    return motions


def _kabsch(moved: NDArray[np.float64], still: NDArray[np.float64]) -> Rigid | None:
    """The rotation and translation that bring (A, 3) points best to others; None where that is not one."""
    if len(moved) < 3:
        return None
    middles = moved.mean(axis=0), still.mean(axis=0)
    one, other = moved - middles[0], still - middles[1]
    spread = [np.linalg.svd(points, compute_uv=False) for points in (one, other)]
    if any(widths[1] <= _FLAT * widths[0] for widths in spread):
        return None
    rotation = best_rotation(one, other)
    return Rigid(rigid_matrix(rotation, middles[1] - rotation @ middles[0]))
