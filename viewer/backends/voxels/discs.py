"""Octants as discs: where the surface is in each, along its mean normal, by the machinery of surfels."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from ...gpu.constants import LEAST_RADIUS
from ...gpu.pose import GpuPose
from ...picture.surface import Surface
from ...splatting.amplify import FEEDS, Points, amplify
from ...splatting.fastest import instancing_for
from ...splatting.local import NEAREST_ALONE, Layer
from ...splatting.passes import tiled_two_passes, two_passes
from ...splatting.splats import FRAGMENT, SURFEL, Splats
from ...splatting.subpixel import average, splat_subpixel, subpixel_share
from ...splatting.tiles import splat

TILES = "tiles"
VARIANTS = (TILES, *FEEDS)


def draw_discs(
    points: Points,
    surface: Surface,
    *,
    instancing: str,
    radius_scale: float,
    two: bool = False,
    layer: Layer = NEAREST_ALONE,
) -> None:
    """The nearest disc of each pixel; where discs are about a pixel, the mean of those close behind it.

    Points: with normals and radii. instancing: "auto", TILES, or a feed, which then brings all of them. two:
    whether larger discs are blended with those close behind them, too. layer: what is shown of layers, with
    `two`.
    """
    splats = _splats(radius_scale)
    share = subpixel_share(points, surface, splats)
    variant = _instancing(surface, instancing, two)
    if two and share < 1:
        _draw(points, surface, layer.of(splats), variant, two)
        return
    if share > 0:
        splats = _splats(radius_scale, share)
    if share > 0 and (variant == TILES or instancing == "auto"):
        surface.stats.skipped["tiles"] = (
            "discs are smaller than a pixel, so Scan4D writes each disc to a single pixel"
        )
        splat_subpixel(points, surface, splats)
    else:
        _draw(points, surface, splats, variant, two=False)
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


def _draw(points: Points, surface: Surface, splats: Splats, variant: str, two: bool) -> None:
    if variant == TILES:
        (tiled_two_passes if two else splat)(points, surface, splats)
    elif two:
        two_passes(points, surface, variant, splats)
    else:
        amplify(points, surface, variant, SURFEL, FRAGMENT, splats)


def _instancing(surface: Surface, setting: str, two: bool) -> str:
    """How octants become discs; in one pass and in two this need not be the same."""
    task = f"voxels as discs, {1 + two} passes"
    return instancing_for(surface, setting, TILES, task, VARIANTS, partial(_variants, two))


def _variants(two: bool, pose: GpuPose, surface: Surface) -> dict[str, Callable[[], None]]:
    """Pictures of a pose by each variant."""
    points = Points.of(pose, surface, 1.0, use_radii=True)
    return {variant: partial(_draw, points, surface, _splats(1.0), variant, two) for variant in VARIANTS}
