"""Octants as discs: where the surface is in each, along its mean normal, by the machinery of surfels."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from ...gpu.amplify import FEEDS, Points, amplify
from ...gpu.constants import LEAST_RADIUS
from ...gpu.fastest import instancing_for
from ...gpu.pose import GpuPose
from ...gpu.surface import Surface
from ..surfels.splats import FRAGMENT, SURFEL, Splats
from ..surfels.subpixel import average, splat_subpixel, subpixel_share
from ..surfels.tiles import splat

TILES = "tiles"
WAYS = (TILES, *FEEDS)


def draw_discs(points: Points, surface: Surface, instancing: str, radius_scale: float) -> None:
    """The nearest disc of each pixel; where discs are about a pixel, the mean of those close behind it.

    Points: with normals and radii. instancing: "auto", TILES, or a feed, which then brings all of them.
    """
    splats = _splats(radius_scale)
    share = subpixel_share(points, surface, splats)
    if share > 0:
        splats = _splats(radius_scale, share)
    way = instancing_for(surface, instancing, TILES, "voxels as discs", WAYS, _ways)
    if share > 0 and (way == TILES or instancing == "auto"):
        surface.stats.skipped["tiles"] = "discs are under a pixel: they are sent there one by one"
        splat_subpixel(points, surface, splats)
    else:
        _draw(points, surface, splats, way)
    if share > 0:
        average(points, surface, splats)


def _splats(radius_scale: float, mean_share: float = 0.0) -> Splats:
    return Splats(
        radius_scale=radius_scale,
        uniform_radius=0.0,
        least_radius=LEAST_RADIUS,
        cull_back=False,  # left out with the octants where that is asked for
        mask_limit=1.0,
        falloff=4.0,
        enlarge=1.0,
        epsilon=1.0,
        mean_share=mean_share,
    )


def _draw(points: Points, surface: Surface, splats: Splats, way: str) -> None:
    if way == TILES:
        splat(points, surface, splats)
    else:
        amplify(points, surface, way, SURFEL, FRAGMENT, splats)


def _ways(pose: GpuPose, surface: Surface) -> dict[str, Callable[[], None]]:
    points = Points.of(pose, surface, 1.0, use_radii=True)
    return {way: partial(_draw, points, surface, _splats(1.0), way) for way in WAYS}
