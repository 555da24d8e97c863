"""Squares: points as squares of pixels; the nearest wins.

A compute scatter: 32-bit depth first, then the lowest id among those at that depth. Where
there are far fewer points than pixels, the points list the pixels to be shaded.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..scan.points import PointCloud
from ..scan.spacing import sparse_spacing, typical_spacing
from ..view import View
from . import gl
from .bindings import Texture
from .compact import IndexList
from .context import Program
from .culling import CulledChunks, culled_chunks
from .pose import GpuPose
from .scatter import HitCells, Visits, scatter, take_items, take_keys
from .surface import Surface

# Points can list the pixels that they hit, in slots that each has; below this share of the pixels that takes
# less than clearing all of them and looking for those that are covered.
_LIST_BELOW = 0.25
# Points are not on a grid, and not everywhere equally dense: squares that cover 1.6 times the
# usual spacing, and 1.25 times that of the sparsest tenth unless it is sparser still, leave
# few gaps.
_USUAL_OVERLAP, _SPARSE_OVERLAP = 1.6, 1.25
LARGEST_SQUARE = 32  # pixels


@dataclass(frozen=True)
class _Squares:
    """Numbers that points/cells.glsl reads. point_size: edge, pixels. point_count: of all."""

    point_size: int
    point_count: int


def draw_squares(
    pose: GpuPose,
    surface: Surface,
    point_size: int,
    share: float = 1.0,
    shown: gl.BufferTexture | None = None,
    stays: bool = False,
) -> bool:
    """Write the points to the Surface as squares; True if a later call would draw more of them.

    point_size: edge, pixels; 0: as far as the next point. share: of the points that are drawn. shown: R32UI,
    a texel a row, 0 where a point is left out; None: none is. stays: whether the picture before was of this
    pose, so that what that one showed is of use.
    """
    size = point_size or _touching(pose, surface.view)
    few = _LIST_BELOW * surface.size[0] * surface.size[1] / size**2
    chunks = culled_chunks(pose) if stays and share >= 1 and len(pose.cloud) > few else None
    if chunks is not None:
        _draw_chunks(pose, surface, size, shown, chunks, few)
        return False
    rows, count = surface.take_sample(share, margin=LARGEST_SQUARE / 2)
    if surface.stats.share < 1:
        enlarged = 1 / math.sqrt(surface.stats.share)
        larger = round(point_size * enlarged) or _touching(pose, surface.view, enlarged)
        size = min(larger, LARGEST_SQUARE)

    def bind(_: Program) -> None:
        pose.array("positions").bind(Texture.POSITIONS)
        if rows is not None:
            rows.bind(Texture.DRAWN_ROWS)
        if shown is not None:
            shown.bind(Texture.VISIBLE)

    visits = Visits("points/cells.glsl", count, bind, _defines(size, shown, rows), _Squares(size, count))
    if count < few:
        _draw_listed(surface, visits, size)
    else:
        scatter(pose.gpu, visits, surface.depths, surface.rows)
    return surface.stats.is_sample


def _draw_listed(surface: Surface, visits: Visits, size: int) -> None:
    """Write points that are far fewer than pixels."""
    hits = HitCells(surface.start_listed(), size**2)
    scatter(surface.gpu, visits, surface.depths, surface.rows, hits)
    surface.stats.skipped["pixels"] = "few points: they list the pixels that are cleared and shaded"


def _draw_chunks(
    pose: GpuPose,
    surface: Surface,
    size: int,
    shown: gl.BufferTexture | None,
    chunks: CulledChunks,
    few: float,
) -> None:
    """Write the points of the chunks alone that the picture may show. few: points, fewer than which list
    their pixels."""

    def bind(_: Program) -> None:
        chunks.bind(pose)
        if shown is not None:
            shown.bind(Texture.VISIBLE)

    defines = {**_defines(size, shown), **chunks.defines}
    given = _Squares(size, chunks.count)

    def visits(listed: IndexList, count: int = chunks.count) -> Visits:
        return Visits("points/cells.glsl", count, bind, defines, given, listed)

    margin = size / 2
    if found := chunks.few(pose, surface.view, margin, few):
        _draw_listed(surface, visits(*found), size)
        surface.stats.skipped["points"] = (
            f"{chunks.count - found[1]:,} of {chunks.count:,} are in chunks out of view"
        )
        return
    surface.clear()
    take_keys(pose.gpu, visits(chunks.start(surface, margin)), surface.depths)
    take_keys(pose.gpu, visits(chunks.late(surface)), surface.depths)
    take_items(pose.gpu, visits(chunks.shown(surface)), surface.depths, surface.rows)


def _defines(
    size: int, shown: gl.BufferTexture | None, rows: gl.BufferTexture | None = None
) -> dict[str, object]:
    given = {
        "SINGLE": size == 1,
        "SAMPLED": rows is not None,
        "FILTERED": shown is not None,
        "CHUNKED": False,
    }
    return {name: int(value) for name, value in given.items()}


def _touching(pose: GpuPose, view: View, enlarged: float = 1.0) -> int:
    """The size at which squares in the middle of the scan touch their neighbours, pixels. enlarged: how many
    times as far apart these are as all points."""
    reach = enlarged * pose.stored.remember(_reach)
    depth = max(float(view.depths(pose.bounds.center - pose.origin)), view.near)
    pixels = reach * view.scale / (depth if view.perspective else 1.0)
    return min(max(math.ceil(pixels), 1), LARGEST_SQUARE)


def _reach(cloud: PointCloud) -> float:
    """The edge of squares that touch, scan units."""
    return max(_USUAL_OVERLAP * typical_spacing(cloud), _SPARSE_OVERLAP * sparse_spacing(cloud))
