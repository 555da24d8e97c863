"""Splats of about a pixel: sent to their pixels one by one, and averaged there.

Many of them share a pixel, so that lists and quads cost more than they give, and the nearest alone, another
one with each small motion, would flicker (docs/developing/decisions/005-splats-under-a-pixel.md).
"""

from __future__ import annotations

import math

from ..gpu.bindings import Storage
from ..gpu.constants import LEAST_RADIUS
from ..gpu.context import Gpu, Program
from ..gpu.scatter import CellSums, FixedPoint, Visits
from ..picture.surface import Surface
from ..srgb import LIGHT_STEPS
from .amplify import Points
from .gaps import GapRadii
from .passes import bind_looks
from .splats import Splats, bind_visible

_LARGEST_RADIUS = 8.0  # pixels: one invocation goes over all pixels of a disc
# What a splat gives to a mean, as surfels/passes/averaged.glsl has it: one of it, its normal, its light.
_LIMITS = (1.0, 2047.0, 2047.0, 2047.0)
_COLORED_LIMITS = (*_LIMITS, *[float(LIGHT_STEPS)] * 3)
# Splats of a pixel whose sums of light fit into 32 bits. Of more, as of a scan far away, the nearest is shown
# alone.
_MOST = (2**31 - 1) // LIGHT_STEPS


def subpixel_share(points: Points, surface: Surface, splats: Splats) -> float:
    """1 where nearly all discs are as small as any is drawn; 0 where they are twice as large, or some
    very large; between them in proportion.

    Outliers count for what none may be.
    """
    pose, view = points.pose, surface.view
    nearest = float(view.depths(pose.whole_bounds.corners() - pose.origin).min())
    if view.perspective and nearest <= view.near:
        return 0.0
    usual = largest = splats.uniform_radius
    if points.use_radii:
        if "radii" in points.buffers:
            gaps = pose.cached(GapRadii)
            own = gaps.usual, gaps.largest
        else:
            own = pose.reaches
        usual, largest = max(usual, own[0]), max(largest, own[1])
    pixels = splats.radius_scale * math.sqrt(splats.mask_limit) * points.enlarged * view.scale
    if (largest / nearest if view.perspective else largest) * pixels > _LARGEST_RADIUS:
        return 0.0
    if view.perspective:  # the box of most points lies within that of all
        usual /= float(view.depths(pose.bounds.corners() - pose.origin).min())
    return min(max(2 - usual * pixels / LEAST_RADIUS, 0.0), 1.0)


def _plain_sums(gpu: Gpu, size: tuple[int, int]) -> CellSums:
    return CellSums(gpu, size[0] * size[1], len(_LIMITS))


def _colored_sums(gpu: Gpu, size: tuple[int, int]) -> CellSums:
    return CellSums(gpu, size[0] * size[1], len(_COLORED_LIMITS))


def splat_subpixel(points: Points, surface: Surface, splats: Splats) -> None:
    """The nearest disc at each pixel, by scatter: what `tiles.splat` draws, up to rounding."""
    visits = Visits("surfels/scatter.glsl", points.count, points.bind, points.defines, splats)
    with surface.keeping_nearest() as nearest:
        nearest.take(visits)


def average(points: Points, surface: Surface, splats: Splats) -> None:
    """Colours and normals of each pixel: the mean of the discs that lie at most epsilon radii behind
    what it shows, as far as `mean_share` says."""
    gpu = surface.gpu
    covered = surface.list_covered()
    bound = bind_looks(points, surface)
    limits, make = (_COLORED_LIMITS, _colored_sums) if bound["HAS_COLORS"] else (_LIMITS, _plain_sums)
    sums = surface.cached(make)
    fixed = FixedPoint(limits, (1.0,) * len(limits), _MOST)

    def bind(program: Program) -> None:
        bind_visible(points, program)
        points.bind(program)

    def run(step: int) -> None:
        defines = {"STEP": step, "MOST": _MOST, **fixed.defines, **bound}
        program = gpu.compute("surfels/passes/mean.comp", defines, params=splats)
        sums.buffer.bind_to_storage_buffer(Storage.SUMS)
        covered.run(program)

    with gpu.timers.measure("mean"):
        surface.bind_textures()
        run(0)
        defines = {**bound, **points.defines}
        sums.add(Visits("surfels/passes/averaged.glsl", points.count, bind, defines, splats), fixed)
        run(1)
