"""Splats: what the shaders of surfels are told of them, once a picture."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..gpu.context import Program
from .amplify import Points, Shape

SURFEL = Shape("surfels/surfel.glsl", corners=4)
FRAGMENT = "surfels/splat.frag"


@dataclass(frozen=True)
class Splats:
    """How points become splats.

    radius_scale: factor on radii. uniform_radius: scan units, of points without one of their own.
    least_radius: pixels; what the mask leaves of it reaches a pixel centre. cull_back: whether those that
    face away are left out. mask_limit: squared distance from the centre, in radii, at which the mask is cut
    off. falloff: of the mask exp(-falloff t), t the squared distance, 1 where it is cut off; at most 4.

    For blending: enlarge: factor on the splats of the second pass. epsilon: how far behind the visible splat
    others still count, in its radii. layer: how far behind the nearest splat others of its layer lie, along
    its normal, scan units; 0: the picture shows the depth of the nearest. mean_share: of the mean, where
    splats of about a pixel are averaged; the rest is the visible one's.
    """

    radius_scale: float
    uniform_radius: float
    least_radius: float
    cull_back: bool
    mask_limit: float
    falloff: float
    enlarge: float
    epsilon: float
    mean_share: float = 0.0
    layer: float = 0.0

    def larger(self, points: Points) -> Points:
        """The points as the second pass draws them."""
        return replace(points, enlarged=points.enlarged * self.enlarge)


def bind_visible(points: Points, program: Program) -> None:
    """Bind what surfels/passes/limit.glsl reads of the points that were drawn first."""
    points.pose.gpu.set(program, enlarged=points.enlarged)
    points.bind_radii()
