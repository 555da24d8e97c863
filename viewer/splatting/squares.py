"""Squares: points as squares of pixels; the nearest wins.

A compute scatter: 32-bit depth first, then the lowest id among those at that depth. Where
there are far fewer points than pixels, the points list the pixels to be shaded.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..gpu import gl
from ..gpu.bindings import Texture
from ..gpu.compact import IndexList
from ..gpu.context import Program
from ..gpu.pose import GpuPose
from ..gpu.scatter import HitCells, Visits, scatter
from ..picture.frame_view import Before
from ..picture.surface import Surface
from ..scan.points import PointCloud
from ..scan.spacing import sparse_spacing, typical_spacing
from ..view import View
from .culling import CulledChunks, culled_chunks, is_centered
from .kept import ClosedGaps, KeptPoints, stride_of

# Points can list the pixels that they hit, in slots that each has; below this share of the pixels that takes
# less than clearing all of them and looking for those that are covered.
_LIST_BELOW = 0.25
# Points are not on a grid, and not everywhere equally dense: squares that cover 1.6 times the
# usual spacing, and 1.25 times that of the sparsest tenth unless it is sparser still, leave
# few gaps.
_USUAL_OVERLAP, _SPARSE_OVERLAP = 1.6, 1.25
LARGEST_SQUARE = 32  # pixels
_STEP = 4.0  # squares that touch, by which depths of a closed surface differ at most between pixels


@dataclass(frozen=True)
class _Squares:
    """Numbers that points/cells.glsl reads. point_size: edge, pixels. point_count: of all. stride, turn: of
    how many rows in a run one is drawn, and which. first: row of the first point, where these are a part."""

    point_size: int
    point_count: int
    stride: int = 1
    turn: int = 0
    first: int = 0


def draw_squares(
    pose: GpuPose,
    surface: Surface,
    point_size: int,
    share: float = 1.0,
    shown: gl.BufferTexture | None = None,
    stays: bool = False,
    before: Before | None = None,
) -> bool:
    """Write the points to the Surface as squares; True if a later call would draw more of them.

    point_size: edge, pixels; 0: as far as the next point. share: of the points that are drawn. shown: R32UI,
    a texel a row, 0 where a point is left out; None: none is. stays: whether the picture before was of this
    pose, so that what that one showed is of use. before: a picture of it whose points are drawn again where
    not all are drawn, and none is left out.
    """
    size = point_size or math.ceil(_touching(pose, surface.view))
    if pose.is_split:
        return _draw_parts(pose, surface, size, share)
    few = _few(surface, size)
    chunks = culled_chunks(pose) if stays and share >= 1 and len(pose.cloud) > few else None
    if chunks is not None:
        _draw_chunks(pose, surface, size, shown, chunks, few)
        return False
    if before is not None and shown is None and share < 1:
        _draw_kept(pose, surface, size, share, before)
        return True
    by_chunks = share >= 1 and is_centered(pose)  # from the second picture on, on the GPU
    rows, count = surface.take_sample(share, margin=None if by_chunks else LARGEST_SQUARE / 2)
    surface.stats.known = surface.stats.share
    if surface.stats.share < 1:
        size = _enlarged(size, pose, surface)

    def bind(_: Program) -> None:
        pose.array("positions").bind(Texture.POSITIONS)
        if rows is not None:
            rows.bind(Texture.DRAWN_ROWS)
        if shown is not None:
            shown.bind(Texture.VISIBLE)

    visits = Visits("points/cells.glsl", count, bind, _defines(size, shown, rows), _Squares(size, count))
    if count < _few(surface, size):
        _draw_listed(surface, visits, size)
    else:
        with surface.keeping_nearest() as nearest:
            nearest.take(visits)
    return surface.stats.is_sample


def _draw_parts(pose: GpuPose, surface: Surface, size: int, share: float) -> bool:
    """Write the points of a pose that has its arrays in parts: all, or one of some in a run."""
    stats, stride = surface.stats, 1
    if share < 1:
        stride = stride_of(share)
        stats.share = stats.known = share
        stats.left_out = pose.count - sum(-(-part.pose.count // stride) for part in pose.parts)
        size = _enlarged(size, pose, surface)
    defines = {**_defines(size, None), "STRIDED": int(stride > 1), "PART": 1}
    with surface.keeping_nearest() as nearest:
        for part in pose.parts:
            given = _Squares(size, part.pose.count, stride, first=part.first)
            count = -(-part.pose.count // stride)
            nearest.take(
                Visits("points/cells.glsl", count, partial(_bind_positions, part.pose), defines, given)
            )
    surface.resolve_shaded()
    return stats.is_sample


def _bind_positions(pose: GpuPose, _: Program) -> None:
    pose.array("positions").bind(Texture.POSITIONS)


def _few(surface: Surface, size: int) -> float:
    """Points of squares of this size, fewer than which list the pixels that they hit."""
    return _LIST_BELOW * surface.size[0] * surface.size[1] / size**2


def _draw_listed(surface: Surface, visits: Visits, size: int) -> None:
    """Write points that are far fewer than pixels."""
    hits = HitCells(surface.start_listed(surface.look.background), size**2)
    scatter(surface.gpu, visits, surface.depths, surface.rows, hits)
    surface.stats.skipped["pixels"] = (
        "Scan4D clears and shades only the pixels of the points, because there are few points"
    )


def _draw_kept(pose: GpuPose, surface: Surface, size: int, share: float, before: Before) -> None:
    """Write the points that a picture before showed, and the share of all whose turn it is."""
    kept, stride, count = pose.cached(KeptPoints), stride_of(share), len(pose.cloud)
    listed, turn, turns = kept.list_shown(before.target), kept.next_turn(), -(-count // stride)
    stats = surface.stats
    stats.share, stats.left_out = 1 / stride, count - turns
    stats.known = min(before.known + stats.share, 1.0)
    numbers = _Squares(_enlarged(size, pose, surface), count, stride, turn)

    def bind(_: Program) -> None:
        pose.array("positions").bind(Texture.POSITIONS)

    defines = _defines(numbers.point_size, None)
    both = (
        Visits("points/cells.glsl", count, bind, {**defines, "KEPT": 1}, numbers, listed),
        Visits("points/cells.glsl", turns, bind, {**defines, "STRIDED": 1}, numbers),
    )
    with surface.keeping_nearest() as nearest:
        for visits in both:
            nearest.take(visits)
    if _touching(pose, surface.view) <= size:
        surface.cached(ClosedGaps).close(surface, _STEP * pose.stored.remember(_reach))


def _enlarged(size: int, pose: GpuPose, surface: Surface) -> int:
    """The size of squares where some of the points stand for all, pixels: as much larger as they are sparser,
    and no more than it takes to reach as far as the next one."""
    sparser = 1 / math.sqrt(surface.stats.known)
    touching = math.ceil(_touching(pose, surface.view) * sparser)
    return min(max(size, min(round(size * sparser), touching)), LARGEST_SQUARE)


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
    if found := chunks.few(surface, margin, few):
        _draw_listed(surface, visits(*found), size)
        left_out = max(chunks.count - found[1], 0)
        surface.stats.skipped["points"] = f"{left_out:,} of {chunks.count:,} points are in groups out of view"
        return
    if not chunks.looks_for_hidden(surface):
        with surface.keeping_nearest() as nearest:
            nearest.take(visits(chunks.in_view(surface, margin)))
        return
    with surface.keeping_nearest(lambda: visits(chunks.shown(surface))) as nearest:
        nearest.take(visits(chunks.start(surface, margin)))
        nearest.show_keys()
        nearest.take(visits(chunks.late(surface)))
    chunks.note_counts(surface)


def _defines(
    size: int, shown: gl.BufferTexture | None, rows: gl.BufferTexture | None = None
) -> dict[str, object]:
    given = {
        "SINGLE": size == 1,
        "SAMPLED": rows is not None,
        "FILTERED": shown is not None,
        "CHUNKED": False,
        "KEPT": False,
        "STRIDED": False,
        "PART": False,
    }
    return {name: int(value) for name, value in given.items()}


def foresee_squares(cloud: PointCloud) -> None:
    """Find what the size of squares that touch goes by (`Backend.foresee`)."""
    cloud.remember(_reach)


def _touching(pose: GpuPose, view: View) -> float:
    """The size at which squares in the middle of the scan touch their neighbours, pixels, at most that of the
    largest ones."""
    reach = pose.stored.remember(_reach)
    depth = max(float(view.depths(pose.bounds.center - pose.origin)), view.near)
    pixels = reach * view.scale / (depth if view.perspective else 1.0)
    return min(max(pixels, np.finfo(float).tiny), LARGEST_SQUARE)


def _reach(cloud: PointCloud) -> float:
    """The edge of squares that touch, scan units."""
    return max(_USUAL_OVERLAP * typical_spacing(cloud), _SPARSE_OVERLAP * sparse_spacing(cloud))
