"""Where every point of a reference frame is in the other frames: its surface deforms (`tracking.deformation`)
and carries the points along."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...scan.pose import Pose
from ...scan.spacing import typical_spacing
from ...scan.timeline import Timeline
from ...task import checkpoint
from ..tracking.body import BodyPose
from ..tracking.deformation import FLOOR, LOST, MOST_PLACES, DeformingSurface
from ..tracking.surface import MomentSurface
from .stabilise import outward

Float = NDArray[np.float64]

_UNSUPPORTED = 0.04  # of the way from the nearest point that is seen, the deviation of a hidden one
_EXACT = 0.06  # spacings: noise up to which recurring points are taken as they are; bending makes up to 0.055
_AROUND = 13  # points, with the one in the middle, that tell its noise
_MEDIAN_SQUARE = 2.366  # of three Gaussian numbers: the median of the sum of their squares


class PointState(IntEnum):
    """State of a point in a frame: seen there; hidden, so that others predict it; or not determined."""

    SEEN = 0
    HIDDEN = 1
    LOST = 2


@dataclass(frozen=True, eq=False)
class TrackedFrame:
    """The N points of the reference frame as they are in another frame.

    displacement: (N, 3) float32, scan units. sigma: (N,) float32, the standard deviation of the position in
    its most uncertain direction. state: (N,) uint8, see `PointState`. pose: of the body; None where
    it was not moved to the frame. rows: (N,) int32, of the points of the frame that are the same, -1 where
    none is known.
    """

    displacement: NDArray[np.float32]
    sigma: NDArray[np.float32]
    state: NDArray[np.uint8]
    pose: BodyPose | None
    rows: NDArray[np.int32]


class DensePoints:
    """The points of a reference frame, and the body that carries them through the others.

    points: (N, 3), relative to the origin of the surface.
    """

    def __init__(self, pose: Pose) -> None:
        self.pose = pose
        self.surface = _surface(pose, pose.cloud.origin)
        self.points = self.surface.held.points

    @property
    def reference(self) -> Float:
        """The positions of the points in the coordinates of the scan, (N, 3)."""
        return self.pose.cloud.world()

    @property
    def at_rest(self) -> TrackedFrame:
        """The reference frame itself."""
        count = len(self.points)
        return TrackedFrame(
            np.zeros((count, 3), np.float32),
            np.zeros(count, np.float32),
            np.full(count, PointState.SEEN, np.uint8),
            None,
            np.arange(count, dtype=np.int32),
        )

    @property
    def lost(self) -> TrackedFrame:
        """A frame that cannot be read."""
        count = len(self.points)
        return TrackedFrame(
            np.full((count, 3), np.nan, np.float32),
            np.full(count, np.nan, np.float32),
            np.full(count, PointState.LOST, np.uint8),
            None,
            np.full(count, -1, np.int32),
        )

    def is_same(self, pose: Pose) -> bool:
        """Whether the scan says which points of another pose are the same."""
        topology = self.pose.cloud.topology
        return topology is not None and pose.cloud.topology == topology

    def same(self, pose: Pose) -> TrackedFrame:
        """The points in a pose in which the scan says which they are; lost are those that it lacks."""
        ours, theirs = (
            np.arange(len(cloud)) if cloud.ids is None else cloud.ids
            for cloud in (self.pose.cloud, pose.cloud)
        )
        rows = np.minimum(np.searchsorted(theirs, ours), len(theirs) - 1)
        there = theirs[rows] == ours
        found = self.lost
        found.displacement[there] = pose.cloud.world()[rows[there]] - self.reference[there]
        found.sigma[there], found.state[there], found.rows[there] = 0.0, PointState.SEEN, rows[there]
        return found

    def surface_of(self, pose: Pose) -> MomentSurface:
        """The surface of another pose, relative to the origin of the reference frame."""
        return _surface(pose, self.pose.cloud.origin)

    def follow(
        self, now: MomentSurface, before: MomentSurface, beside: TrackedFrame, earlier: TrackedFrame
    ) -> TrackedFrame:
        """Find the points in a frame. before: the surface of the frame beside it.

        beside, earlier: the points there, and in the frame before that.
        """
        deforming = self._deforming
        deformed = deforming.follow(now, before, beside.pose, earlier.pose, beside.rows)
        rows, found = deformed.rows, deforming.find(deforming.held, deformed, now)
        known = rows >= 0
        moved = found.positions - deforming.places
        is_seen = found.is_seen | known
        variance = found.variances + (_UNSUPPORTED * self._distances(is_seen)) ** 2
        ways = now.held.points[rows] - self.points
        noise = self._noise_of(ways, known)
        of_points = (FLOOR * now.spacing) ** 2 + noise**2
        if noise <= _EXACT * now.spacing:
            moved[known], variance[known] = ways[known], of_points
        else:  # the body tells as well, without the noise of both frames
            share = (variance / (variance + of_points))[known]
            moved[known] += share[:, None] * (ways - moved)[known]
            variance[known] *= 1 - share
        sigma = np.sqrt(np.maximum(variance, (FLOOR * now.spacing) ** 2))
        state = np.where(is_seen, PointState.SEEN, PointState.HIDDEN).astype(np.uint8)
        state[~(sigma <= LOST * now.spacing)] = PointState.LOST
        return TrackedFrame(moved.astype(np.float32), sigma.astype(np.float32), state, deformed.pose, rows)

    @cached_property
    def _deforming(self) -> DeformingSurface:
        return DeformingSurface(self.surface)

    @cached_property
    def _predictions(self) -> tuple[NDArray[np.intp], Float]:
        """Some points and those around each, (n, 13) rows; and the shares (n, 12) of their ways that predict
        its own, if the surface is stretched alike there."""
        from scipy.spatial import cKDTree

        some = self.points[:: max(1, len(self.points) // MOST_PLACES)]
        rows = cKDTree(self.points).query(some, _AROUND)[1]
        offsets = self.points[rows[:, 1:]] - self.points[rows[:, :1]]
        tangents = np.linalg.eigh(np.einsum("nki,nkj->nij", offsets, offsets))[1][:, :, 1:]
        flat = np.concatenate([np.ones((*offsets.shape[:2], 1)), offsets @ tangents], axis=2)
        return rows, np.linalg.pinv(flat)[:, 0]

    def _noise_of(self, ways: Float, known: NDArray[np.bool_]) -> float:
        """The standard deviation that noise of both frames gives the ways (N, 3) of points along an axis: so
        much are they off what those around predict. known: (N,). 0 where too few are."""
        if known.sum() < _AROUND:
            return 0.0
        rows, shares = self._predictions
        told = known[rows].all(axis=1)
        if not told.any():
            return 0.0
        rows, shares = rows[told], shares[told]
        off = ways[rows[:, 0]] - np.einsum("nk,nki->ni", shares, ways[rows[:, 1:]])
        squares = np.square(off).sum(axis=1) / (1 + np.square(shares).sum(axis=1))
        return float(np.sqrt(np.median(squares) / _MEDIAN_SQUARE))

    def _distances(self, is_seen: NDArray[np.bool_]) -> Float:
        """How far each point is from those that a frame shows, at rest, (N,); inf where it shows none."""
        from scipy.spatial import cKDTree

        away = np.zeros(len(self.points))
        if not is_seen.all():
            some = self.points[is_seen][:: max(1, int(is_seen.sum()) // MOST_PLACES)]
            away[~is_seen] = cKDTree(some).query(self.points[~is_seen])[0] if len(some) else np.inf
        return away


def _surface(pose: Pose, origin: Float) -> MomentSurface:
    return MomentSurface.of(pose, origin, typical_spacing(pose.cloud))


class KeptFrames(Protocol):
    """A store of frames, by number."""

    def __contains__(self, frame: int) -> bool: ...

    def read(self, frame: int) -> TrackedFrame: ...

    def save(self, frame: int, found: TrackedFrame) -> None: ...


def follow_points(
    timeline: Timeline, points: DensePoints, reference: int | None, kept: KeptFrames
) -> Iterator[int]:
    """Follow the points through each frame that is not kept yet, outward from the reference; gives the frame.

    reference: its frame; None: it is none of the scan's. Raises Cancelled between frames, see `checkpoint`;
    another call goes on from there.
    """
    order = outward(range(len(timeline)), points.pose.index)
    read: dict[int | None, int | None] = {None: None}  # the last frame that could be read, up to each one
    earlier: dict[int | None, int | None] = {None: None}  # the one before it
    surfaces: dict[int, MomentSurface] = {}  # of the last frame in each direction

    def surface(frame: int | None) -> MomentSurface:
        if frame is None:
            return points.surface
        return surfaces.pop(frame, None) or points.surface_of(timeline.visit(frame))

    def tracked(frame: int | None) -> TrackedFrame:
        return points.at_rest if frame is None else kept.read(frame)

    for number, (frame, beside) in enumerate(order):
        checkpoint(number / len(order))
        last = read[beside]
        if frame in kept:
            is_read = not (kept.read(frame).state == PointState.LOST).all()
        else:
            try:
                pose = timeline.visit(frame)
            except InputError:
                found, is_read = points.lost, False
            else:
                is_read = True
                if frame == reference:
                    found = points.at_rest
                elif points.is_same(pose):
                    found = points.same(pose)
                else:
                    now, before = points.surface_of(pose), surface(last)
                    found = points.follow(now, before, tracked(last), tracked(earlier[last]))
                    surfaces[frame] = now
            kept.save(frame, found)
            yield frame
        if frame == reference:
            read[frame] = None
        else:
            read[frame] = frame if is_read else last
            earlier[frame] = last
