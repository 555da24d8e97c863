"""The mouse moves the camera so that what it holds follows it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.app.scene import navigation
from viewer.bounds import Bounds
from viewer.camera import Camera
from viewer.geometry import up_vector
from viewer.view import View

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


@pytest.mark.parametrize("camera", CAMERAS)
def test_orbit_keeps_the_pivot_at_its_pixel_and_the_subject_rigid(camera: Camera) -> None:
    pivot = (0.5, -0.3, 0.8)
    moved = camera
    for right, up in [(0.2, 0.1), (-0.4, 0.3), (0.1, -0.6)]:
        moved = navigation.orbit(moved, right, up, pivot)
        assert pixel(moved, np.array(pivot)) == pytest.approx(pixel(camera, np.array(pivot)))
    assert moved.distance == pytest.approx(camera.distance)
    assert np.linalg.norm(moved.rotation() - camera.rotation()) > 0.5, "it has turned"


@pytest.mark.parametrize("camera", CAMERAS)
def test_focusing_on_a_point_keeps_the_picture(camera: Camera) -> None:
    point = (0.5, -0.3, 0.8)
    focused = camera.focused(point)
    assert focused.eye == camera.eye
    others = np.random.default_rng(0).uniform(-1, 1, (20, 3))
    for other in others:
        assert pixel(focused, other) == pytest.approx(pixel(camera, other))
    right, up = focused.place_in_picture(point)
    assert at_target_depth(focused, right, up) == pytest.approx(point), "at the target's depth"
    # And so zooming and panning hold on to it.
    for moved, shift in [
        (navigation.wheel(focused, 3, (right, up), 1.0), (0, 0)),
        (navigation.pan(focused, 0.1, 0.2), (0.1, 0.2)),
    ]:
        assert moved.place_in_picture(point) == pytest.approx((right + shift[0], up + shift[1]))


@pytest.mark.parametrize("camera", CAMERAS)
def test_centring_a_point_keeps_direction_and_scale(camera: Camera) -> None:
    point = (0.5, -0.3, 0.8)
    centered = camera.centered(point)
    assert centered.place_in_picture(point) == pytest.approx((0, 0), abs=1e-12)
    assert centered.rotation() == pytest.approx(camera.rotation())
    assert centered.view_height == pytest.approx(camera.focused(point).view_height)
    behind = tuple(np.array(camera.eye) + camera.rotation()[2])
    assert camera.centered(behind) == camera


def test_a_point_behind_the_eye_is_no_pivot() -> None:
    camera = CAMERAS[0]
    behind = np.array(camera.eye) + camera.rotation()[2]
    assert camera.focused(tuple(behind)) == camera
    assert camera.place_in_picture(tuple(behind)) is None
    far = Camera(eye=(1e7, 1e7, 1e7), target=(1e7 - 1, 1e7 - 1e-3, 1e7))
    beside = (1e7, float(np.nextafter(1e7, 0)), 1e7)
    assert far.focused(beside) == far, "nor one that rounding puts into the eye"


@pytest.mark.parametrize("camera", CAMERAS)
def test_place_is_the_pixel_in_heights(camera: Camera) -> None:
    for point in np.random.default_rng(1).uniform(-1, 1, (20, 3)):
        right, up = camera.place_in_picture(tuple(point))
        assert pixel(camera, point) == pytest.approx([150 + 200 * right, 100 - 200 * up])


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("up", ["+y", "-y", "+z", "-x"])
def test_views_show_the_side_they_name(camera: Camera, up: str) -> None:
    """A subject that stands upright and faces the front: its left hand, nose and crown."""
    crown = np.array(up_vector(up), float)
    nose = np.array({"+y": (0, 0, 1), "-y": (0, 0, -1), "+z": (0, -1, 0), "-x": (0, 0, 1)}[up], float)
    left = np.cross(crown, nose)
    toward = {"front": nose, "back": -nose, "left": left, "right": -left, "top": crown, "bottom": -crown}
    # Up in the picture; seen from the top or the bottom, the back of the head or the face.
    above = {"top": -nose, "bottom": nose}
    assert list(navigation.VIEWS) == list(toward)
    for side, axis in toward.items():
        seen = navigation.view_from(*navigation.VIEWS[side], camera, BOUNDS, 1.5, up)
        rotation = seen.rotation()
        np.testing.assert_allclose(rotation[2], axis, atol=2e-5)
        np.testing.assert_allclose(rotation[1], above.get(side, crown), atol=2e-5)
        assert (seen.projection, seen.fov_y) == (camera.projection, camera.fov_y)
        places = np.array([pixel(seen, corner) for corner in BOUNDS.corners()]) / SIZE
        assert places.min() > 0
        assert places.max() < 1
        assert np.abs(places[:, 1] - 0.5).max() > 0.45, "fitted"


@pytest.mark.parametrize("side", ["top", "bottom"])
def test_from_the_poles_orbiting_turns_about_the_scans_up_without_a_jump(side: str) -> None:
    seen = navigation.view_from(*navigation.VIEWS[side], CAMERAS[0], BOUNDS, 1.5, "+y")
    turned = navigation.orbit(seen, 0.25, 0)
    np.testing.assert_allclose(turned.rotation()[2], seen.rotation()[2], atol=5e-5)
    assert turned.rotation()[1] @ seen.rotation()[1] == pytest.approx(np.cos(np.pi / 4))
    tilted = navigation.orbit(seen, 0, -0.25 if side == "bottom" else 0.25)
    angle = np.degrees(np.arccos(tilted.rotation()[2] @ seen.rotation()[2]))
    assert angle == pytest.approx(45, abs=0.01)


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


@pytest.mark.parametrize("camera", CAMERAS)
def test_a_camera_shows_something_or_nothing_of_the_scan(camera: Camera) -> None:
    aspect = SIZE[0] / SIZE[1]
    assert navigation.shows(camera, BOUNDS, aspect)
    assert navigation.shows(camera.zoomed(50), BOUNDS, aspect), "a detail"
    assert navigation.shows(camera.panned(0.5, 0), BOUNDS, aspect)
    assert not navigation.shows(camera.panned(9, 0), BOUNDS, aspect)
    assert not navigation.shows(camera.panned(0, -9), BOUNDS, aspect)
    assert not navigation.shows(camera.zoomed(1e9), BOUNDS, aspect)
    assert not navigation.shows(camera.zoomed(1e-6), BOUNDS, aspect)
    eye, target = np.array(camera.eye), np.array(camera.target)
    behind = replace(camera, eye=tuple(eye), target=tuple(2 * eye - target))
    assert not navigation.shows(behind, BOUNDS, aspect), "it looks away"
    far = Bounds(BOUNDS.low + 1e5, BOUNDS.high + 1e5)
    assert not navigation.shows(camera, far, aspect)
    assert navigation.shows(camera, Bounds(target, target), aspect), "a single point"


@pytest.mark.parametrize("camera", CAMERAS)
def test_a_single_point_can_be_zoomed_at(camera: Camera) -> None:
    """Its radius is 0."""
    assert navigation.zoom(camera, 0.5, 0.0).view_height < camera.view_height
    assert navigation.wheel(camera, -1, (0.1, 0.1), 0.0).view_height > camera.view_height
