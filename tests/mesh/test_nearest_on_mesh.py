"""Signed distances from meshes: exact, with the right side at edges and corners, and none beyond a border."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import sphere_mesh

from viewer.errors import InputError
from viewer.mesh.nearest import NearestOnMesh
from viewer.scan.points import PointCloud

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
SIDES = [
    [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
    [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
]  # fmt: skip


def cube_distance(points: np.ndarray) -> np.ndarray:
    """Signed distances from the cube of edge 2 about zero."""
    over = np.abs(points) - 1
    return np.linalg.norm(np.maximum(over, 0), axis=1) + np.minimum(over.max(axis=1), 0)


@pytest.mark.parametrize("is_split", [False, True])
@pytest.mark.parametrize("away", [0.0, 1e6])
def test_distances_from_a_cube_are_exact_on_both_sides(is_split: bool, away: float) -> None:
    corners, faces = (CUBE[np.ravel(SIDES)], np.arange(36).reshape(-1, 3)) if is_split else (CUBE, SIDES)
    cube = NearestOnMesh(PointCloud.from_arrays(corners + away), np.array(faces))
    points = np.random.default_rng(5).uniform(-2.5, 2.5, (20_000, 3))
    found = cube.signed(points + away, 10.0)
    np.testing.assert_allclose(found, cube_distance(points), atol=1e-6 if away == 0 else 1e-6 + 1e-9)


def test_what_lies_on_the_mesh_or_far_from_it() -> None:
    cube = NearestOnMesh(PointCloud.from_arrays(CUBE), np.array(SIDES))
    found = cube.signed(np.array([[1, 0.25, 0.5], [1, 1, 1], [3.5, 0, 0], [1.5, 0, 0]]), 2.0)
    np.testing.assert_allclose(found, [0, 0, np.nan, 0.5], atol=1e-7)


def test_a_ball_of_faces_is_met_to_the_depth_of_its_chords() -> None:
    mesh = sphere_mesh(128)
    ball = NearestOnMesh(mesh.points, mesh.faces)
    directions = np.random.default_rng(6).normal(size=(5000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for radius in (0.5, 0.999, 1.001, 1.7):
        np.testing.assert_allclose(ball.signed(radius * directions, 5.0), radius - 1, atol=4e-4)


def test_beyond_a_border_there_is_no_distance() -> None:
    square = PointCloud.from_arrays([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    sheet = NearestOnMesh(square, np.array([[0, 1, 2], [0, 2, 3]]))
    points = np.random.default_rng(7).uniform((-0.5, -0.5, -0.5), (1.5, 1.5, 0.5), (50_000, 3))
    found = sheet.signed(points, 1.0)
    above = ((points[:, :2] >= 0) & (points[:, :2] <= 1)).all(axis=1)
    assert np.isfinite(found[above]).all()
    np.testing.assert_allclose(found[above], points[above, 2], atol=1e-9)
    outside = np.maximum(points[:, :2] - 1, -points[:, :2]).max(axis=1)
    assert outside[np.isfinite(found)].max() < 1e-3 * 0.5


def test_the_end_of_a_tube_keeps_what_is_beside_it() -> None:
    turns = np.linspace(0, 2 * np.pi, 7)[:-1]
    ring = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    tube = PointCloud.from_arrays(np.concatenate([ring, ring + np.array([0, 0, 1])]))
    at = np.arange(6)
    after = (at + 1) % 6
    faces = np.concatenate([np.stack([at, after, after + 6], 1), np.stack([at, after + 6, at + 6], 1)])
    found = NearestOnMesh(tube, faces).signed(np.array([[1.5, 0, 0], [1.5, 0, 1], [1.5, 0, -0.1]]), 1.0)
    np.testing.assert_allclose(found, [0.5, 0.5, np.nan], atol=1e-6)


def test_faces_without_area_are_left_out() -> None:
    flat = PointCloud.from_arrays([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]])
    found = NearestOnMesh(flat, np.array([[0, 1, 2], [0, 1, 3]])).signed(np.array([[0.2, 0.2, -1.0]]), 2.0)
    np.testing.assert_allclose(found, [-1.0])
    with pytest.raises(InputError, match="no faces"):
        NearestOnMesh(flat, np.array([[0, 1, 2]]))
