"""The view as shaders see it: `#include <view>`, through common/view.glsl."""

from __future__ import annotations

from dataclasses import dataclass

from ..view import View
from .blocks import Mat4, Vec4


@dataclass(frozen=True)
class ViewBlock:
    """The camera in float32, from positions relative to the view's origin.

    world_to_view: columns. view_scale: pixels per unit of x / depth, or of x (orthographic). view_near,
    view_far: scan units along the view axis, infinite where nothing was said. view_reach: what an
    orthographic depth buffer ends at. view_size: pixels. view_center: pixel coordinates of
    the line of sight. view_base: how far from the eye depths begin.
    """

    world_to_view: Mat4
    view_scale: float
    view_near: float
    view_far: float
    view_reach: float
    view_size: tuple[int, int]
    view_center: tuple[float, float]
    view_perspective: bool
    view_base: float

    @classmethod
    def of(cls, view: View) -> ViewBlock:
        """The block of a view."""
        x, y, z = view.rotation.T.tolist()
        return cls(
            world_to_view=(
                _column(x, 0),
                _column(y, 0),
                _column(z, 0),
                _column(view.translation.tolist(), 1),
            ),
            view_scale=view.scale,
            view_near=view.near,
            view_far=view.far,
            view_reach=view.reach,
            view_size=view.size,
            view_center=(float(view.center[0]), float(view.center[1])),
            view_perspective=view.perspective,
            view_base=view.base,
        )


def _column(xyz: list[float], w: float) -> Vec4:
    return xyz[0], xyz[1], xyz[2], w
