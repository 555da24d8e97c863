from __future__ import annotations

import json
import math
import os
import sys
from pathlib import Path

import numpy as np
import pytest
from hostile_values import variants
from hypothesis import given
from hypothesis import strategies as st

from viewer.bounds import Bounds
from viewer.camera import Camera
from viewer.errors import InputError
from viewer.geometry import up_vector
from viewer.view import View

BOX = Bounds(np.array([-1.0, -2, -3]), np.array([3.0, 2, 1]))


def pixels(camera: Camera, points: np.ndarray, size: tuple[int, int] = (300, 200)) -> np.ndarray:
    """Where points (N, 3) land in a picture."""
    return View.of(camera, size, np.zeros(3), BOX).project(points)[0]


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("aspect", [0.3, 1.0, 2.5])
def test_framing_shows_all_points_and_touches_two_opposite_edges(projection: str, aspect: float) -> None:
    """Points in a pyramid, as a depth camera sees them: their box is much larger."""
    depth = np.random.default_rng(0).uniform(1, 5, 500)
    points = np.random.default_rng(1).uniform(-0.5, 0.5, (500, 3)) * depth[:, None]
    points[:, 2] = -depth
    points += 1e6
    size = (int(400 * aspect), 400)
    for azimuth in (0, 33, 120, 270):
        turned = Camera.orbit(BOX, azimuth, 20, aspect=size[0] / size[1], projection=projection)
        camera = turned.framing(points, size[0] / size[1])
        np.testing.assert_allclose(camera.rotation(), turned.rotation(), atol=1e-9)
        at = View.of(camera, size, np.full(3, 1e6), BOX).project(points - 1e6)[0] / size
        assert at.min() > 0
        assert at.max() < 1
        reached = np.minimum(at.max(axis=0) - 0.5, 0.5 - at.min(axis=0))
        assert reached.max() > 0.47
        inner = np.abs(camera.rotation() @ (np.subtract(camera.target, points.mean(axis=0))))
        assert inner.max() < 3, "it turns about the points"


def test_framing_one_point_leaves_room_round_it() -> None:
    camera = Camera().framing(np.array([[1.0, 2.0, 3.0]]))
    assert camera.target == (1.0, 2.0, 3.0)
    assert camera.distance > 0.5


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("aspect", [0.3, 1.0, 2.5])
def test_fit_shows_the_whole_box_and_wastes_little(projection: str, aspect: float) -> None:
    size = (int(400 * aspect), 400)
    for azimuth in (0, 33, 120, 270):
        camera = Camera.orbit(BOX, azimuth, 20, aspect=size[0] / size[1], projection=projection)
        at = pixels(camera, BOX.corners(), size) / size
        assert at.min() > 0
        assert at.max() < 1
        assert np.abs(at - 0.5).max() > 0.45


def test_azimuth_and_elevation_as_the_design_has_them() -> None:
    eye = {a: np.subtract(Camera.orbit(BOX, a).eye, BOX.center) for a in (0, 90, 180)}
    assert eye[0][2] > 0
    assert np.allclose(eye[0][:2], 0)
    assert eye[90][0] > 0
    assert eye[180][2] < 0
    assert np.subtract(Camera.orbit(BOX, 0, 45).eye, BOX.center)[1] > 0


@pytest.mark.parametrize("up", ["+x", "-x", "+y", "-y", "+z", "-z"])
def test_up_is_up_in_the_picture(up: str) -> None:
    axis = np.array(up_vector(up), float)
    for azimuth in (0, 77, 250):
        low, high = pixels(
            Camera.orbit(BOX, azimuth, 10, up=up), np.array([BOX.center, BOX.center + 0.1 * axis])
        )
        assert high[1] < low[1], "row 0 is the top"
        assert abs(high[0] - low[0]) < 1e-6


@pytest.mark.parametrize("elevation", [90, -90, 89.9999])
def test_the_poles_have_an_upright_picture(elevation: float) -> None:
    rotation = Camera.orbit(BOX, 30, elevation).rotation()
    assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-9)
    assert np.isclose(np.linalg.det(rotation), 1)


def test_up_parallel_to_the_view_axis_still_gives_a_rotation() -> None:
    rotation = Camera(eye=(0, 5, 0), up=(0, 1, 0)).rotation()
    assert np.allclose(rotation @ rotation.T, np.eye(3))


@given(
    st.floats(-400, 400), st.floats(-100, 100), st.floats(0.1, 10), st.floats(-0.4, 0.4), st.floats(-0.4, 0.4)
)
def test_moves_keep_what_they_promise(
    azimuth: float, elevation: float, factor: float, right: float, up: float
) -> None:
    camera = Camera.orbit(BOX, 10, 5)
    turned = camera.orbited(azimuth, elevation)
    assert math.isclose(turned.distance, camera.distance, rel_tol=1e-9)
    assert turned.target == camera.target
    zoomed = camera.zoomed(factor)
    assert math.isclose(zoomed.distance * factor, camera.distance, rel_tol=1e-9)
    # The target moves with the mouse: panning by a picture's height moves it by that height.
    panned = camera.panned(right, up)
    at = pixels(panned, np.array([camera.target]))[0]
    assert np.allclose(at, [150 - right * 200, 100 + up * 200], atol=1e-6)


def test_orbiting_stops_at_the_poles() -> None:
    camera = Camera.orbit(BOX)
    for _ in range(40):
        camera = camera.orbited(0, 10)
    direction = np.subtract(camera.eye, camera.target) / camera.distance
    assert 0.99 < direction[1] < 1


def test_changing_the_projection_keeps_the_size_at_the_target() -> None:
    camera = Camera.orbit(BOX, 20, 10)
    point = np.array([camera.target]) + camera.rotation()[1] * 0.5
    assert np.allclose(pixels(camera, point), pixels(camera.projected("orthographic"), point), atol=1e-9)
    there_and_back = camera.projected("orthographic").projected("perspective")
    assert np.allclose(pixels(camera, point), pixels(there_and_back, point))


def test_what_was_fitted_in_one_projection_keeps_its_size_in_the_other() -> None:
    fitted = Camera.orbit(BOX, 20, 10, projection="orthographic")
    point = np.array([fitted.target]) + fitted.rotation()[1] * 0.5
    assert np.allclose(pixels(fitted, point), pixels(fitted.projected("perspective"), point))


def test_zooming_an_orthographic_view_scales_it() -> None:
    camera = Camera.orbit(BOX, projection="orthographic")
    assert camera.zoomed(2).view_height == pytest.approx(camera.view_height / 2)
    # A view that was never given a height shows what the perspective one does at its target.
    bare = Camera(eye=(0, 0, 4), projection="orthographic")
    assert bare.zoomed(2).view_height == pytest.approx(bare.view_height / 2)


def test_json_round_trip(tmp_path: Path) -> None:
    camera = Camera.orbit(BOX, 12.5, -7, projection="orthographic")
    camera.save(tmp_path / "camera.json")
    assert Camera.load(tmp_path / "camera.json") == camera
    assert json.loads((tmp_path / "camera.json").read_text())["near"] is None


@pytest.mark.slow
def test_no_camera_file_is_an_internal_error(tmp_path: Path) -> None:
    usable = Camera(eye=(1, 2, 3), height=2.0, near=0.1, far=9.0).to_json()
    path = tmp_path / "camera.json"
    read = longest = 0
    for camera in variants(usable):
        path.write_text(json.dumps(camera))
        try:
            camera = Camera.load(path)
        except InputError as error:
            longest = max(longest, len(str(error)))
        else:
            # What is accepted can be reckoned with: numpy raises in these tests.
            assert np.isfinite([*camera.rotation().ravel(), camera.view_height, camera.clip_range()[0]]).all()
            camera.orbited(10, 10).panned(0.1, 0.1).zoomed(1.1).projected("orthographic")
            read += 1
    assert read > 20
    assert longest < 600


@pytest.mark.skipif(sys.platform == "win32", reason="has neither")
def test_pipes_and_devices_are_no_camera(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", "/dev/zero"):
        with pytest.raises(InputError, match="not a regular file"):
            Camera.load(path)


def test_a_deeply_nested_camera_file_is_explained(tmp_path: Path) -> None:
    (tmp_path / "camera.json").write_text("[" * 100_000)
    with pytest.raises(InputError, match="nested too deeply"):
        Camera.load(tmp_path / "camera.json")


@pytest.mark.parametrize("at", [0.0, 1.0, 1e17])
@pytest.mark.parametrize("size", [0.0, 5e-324, 1e-310, 1e-20])
def test_what_is_as_good_as_a_point_is_shown(at: float, size: float) -> None:
    bounds = Bounds(np.full(3, at), np.array([at, at, at + size]))
    camera = Camera.orbit(bounds)
    assert camera.target == pytest.approx((at, at, at))
    assert camera.distance >= 0.5


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "is not JSON"),
        ("[]", "JSON object"),
        ('{"eyes": [0, 0, 1]}', "unknown camera field 'eyes'"),
        ('{"eye": [0, 0]}', "three finite numbers"),
        ('{"eye": "abc"}', "camera"),
        ('{"projection": "fisheye"}', "perspective"),
        ('{"fov_y": 0}', "fov_y"),
        ('{"fov_y": "wide"}', "fov_y is wide"),
        ('{"eye": [0, 0, 0], "target": [0, 0, 0]}', "same point"),
        ('{"near": -1}', "near"),
        ('{"near": 2, "far": 1}', "near plane"),
        ('{"height": NaN}', "height"),
    ],
)
def test_bad_camera_files_are_explained(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "camera.json"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        Camera.load(path)
    assert "camera.json" in str(caught.value)


def test_a_missing_camera_file_is_explained(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        Camera.load(tmp_path / "none.json")
