"""Draws a smooth surface from points without normals, by fitting splats to the visible points.

`auto_splats` implements the method of Preiner 2012. For each picture, `auto_splats` finds the visible points.
For each visible point, `auto_splats` finds its nearest neighbours, fits a plane to them, and draws a splat.
The search for neighbours is exact (`neighborhoods.py`), so neighbourhoods do not change with the view.
Neighbours can also be hidden points of the same surface, so that neighbourhoods at outlines are complete.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...gpu.pose import GpuPose
from ...params import param, radius_scale_param
from ...picture.surface import Surface
from ...scan.noise import Noise, noise_of
from ...scan.points import PointCloud
from ...scan.pose import Pose
from ...splatting.amplify import Points
from ...splatting.local import (
    DETAIL,
    LOCAL,
    NoiseEstimate,
    estimated_noise,
    foresee_noise,
    layer_of,
    surface_param,
)
from ...splatting.packed import VARIANTS, draw_depths, draw_splats
from .. import NO_SPACING, Backend, FrameView, Limit, Suited
from .grids import border_of
from .neighborhoods import MOST_NEIGHBORS, Neighborhoods, Search, foresee_neighborhoods
from .values import VALUES, give_value

_HIDDEN_COPIES = (
    "the search for neighbours counts visible copies of a point once, but hidden copies several times"
)

_FEW = 200  # points
_NO_NOISE = Noise(0.0, 0.0)
_USUAL_COUNT = 10  # points of a neighborhood, for which the next numbers hold
# Noise in spacings, and the radius of the ball of a plane in radii of neighborhoods; linear in between. With
# these values, normals of smooth and of finely detailed models are about as good as with the best fixed k.
_WIDENING = ((0.087, 0.142, 0.45), (1.0, 1.48, 1.95))
_LEFT = 0.4  # share of the noise that is left in splats whose centres moved onto such a surface
_NEIGHBORS, _SPLATS, _SPEED = "Neighbours", "Splats", "Speed"


@dataclass(frozen=True)
class Params:
    """Parameters of auto splats."""

    k: int = param(
        10,
        "Number of points in a neighbourhood, including the point itself. A larger number smooths noise, "
        "and a smaller number keeps detail",
        low=3,
        high=MOST_NEIGHBORS,
        sweep=(6, 10, 20),
        title="Smoothing",
        basic=True,
        group=_NEIGHBORS,
    )
    adaptive: bool = param(
        True,
        "Compute each normal from as few of the k neighbours as the noise allows, and from more points "
        "if the scan is very noisy",
        group=_NEIGHBORS,
        sweep=(True, False),
    )
    hidden_neighbors: bool = param(
        True,
        "Use a point as a neighbour even if a nearer point of the same surface covers its pixel",
        group=_NEIGHBORS,
    )
    outliers: bool = param(
        False, "Show outliers, which are points without close neighbours", key="Shift+O", group=_NEIGHBORS
    )
    expansions: int = param(
        3,
        "How often the search for neighbours doubles its radius. A point that still has no "
        "neighbours is an outlier",
        low=0,
        high=10,
        group=_NEIGHBORS,
    )
    growth: float = param(
        4.0,
        "If the search area grows by this factor without reaching another point, the search ends with "
        "fewer than k neighbours",
        low=1,
        high=100,
        group=_NEIGHBORS,
    )
    orient: str = param(
        "eye",
        "Direction of normals. eye: towards the viewer; scanner: towards the scanner that measured the point",
        choices=("eye", "scanner"),
        group=_NEIGHBORS,
    )
    passes: str = param(
        "two",
        "one: show the nearest splat; two: blend the nearest splat with the splats close behind it",
        choices=("one", "two"),
        group=_SPLATS,
    )
    surface: str = surface_param("local", _SPLATS)
    elliptical: bool = param(
        False,
        "Draw elliptical splats, which are longer in the direction where neighbours lie farther apart; "
        "off: round splats",
        group=_SPLATS,
    )
    radius_scale: float = radius_scale_param(group=_SPLATS, basic=True)
    refine: bool = param(
        True,
        "Shrink the splats of hidden points to the size of the splats in front, so that hidden splats do "
        "not extend beyond outlines",
        group=_SPLATS,
    )
    cull: bool = param(
        True,
        "Skip points far behind the nearest points, until a picture needs the skipped points",
        affects="speed",
        group=_SPEED,
    )
    instancing: str = param(
        "auto",
        "Method by which the GPU draws splats. auto: the fastest method on this device",
        choices=("auto", *VARIANTS),
        affects="speed",
        group=_SPEED,
    )


class AutoSplats(Backend):
    """The backend `auto_splats`."""

    title = "Smooth surface"
    good_for = "Best look for points without normals"
    params_class = Params
    draws_with = ("colors",)
    blends = True
    finds_normals = True
    values = VALUES
    limits = {
        "a body, each point 1000 times": Limit(0.014, _HIDDEN_COPIES),
        "collinear points, viewed along their line, perspective": Limit(0.001, NO_SPACING),
        "collinear points, viewed along their line, orthographic": Limit(0.001, NO_SPACING),
    }
    default_reasons = {
        "adaptive": "the default improves the normals of other scans: the error is 1.3° instead of 1.4° "
        "on the "
        "bunny, and 2.6° instead of 3.1° on the armadillo",
        "hidden_neighbors": "the default improves outlines of other scans: it draws "
        "1.2 % instead of 1.8 % of the silhouette's area outside the silhouette on the bunny, and "
        "2.2 % instead of 3.0 % on the armadillo",
        "instancing": "with a software driver, auto is the same as tiles, so the measured difference is "
        "noise; with "
        "a graphics card, auto is the fastest method",
    }

    def needs(self, pose: Pose, params: Params) -> tuple[str, ...]:
        """Nothing but positions."""
        return ()

    def suits(self, pose: Pose) -> Suited | None:
        """Scans of positions alone, but for a few points: their surface is found while they are drawn."""
        is_bare = pose.overview.normals is None and pose.count >= _FEW
        return Suited(1) if is_bare else None

    def offers(self, pose: Pose) -> tuple[dict[str, object], ...]:
        """Two passes, and one, of bare points; with normals, surfels draw about the same in less time."""
        return () if pose.views or self.suits(pose) is None else ({}, {"passes": "one", "surface": "nearest"})

    def foresee(self, cloud: PointCloud, params: Params) -> None:
        """Estimate the noise of points, and how far apart they are."""
        if params.adaptive:
            noise_of(cloud)
        foresee_noise(cloud, params)
        if len(cloud):
            foresee_neighborhoods(cloud)

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Find neighborhoods and draw their splats; complete where all points shall be drawn."""
        params: Params = frame.params
        found = surface.cached(Neighborhoods)
        noise, is_own = _noise_of(pose, frame)
        search = search_of(params, pose, noise or _NO_NOISE)
        anew = bool(frame.changed - {"parameters", "values"})
        border = border_of(pose.cloud, frame.view, params.k)
        found.find(pose, surface, frame.view, search, frame.share, anew, border)
        surface.stats.counted["neighbourhoods by searches"] = found.read_rounds
        if not found.count:
            surface.clear()
            surface.own("normal")
            give_value(found, surface, params.radius_scale)
            return surface.stats.share < 1 or not is_own
        instancing, scale = params.instancing, params.radius_scale
        is_moved = params.surface == LOCAL
        if not found.is_whole:
            draw_depths(_points(pose, found, is_moved), surface, instancing=instancing, radius_scale=scale)
            found.find_late(pose, surface, search)
        if search.widening > 1:
            surface.stats.chosen["adaptive"] = (
                f"fitted to all points within {search.widening:.2g} radii, because the points are noisy"
            )
        left = _LEFT if is_moved and search.widening > 1 else 1.0
        layer = layer_of(pose, frame, surface, blends=params.passes == "two", left=left)
        draw_splats(
            _points(pose, found, is_moved),
            surface,
            instancing=instancing,
            radius_scale=scale,
            two=params.passes == "two" or layer.is_local,
            refine=params.refine,
            layer=layer,
        )
        give_value(found, surface, params.radius_scale)
        return surface.stats.share < 1 or not layer.known or not is_own


def _noise_of(pose: GpuPose, frame: FrameView) -> NoiseEstimate:
    """The noise that planes adapt to. The background estimates it."""
    if not frame.params.adaptive:
        return NoiseEstimate(_NO_NOISE, True)
    return estimated_noise(pose, frame)


def _points(pose: GpuPose, found: Neighborhoods, is_moved: bool) -> Points:
    """The points whose neighborhoods were found, with their splats. is_moved: whether splats lie where the
    fits put them, in place of at their points."""
    buffers = {name: found[name] for name in ("splats", "looks")}
    if is_moved:
        buffers["positions"] = found["places"]
    return Points(
        pose,
        use_radii=True,
        count=found.count,
        rows=found["drawn"],
        buffers=buffers,
    )


def search_of(params: Params, pose: GpuPose, noise: Noise) -> Search:
    """The search that parameters ask for, of points with some noise."""
    return Search(
        k=params.k,
        hidden_neighbors=params.hidden_neighbors,
        culls=params.cull,
        growth=params.growth,
        alone=2.0**params.expansions,
        drops=not params.outliers,
        adaptive=params.adaptive,
        elliptical=params.elliptical,
        by_scanner=params.orient == "scanner" and bool(pose.views),
        widening=widening_of(noise, params.k),
        noise=noise.deviation,
        raises=params.surface == LOCAL,
    )


def widening_of(noise: Noise, k: int) -> float:
    """The radius of the ball whose points determine a plane, in radii of a neighborhood of k points.

    A neighborhood of more than the usual number of points is wider already, so its ball grows less.
    """
    if noise.deviation <= DETAIL * noise.spacing:
        return 1.0
    radii = float(np.interp(noise.deviation / noise.spacing, *_WIDENING))
    return radii * min(math.sqrt(_USUAL_COUNT / k), 1.0)
