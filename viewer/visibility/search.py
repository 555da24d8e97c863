"""Search for the points that an eye sees, in sectors of directions or among discs around points."""

from __future__ import annotations

import math
import weakref
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError, unknown_name
from ..gpu import gl
from ..gpu.context import Gpu, headless
from ..gpu.pose import GpuPose
from ..picture.frame_view import FrameView
from ..picture.surface import Surface
from ..scan.noise import noise_of
from ..scan.points import PointCloud, checked_viewpoint
from ..scan.pose import Pose
from .calibration import EyeCalibration, SectorSearch, body_of, calibrate, directions_of
from .candidates import Candidates, RowSample
from .clipping import EVERYWHERE, Planes, near_plane, side_planes
from .covering import CLEAR, CLEAR_OF_NOISE, Covering, SpacedPoints
from .exact import SeenPoints, as_cloud, flipping
from .exact_search import ExactlySeen
from .sectors import Sectors
from .spacing import copies_in, spacing_texels, steady_points

HULL, PAPER, EXACT = "hull", "paper", "exact"
MODES = ("combined", HULL, PAPER)  # of the search on the GPU
_BY_SECTORS = (HULL, PAPER)
DEPTH = 2.0  # of 1 to 4 the least errors in all, of three views of armadillo, igea and dragon each
QUALITY = 0.5
MOST_SECTORS = 1 << 24
_MOVING = 0.5  # of the quality while the picture moves


@dataclass(frozen=True)
class SearchSettings:
    """Settings of a search; all but `mode` count for those that flip points alone."""

    mode: str = MODES[0]  # one of `MODES`, or `EXACT`
    quality: float = QUALITY  # sectors, relative to the number of which half would hold a point
    depth: float = DEPTH  # how far behind a surface points count as hidden, distances between points
    radius: float | None = None  # R of the flip, distances from the eye to the farthest point; None: found
    sectors: int | None = None  # their number, k; None: by the quality
    steps: int | None = None  # sectors that a candidate reaches beyond its own; None: found


def mark_visible(pose: GpuPose, frame: FrameView, surface: Surface) -> gl.BufferTexture:
    """Mark points, R32UI, a texel a row: 1 where the eye sees one, by the default settings.

    The pose has points.
    """
    return surface.cached(SeenPicture).look(pose, frame, surface, SearchSettings()).visible


class _Search:
    """Searches for visible points, with the room that the last one took."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._candidates: Candidates | None = None
        self._covering: Covering | None = None

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return sum(each.nbytes for each in (self._candidates, self._covering) if each)

    def hull(
        self,
        pose: GpuPose,
        search: SectorSearch,
        sample: RowSample | None = None,
        clip: Planes = EVERYWHERE,
    ) -> Candidates:
        """Find the points on the hull of the flipped ones."""
        count = len(pose.cloud)
        if self._candidates is None or not self._candidates.fits(search.sectors, count):
            self._gpu.discard(self._candidates)
            self._candidates = None
            self._candidates = Candidates(self._gpu, search.sectors, count)
        self._candidates.find(pose.array("positions"), *search, sample=sample, clip=clip)
        return self._candidates

    def uncovered(
        self,
        pose: GpuPose,
        found: EyeCalibration,
        sample: RowSample | None = None,
        clip: Planes = EVERYWHERE,
    ) -> Covering:
        """Find the points that no others cover."""
        if self._covering is None or self._covering.points != len(pose.cloud):
            self._gpu.discard(self._covering)
            self._covering = None
            self._covering = Covering(self._gpu, len(pose.cloud))
        self._covering.find(
            SpacedPoints(steady_points(pose), spacing_texels(pose), copies_in(pose)),
            found.sectors,
            found.spacing / found.sectors.edge,
            _clearance(pose),
            sample=sample,
            clip=clip,
        )
        return self._covering

    def release(self) -> None:
        """Delete what it holds on the GPU."""
        for each in (self._candidates, self._covering):
            if each is not None:
                each.release()


class SeenPicture(_Search):
    """The visible points that a surface showed last, and what for."""

    def __init__(self, gpu: Gpu, _: tuple[int, int]) -> None:
        super().__init__(gpu)
        self._found: Candidates | Covering | ExactlySeen | None = None
        self._pose: weakref.ref[GpuPose] | None = None
        self._sought: tuple[object, ...] = ()
        self._chosen: dict[str, str] = {}
        self.calibration: EyeCalibration | None = None  # for what was found

    def look(
        self,
        pose: GpuPose,
        frame: FrameView,
        surface: Surface,
        settings: SearchSettings,
        exact: ExactlySeen | None = None,
    ) -> Candidates | Covering | ExactlySeen:
        """Find the visible points of a picture, unless they are known. exact: those of `EXACT`."""
        directions, body = directions_of(pose.stored, pose.origin, frame.view)
        near, sample = near_plane(frame.view, body), surface.take_sample(frame.share)
        hull = (settings.quality, settings.depth, settings.radius, settings.sectors, settings.steps)
        by_sectors = hull if settings.mode in _BY_SECTORS else ()
        sought = (settings.mode, exact, sample[1], directions, near, *by_sectors)
        # What is found at rest is in all directions, and stays while the camera turns.
        sides = side_planes(frame.view, body) if frame.moving else None
        if settings.mode == EXACT or (settings.mode not in _BY_SECTORS and sides == EVERYWHERE[1:]):
            sides = None  # nothing else is coarser
        stats = surface.stats
        known = self._found is not None and self._pose is not None and self._pose() is pose
        if known and self._sought in ((sought, None), (sought, sides)):
            stats.skipped["visible"] = "the pose and the position of the camera are the same as before"
        else:
            clip = (near, *(sides or EVERYWHERE[1:]))
            self._find(pose, directions, clip, (settings, frame.moving, exact), sample, surface.stats.share)
            self._pose, self._sought = weakref.ref(pose), (sought, sides)
        assert self._found is not None
        stats.chosen.update(self._chosen)
        stats.counted["points"] = self._found.count
        stats.simplified = self._sought[1] is not None
        return self._found

    def _find(
        self,
        pose: GpuPose,
        directions: Sectors,
        clip: Planes,
        asked: tuple[SearchSettings, bool, ExactlySeen | None],
        sample: tuple[gl.BufferTexture | None, int],
        share: float,
    ) -> None:
        settings, is_moving, exact = asked
        radius = None if settings.radius is None else settings.radius * directions.farthest
        rows, count = sample
        drawn = count / len(pose.cloud)
        found = calibrate(pose.stored, directions, pose.origin, settings.depth, radius, drawn)
        self.calibration = found
        if exact is not None:
            length = exact.radius * directions.farthest if math.isfinite(found.radius) else math.inf
            self._found, self._chosen = exact, {"radius": _told(length)}
            return
        only = None if rows is None else RowSample(rows, count, share)
        if settings.mode not in _BY_SECTORS:
            self._found, self._chosen = self.uncovered(pose, found, only, clip), {}
            return
        quality = settings.quality * (_MOVING if is_moving else 1.0)
        search = _compared(chosen_search(found, settings.sectors, settings.steps, quality), settings.mode)
        self._found = self.hull(pose, search, only, clip)
        self._chosen = {
            "radius": _told(found.radius),
            "sectors": f"{search.sectors.count:,} ({search.sectors.mapping})",
            "steps": str(search.steps),
        }


def _told(radius: float) -> str:
    return f"{radius:.4g}" if math.isfinite(radius) else "parallel rays"


class _Asked(_Search):
    """Searches of `visible_points`: the cloud that was asked for last stays on the GPU, so that it is
    uploaded once for all eyes."""

    def __init__(self, gpu: Gpu) -> None:
        super().__init__(gpu)
        self._pose: GpuPose | None = None

    def pose_of(self, cloud: PointCloud) -> GpuPose:
        """The cloud on the GPU."""
        if self._pose is None or self._pose.stored is not cloud:
            self._pose = None
            self._gpu.collect()
            self._pose = GpuPose(self._gpu, Pose(0, 0.0, "", cloud))
        return self._pose


def chosen_search(
    found: EyeCalibration, count: int | None, steps: int | None, quality: float = QUALITY
) -> SectorSearch:
    """The search in so many sectors with so many steps of propagation, None: by the quality."""
    faces = found.sectors.count / found.sectors.edge**2
    wanted = quality * found.sectors.count if count is None else count
    edge = math.sqrt(min(wanted, MOST_SECTORS) / faces)
    search = found.with_sectors(max(round(edge), 1))
    return search if steps is None else search._replace(steps=steps)


def _compared(search: SectorSearch, mode: str) -> SectorSearch:
    """The search, in which points are compared with candidates or, in the paper's way, with none."""
    return search._replace(stride=0) if mode == PAPER else search


def calibrated(
    points: Pose | PointCloud | ArrayLike, eye: ArrayLike, radius: float | None = None
) -> EyeCalibration:
    """Calibrate `visible_points` for points as an eye sees them, where nobody says more.

    points: a pose, a cloud, or (N, 3) absolute. eye: (3,), absolute. radius: R, scan units; None: found too.
    Raises InputError, also where there are no points, or not all within the radius.
    """
    cloud, at = as_cloud(points), checked_viewpoint(eye)
    if not len(cloud):
        raise InputError("there are no points from which to calibrate the test for visible points")
    if radius is not None:
        flipping(SeenPoints.of(cloud, at), radius)  # refuses one that is too small
    body = body_of(cloud)
    sectors = Sectors.around(body.center, body.radius, at, cloud.origin)
    return calibrate(cloud, sectors, cloud.origin, DEPTH, radius)


def visible_points(
    points: Pose | ArrayLike,
    eye: ArrayLike,
    *,
    radius: float | None = None,
    sectors: int | None = None,
    steps: int | None = None,
    mode: str = "combined",
    gpu: Gpu | None = None,
) -> NDArray[np.uint32]:
    """The points that an eye sees: ids (M,) uint32, ascending.

    points: a pose, or (N, 3) absolute; ids count the points that it came with, also those that are
    left out because a coordinate is not finite. eye: (3,), absolute. radius: R of the flip, scan units, not
    less than the distance to the farthest point; sectors: how many, k; steps: of propagation at most; None:
    as `calibrated` says; "hull" and "paper" alone go by these. mode: "hull" takes the points on the hull of
    the flipped ones, as the sectors find it; "paper" only the candidates of sectors (Machado e Silva 2014);
    "combined" those that no others cover (`Covering`). Of points at one
    position one is visible, and so is a point in the eye itself. gpu: None takes a context of its own, which
    is kept. What was found of a pose is kept until another is asked for, so that further eyes take less.
    Raises InputError, NoOpenGLError.
    """
    if mode not in MODES:
        raise unknown_name("mode", mode, MODES)
    cloud, gpu = as_cloud(points), gpu or _gpu()
    if not len(cloud):
        return np.empty(0, np.uint32)
    found = calibrated(cloud, eye, radius)
    search = _compared(chosen_search(found, sectors, steps), mode)
    gpu.activate()
    gpu.collect()
    asked = gpu.cached(_Asked)
    pose = asked.pose_of(cloud)
    by_sectors = mode in _BY_SECTORS
    seen = asked.hull(pose, search) if by_sectors else asked.uncovered(pose, found)
    rows = seen.visible_rows()
    return rows if cloud.ids is None else cloud.ids[rows]


def _clearance(pose: GpuPose) -> float:
    noise = noise_of(pose.stored)
    return max(CLEAR, CLEAR_OF_NOISE * noise.deviation / noise.spacing) if noise.stands_out else CLEAR


@cache
def _gpu() -> Gpu:
    """The context that `visible_points` uses where none is given."""
    return headless()
