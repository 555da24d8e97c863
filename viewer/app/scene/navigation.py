"""How the mouse, and keys, move the camera. Plain functions; distances in heights of the view."""

from __future__ import annotations

from ...bounds import Bounds
from ...camera import Camera
from ...geometry import Vector

# (azimuth, elevation) in degrees; left and right are the subject's. Just short of the poles,
# a hundredth of a pixel, so that the scan's up axis stays the one that orbiting turns about.
POLE = 89.999
VIEWS = {
    "front": (0.0, 0.0),
    "back": (180.0, 0.0),
    "left": (90.0, 0.0),
    "right": (-90.0, 0.0),
    "top": (0.0, POLE),
    "bottom": (0.0, -POLE),
}

_DEGREES_PER_HEIGHT = 180.0  # a drag over the whole height turns from one pole to the other
_ZOOM_PER_HEIGHT = 8.0  # factor
_ZOOM_PER_NOTCH = 1.15  # factor
_NEAREST, _FARTHEST = 1e-5, 1e3  # distances to the target, in radii of the scan


def view_from(
    azimuth: float, elevation: float, camera: Camera, bounds: Bounds, aspect: float, up: str
) -> Camera:
    """All of the bounds seen from a direction, in the camera's projection.

    azimuth, elevation: degrees, such as those of `VIEWS`. aspect: width / height of the view. up: the scan's.
    """
    return Camera.orbit(
        bounds, azimuth, elevation, aspect=aspect, up=up, fov_y=camera.fov_y, projection=camera.projection
    )


def shows(camera: Camera, bounds: Bounds, aspect: float) -> bool:
    """Whether a camera shows something of the bounds, at a distance that navigating allows.

    aspect: width / height of the view.
    """
    radius = bounds.radius or 1.0
    if not _NEAREST * radius <= camera.distance <= _FARTHEST * radius:
        return False
    right, up, back = camera.rotation() @ (bounds.center - camera.eye)
    half = camera.view_height / 2
    if camera.projection == "perspective":
        half *= (max(-back, 0.0) + radius) / camera.distance
    return bool(back < radius and abs(up) < half + radius and abs(right) < half * aspect + radius)


def drag(
    gesture: str, camera: Camera, right: float, up: float, radius: float, pivot: Vector | None = None
) -> Camera:
    """Move as a drag does. gesture: "orbit", "pan" or "zoom". pivot, radius: as for `orbit` and `zoom`."""
    if gesture == "zoom":
        return zoom(camera, up, radius)
    return pan(camera, right, up) if gesture == "pan" else orbit(camera, right, up, pivot)


def orbit(camera: Camera, right: float, up: float, pivot: Vector | None = None) -> Camera:
    """The subject turns with the mouse, about the pivot, which stays where it is; None: the target."""
    return camera.orbited(-right * _DEGREES_PER_HEIGHT, -up * _DEGREES_PER_HEIGHT, pivot)


def pan(camera: Camera, right: float, up: float) -> Camera:
    """Move sideways, so that what is at the target's depth stays under the mouse."""
    return camera.panned(-right, -up)


def zoom(camera: Camera, up: float, radius: float) -> Camera:
    """Dragging up comes nearer. radius: of the scan, scan units; it limits the distance."""
    return camera.zoomed(_limited(camera, _ZOOM_PER_HEIGHT**up, radius))


def wheel(
    camera: Camera, notches: float, mouse: tuple[float, float], radius: float, seen: Vector | None = None
) -> Camera:
    """Nearer for notches > 0; what is under the mouse stays there.

    mouse: to the right of and above the view's centre. radius: as for `zoom`. seen: what is under the mouse,
    scan units; None takes the target's depth.
    """
    if seen is None:
        seen = camera.panned(*mouse).target
    return camera.approached(seen, _limited(camera, _ZOOM_PER_NOTCH**notches, radius))


def _limited(camera: Camera, factor: float, radius: float) -> float:
    """The part of a zoom that keeps the distance within its limits."""
    radius = radius or 1.0  # of a single point
    low, high = camera.distance / (_FARTHEST * radius), camera.distance / (_NEAREST * radius)
    return min(max(factor, min(low, 1.0)), max(high, 1.0))
