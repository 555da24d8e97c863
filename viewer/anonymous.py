"""Anonymous pictures: a scan drawn without what tells whose it is, where and when; see docs/privacy.md.

The scan itself is changed before it is drawn, not what comes of it: whatever is made of such a picture
(its text, its channels, the marks on it) has nothing to tell.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .frame import Request
from .geometry import up_vector
from .look import Look, unnamed
from .scan.points import UNKNOWN_UNIT
from .scan.pose import Pose
from .scan.range_view import RangeView
from .scan.units import is_length


def anonymous_request(request: Request, start: float) -> Request:
    """The same picture of a pose that stands at the origin of its coordinates.

    Times count from the scan's first frame, which is at `start` seconds, heights from the origin of the
    pose, and a scalar is told by its number.
    """
    pose = request.pose
    origin = pose.cloud.origin
    look = raised(unnamed(request.look, pose.cloud), -origin)
    return replace(request, pose=anonymous_pose(pose, start), camera=request.camera.moved(-origin), look=look)


@lru_cache(maxsize=1)  # several pictures of one pose share what is uploaded of it
def anonymous_pose(pose: Pose, start: float) -> Pose:
    """The pose with its origin at zero, seconds counted from `start`, and without names."""
    views = tuple(_anonymous_view(view, pose.cloud.origin, n) for n, view in enumerate(pose.views))
    cloud = replace(pose.cloud, origin=np.zeros(3))
    return Pose(pose.index, pose.time - start, f"frame {pose.index}", cloud, views)


def anonymous_unit(unit: str) -> str:
    """The unit of length where it is a common one: others may tell anything."""
    return unit if is_length(unit) else UNKNOWN_UNIT


def raised(look: Look, by: NDArray[np.float64]) -> Look:
    """The look of a scan that is moved: where it colours by height, its range moves too.

    by: (3,) scan units.
    """
    if look.color_by != "height":
        return look
    height = float(by @ up_vector(look.up))
    low, high = (None if end is None else end + height for end in (look.low, look.high))
    return replace(look, low=low, high=high)


def _anonymous_view(view: RangeView, origin: NDArray[np.float64], number: int) -> RangeView:
    to_camera = view.world_to_camera.copy()
    to_camera[:3, 3] += to_camera[:3, :3] @ origin
    unit = anonymous_unit(view.unit)
    return replace(view, world_to_camera=to_camera, name=f"pod {number}", unit=unit)
