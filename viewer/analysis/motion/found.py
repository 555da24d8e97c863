"""The rigid region of a subject: the places whose distances stay small over all frames.

All points begin as the region. Each round registers some frames by the region and measures how far all
points, averaged over their neighbourhoods, are off. The region of the next round is what noise explains, and
what is off less than most of the region (trimmed: Chetverikov et al. 2002). Thus it settles on the largest
part that moves as one. Where nothing stays rigid it shrinks on and on.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...rigid import STILL, Rigid
from ...scan.pose import Pose
from ...scan.timeline import Timeline
from ...task import checkpoint
from ..tracking.surface import MomentSurface
from .registration import FEWEST, LEVELS, RegionSurface, distances, register_region
from .stabilise import moment_surface, outward

Float = NDArray[np.float64]

_FRAMES = 16  # that are looked at, at most
_ROUNDS = 10
_AROUND = 12  # points that a distance is averaged over
_KEPT = 0.7  # of the region's points: what is off more than they are is no region in the next round,
_NOISE = 1.0  # unless it is off by no more than so many standard deviations of a single distance,
_FLOOR = 0.03  # or so many spacings
_DEVIATION = 1.4826  # standard deviation of Gaussian residuals, by their median absolute deviation
_SEEN = 0.5  # of the frames, in which a place must have surface
_LEAST = 0.05  # of the points, that a region must have


class NoRigidRegion(InputError):
    """A scan in which Scan4D finds no region that stays rigid."""


def found_region(timeline: Timeline, pose: Pose, frame: int | None) -> NDArray[np.int64]:
    """The rows of a pose that stay rigid, increasing. frame: the pose's in the scan; None: it is of none.

    Raises NoRigidRegion where there is none, and InputError where no other frame can be read.
    """
    from scipy.spatial import cKDTree

    origin = pose.cloud.origin
    surface = moment_surface(pose.cloud, origin)
    every = np.arange(len(surface.held.points))
    whole = RegionSurface.of(surface, every)
    if whole is None:
        raise NoRigidRegion("has too few points for a rigid region", pose.label)
    around = cKDTree(whole.patch.local).query(whole.patch.local, _AROUND)[1]
    moments = _moments(timeline, origin, frame)
    if not moments:
        raise InputError("no other frame can be read", timeline.name, "Name the region with --region")
    starts: dict[int | None, Rigid] = {}
    kept = np.ones(len(whole.rows), bool)
    for round_ in range(_ROUNDS):
        region = whole.only(kept)
        off, seen = np.zeros((2, len(kept)))
        noises: list[float] = []
        for number, (index, beside) in enumerate(outward(list(moments), pose.index)):
            checkpoint((round_ + number / len(moments)) / _ROUNDS)
            start = starts.get(index, starts.get(beside, STILL))
            found = register_region(region, moments[index], start, LEVELS if round_ == 0 else LEVELS[1:])
            if found is None:
                continue
            starts[index] = found.motion
            away = distances(whole, moments[index], found.motion)[around]
            is_seen = np.isfinite(away)
            mean = np.where(is_seen, away, 0.0).sum(axis=1) / np.maximum(is_seen.sum(axis=1), 1)
            has = is_seen.sum(axis=1) > _AROUND // 2
            off = np.where(has, np.maximum(off, np.abs(mean)), off)
            seen += has
            noises.append(_DEVIATION * float(np.nanmedian(np.abs(away[:, 0] - mean))))
        is_measured = seen >= _SEEN * len(moments)
        least = max(_NOISE * float(np.median(noises or [0.0])), _FLOOR * surface.spacing)
        before, rigid = kept, off[kept & is_measured]
        most = float(np.quantile(rigid, _KEPT)) if len(rigid) else 0.0
        kept = is_measured & (off <= max(least, most))
        if np.count_nonzero(kept) < max(_LEAST * len(kept), FEWEST):
            raise _none(timeline)
        if (kept == before).all():
            break
    if most > least:  # the region still shrinks: it is no more than what is off least
        raise _none(timeline)
    nearest = cKDTree(whole.patch.local).query(surface.held.points - whole.patch.center)[1]
    return np.flatnonzero(kept[nearest])


def _none(timeline: Timeline) -> NoRigidRegion:
    what = "Scan4D finds no region that stays rigid over all frames"
    return NoRigidRegion(what, timeline.name, "Name the region with --region")


def _moments(timeline: Timeline, origin: Float, frame: int | None) -> dict[int, MomentSurface]:
    """The surfaces of some frames, spread evenly, without that of the reference."""
    chosen = np.unique(np.linspace(0, len(timeline) - 1, _FRAMES + 1).astype(int)).tolist()
    moments = {}
    for index in chosen:
        checkpoint()
        if index == frame:
            continue
        try:
            moments[index] = moment_surface(timeline.pose(index).cloud, origin)
        except InputError:
            continue
    return moments
