"""The orientation cube's geometry: what is clicked is what is seen, and looks from where it says."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from viewer.app.scene import navigation, orientation
from viewer.bounds import Bounds
from viewer.camera import Camera
from viewer.geometry import AXES

BOUNDS = Bounds(np.array([-1.0, -1, -1]), np.array([1.0, 1, 1]))
PARTS = [part for part in itertools.product((-1, 0, 1), repeat=3) if any(part)]
CAMERAS = [
    Camera.orbit(BOUNDS, azimuth, elevation, up="+z")
    for azimuth, elevation in [(0, 0), (30, 20), (-140, 60), (200, -35), (90, 89)]
]


@pytest.mark.parametrize("up", AXES)
@pytest.mark.parametrize("part", PARTS)
def test_looking_from_a_part_shows_it_in_the_middle(up: str, part: orientation.Direction) -> None:
    camera = navigation.view_from(*orientation.angles(part), CAMERAS[1], BOUNDS, 1.5, up)
    turned = orientation.rotation(camera, up)
    np.testing.assert_allclose(turned[2], np.array(part) / np.linalg.norm(part), atol=5e-5)
    assert orientation.part_at(turned, 0.01, -0.02) == part


@pytest.mark.parametrize("side", orientation.FACES)
def test_the_faces_are_the_views(side: str) -> None:
    assert orientation.angles(orientation.FACES[side]) == pytest.approx(navigation.VIEWS[side])


@pytest.mark.parametrize("camera", CAMERAS)
def test_the_part_under_a_place_is_the_one_seen_there(camera: Camera) -> None:
    """Points strewn over the faces that are seen: each is found in its own part."""
    rng = np.random.default_rng(0)
    turned = orientation.rotation(camera, "+z")
    points = rng.uniform(-1, 1, (4000, 3))
    axis = rng.integers(0, 3, len(points))
    points[np.arange(len(points)), axis] = rng.choice([-1.0, 1.0], len(points))
    seen = points @ turned.T
    facing = points[np.arange(len(points)), axis] * turned[2, axis]
    for point, (right, up, _), front in zip(points, seen, facing, strict=True):
        if front > 0.02:
            expected = tuple(int(np.sign(v)) if abs(v) > 0.6 else 0 for v in point)
            assert orientation.part_at(turned, right, up) == expected
    reach = 1.001 * np.abs(seen[:, :2]).max() + 0.1
    assert orientation.part_at(turned, reach, 0) is None
    assert orientation.part_at(turned, 0, -reach) is None


@pytest.mark.parametrize("part", PARTS)
def test_the_patches_of_a_part_are_where_it_is_hit(part: orientation.Direction) -> None:
    camera = Camera.orbit(BOUNDS, *orientation.angles(part))
    turned = orientation.rotation(camera, "+y")
    faces = [face for face in orientation.FACES.values() if np.dot(face, part) > 0]
    assert len(faces) == np.abs(part).sum()
    for face in faces:
        corners = orientation.patch(face, part)
        middle = corners.mean(axis=0)
        for place in (middle, *(middle + 0.98 * (corners - middle))):
            assert orientation.part_at(turned, *(turned[:2] @ place)) == part
        square = orientation.square(face)
        assert (square @ face == 1).all()
        assert np.ptp(square, axis=0).tolist() == [0 if axis else 2 for axis in face]


@pytest.mark.parametrize("camera", [*CAMERAS, Camera.orbit(BOUNDS, 170, -70), Camera.orbit(BOUNDS, -80, 75)])
def test_names_are_never_mirrored_nor_upside_down(camera: Camera) -> None:
    turned = orientation.rotation(camera, "+z")
    for face in orientation.FACES.values():
        right, up = orientation.writing(turned, face)
        assert np.cross(right, up).tolist() == list(face), "read from outside"
        if face[1] == 0:
            assert up.tolist() == [0, 1, 0]
        elif turned[2] @ face > 0:
            assert turned[1] @ up >= abs(turned[1] @ right)


def test_names_say_which_faces_meet() -> None:
    assert orientation.name((0, 1, 0)) == "top"
    assert orientation.name((1, -1, 1)) == "front, left, bottom"


@pytest.mark.parametrize("up", ["+y", "-y", "+z"])
@pytest.mark.parametrize("front", [0.0, 90.0, -30.0])
def test_the_cube_shows_its_front_from_where_the_front_is(up: str, front: float) -> None:
    camera = Camera.orbit(BOUNDS, front, 0, up=up)
    np.testing.assert_allclose(orientation.rotation(camera, up, front), np.eye(3), atol=1e-12)
    assert orientation.azimuth_of(camera, up) == pytest.approx(front)
