"""The view that a scan is first shown from: that of its pods, where they agree."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..bounds import Bounds
from ..camera import Camera
from ..geometry import Vector, up_vector, vector
from .range_view import RangeView
from .upright import UNKNOWN, Upright, first_elevation

_AGREE = 0.75  # length of the mean of directions that agree: they lie within 41 degrees of it, or so
_UPRIGHT = 0.5  # cosine of how far a pod that stands upright is tilted
_LEAST_SINE = 0.3  # of the angle between what is up and where a camera that is level looks
_WIDEST = 120.0  # field of view, degrees


def first_camera(
    views: Sequence[RangeView], bounds: Bounds, aspect: float, upright: Upright = UNKNOWN
) -> Camera:
    """A camera that sees what the pods see: from the position of a single pod, with its field of view; in the
    mean direction of several, or above heights, as near as shows the bounds whole. Where there is no pod, or
    they look from all around or straight down on ground, it looks from the front, on ground from above.

    aspect: width / height of the picture. upright: the scan's, whose up it keeps unless that is along
    the view axis, or nearly what is up in the picture of one pod alone.
    """
    axes = _mean_axes(views)
    _, pods_up, back = axes
    scan_up, elevation = np.array(up_vector(upright.up)), first_elevation(bounds, upright.up)
    if not _leads(axes, bounds, upright):
        return Camera.orbit(bounds, upright.front, elevation, aspect=aspect, up=upright.up)
    if (pod := _lone_pod(views)) is not None:
        keeps_up = pods_up @ scan_up > _UPRIGHT
        return _camera_of_pod(pod, aspect, vector(pods_up if keeps_up else scan_up))
    is_level = np.linalg.norm(np.cross(scan_up, back)) > _LEAST_SINE
    above = vector(scan_up if is_level else pods_up)
    return Camera(eye=vector(back), target=(0.0, 0.0, 0.0), up=above).fit(bounds, aspect)


def subject_of(
    views: Sequence[RangeView], points: NDArray[np.float64], bounds: Bounds, upright: Upright = UNKNOWN
) -> NDArray[np.float64] | None:
    """The points of what one pod alone looks at, without the background far behind it: those about what is
    in the middle of its picture, as far round as the picture reaches there. None where `first_camera` takes
    no pod's position, or no point is there.

    points: (N, 3) scan units. bounds, upright: as for `first_camera`.
    """
    pod = _lone_pod(views)
    if pod is None or not _leads(_mean_axes(views), bounds, upright):
        return None
    depth = _middle_depth(pod)
    off = np.linalg.norm(points - (pod.eye - depth * pod.world_to_camera[2, :3]), axis=1)
    near = points[off < depth * math.hypot(*_slopes(pod))]
    return near if len(near) else None


def _mean_axes(views: Sequence[RangeView]) -> NDArray[np.float64]:
    """The means of the pods' right, up and backward axes, (3, 3); zeros without a pod."""
    axes: NDArray[np.float64] = np.mean(
        [view.world_to_camera[:3, :3] for view in views] or np.zeros((1, 3, 3)), axis=0
    )
    return axes


def _leads(axes: NDArray[np.float64], bounds: Bounds, upright: Upright) -> bool:
    """Whether pods agree on a direction, and do not look straight down on ground. axes: of `_mean_axes`."""
    is_ground = first_elevation(bounds, upright.up) > 0
    looks_down = is_ground and axes[2] @ np.array(up_vector(upright.up)) > 1 - _LEAST_SINE
    return bool(np.linalg.norm(axes, axis=1).min() >= _AGREE and not looks_down)


def _lone_pod(views: Sequence[RangeView]) -> RangeView | None:
    """The only pod, where it is a camera; None of several, or of a map of heights."""
    return views[0] if len(views) == 1 and views[0].kind != "height" else None


def _slopes(view: RangeView) -> tuple[float, float]:
    """How far a pod's picture reaches up or down, and to a side, at most: in depths."""
    height, width = view.depth.shape
    return max(view.cy, height - view.cy) / view.fy, max(view.cx, width - view.cx) / view.fx


def _middle_depth(view: RangeView) -> float:
    """The depth of what is in the middle of a pod's picture, scan units."""
    height, width = view.depth.shape
    middle = slice(height // 3, height - height // 3), slice(width // 3, width - width // 3)
    valid = view.valid()
    inside = view.depth[middle][valid[middle]]
    return float(np.median(inside if len(inside) else view.depth[valid]))


def _camera_of_pod(view: RangeView, aspect: float, above: Vector) -> Camera:
    """The camera at a pod, which turns about what is in the middle of the pod's picture."""
    tall, wide = _slopes(view)
    return Camera(
        eye=vector(view.eye),
        target=vector(view.eye - _middle_depth(view) * view.world_to_camera[2, :3]),
        up=above,
        fov_y=min(2 * math.degrees(math.atan(max(tall, wide / aspect))), _WIDEST),
    )
