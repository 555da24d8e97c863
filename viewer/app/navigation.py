"""How the mouse moves the camera. Plain functions; distances in heights of the view."""

from __future__ import annotations

from ..camera import Camera

_DEGREES_PER_HEIGHT = 180.0  # a drag over the whole height turns from one pole to the other
_ZOOM_PER_HEIGHT = 8.0  # factor
_ZOOM_PER_NOTCH = 1.15  # factor
_NEAREST, _FARTHEST = 1e-5, 1e3  # distances to the target, in radii of the scan


def orbit(camera: Camera, right: float, up: float) -> Camera:
    """The subject turns with the mouse, about the target."""
    return camera.orbited(-right * _DEGREES_PER_HEIGHT, -up * _DEGREES_PER_HEIGHT)


def pan(camera: Camera, right: float, up: float) -> Camera:
    """What is at the target's depth stays under the mouse."""
    return camera.panned(-right, -up)


def zoom(camera: Camera, up: float, radius: float) -> Camera:
    """Dragging up comes nearer. radius: of the scan, scan units; it limits the distance."""
    return camera.zoomed(_limited(camera, _ZOOM_PER_HEIGHT**up, radius))


def wheel(camera: Camera, notches: float, mouse: tuple[float, float], radius: float) -> Camera:
    """Nearer for notches > 0; what is under the mouse at the target's depth stays there.

    mouse: to the right of and above the view's centre. radius: as for `zoom`.
    """
    factor = _limited(camera, _ZOOM_PER_NOTCH**notches, radius)
    kept = 1 - 1 / factor
    return camera.panned(mouse[0] * kept, mouse[1] * kept).zoomed(factor)


def _limited(camera: Camera, factor: float, radius: float) -> float:
    """The part of a zoom that keeps the distance within its limits."""
    low, high = camera.distance / (_FARTHEST * radius), camera.distance / (_NEAREST * radius)
    return min(max(factor, min(low, 1.0)), max(high, 1.0))
