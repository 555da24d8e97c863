"""The rigid motion of a region through all frames of a scan.

From the reference frame on, each frame is registered from where its neighbour was. The way back, from the
frame to the reference, must lead to where it began. A frame that does not register is a gap.
"""

from __future__ import annotations

from collections.abc import Iterator, MutableMapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...rigid import STILL, Rigid
from ...scan.points import PointCloud
from ...scan.pose import Pose
from ...scan.spacing import typical_spacing
from ...scan.timeline import Timeline
from ...scan.units import conversion
from ...task import checkpoint
from ..tracking.surface import MomentSurface
from .registration import FEWEST, LEVELS, RegionSurface, RegisteredRegion, distances, register_region

Float = NDArray[np.float64]

_CLOSE = 0.5  # mm
_LEAST_MATCHED = 0.35  # of a region, by weights
_TOLD, _SURE = 1.96, 3.0  # standard deviations: of what is told, and that errors hardly ever exceed
_BACK = 3.0  # standard deviations, and
_BACK_SPACINGS = 0.5  # spacings that the way back may miss where it began
FEW = "too few points of the region match the surface"
BACK = "the way back to the reference frame misses it"


class MotionState(StrEnum):
    """State of a frame: its motion is known well, in part, or not."""

    OK = "ok"
    WEAK = "weak"
    GAP = "gap"


@dataclass(frozen=True, eq=False)
class WeakLimits:
    """The lengths, scan units, and angles from which on three standard deviations count as weak."""

    shift: float
    degrees: float = 0.5

    @classmethod
    def of(cls, unit: str, spacing: float) -> WeakLimits:
        """Half a degree and half a millimetre. spacing: between points, which stands for the latter where the
        unit of the scan is no known length."""
        factor = conversion("mm", unit)
        return cls(spacing if factor is None else _CLOSE * factor)

    def exceeded(self, spreads: Float) -> Float:
        """How many times spreads (..., 6), see `FrameMotion.spread`, exceed the limits."""
        return _SURE / _TOLD * spreads / np.repeat([self.degrees, self.shift], 3)


@dataclass(frozen=True, eq=False)
class FrameMotion:
    """The motion of a region from the reference to a frame, in the coordinates of the scan.

    motion: None in a gap. covariance: (6, 6), of the shift of the region's middle, scan units, and of the
    turn about it, radians, along the world's axes; NaN in a gap. reason: why there is a gap. within: the
    share of the region's distances from the frame's surface that is no larger than a limit. residual: root
    mean square of these distances, scan units.
    """

    motion: Rigid | None
    covariance: Float
    reason: str = ""
    within: float = np.nan
    residual: float = np.nan

    @classmethod
    def still(cls) -> FrameMotion:
        """The motion of the reference frame to itself."""
        return cls(STILL, np.zeros((6, 6)), within=1.0, residual=0.0)

    @classmethod
    def gap(cls, reason: str) -> FrameMotion:
        """A frame without a motion."""
        return cls(None, np.full((6, 6), np.nan), reason)

    def deviations(self, axes: Float) -> Float:
        """Standard deviations about and along axes (3, 3), by row: (6,), of turns, degrees, then of shifts,
        scan units."""
        shift, turn = self.covariance[:3, :3], self.covariance[3:, 3:]
        variances = [np.einsum("ai,ij,aj->a", axes, block, axes) for block in (turn, shift)]
        return np.sqrt(np.concatenate(variances)) * np.repeat([np.degrees(1.0), 1.0], 3)

    def deviations_at(self, positions: Float, directions: Float, middle: Float) -> Float:
        """Standard deviations of the place of positions (N, 3) along directions (N, 3), (N,), scan units.

        All are of the reference, and so is the middle (3,) of the region. None of it in a gap.
        """
        assert self.motion is not None
        ahead = self.motion.directions(directions)
        turned = np.cross(self.motion.directions(positions - middle), ahead)
        both = np.concatenate([ahead, turned], axis=1)
        return np.sqrt(np.einsum("ni,ij,nj->n", both, self.covariance, both))

    def spread(self, axes: Float) -> Float:
        """The ± that Scan4D reports: 1.96 of the `deviations`."""
        return _TOLD * self.deviations(axes)

    def state(self, axes: Float, limits: WeakLimits) -> MotionState:
        """Whether it is known well along and about axes (3, 3)."""
        if self.motion is None:
            return MotionState.GAP
        return MotionState.WEAK if (limits.exceeded(self.spread(axes)) > 1).any() else MotionState.OK


@dataclass(eq=False)
class MotionReference:
    """The moment that motions begin in.

    surface: of all its points, relative to `origin`. region: its rigid part. frame: the frame of the scan
    that it is; None: it is none of them. start: the frame from which on others are registered.
    """

    surface: MomentSurface
    origin: Float
    region: RegionSurface
    frame: int | None
    start: int

    @classmethod
    def of(cls, pose: Pose, rows: NDArray[np.int64], frame: int | None) -> MotionReference:
        """The reference of a pose. rows: of its points that count as rigid. Raises InputError where they are
        too few."""
        origin = pose.cloud.origin
        surface = moment_surface(pose.cloud, origin)
        region = RegionSurface.of(surface, rows)
        if region is None:
            what = f"the region has {len(rows)} points in the reference frame, which is too few"
            hint = f"Choose a larger region: at least {FEWEST} points need neighbours"
            raise InputError(what, pose.label, hint)
        return cls(surface, origin, region, frame, pose.index)

    @property
    def middle(self) -> Float:
        """The middle of the region, (3,), which covariances of motions are about, in the coordinates of the
        scan."""
        return self.origin + self.region.patch.center


def moment_surface(cloud: PointCloud, origin: Float) -> MomentSurface:
    """The surface of a cloud, relative to an origin, (3,)."""
    return MomentSurface(
        cloud.positions + (cloud.origin - origin), typical_spacing(cloud), None, cloud.normals
    )


def outward(frames: Sequence[int], start: int) -> list[tuple[int, int | None]]:
    """Frames, each with the one beside it that is nearer to the start; the nearest to the start first, up and
    down by turns."""
    up = sorted(frame for frame in frames if frame >= start)
    down = sorted((frame for frame in frames if frame < start), reverse=True)
    ways = [list(zip(way, [None, *way], strict=False)) for way in (up, down)]
    if ways[0] and ways[1]:
        ways[1][0] = ways[1][0][0], ways[0][0][0]
    longest = max(map(len, ways))
    return [way[step] for step in range(longest) for way in ways if step < len(way)]


def stabilise(
    timeline: Timeline,
    reference: MotionReference,
    within: float,
    known: MutableMapping[int, FrameMotion],
    frames: Sequence[int] | None = None,
) -> Iterator[int]:
    """Find the motion of the region in each frame that is not known yet, and add it; gives the frame.

    within: scan units, see `FrameMotion`. frames: that are registered; None: all. Raises Cancelled between
    frames, see `checkpoint`; another call goes on from there.
    """
    order = outward(range(len(timeline)) if frames is None else frames, reference.start)
    starts: dict[int | None, Rigid] = {None: STILL}
    for number, (frame, beside) in enumerate(order):
        checkpoint(number / len(order))
        if number + 1 < len(order) and order[number + 1][0] not in known:
            timeline.request(order[number + 1][0])
        start = starts[beside]
        if frame not in known:
            known[frame] = _motion(timeline, frame, reference, start, within)
            yield frame
        found = known[frame].motion
        starts[frame] = start if found is None else found.in_frame(reference.origin)


def _motion(
    timeline: Timeline, frame: int, reference: MotionReference, start: Rigid, within: float
) -> FrameMotion:
    """The motion of a region to a frame. start: relative to the reference's origin."""
    if frame == reference.frame:
        return FrameMotion.still()
    try:
        surface = moment_surface(timeline.pose(frame).cloud, reference.origin)
    except InputError as error:
        return FrameMotion.gap(error.what)
    found = register_region(reference.region, surface, start)
    if found is None or found.matched < _LEAST_MATCHED:
        return FrameMotion.gap(FEW)
    if _missed(reference, surface, found):
        return FrameMotion.gap(BACK)
    away = distances(reference.region, surface, found.motion)
    near = away[np.isfinite(away)]
    return FrameMotion(
        found.motion.in_frame(-reference.origin),
        found.covariance,
        within=float((np.abs(near) <= within).mean()),
        residual=float(np.sqrt((near**2).mean())),
    )


def _missed(reference: MotionReference, surface: MomentSurface, found: RegisteredRegion) -> bool:
    """Whether the region as a frame shows it, registered with the reference, ends elsewhere than it began."""
    from .region_kernels import rows_nearest

    region = reference.region
    rows = rows_nearest(surface.held, found.motion.points(region.points), surface.spacing)
    there = RegionSurface.of(surface, np.unique(rows[rows >= 0]))
    if there is None:
        return True
    back = register_region(there, reference.surface, found.motion.inverse, LEVELS[1:])
    if back is None:
        return True
    missed = back.motion.after(found.motion).points(region.points) - region.points
    sure = sum(
        np.trace(each.covariance[:3, :3]) + region.scale**2 * np.trace(each.covariance[3:, 3:])
        for each in (found, back)
    )
    limit = _BACK_SPACINGS * surface.spacing + _BACK * np.sqrt(sure)
    return bool(np.sqrt((missed**2).sum(axis=1).mean()) > limit)
