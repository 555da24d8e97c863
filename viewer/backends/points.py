"""Each point as a square of pixels; the nearest wins. The fastest, and exact.

A compute scatter: 32-bit depth first, then the lowest id among those at that depth. Where
there are far fewer points than pixels, the points list the pixels to be shaded.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..gpu import gl
from ..gpu.bindings import Texture
from ..gpu.context import Program
from ..gpu.pose import GpuPose
from ..gpu.scatter import Visits, scatter
from ..gpu.surface import Surface
from ..params import param
from ..scan.points import PointCloud
from ..scan.pose import Pose
from ..scan.spacing import sparse_spacing, typical_spacing
from ..view import View
from . import FrameView, Suited

TITLE = "Points"

# The points can list the pixels that they hit, at a third pass over the points; looking for
# the covered pixels costs about as much as that pass over this share of their number.
_LIST_BELOW = 0.25
# Points are not on a grid, and not everywhere equally dense: squares that cover 1.6 times the
# usual spacing, and 1.25 times that of the sparsest tenth unless it is sparser still, leave
# few gaps.
_USUAL_OVERLAP, _SPARSE_OVERLAP = 1.6, 1.25
_LARGEST = 32  # pixels


@dataclass(frozen=True)
class Params:
    """Parameters of the points backend."""

    point_size: int = param(
        1,
        "Edge of a point's square; 0: as far as the next point",
        low=0,
        high=_LARGEST,
        unit="px",
        sweep=(0, 1, 2, 4),
        basic=True,
    )


def needs(pose: Pose, params: Params) -> tuple[str, ...]:
    """Nothing but positions."""
    return ()


def suits(pose: Pose) -> Suited:
    """Any scan, with squares that touch: nothing has to be there, or estimated."""
    return Suited(0, {"point_size": 0})


def draw(pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
    """Scatter the points; complete where all shall be drawn."""
    return draw_squares(pose, frame, surface, frame.params.point_size)


def draw_squares(
    pose: GpuPose,
    frame: FrameView,
    surface: Surface,
    point_size: int,
    shown: gl.BufferTexture | None = None,
) -> bool:
    """Write the points to the Surface as squares; True if a later call would draw more of them.

    point_size: edge, pixels; 0: as far as the next point. shown: R32UI, a texel a row, 0 where a point is
    left out; None: all are drawn.
    """
    rows, count = surface.take_sample(frame.share)
    size = point_size or _touching(pose, frame.view)
    if rows is not None:
        size = min(round(size * math.sqrt(len(pose.cloud) / count)), _LARGEST)
    sparse = count * size**2 < _LIST_BELOW * surface.size[0] * surface.size[1]

    def bind(_: Program) -> None:
        pose.array("positions").bind(Texture.POSITIONS)
        if rows is not None:
            rows.bind(Texture.DRAWN_ROWS)
        if shown is not None:
            shown.bind(Texture.VISIBLE)

    defines = {"SINGLE": int(size == 1), "SAMPLED": int(rows is not None), "FILTERED": int(shown is not None)}
    visits = Visits("points/cells.glsl", count, bind, defines, Params(point_size=size))
    listed = surface.take_covered() if sparse else None
    scatter(pose.gpu, visits, surface.depths, surface.rows, listed)
    if sparse:
        surface.stats.skipped["compact"] = "few points: they list the pixels themselves"
    return rows is not None


def _touching(pose: GpuPose, view: View) -> int:
    """The size at which squares in the middle of the scan touch their neighbours, pixels."""
    reach = pose.stored.remember(_reach)
    depth = max(float(view.depths(pose.bounds.center - pose.origin)), view.near)
    pixels = reach * view.scale / (depth if view.perspective else 1.0)
    return min(max(math.ceil(pixels), 1), _LARGEST)


def _reach(cloud: PointCloud) -> float:
    """The edge of squares that touch, scan units."""
    return max(_USUAL_OVERLAP * typical_spacing(cloud), _SPARSE_OVERLAP * sparse_spacing(cloud))
