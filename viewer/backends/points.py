"""Each point as a square of pixels; the nearest wins. The fastest, and exact.

A compute scatter: 32-bit depth first, then the lowest id among those at that depth. Where
there are far fewer points than pixels, the points list the pixels to be shaded.
"""

from __future__ import annotations

from dataclasses import dataclass

import moderngl

from ..gpu.pose import GpuPose
from ..gpu.scatter import scatter
from ..gpu.surface import Surface
from ..params import param
from ..scan.points import PointCloud
from . import FrameView

TITLE = "Points"

# The points can list the pixels that they hit, at a third pass over the points; looking for
# the covered pixels costs about as much as that pass over this share of their number.
_LIST_BELOW = 0.25


@dataclass(frozen=True)
class Params:
    """Parameters of the points backend."""

    size: int = param(1, "Edge of a point's square, pixels", low=1, high=32, sweep=(1, 2, 4))


def needs(cloud: PointCloud, params: Params) -> tuple[str, ...]:
    """Nothing but positions."""
    return ()


def draw(pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
    """Scatter the points; always complete."""
    params: Params = frame.params
    count, pixels = len(pose.cloud), surface.size[0] * surface.size[1]
    sparse = count * params.size**2 < _LIST_BELOW * pixels

    def bind(program: moderngl.ComputeShader) -> None:
        pose.array("positions").bind(2)
        pose.gpu.set(program, point_size=params.size)

    scatter(
        pose.gpu,
        "points/cells.glsl",
        count,
        surface.depths,
        surface.rows,
        bind,
        defines={"POINT_SIZE": 1 if params.size == 1 else 0},
        listed=surface.take_covered() if sparse else None,
    )
    if sparse:
        surface.stats.skipped["compact"] = "few points: they list the pixels themselves"
    return False
