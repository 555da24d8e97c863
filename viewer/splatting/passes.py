"""Passes: splats that overlap are blended, over what a single pass found (Slomp 2014, V-B).

Colours and normals of each pixel go to `Surface.own`; depth and row stay those of the nearest splat. Sums
are of whole numbers, so that they do not depend on the order
(docs/developing/decisions/006-blending-whole-numbers.md).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import NamedTuple

import moderngl
import numpy as np

from ..gpu import gl
from ..gpu.bindings import Texture
from ..gpu.constants import BEHIND
from ..gpu.context import Gpu
from ..picture.frame_view import FrameView
from ..picture.surface import Surface
from ..scan.ranges import robust_range
from .amplify import Points, draw_shapes, usable_feed
from .lists import ALL, NOT_HIDDEN, TOWARDS, TileLists
from .local import begin_local, bind_local, settle_depths
from .looks import looks_of
from .splats import FRAGMENT, SURFEL, Splats, bind_visible
from .tiles import FALLBACK, LIMIT, fill_away, run, show, show_all, splat_first, tile_lists, without_wait

FIRST, SECOND = 1, 2  # of which lists the nearest are found as they are blended: TAKE of blend.comp


def blends(frame: FrameView, surface: Surface) -> bool:
    """Whether a picture gets two passes where nobody chose: what moves gets one, where the CPU computes all
    or not all points are drawn in time. Tells the surface's statistics."""
    stats = surface.stats
    stats.simplified = frame.moving and (surface.gpu.software or frame.share < 1)
    stats.chosen["passes"] = "one" if stats.simplified else "two"
    return not stats.simplified


def two_passes(points: Points, surface: Surface, feed: str, splats: Splats) -> None:
    """Visibility, then what each splat gives, added up: by the rasteriser, fed as `amplify` says.

    Where the first pass finds nothing, the nearest of the enlarged splats fills the pixel, but not beyond
    the outline.
    """
    gpu, target, feed = surface.gpu, surface.raster(), usable_feed(points, feed, surface)
    with gpu.timers.measure("visibility"):
        target.clear()
        gpu.ctx.enable_only(moderngl.DEPTH_TEST)
        gpu.ctx.depth_func = ">"  # reversed depth: near is 1
        draw_shapes(points, feed, SURFEL, FRAGMENT, splats)
        if splats.enlarge > 1:
            _draw_fill(splats.larger(points), feed, splats)
    with gpu.timers.measure("copy"):
        surface.take_raster()
    blend(points, surface, feed, splats)
    if splats.enlarge > 1:
        _close(points, surface, splats)
    settle_depths(surface, splats)


def blend(points: Points, surface: Surface, feed: str, splats: Splats) -> None:
    """The second pass: what each splat gives, added up over what `surface` holds, by the rasteriser."""
    begin_local(surface, splats)
    _add(points, splats.larger(points), surface, feed, splats)
    _resolve(points, surface, splats, over=False)


def _draw_fill(larger: Points, feed: str, splats: Splats) -> None:
    """Enlarged splats behind all that the first pass found."""
    with gl.divided_depth(BEHIND):
        draw_shapes(larger, feed, SURFEL, "surfels/passes/fill.frag", splats)


def _add(points: Points, larger: Points, surface: Surface, feed: str, splats: Splats) -> gl.Sums:
    """Add up what enlarged splats give that are not too far behind what is visible. points: all that were
    drawn in the first pass; larger: those to add."""
    gpu = surface.gpu
    with _sums(points, surface) as sums:
        with gpu.timers.measure("limit"):
            _limit(points, surface, splats)
        with gpu.timers.measure("add"):
            sums.clear()
            gpu.ctx.enable_only(moderngl.DEPTH_TEST | moderngl.BLEND)
            gpu.ctx.depth_func = ">="
            gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE
            with gl.kept_depth():
                macros = {"LOCAL": int(splats.layer > 0)}
                draw_shapes(larger, feed, SURFEL, "surfels/passes/add.frag", splats, macros)
    return sums


def splat_sorted(points: Points, surface: Surface, feed: str, splats: Splats) -> None:
    """`splat_over` from back to front."""
    ordered = _farthest_first(points, surface)
    splat_over(ordered, surface, feed, splats, tested=False)
    surface.gpu.discard(ordered.rows)


def splat_over(points: Points, surface: Surface, feed: str, splats: Splats, tested: bool) -> None:
    """Each splat over those before it, as transparent as its mask; `surface` holds what is visible.

    tested: whether what was drawn before hides what is behind it, all of a quad and not its mask alone.
    """
    gpu, feed = surface.gpu, usable_feed(points, feed, surface)
    with _sums(points, surface) as sums, gpu.timers.measure("over"):
        sums.clear()
        sums.clear_depth()
        gpu.ctx.enable_only(moderngl.BLEND | (moderngl.DEPTH_TEST if tested else 0))
        gpu.ctx.depth_func = ">"
        gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
        draw_shapes(points, feed, SURFEL, "surfels/passes/over.frag", splats)
    _resolve(points, surface, splats, over=True)


def _farthest_first(points: Points, surface: Surface) -> Points:
    """Points from back to front, by their centres: sorted on the CPU, for each picture."""
    rows = np.arange(len(points.pose.cloud), dtype=np.uint32)
    if points.rows is not None:
        rows = surface.gpu.read(points.rows.buffer, np.uint32, points.count)
    depths = surface.view.depths(points.pose.cloud.positions[rows])
    rows = rows[np.argsort(-depths, kind="stable")]
    order = gl.BufferTexture(surface.gpu.buffer(rows if rows.size else bytes(4)), gl.R32UI)
    return replace(points, rows=order)


def splat_as_printed(points: Points, surface: Surface, feed: str, splats: Splats) -> None:
    """Draw both passes as Slomp 2014 prints them (V-B): depths of whole quads alone; then enlarged splats
    over one another, in the order in which they are fed, tested against these depths.

    Pixels have a colour, which the feed brings, and the depth of the nearest splat there; none shows a point.
    Depths of the first pass lie `epsilon` radii farther from the eye, as in the papers that Slomp 2014 cites
    for the two passes; it prints no number.
    """
    gpu, points = surface.gpu, replace(points, colored=points.pose.has("colors"))
    feed, target = usable_feed(points, feed, surface), surface.cached(_new_blended)
    target.target.use()
    target.clear()
    target.clear_depth()
    gpu.ctx.enable_only(moderngl.DEPTH_TEST)
    gpu.ctx.depth_func = ">"  # reversed depth: near is 1
    with gpu.timers.measure("visibility"), gl.kept_colors():
        draw_shapes(points, feed, SURFEL, "surfels/passes/depth_alone.frag", splats, {"PUSHED": 1})
    gpu.ctx.enable_only(moderngl.DEPTH_TEST | moderngl.BLEND)
    gpu.ctx.depth_func = ">="
    gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
    with gpu.timers.measure("shading"), gl.kept_depth(), gl.keeping_largest(1):
        larger = splats.larger(points)
        draw_shapes(larger, feed, SURFEL, "surfels/passes/as_printed.frag", splats, {"SHADED": 1})
    gpu.ctx.disable(moderngl.BLEND)
    with gpu.timers.measure("resolve"):
        surface.clear()
        surface.bind_storage()
        surface.bind_own("color")
        target.bind_images(Texture.COLOR_SUMS, Texture.LARGE_DEPTHS)
        gpu.dispatch(gpu.compute("surfels/passes/as_printed.comp"), surface.size[0] * surface.size[1])


def show_visibility(points: Points, surface: Surface, splats: Splats) -> None:
    """Turn what a single pass found into what the first of two leaves to the second: depth in grey."""
    gpu, pose = surface.gpu, points.pose
    program = gpu.compute("surfels/passes/visibility.comp", points.defines, params=splats)
    gpu.set(program, depth_range=robust_range(surface.view.depths(pose.sample)))
    with gpu.timers.measure("grey"):
        bind_visible(points, program)
        surface.bind_storage()
        surface.bind_own("color", "normal")
        gpu.dispatch(program, surface.size[0] * surface.size[1])


def tiled_two_passes(points: Points, surface: Surface, splats: Splats) -> None:
    """Draw the picture of `two_passes` by tiles; splats that are too large for these are rasterised."""
    by_tiles = _two_by_tiles if splats.enlarge == 1 else _enlarged_by_tiles

    def draw() -> bool:
        begin_local(surface, splats)
        return by_tiles(points, surface, splats)

    if without_wait(points, surface, draw) if splats.enlarge == 1 else draw():
        settle_depths(surface, splats)
    else:
        two_passes(points, surface, FALLBACK, splats)


def _two_by_tiles(points: Points, surface: Surface, splats: Splats) -> bool:
    """Draw both passes by the same lists, at once where no disc is large, but for what may show discs that
    face away. False where the rasteriser has to do it all."""
    lists = tile_lists(points, surface, splats, ALL if splats.cull_back else TOWARDS, looks=True)
    if lists is None:
        return False
    large = None
    if lists.large:
        large = show_all(points, surface, lists, splats, LIMIT if lists.away else 0)
    else:
        surface.clear()
        blend_by_tiles(points, surface, lists, None, splats, Sides(FIRST, partly=lists.away > 0))
        if not lists.away:
            return True
    if lists.away and not fill_away(points, surface, lists, splats, blends=True):
        return False
    if lists.away and large is not None:
        show(points, surface, lists, splats, found=True, away=True)
    take = SECOND if large is None else 0
    blend_by_tiles(points, surface, lists, large, splats, Sides(take, away=lists.away > 0))
    return True


def _enlarged_by_tiles(points: Points, surface: Surface, splats: Splats) -> bool:
    """The first pass, and the second with lists of its own: of the enlarged splats that are not all too far
    behind what the first found. False where the rasteriser has to do it all."""
    larger = splats.larger(points)
    if not splat_first(points, surface, splats, LIMIT):
        return False
    lists = tile_lists(larger, surface, splats, NOT_HIDDEN, looks=True)
    if lists is None:
        return False
    large = lists.large_points(larger) if lists.large else None
    _fill_by_tiles(surface, lists, large, splats)
    blend_by_tiles(points, surface, lists, large, splats)
    _close(points, surface, splats)
    return True


class Sides(NamedTuple):
    """The lists that blending goes over.

    take: whether the nearest of the FIRST or the SECOND lists, of what faces away, are still to be found.
    away: whether there are such second lists. partly: whether they follow. Then only pixels that they hardly
    reach are blended, and tiles get how far behind splats still count.
    """

    take: int = 0
    away: bool = False
    partly: bool = False


def blend_by_tiles(
    points: Points,
    surface: Surface,
    lists: TileLists,
    large: Points | None,
    splats: Splats,
    sides: Sides | None = None,
) -> None:
    """The second pass, as `blend`, of the splats that are listed and of the large ones."""
    take, away, partly = sides or Sides()
    if large is not None:
        sums = _add(points, large, surface, FALLBACK, splats)
        sums.bind_images(Texture.COLOR_SUMS, Texture.NORMAL_SUMS)
    defines = {
        **{"FILL": 0, "LARGE": int(large is not None), **points.defines},
        **bind_looks(points, surface),
        **bind_local(surface, splats),
    }
    if away and large is None:
        alone = {**defines, "FOUND": 1, "TAKE": 0, "AWAY": 0, "PARTLY": 0}
        run("blend", surface, lists, alone, points, splats, work="rest")
    defines |= {"FOUND": int(take != FIRST), "TAKE": take, "AWAY": int(away), "PARTLY": int(partly)}
    run("blend", surface, lists, defines, points, splats)


def _fill_by_tiles(surface: Surface, lists: TileLists, large: Points | None, splats: Splats) -> None:
    """The nearest of the enlarged splats where the first pass found nothing. large: those not in lists."""
    if large is not None:
        surface.raster().clear()
        surface.gpu.ctx.enable_only(moderngl.DEPTH_TEST)
        surface.gpu.ctx.depth_func = ">"
        _draw_fill(large, FALLBACK, splats)
        surface.raster().bind_images(Texture.LARGE_ROWS, Texture.LARGE_DEPTHS)
    surface.covered.clear()
    surface.covered.bind()
    defines = {"FOUND": 1, "FARTHEST": 0, "FILL": 1, "LARGE": int(large is not None), "AWAY": 0}
    run("show", surface, lists, defines, splats=splats)


@contextmanager
def _sums(points: Points, surface: Surface) -> Iterator[gl.Sums]:
    """Sums of each pixel, bound, and what their fragment stages read; ends blending."""
    gpu = surface.gpu
    sums = surface.cached(_new_sums)
    sums.target.use()
    bind_looks(points, surface)
    surface.rows.bind(Texture.ROWS)
    yield sums
    gpu.ctx.disable(moderngl.BLEND)


def _limit(points: Points, surface: Surface, splats: Splats) -> None:
    """Set the depth buffer to how far behind the visible splat others still count."""
    gpu = surface.gpu
    defines = {**points.defines, "LOCAL": int(splats.layer > 0)}
    program = gpu.program(("present/present.vert", "surfels/passes/limit.frag"), defines, params=splats)
    bind_visible(points, program)
    surface.depths.bind(Texture.DEPTHS)
    gpu.ctx.enable_only(moderngl.DEPTH_TEST)
    gpu.ctx.depth_func = "1"
    with gpu.vertices(program) as triangle:
        triangle.render(moderngl.TRIANGLES, vertices=3)


def _resolve(points: Points, surface: Surface, splats: Splats, over: bool) -> None:
    """Turn sums into the surface's own colours and normals. over: splats were drawn over each other."""
    gpu = surface.gpu
    sums = surface.cached(_new_sums)
    with gpu.timers.measure("resolve"):
        defines = bind_looks(points, surface)
        defines |= {"OVER": int(over), **(bind_local(surface, splats) if not over else {})}
        program = gpu.compute("surfels/passes/resolve.comp", defines, params=splats)
        sums.bind_images(Texture.COLOR_SUMS, Texture.NORMAL_SUMS)
        surface.bind_textures()
        surface.covered.clear()
        surface.covered.bind()
        gpu.dispatch(program, surface.size[0] * surface.size[1])


def _close(points: Points, surface: Surface, splats: Splats) -> None:
    """Take back what the second pass filled beyond the outline, and give the rest a level in place of points;
    `covered` lists what it filled."""
    gpu, filled, points = surface.gpu, surface.covered, replace(points, rows=None)  # which are read by rows

    def run(*steps: int) -> None:
        surface.bind_storage()
        for step in steps:
            program = gpu.compute(
                "surfels/passes/close.comp", {"STEP": step, **points.defines}, params=splats
            )
            points.bind(program)
            bind_visible(points, program)
            filled.run(program)

    with gpu.timers.measure("close"):
        run(0, 1)
    if surface.row_values is not None:
        surface.resolve("value")  # of the splats that fill, as their colours and normals
    with gpu.timers.measure("level"):
        surface.gpu.clear(surface.own("level").buffer, 0)
        surface.bind_own("level")
        run(2)


def _new_blended(gpu: Gpu, size: tuple[int, int]) -> gl.Blended:
    return gl.Blended(gpu.ctx, size)


def _new_sums(gpu: Gpu, size: tuple[int, int]) -> gl.Sums:
    return gl.Sums(gpu.ctx, size)


def bind_looks(points: Points, surface: Surface) -> dict[str, object]:
    """Bind what surfels/passes/look.glsl reads and store.glsl writes; the defines that say so."""
    has_colors = points.pose.has("colors")
    looks_of(points).bind(Texture.LOOKS)
    if has_colors:
        surface.bind_own("color")
    surface.bind_own("normal")
    return {"HAS_COLORS": int(has_colors)}
