"""Only the points that the viewer can see; needs no normals and no faces.

Machado e Silva 2014 approximates the operator of Katz 2007: flip the points about a sphere around the eye; a
point is visible if its flip lies on the convex hull. Directions are divided into sectors, and each sector
keeps the point whose flip lies farthest along it (sections 3 to 5). The radius, the number of sectors and the
number of steps follow section 6. Scan4D differs in two ways. It divides angles evenly, so that sectors have
about the same size up to 45 degrees off the middle. Around an eye near the scan it uses six such grids, like
the faces of a cube. It also compares points that lost their sector with the candidates around them, which
keeps points that share a sector and needs fewer sectors.
"""

from __future__ import annotations

import math
import weakref
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import InputError, unknown_name
from ...gpu import gl
from ...gpu.context import Gpu, headless
from ...gpu.pose import GpuPose
from ...gpu.surface import Surface
from ...params import param
from ...scan.points import PointCloud, checked_viewpoint
from ...scan.pose import Pose
from ...view import View
from .. import AROUND_ALL, NO_DETAIL, Backend, FrameView, Limit
from .calibration import Body, EyeCalibration, SectorSearch, body_of, calibrate
from .candidates import UNLIMITED, Candidates
from .clipping import EVERYWHERE, Planes, near_plane, side_planes
from .covering import CLEAR, CLEAR_OF_NOISE, Covering, Sample
from .exact import SeenPoints, as_cloud, flipping
from .noise import noise_of
from .outputs import OUTPUTS, show_visible
from .sectors import Sectors
from .spacing import Spacings, copies_in, steady_points

# Rows of the stability suite that sectors cannot hold in principle.
HULL = "hull"
MODES = ("combined", HULL)
_DEPTH = 2.0  # of 1 to 4 the least errors in all, of three views of armadillo, igea and dragon each
_QUALITY = 0.5
_SHOWN, _VISIBLE = "Shown", "Visibility"
_OF_HULL = {"mode": (HULL,)}
_MOVING = 0.5  # of the quality while the picture moves
_MOST_SECTORS = 1 << 24
_EYE_BITS = 36  # of its place


@dataclass(frozen=True)
class Params:
    """Parameters of hidden point removal."""

    output: str = param(
        "splats",
        "What to draw of the visible points. points: the points; faces: triangles between neighbours; "
        "splats: discs; reconstruction: points, with the gaps between them filled",
        choices=OUTPUTS,
        sweep=("faces", "reconstruction", "splats"),
        title="Shown as",
        basic=True,
        group=_SHOWN,
    )
    point_size: int = param(
        1,
        "Edge of a point's square; 0: the distance to the next point",
        low=0,
        high=32,
        unit="px",
        group=_SHOWN,
        when={"output": ("points",)},
    )
    longest: float = param(
        6.0,
        "Longest edge of a face, in distances between points",
        low=1,
        high=1000,
        sweep=(3, 6, 12),
        group=_SHOWN,
        when={"output": ("faces",)},
    )
    radius_scale: float = param(
        1.0,
        "Factor on the radius of splats",
        low=0.01,
        high=100,
        sweep=(0.7, 1.0, 1.4),
        group=_SHOWN,
        when={"output": ("splats", "reconstruction")},
    )
    mode: str = param(
        MODES[0],
        "hull: the points on the hull of the flipped points; combined: the points that no discs around "
        "other points cover. combined keeps points in folds and hides points behind gaps",
        choices=MODES,
        title="Visible by",
        basic=True,
        group=_VISIBLE,
    )
    quality: float = param(
        _QUALITY,
        "Number of sectors, relative to the number at which half of them would hold a point",
        title="Sector density",
        low=0.05,
        high=64,
        sweep=(0.25, 0.5, 1, 4),
        basic=True,
        group=_VISIBLE,
        when=_OF_HULL,
    )
    depth: float = param(
        _DEPTH,
        "How far behind a surface points still count as hidden, in distances between points. A larger "
        "value shows deeper folds and more of what lies behind gaps",
        low=1e-3,
        high=1e6,
        title="Hides from",
        sweep=(1, 2, 4),
        basic=True,
        group=_VISIBLE,
        when=_OF_HULL,
    )
    radius: float | None = param(
        None,
        "Radius R of the flip, in distances from the eye to the farthest point; auto: from the depth and "
        "the density of points",
        type=float,
        low=1,
        high=1e9,
        group=_VISIBLE,
        when=_OF_HULL,
    )
    sectors: int | None = param(
        None,
        "Total number of sectors, k; auto: from the quality",
        type=int,
        low=1,
        high=_MOST_SECTORS,
        group=_VISIBLE,
        when=_OF_HULL,
    )
    steps: int | None = param(
        None,
        "How many sectors a candidate can reach beyond its own; auto: as many as lie between visible points",
        type=int,
        low=0,
        high=UNLIMITED,
        group=_VISIBLE,
        when=_OF_HULL,
    )


class VisiblePoints(Backend):
    """The backend `hpr`."""

    title = "Visible points"
    good_for = "Points without those on the far side"
    params_class = Params
    blends = True
    fills = True
    finds_normals = True
    limits = {
        "rotated by 37 degrees": Limit(0.01, AROUND_ALL),
        "near plane inside the cloud": Limit(0.01, AROUND_ALL),
        "zoomed in on 10^-3 of the scan": Limit(0.05, NO_DETAIL),
        "zoomed in on 10^-6 of the scan": Limit(0.05, NO_DETAIL),
        "zoomed out x10^6": Limit(0.02, AROUND_ALL),
        "zoomed out x10^9": Limit(0.02, AROUND_ALL),
        "collinear points": Limit(0.02, AROUND_ALL),
        "normals parallel to y": Limit(0.02, AROUND_ALL, {"output": ("splats",)}),
    }

    def needs(self, pose: Pose, params: Params) -> tuple[str, ...]:
        """Nothing but positions."""
        return ()

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Find what the eye sees, unless that is known, and show it."""
        if not len(pose.cloud):
            surface.clear()
            return False
        seen = surface.keep(_Seen)
        candidates = seen.look(pose, frame, surface)
        assert seen.calibration is not None
        return show_visible(pose, frame, surface, candidates, seen.calibration)


def mark_visible(pose: GpuPose, frame: FrameView, surface: Surface) -> gl.BufferTexture:
    """Flags for other backends, R32UI, a texel a row: 1 where the eye sees a point, as with the default
    parameters. The pose has points."""
    return surface.keep(_Seen).look(pose, replace(frame, params=Params()), surface).visible


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
        self, pose: GpuPose, search: SectorSearch, sample: Sample | None = None, clip: Planes = EVERYWHERE
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
        sample: Sample | None = None,
        share: float = 1.0,
        clip: Planes = EVERYWHERE,
    ) -> Covering:
        """Find the points that no others cover. share: of all points, that the sample is of."""
        if self._covering is None or self._covering.points != len(pose.cloud):
            self._gpu.discard(self._covering)
            self._covering = None
            self._covering = Covering(self._gpu, len(pose.cloud))
        self._covering.find(
            steady_points(pose),
            pose.keep(Spacings).texels,
            found.sectors,
            found.spacing / found.sectors.edge,
            _clearance(pose),
            repeated=copies_in(pose),
            sample=sample,
            share=share,
            clip=clip,
        )
        return self._covering

    def release(self) -> None:
        """Delete what it holds on the GPU."""
        for each in (self._candidates, self._covering):
            if each is not None:
                each.release()


class _Seen(_Search):
    """The visible points that a surface showed last, and what for."""

    def __init__(self, gpu: Gpu, _: tuple[int, int]) -> None:
        super().__init__(gpu)
        self._found: Candidates | Covering | None = None
        self._pose: weakref.ref[GpuPose] | None = None
        self._sought: tuple[object, ...] = ()
        self._chosen: dict[str, str] = {}
        self.calibration: EyeCalibration | None = None  # for what was found

    def look(self, pose: GpuPose, frame: FrameView, surface: Surface) -> Candidates | Covering:
        """Find the visible points of a picture, unless they are known."""
        params: Params = frame.params
        directions, body = _directions(pose, frame.view)
        near, sample = near_plane(frame.view, body), surface.take_sample(frame.share)
        hull = (params.quality, params.depth, params.radius, params.sectors, params.steps)
        sought = (sample[1], directions, near, *(hull if params.mode == HULL else ()))
        # What is found at rest is in all directions, and stays while the camera turns.
        sides = side_planes(frame.view, body) if frame.moving else None
        if params.mode != HULL and sides == EVERYWHERE[1:]:
            sides = None  # nothing else is coarser
        stats = surface.stats
        known = self._found is not None and self._pose is not None and self._pose() is pose
        if known and self._sought in ((sought, None), (sought, sides)):
            stats.skipped["visible"] = "pose and eye stand still"
        else:
            clip = (near, *(sides or EVERYWHERE[1:]))
            self._find(pose, directions, clip, frame, sample, surface.stats.share)
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
        frame: FrameView,
        sample: tuple[gl.BufferTexture | None, int],
        share: float,
    ) -> None:
        params: Params = frame.params
        radius = None if params.radius is None else params.radius * directions.farthest
        rows, count = sample
        drawn = count / len(pose.cloud)
        found = calibrate(pose.stored, directions, pose.origin, params.depth, radius, drawn)
        self.calibration = found
        only = None if rows is None else (rows, count)
        if params.mode != HULL:
            self._found, self._chosen = self.uncovered(pose, found, only, share, clip), {}
            return
        quality = params.quality * (_MOVING if frame.moving else 1.0)
        search = chosen_search(found, params.sectors, params.steps, quality)
        self._found = self.hull(pose, search, only, clip)
        self._chosen = {
            "radius": "parallel rays" if math.isinf(found.radius) else f"{found.radius:.4g}",
            "sectors": f"{search.sectors.count:,} ({search.sectors.mapping})",
            "steps": str(search.steps),
        }


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


def _directions(pose: GpuPose, view: View) -> tuple[Sectors, Body]:
    """How directions from a view's eye are divided, and the body that it sees."""
    body = body_of(pose.stored)
    if view.perspective:
        eye = _snapped(view.origin - view.rotation.T @ view.translation, body)
        return Sectors.around(body.center, body.radius, eye, pose.origin), body
    return Sectors.along(body.center, body.radius, -view.rotation[2], pose.origin), body


def _snapped(eye: NDArray[np.float64], body: Body) -> NDArray[np.float64]:
    """The eye without what rounding makes of it when the camera turns."""
    away = eye - body.center
    step = 2.0 ** (math.ceil(math.log2(max(float(np.abs(away).max()), body.radius))) - _EYE_BITS)
    return body.center + np.round(away / step) * step


def chosen_search(
    found: EyeCalibration, count: int | None, steps: int | None, quality: float = _QUALITY
) -> SectorSearch:
    """The search in so many sectors with so many steps of propagation, None: by the quality."""
    faces = found.sectors.count / found.sectors.edge**2
    wanted = quality * found.sectors.count if count is None else count
    edge = math.sqrt(min(wanted, _MOST_SECTORS) / faces)
    search = found.with_sectors(max(round(edge), 1))
    return search if steps is None else search._replace(steps=steps)


def calibrated(
    points: Pose | PointCloud | ArrayLike, eye: ArrayLike, radius: float | None = None
) -> EyeCalibration:
    """Calibrate `visible_points` for points as an eye sees them, where nobody says more.

    points: a pose, a cloud, or (N, 3) absolute. eye: (3,), absolute. radius: R, scan units; None: found too.
    Raises InputError, also where there are no points, or not all within the radius.
    """
    cloud, at = as_cloud(points), checked_viewpoint(eye)
    if not len(cloud):
        raise InputError("no points to calibrate by")
    if radius is not None:
        flipping(SeenPoints.of(cloud, at), radius)  # refuses one that is too small
    body = body_of(cloud)
    sectors = Sectors.around(body.center, body.radius, at, cloud.origin)
    return calibrate(cloud, sectors, cloud.origin, _DEPTH, radius)


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
    as `calibrated` says; the hull alone goes by these. mode: "hull" takes the points on the hull of the
    flipped ones, as the sectors find it; "combined" those that no others cover (`Covering`). Of points in one
    place one is visible, and so is a point in the eye itself. gpu: None takes a context of its own, which is
    kept. What was found of a pose is kept until another is asked for, so that further eyes take less. Raises
    InputError, NoOpenGLError.
    """
    if mode not in MODES:
        raise unknown_name("mode", mode, MODES)
    cloud, gpu = as_cloud(points), gpu or _gpu()
    if not len(cloud):
        return np.empty(0, np.uint32)
    found = calibrated(cloud, eye, radius)
    search = chosen_search(found, sectors, steps)
    gpu.activate()
    gpu.collect()
    asked = gpu.keep(_Asked)
    pose = asked.pose_of(cloud)
    rows = (asked.hull(pose, search) if mode == HULL else asked.uncovered(pose, found)).visible_rows()
    return rows if cloud.ids is None else cloud.ids[rows]


def _clearance(pose: GpuPose) -> float:
    noise = noise_of(pose.stored)
    return max(CLEAR, CLEAR_OF_NOISE * noise.deviation / noise.spacing) if noise.stands_out else CLEAR


@cache
def _gpu() -> Gpu:
    """The context that `visible_points` uses where none is given."""
    return headless()
