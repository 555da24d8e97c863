"""The mouse moves the camera so that what it holds follows it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.app import navigation
from viewer.camera import Camera
from viewer.gpu.view import View
from viewer.scan.points import Bounds

SIZE = (300, 200)
BOUNDS = Bounds(np.array([-1.0, -1, -1]), np.array([1.0, 1, 1]))
CAMERAS = [
    Camera(eye=(1, 2, 5), target=(0.2, 0.1, 0)),
    Camera(eye=(-3, 1, 2), target=(0, 0, 0), projection="orthographic", height=2.5),
]


def pixel(camera: Camera, point: NDArray[np.float64]) -> NDArray[np.float64]:
    return View.of(camera, SIZE, np.zeros(3), BOUNDS).project(point[None])[0][0]


def at_target_depth(camera: Camera, right: float, up: float) -> NDArray[np.float64]:
    """The point that lies so many view heights from the target in the picture."""
    axes = camera.rotation()
    return np.array(camera.target) + (axes[0] * right + axes[1] * up) * camera.view_height


@pytest.mark.parametrize("camera", CAMERAS)
def test_pan_keeps_the_point_under_the_mouse(camera: Camera) -> None:
    point = at_target_depth(camera, -0.1, 0.2)
    moved = navigation.pan(camera, 0.25, -0.15)
    assert pixel(moved, point) - pixel(camera, point) == pytest.approx([0.25 * 200, 0.15 * 200])


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("notches", [3, -2])
def test_wheel_zooms_at_the_mouse(camera: Camera, notches: float) -> None:
    point = at_target_depth(camera, 0.3, -0.2)
    moved = navigation.wheel(camera, notches, (0.3, -0.2), 1.0)
    assert pixel(moved, point) == pytest.approx(pixel(camera, point))
    assert moved.view_height / camera.view_height == pytest.approx(1.15**-notches)


@pytest.mark.parametrize("camera", CAMERAS)
def test_orbit_turns_the_subject_with_the_mouse(camera: Camera) -> None:
    front = np.array(camera.target) + 0.1 * camera.rotation()[2]
    for right, up in [(0.05, 0), (0, 0.05)]:
        moved = navigation.orbit(camera, right, up)
        assert moved.distance == pytest.approx(camera.distance)
        assert moved.target == camera.target
        shift = (pixel(moved, front) - pixel(camera, front)) * [1, -1]
        assert shift @ [right, up] > 0.05 * np.linalg.norm([right, up])
        assert abs(shift @ [up, right]) < 0.2 * np.linalg.norm(shift)


def test_half_a_view_height_is_a_quarter_turn() -> None:
    camera = Camera(eye=(0, 0, 5), target=(0, 0, 0))
    assert navigation.orbit(camera, 0.5, 0).eye == pytest.approx((-5, 0, 0))


@pytest.mark.parametrize(
    "zoom", [lambda c, s: navigation.wheel(c, s, (0.1, 0.1), 2.0), lambda c, s: navigation.zoom(c, s, 2.0)]
)
@pytest.mark.parametrize("direction", [1, -1])
def test_zoom_stops_where_numbers_stay_sound(
    zoom: Callable[[Camera, float], Camera], direction: float
) -> None:
    camera = Camera(eye=(0, 0, 5), target=(0, 0, 0))
    for _ in range(400):
        camera = zoom(camera, direction * 1.0)
    assert camera.distance == pytest.approx(2e-5 if direction > 0 else 2e3)
    assert zoom(camera, -direction).distance != pytest.approx(camera.distance)
