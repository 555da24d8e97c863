"""Scan4D: a viewer and a render core for 4D scans, time series of point clouds."""

from __future__ import annotations

from .imports import explain_missing_packages

TYPE_CHECKING = False  # as `typing` has it, which takes its time to import
if TYPE_CHECKING:
    from typing import Any

    from .analysis.visible_normals import NormalSearch, VisibleNormals, estimate_normals
    from .camera import Camera
    from .errors import Scan4DError
    from .look import Look
    from .picture.surface import Surface
    from .rigid import Rigid
    from .scan.layers import Layers
    from .scan.open import open_scan
    from .scan.points import PointCloud
    from .scan.pose import Pose
    from .scan.range_view import RangeView
    from .scan.winding import winding_number

__version__ = "0.1.0"
__all__ = [
    "Camera", "Layers", "Look", "NormalSearch", "PointCloud", "Pose", "RangeView", "Rigid", "Scan4DError",
    "VisibleNormals", "estimate_normals", "open_scan", "render", "winding_number",
]  # fmt: skip

_HOMES = {
    "Camera": "camera",
    "Layers": "scan.layers",
    "Look": "look",
    "NormalSearch": "analysis.visible_normals",
    "PointCloud": "scan.points",
    "Pose": "scan.pose",
    "RangeView": "scan.range_view",
    "Rigid": "rigid",
    "Scan4DError": "errors",
    "VisibleNormals": "analysis.visible_normals",
    "estimate_normals": "analysis.visible_normals",
    "open_scan": "scan.open",
    "winding_number": "scan.winding",
}


explain_missing_packages()


def __getattr__(name: str) -> object:
    """Import what the package gives when it is first used.

    The command line is in this package; so it can handle an interrupt before anything else is imported.
    """
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    from importlib import import_module

    globals()[name] = found = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    return found


def render(
    pose: Pose | PointCloud,
    camera: Camera | None = None,
    size: tuple[int, int] = (1920, 1280),
    backend: str | None = None,
    look: Look | None = None,
    layers: Layers | None = None,
    **params: Any,
) -> Surface:
    """Draw one pose without a window and return its Surface (`.image()` is the picture).

    camera: None fits the pose from the front. backend: None for the default of the scan. layers: numbers for
    its points, and its motion. params: the backend's parameters. Raises InputError, NoOpenGLError.
    """
    from .drawing import frame

    return frame.render(pose, camera, size, backend, look, params, layers)
