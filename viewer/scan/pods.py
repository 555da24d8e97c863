"""The view that a scan is first shown from: that of its pods, where they agree."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..bounds import Bounds
from ..camera import Camera
from ..geometry import Vector, up_vector, vector
from .range_view import RangeView
from .upright import UNTOLD, Upright, first_elevation

_AGREE = 0.75  # length of the mean of directions that agree: they lie within 41 degrees of it, or so
_UPRIGHT = 0.5  # cosine of how far a pod that stands upright is tilted
_LEAST_SINE = 0.3  # of the angle between what is up and where a camera that is level looks
_WIDEST = 120.0  # field of view, degrees


def first_camera(
    views: Sequence[RangeView], bounds: Bounds, aspect: float, upright: Upright = UNTOLD
) -> Camera:
    """A camera that sees what the pods see: from the place of one alone, with its field of view; in the mean
    direction of several, or above heights, as near as shows the bounds whole. Where there is no pod, or they
    look from all around or straight down on ground, it looks from the front, on ground from above.

    aspect: width / height of the picture. upright: the scan's, whose up is kept to unless it is along
    the view axis, or nearly what is up in the picture of one pod alone.
    """
    axes = np.mean([view.world_to_camera[:3, :3] for view in views] or np.zeros((1, 3, 3)), axis=0)
    _, pods_up, back = axes
    scan_up, elevation = np.array(up_vector(upright.up)), first_elevation(bounds, upright.up)
    looks_down = elevation > 0 and back @ scan_up > 1 - _LEAST_SINE
    if np.linalg.norm(axes, axis=1).min() < _AGREE or looks_down:
        return Camera.orbit(bounds, upright.front, elevation, aspect=aspect, up=upright.up)
    if len(views) == 1 and views[0].kind != "height":
        keeps_up = pods_up @ scan_up > _UPRIGHT
        return _camera_of_pod(views[0], aspect, vector(pods_up if keeps_up else scan_up))
    is_level = np.linalg.norm(np.cross(scan_up, back)) > _LEAST_SINE
    above = vector(scan_up if is_level else pods_up)
    return Camera(eye=vector(back), target=(0.0, 0.0, 0.0), up=above).fit(bounds, aspect)


def _camera_of_pod(view: RangeView, aspect: float, above: Vector) -> Camera:
    """The camera at a pod, which turns about what is in the middle of the pod's picture."""
    height, width = view.depth.shape
    tall, wide = max(view.cy, height - view.cy) / view.fy, max(view.cx, width - view.cx) / view.fx
    middle = slice(height // 3, height - height // 3), slice(width // 3, width - width // 3)
    valid = view.valid()
    inside = view.depth[middle][valid[middle]]
    depth = float(np.median(inside if len(inside) else view.depth[valid]))
    return Camera(
        eye=vector(view.eye),
        target=vector(view.eye - depth * view.world_to_camera[2, :3]),
        up=above,
        fov_y=min(2 * math.degrees(math.atan(max(tall, wide / aspect))), _WIDEST),
    )
