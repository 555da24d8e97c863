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
from .context import Program
from .pose import GpuPose
from .scatter import Visits, list_hits, scatter
from .surface import Surface

# The points can list the pixels that they hit, at a third pass over the points; looking for
# the covered pixels costs about as much as that pass over this share of their number.
_LIST_BELOW = 0.25
# Points are not on a grid, and not everywhere equally dense: squares that cover 1.6 times the
# usual spacing, and 1.25 times that of the sparsest tenth unless it is sparser still, leave
# few gaps.
_USUAL_OVERLAP, _SPARSE_OVERLAP = 1.6, 1.25
LARGEST_SQUARE = 32  # pixels


@dataclass(frozen=True)
class _Squares:
    """Numbers that points/cells.glsl reads. point_size: edge, pixels."""

    point_size: int


def draw_squares(
    pose: GpuPose,
    surface: Surface,
    point_size: int,
    share: float = 1.0,
    shown: gl.BufferTexture | None = None,
) -> bool:
    """Write the points to the Surface as squares; True if a later call would draw more of them.

    point_size: edge, pixels; 0: as far as the next point. share: of the points that are drawn. shown: R32UI,
    a texel a row, 0 where a point is left out; None: none is.
    """
    size = point_size or _touching(pose, surface.view)
    rows, count = surface.take_sample(share, margin=LARGEST_SQUARE / 2)
    is_sample = surface.stats.share < 1
    if is_sample:
        size = min(round(size / math.sqrt(surface.stats.share)), LARGEST_SQUARE)
    sparse = count * size**2 < _LIST_BELOW * surface.size[0] * surface.size[1]

    def bind(_: Program) -> None:
        pose.array("positions").bind(Texture.POSITIONS)
        if rows is not None:
            rows.bind(Texture.DRAWN_ROWS)
        if shown is not None:
            shown.bind(Texture.VISIBLE)

    defines = {"SINGLE": int(size == 1), "SAMPLED": int(rows is not None), "FILTERED": int(shown is not None)}
    visits = Visits("points/cells.glsl", count, bind, defines, _Squares(size))
    if sparse:
        listed = surface.start_listed()
        scatter(pose.gpu, visits, surface.depths, surface.rows, cleared=True)
        list_hits(pose.gpu, visits, surface.depths, surface.rows, listed, size**2)
        surface.stats.skipped["pixels"] = "few points: they list the pixels that are cleared and shaded"
    else:
        scatter(pose.gpu, visits, surface.depths, surface.rows)
    return is_sample


def _touching(pose: GpuPose, view: View) -> int:
    """The size at which squares in the middle of the scan touch their neighbours, pixels."""
    reach = pose.stored.remember(_reach)
    depth = max(float(view.depths(pose.bounds.center - pose.origin)), view.near)
    pixels = reach * view.scale / (depth if view.perspective else 1.0)
    return min(max(math.ceil(pixels), 1), LARGEST_SQUARE)


def _reach(cloud: PointCloud) -> float:
    """The edge of squares that touch, scan units."""
    return max(_USUAL_OVERLAP * typical_spacing(cloud), _SPARSE_OVERLAP * sparse_spacing(cloud))
