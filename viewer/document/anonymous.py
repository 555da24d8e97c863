"""Anonymous pictures: a scan drawn without what tells whose it is, where and when; see docs/guide/privacy.md.

The scan itself is changed before it is drawn, not what comes of it: whatever is made of such a picture
(its text, its channels, the marks on it) has nothing to tell.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..drawing.request import Request
from ..geometry import up_vector
from ..look import Look, drawable, unnamed, value_source
from ..scan.points import UNKNOWN_UNIT, PointCloud
from ..scan.pose import Pose
from ..scan.range_points import RangePoints
from ..scan.range_view import RangeView
from ..scan.times import frame_in_words
from ..scan.units import is_length

_STEPS = 256  # of the grid that the middle is on, at least, in the extent of a pose
_DECIMALS = 6  # of seconds


def anonymous_request(request: Request, start: float) -> Request:
    """Request for the same picture of a pose that stands about the origin of its coordinates.

    Times count from the scan's first frame, which is at `start` seconds, heights from the middle of the
    pose, and a scalar of the scan has its number for a name.
    """
    pose = request.pose
    middle = middle_of(pose) if pose.count else np.array(request.camera.target)
    look, names = request.look, request.layers.names(pose.overview.scalars)
    if look.color_by not in request.layers.scalars:  # what Scan4D computes has names of its own
        look = unnamed(look, names)
    look = raised(look, -middle)
    layers = replace(request.layers, world_from_pose=request.layers.world_from_pose.in_frame(middle))
    anonymous, camera = anonymous_pose(pose, start), request.camera.moved(-middle)
    return replace(request, pose=anonymous, camera=camera, look=look, layers=layers)


@lru_cache(maxsize=1)  # several pictures of one pose share what is uploaded of it
def anonymous_pose(pose: Pose, start: float) -> Pose:
    """The pose with its middle at zero, seconds counted from `start`, and without names."""
    return _moved(pose, middle_of(pose) if pose.count else pose.origin, start)


def _moved(pose: Pose, middle: NDArray[np.float64], start: float) -> Pose:
    views = tuple(_anonymous_view(view, middle, number) for number, view in enumerate(pose.views))
    if isinstance(pose.points, PointCloud):
        points: PointCloud | RangePoints = pose.points.moved(-middle)
    else:
        points = pose.points.moved(views, -middle)
    time = round(pose.time - start, _DECIMALS)  # no rest of a large number tells that it was one
    average = pose.average and replace(pose.average, raw=_moved(pose.raw, middle, start))
    return Pose(pose.index, time, frame_in_words(pose.index), points, average)


def middle_of(pose: Pose) -> NDArray[np.float64]:
    """The middle of its robust bounds, (3,), on a power-of-two grid: taking it off rounds nothing, as a rule.

    The origin of the cloud would not do: it is zero where the scan is no farther from it than it is wide.
    """
    bounds = pose.bounds
    extent = float((bounds.high - bounds.low).max())
    if extent <= np.finfo(np.float64).eps * np.abs(bounds.center).max():
        return bounds.center
    grid = 2.0 ** np.floor(np.log2(extent / _STEPS))
    return np.round(bounds.center / grid) * grid


def anonymous_unit(unit: str) -> str:
    """The unit of length where it is a common one: others may tell anything."""
    return unit if is_length(unit) else UNKNOWN_UNIT


def in_scan_coordinates(camera: Camera, look: Look, pose: Pose) -> tuple[Camera, Look]:
    """Camera and look of an anonymous picture, for the pose as the scan has it."""
    middle = middle_of(pose)
    scalar = value_source(drawable(look, pose.overview.scalars), pose.overview.scalars)
    return camera.moved(middle), raised(replace(look, color_by=scalar or look.color_by), middle)


def raised(look: Look, by: NDArray[np.float64]) -> Look:
    """The look of a scan that is moved: where it colours by height, its range moves too.

    by: (3,) scan units.
    """
    if look.color_by != "height":
        return look
    height = float(by @ up_vector(look.up))
    low, high = (None if end is None else end + height for end in (look.low, look.high))
    return replace(look, low=low, high=high)


def _anonymous_view(view: RangeView, middle: NDArray[np.float64], number: int) -> RangeView:
    to_camera = view.world_to_camera.copy()
    to_camera[:3, 3] += to_camera[:3, :3] @ middle
    unit = anonymous_unit(view.unit)
    return replace(view, world_to_camera=to_camera, name=f"pod {number}", unit=unit)
