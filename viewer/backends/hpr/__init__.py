"""Draws only the points that the viewer can see; the scan needs neither normals nor faces.

The paper (Machado e Silva 2014) approximates the hidden point operator of Katz 2007. This operator flips the
points about a sphere around the eye; a point is visible if its flipped position lies on the convex hull.
`hpr` divides directions into sectors. Each sector stores the point whose flipped position reaches farthest
along the direction of the sector (sections 3 to 5 of the paper). The sphere's radius, the number of sectors
and the number of steps follow section 6 of the paper.

`hpr` differs from the paper (Machado e Silva 2014) in two ways. First, `hpr` divides angles evenly, so that
sectors have about the same size up to 45 degrees from the middle. Around an eye near the scan, `hpr` uses six
grids of sectors, like the faces of a cube. Second, `hpr` compares each point with the points that the sectors
around it store. In `hpr`, several points of one sector can therefore be visible, so fewer sectors are enough.
With `mode=paper`, only the points that sectors store are visible. With `mode=exact`, the CPU computes the
hull of all flipped points with Qhull, for each view.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from ...gpu.context import Gpu
from ...gpu.pose import GpuPose
from ...params import param, radius_scale_param
from ...picture.surface import Surface
from ...scan.points import PointCloud
from ...scan.pose import Pose
from ...splatting.local import surface_param
from ...view import View
from ...visibility.candidates import UNLIMITED
from ...visibility.exact_search import ExactlySeen, FoundOnCpu, find_on_cpu
from ...visibility.search import (
    DEPTH,
    EXACT,
    HULL,
    MODES,
    MOST_SECTORS,
    PAPER,
    QUALITY,
    SearchSettings,
    SeenPicture,
)
from ...visibility.spacing import foresee_spacing
from .. import AROUND_ALL, NO_DETAIL, Backend, Derives, FrameView, Limit
from .outputs import OUTPUTS, show_visible

_SHOWN, _VISIBLE = "Shown", "Visibility"
_BY_SECTORS, _FLIPPED = {"mode": (HULL, PAPER)}, {"mode": (HULL, PAPER, EXACT)}
_BY = ("spacing", "search")  # what gives the radius


@dataclass(frozen=True)
class Params:
    """Parameters of hidden point removal."""

    output: str = param(
        "splats",
        "What to draw of the visible points. points: the points; faces: triangles between neighbours; "
        "splats: discs; reconstruction: points, with filled gaps between them",
        choices=OUTPUTS,
        sweep=("faces", "reconstruction", "splats"),
        title="Shown as",
        basic=True,
        group=_SHOWN,
    )
    point_size: int = param(
        1,
        "Edge length of a point's square; 0: the spacing of the points",
        low=0,
        high=32,
        unit="px",
        group=_SHOWN,
        when={"output": ("points",)},
    )
    longest: float = param(
        6.0,
        "Longest edge of a face, in point spacings",
        low=1,
        high=1000,
        sweep=(3, 6, 12),
        group=_SHOWN,
        when={"output": ("faces",)},
    )
    radius_scale: float = radius_scale_param(
        group=_SHOWN, sweep=(0.7, 1.0, 1.4), when={"output": ("splats", "reconstruction")}
    )
    surface: str = surface_param("local", _SHOWN, when={"output": ("splats",)})
    mode: str = param(
        MODES[0],
        "Test for visible points. combined: a point is visible if no disc around another point covers it; "
        "hull: a point is visible if it lies on the convex hull of the flipped points, which sectors "
        "approximate; paper: only the points that sectors store are visible; exact: the exact hull, on the "
        "CPU. 'combined' shows more points in folds, and hides more points behind gaps",
        choices=(*MODES, EXACT),
        title="Visibility test",
        basic=True,
        group=_VISIBLE,
    )
    quality: float = param(
        QUALITY,
        "Number of sectors, as a multiple of the number at which half of the sectors are empty",
        title="Sector density",
        low=0.05,
        high=64,
        sweep=(0.25, 0.5, 1, 4),
        basic=True,
        group=_VISIBLE,
        when=_BY_SECTORS,
    )
    depth: float = param(
        DEPTH,
        "How far a point may lie behind a surface and still be shown, in point spacings. A larger value "
        "shows deeper folds, but also more points behind gaps",
        low=1e-3,
        high=1e6,
        title="Depth tolerance",
        sweep=(1, 2, 4),
        basic=True,
        group=_VISIBLE,
        when=_FLIPPED,
    )
    radius: float | None = param(
        None,
        "Radius of the sphere that flips the points, as a multiple of the distance of the farthest "
        "point; auto: the radius that 'radius_by' gives",
        type=float,
        low=1,
        high=1e9,
        group=_VISIBLE,
        when=_FLIPPED,
    )
    radius_by: str = param(
        _BY[0],
        "What gives an automatic radius. spacing: the depth and density of the points; search: the radius "
        "at which most points are visible from exactly one of two opposite eyes, which takes minutes",
        choices=_BY,
        title="Radius from",
        group=_VISIBLE,
        when=_FLIPPED,
    )
    sectors: int | None = param(
        None,
        "Number of sectors; auto: computed from the sector density",
        type=int,
        low=1,
        high=MOST_SECTORS,
        group=_VISIBLE,
        when=_BY_SECTORS,
    )
    steps: int | None = param(
        None,
        "Number of neighbouring sectors in which a point can replace other points; auto: the number of "
        "sectors between visible points",
        type=int,
        low=0,
        high=UNLIMITED,
        group=_VISIBLE,
        when=_BY_SECTORS,
    )

    @property
    def is_on_cpu(self) -> bool:
        """Whether the CPU searches for the radius or for the visible points in each view."""
        return self.mode == EXACT or (
            self.mode in _FLIPPED["mode"] and self.radius is None and self.radius_by != _BY[0]
        )

    @property
    def search(self) -> SearchSettings:
        """How visible points are searched for."""
        return SearchSettings(self.mode, self.quality, self.depth, self.radius, self.sectors, self.steps)


class VisiblePoints(Backend):
    """The backend `hpr`."""

    title = "Visible points"
    good_for = "Hides the points on the far side of the scan"
    params_class = Params
    draws_with = ("colors",)
    blends = True
    fills = True
    finds_normals = True
    derives = Derives.IN_PROCESS
    derived_by_camera = True
    limits = {
        "rotated by 37 degrees": Limit(0.01, AROUND_ALL),
        "the near plane inside the scan": Limit(0.01, AROUND_ALL),
        "zoomed in to 1/1000 of the scan's width": Limit(0.05, NO_DETAIL),
        "zoomed in to a millionth of the scan's width": Limit(0.05, NO_DETAIL),
        "zoomed out x10^6": Limit(0.02, AROUND_ALL),
        "zoomed out x10^9": Limit(0.02, AROUND_ALL),
        "collinear points": Limit(0.02, AROUND_ALL),
    }

    def foresee(self, cloud: PointCloud, params: Params) -> None:
        """Estimate the noise and the spacing of points, and remove the noise."""
        if len(cloud):
            foresee_spacing(cloud)

    def awaits_facts(self, params: Params) -> bool:
        """True: without these facts, no point is known to be visible."""
        return True

    def derive_key(self, params: Params) -> tuple[Any, ...] | None:
        """The parameter values that the search on the CPU reads; None if the CPU searches nothing."""
        key = params.mode == EXACT, params.depth, params.radius, params.radius_by
        return key if params.is_on_cpu else None

    def derive(self, pose: Pose, params: Params, view: View | None) -> FoundOnCpu | None:
        """Find the radius, and the points that the exact operator calls visible; None without points."""
        assert view is not None
        if not len(pose.cloud):
            return None
        searched, exact = params.radius_by != _BY[0], params.mode == EXACT
        return find_on_cpu(pose.cloud, view, params.depth, params.radius, searched=searched, exact=exact)

    def upload(self, gpu: Gpu, arrays: FoundOnCpu | None) -> ExactlySeen:
        """Mark the visible points on the GPU."""
        return ExactlySeen(gpu, arrays or FoundOnCpu(math.inf, None))

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Find what the eye sees, unless that is known, and show it."""
        if not len(pose.cloud):
            surface.clear()
            return False
        seen = surface.cached(SeenPicture)
        settings, found = frame.params.search, frame.derived
        if found is not None:
            settings = replace(settings, radius=found.radius)
        exact = found if settings.mode == EXACT else None
        candidates = seen.look(pose, frame, surface, settings, exact)
        assert seen.calibration is not None
        return show_visible(pose, frame, surface, candidates, seen.calibration)
