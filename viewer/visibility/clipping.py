"""Clipping: planes that say which points of a picture are looked at at all."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..gpu.blocks import Vec4
from ..view import View
from .calibration import Body

Planes = tuple[Vec4, Vec4, Vec4, Vec4, Vec4]  # near, left, right, top, bottom; points below one are left out
NO_PLANE: Vec4 = (0.0, 0.0, 0.0, 1.0)
EVERYWHERE: Planes = (NO_PLANE,) * 5
_NEAR = 1 / 64  # of the body's radius: a near plane closer to an eye inside it cuts off too little to matter
_MARGIN = 0.125  # of the picture, on each side: points beyond it may hide what is in it


def near_plane(view: View, body: Body) -> Vec4:
    """The near plane where it cuts the body, so that what is not drawn hides nothing."""
    nearest = float(view.depths(body.center - view.origin)) - body.radius
    if view.near <= (nearest if nearest > 0 else _NEAR * body.radius):
        return NO_PLANE
    return _plane(-view.rotation[2], -view.translation[2] - view.near)


def side_planes(view: View, body: Body) -> tuple[Vec4, Vec4, Vec4, Vec4]:
    """The sides of the field of view, with a margin; none where the whole body is within."""
    right, down, ahead = view.rotation[0], -view.rotation[1], -view.rotation[2]
    x, y, depth = view.translation * np.array([1, -1, -1])
    planes = []
    for axis, offset, size, center in zip(
        (right, down), (x, y), view.size, view.center.tolist(), strict=True
    ):
        low, high = center + _MARGIN * size, (1 + _MARGIN) * size - center
        for sign, edge in ((1, low), (-1, high)):
            # Pixels from the middle are scale * across / depth, or scale * across for parallel rays.
            normal = sign * view.scale * axis + (edge * ahead if view.perspective else 0.0)
            planes.append((normal, sign * view.scale * offset + edge * (depth if view.perspective else 1.0)))
    center = body.center - view.origin
    if all(normal @ center + at >= np.linalg.norm(normal) * body.radius for normal, at in planes):
        return EVERYWHERE[1:]
    left, right_side, top, bottom = (_plane(normal, at) for normal, at in planes)
    return left, right_side, top, bottom


def _plane(normal: NDArray[np.float64], offset: float) -> Vec4:
    x, y, z = normal.tolist()
    return x, y, z, float(offset)
