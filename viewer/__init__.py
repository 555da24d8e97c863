"""Scan4D: a viewer and a render core for 4D scans, time series of point clouds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .camera import Camera
from .errors import Scan4DError
from .look import Look
from .scan.open import open_scan
from .scan.points import PointCloud
from .scan.pose import Pose
from .scan.range_view import RangeView

if TYPE_CHECKING:
    from .gpu.surface import Surface

__version__ = "0.1.0"
__all__ = ["Camera", "Look", "PointCloud", "Pose", "RangeView", "Scan4DError", "open_scan", "render"]


def render(
    pose: Pose | PointCloud,
    camera: Camera | None = None,
    size: tuple[int, int] = (1920, 1280),
    backend: str | None = None,
    look: Look | None = None,
    **params: Any,
) -> Surface:
    """Draw one pose without a window and return its Surface (`.image()` is the picture).

    camera: None fits the pose from the front. backend: None for the default of the scan.
    params: the backend's parameters. Raises InputError, NoOpenGLError.
    """
    from . import frame

    return frame.render(pose, camera, size, backend, look, params)
