"""The points of a reference frame in all frames of a scan, kept in the cache folder as they are found."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...folders import cache_folder
from ...rigid import Rigid
from ...scan.estimate import cloud_normals
from ...scan.pose import Pose
from ...scan.timeline import Timeline
from ..surface_point import SurfacePoint
from ..tracking.follower import Sighting
from .dense import DensePoints, PointState, TrackedFrame, follow_points
from .displacements import Displacements, MeanPath, mean_path_of
from .partial_frames import PartialFrames
from .quantities import QUANTITIES, PointQuantities, StandingFrame, frames_needed
from .region import RigidRegion

_MOST_KEPT = 4 * 2**30  # bytes, of all scans
_REACH = 3.0  # spacings from a followed point, that it tells about
_SOME = 4000  # points that tell the range of a number
_WITHIN = 0.98  # of the points of a frame are in the range of a number
_AROUND = 6  # followed points that carry a position
_LOST = "dense tracking lost the points around the landmark"

Float = NDArray[np.float64]
MotionOf = Callable[[int], Rigid | None]


class FrameFacts(NamedTuple):
    """Facts of the points in a frame. points: how many there are. shares: of those in each `PointState`.
    is_exact: whether the file says which points are the same."""

    points: int
    shares: tuple[float, ...]
    is_exact: bool


class FollowedPoints:
    """The points of a reference frame, followed through a scan. It reads the frame; call it on a thread.

    timeline: the scan. reference: the frame. spacing: of its points, scan units.
    Raises InputError where the frame cannot be read or the cache folder not be written to.
    """

    def __init__(self, timeline: Timeline, reference: int, of: Mapping[str, Any]) -> None:
        """of: tells scans, and how points are followed, apart; plain JSON."""
        timeline.label(reference)  # raises where there is none
        self.timeline, self.reference = timeline, reference
        self._points = DensePoints(timeline.pose(reference))
        self.spacing = self._points.surface.spacing
        key = {
            **of,
            "times": len(timeline),
            "unit": timeline.unit,
            "reference": reference,
            "points": hashlib.sha256(self._points.reference.tobytes()).hexdigest(),
        }
        digest = hashlib.blake2b(json.dumps(key, sort_keys=True).encode(), digest_size=16).hexdigest()
        folder = dense_folder() / digest
        try:
            self._kept = PartialFrames(folder, key)
        except InputError:  # damaged: all is found again
            shutil.rmtree(folder, ignore_errors=True)
            self._kept = PartialFrames(folder, key)
        os.utime(folder)  # the cache forgets what is unused for longest
        _forget_oldest(dense_folder(), folder)
        self._known = {frame for frame in range(len(timeline)) if frame in self._kept}

    @property
    def known(self) -> frozenset[int]:
        """The frames in which the points are known."""
        return frozenset(self._known)

    @property
    def is_whole(self) -> bool:
        """Whether all frames are known."""
        return len(self._known) == len(self.timeline)

    def find(self) -> Iterator[int]:
        """Follow the points through the frames that are not known yet; gives each. Raises Cancelled, see
        `checkpoint`, and InputError; another call goes on from there."""
        for frame in follow_points(self.timeline, self._points, self.reference, self._kept):
            self._known.add(frame)
            yield frame

    def frame(self, index: int) -> TrackedFrame:
        """The points in a frame, which is found first where it is not known. Raises InputError."""
        if index not in self._known:
            for found in self.find():
                if found == index:
                    break
        return self._kept.read(index)

    def of_pose(
        self, name: str, index: int, rows: NDArray[np.int64], motion_of: MotionOf
    ) -> NDArray[np.float32]:
        """A number of QUANTITIES at each point of a frame, (M,): that of the nearest followed point. NaN
        where none is near, where it is hidden or lost, and where the motion of a frame is not known.

        rows: (M,), see `rows_nearest`. motion_of: by which a frame is shown; None where that is not known.
        """
        found = self._numbers(self._all, name, index, motion_of)
        return np.where(rows < 0, np.nan, found[rows]).astype(np.float32)

    def facts(self, frame: int) -> FrameFacts:
        """The facts of the points in a frame."""
        found = self.frame(frame)
        shares = np.bincount(found.state, minlength=len(PointState)) / max(len(found.state), 1)
        is_exact = found.pose is None and frame != self.reference and bool(shares[PointState.SEEN])
        return FrameFacts(len(found.state), tuple(shares.tolist()), is_exact)

    def largest(self, name: str, frame: int, motion_of: MotionOf) -> float:
        """How large a number of QUANTITIES is in a frame, without its sign, but at a few points; NaN where
        none is known."""
        found = np.abs(self._numbers(self._some, name, frame, motion_of))
        found = found[np.isfinite(found)]
        return float(np.quantile(found, _WITHIN)) if len(found) else np.nan

    def rows_nearest(self, pose: Pose) -> NDArray[np.int64]:
        """The rows of the followed points nearest to those of a frame, (M,), -1 where none is near."""
        from scipy.spatial import cKDTree

        there = self.frame(pose.index)
        is_there = np.flatnonzero(there.state != PointState.LOST)
        cloud = pose.cloud
        if not len(is_there) or not len(cloud):
            return np.full(len(cloud), -1, np.int64)
        origin = self._points.pose.cloud.origin
        tree = cKDTree(self._points.points[is_there] + there.displacement[is_there])
        positions = cloud.positions + (cloud.origin - origin)
        away, near = tree.query(positions, distance_upper_bound=_REACH * self.spacing)
        return np.where(np.isfinite(away), is_there[np.minimum(near, len(is_there) - 1)], -1)

    def carried(self, spots: Sequence[SurfacePoint]) -> list[dict[int, Sighting]]:
        """Carry spots of any frames through all frames; gives the sightings of each by frame, none where no
        followed point is near.

        A spot goes along with the points nearest to it in its own frame, see `Displacements.path`. Its
        covariance is that of these points in both frames, and its own. Frames that are not known are found
        first. Raises InputError.
        """
        held = self._held(spots)
        rows = np.array([one[0] for one in held if one is not None], np.int64)
        moved, sigma, state = [], [], []
        for frame in range(len(self.timeline) if len(rows) else 0):
            found = self.frame(frame)
            moved.append(found.displacement[rows])
            sigma.append(found.sigma[rows])
            state.append(found.state[rows])
        sightings: list[dict[int, Sighting]] = [{} for _ in spots]
        number = 0
        for spot, one, into in zip(spots, held, sightings, strict=True):
            if one is None:
                continue
            ways = np.stack([each[number] for each in moved])
            sigmas, states = (np.stack([each[number] for each in part]) for part in (sigma, state))
            along = Displacements(one[1], ways - ways[spot.frame], sigmas, states)
            number += 1
            path = along.path(np.array(spot.position))
            variances = (sigmas**2).mean(axis=1) + (sigmas[spot.frame] ** 2).mean()
            spread = np.zeros((3, 3)) if spot.spread is None else spot.spread
            for frame, position in enumerate(path):
                if np.isfinite(position).all():
                    into[frame] = Sighting(position, variances[frame] * np.eye(3) + spread, is_carried=True)
                else:
                    into[frame] = Sighting.gap(_LOST)
        return sightings

    def mean_path(self, region: RigidRegion) -> MeanPath:
        """The mean path of the points in a region of the reference frame, without landmarks. Frames that are
        not known are found first. Raises InputError, also where the region has no points."""
        rows = region.rows(self._points.pose.cloud, {})
        if not len(rows):
            raise InputError("The region has no followed points.", hint="Paint the region again")
        return mean_path_of(self._points.reference, map(self.frame, range(len(self.timeline))), rows)

    def _held(self, spots: Sequence[SurfacePoint]) -> list[tuple[NDArray[np.int64], Float] | None]:
        """The rows of the points that carry each spot, and their places in its frame, (k, 3); None where no
        point is near."""
        from scipy.spatial import cKDTree

        found: list[tuple[NDArray[np.int64], Float] | None] = [None] * len(spots)
        for frame in {spot.frame for spot in spots}:
            here = self.frame(frame)
            is_there = np.flatnonzero(here.state != PointState.LOST)
            if len(is_there) < _AROUND:
                continue
            places = self._points.reference[is_there] + here.displacement[is_there]
            numbers = [number for number, spot in enumerate(spots) if spot.frame == frame]
            away, near = cKDTree(places).query([spots[number].position for number in numbers], _AROUND)
            for number, distances, rows in zip(numbers, away, near, strict=True):
                if distances[0] <= _REACH * self.spacing:
                    found[number] = is_there[rows], places[rows]
        return found

    def _numbers(self, of: PointQuantities, name: str, frame: int, motion_of: MotionOf) -> Float:
        """A number of QUANTITIES of some of the points in a frame; NaN where a motion is not known."""
        is_still = QUANTITIES[name].kind == "strain"  # no motion changes strains
        needed = frames_needed(name, frame, len(self.timeline))
        motions = {index: Rigid() if is_still else motion_of(index) for index in (self.reference, *needed)}
        standing = {
            index: StandingFrame(self.frame(index), float(self.timeline.times[index]), motion)
            for index in needed
            if (motion := motions[index]) is not None
        }
        at_rest = motions[self.reference]
        if frame not in standing or at_rest is None:
            return np.full(of.count, np.nan)
        return of.of(name, standing.pop(frame), at_rest, standing)

    @cached_property
    def _all(self) -> PointQuantities:
        return self._quantities(1)

    @cached_property
    def _some(self) -> PointQuantities:
        return self._quantities(max(1, len(self._points.points) // _SOME))

    def _quantities(self, step: int) -> PointQuantities:
        rows = np.arange(0, len(self._points.points), step)
        return PointQuantities(self._points.reference, lambda: self._normals, rows, lambda: self._tree)

    @cached_property
    def _normals(self) -> NDArray[np.floating]:
        cloud = self._points.pose.cloud
        return cloud_normals(cloud) if cloud.normals is None else cloud.normals

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self._points.reference)


def dense_folder() -> Path:
    """The folder of kept points; it need not be there yet."""
    return cache_folder() / "dense"


def _forget_oldest(folder: Path, used: Path) -> None:
    """Remove what was used longest ago, until the rest has at most `_MOST_KEPT` bytes. used: stays."""
    left = _MOST_KEPT
    with suppress(OSError):
        by_age = sorted(folder.iterdir(), key=lambda one: one.stat().st_mtime_ns, reverse=True)
        for one in by_age:
            left -= sum(file.stat().st_size for file in one.iterdir())
            if left < 0 and one != used:
                shutil.rmtree(one, ignore_errors=True)
