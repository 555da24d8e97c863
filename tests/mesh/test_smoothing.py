from __future__ import annotations

import numpy as np
import pytest

from viewer.mesh.patch import Patch
from viewer.mesh.smoothing import (
    LENGTHENED,
    moved_to_quadrics,
    noise_over_faces,
    rows_apart,
    smoothing_radius,
)


def patch_of(count: int, seed: int = 0) -> np.ndarray:
    """Points of a patch that is bent like a saddle, one per square unit on average."""
    side = np.sqrt(count)
    x, y = np.random.default_rng(seed).uniform(-side / 2, side / 2, (2, count))
    return np.stack([x, y, (x * x - y * y) / (4 * side)], axis=1)


def test_a_quadric_without_noise_stays_where_it_is() -> None:
    points = patch_of(900)
    found, normals = moved_to_quadrics(points, 3.0)
    inner = np.abs(points[:, :2]).max(axis=1) < 10
    assert np.abs(found - points)[inner].max() < 0.01  # quadrics of the tilted plane differ by cubes alone
    slopes = np.stack([-points[:, 0] / 60, points[:, 1] / 60, np.ones(900)], axis=1)
    cosines = (normals * slopes).sum(axis=1) / np.linalg.norm(slopes, axis=1)
    assert np.degrees(np.arccos(np.abs(cosines[inner]))).max() < 1


def test_noise_gets_as_little_as_is_said() -> None:
    """The slope of what is left makes a path longer by `LENGTHENED`, on a plane of points 1 apart."""
    side, noise = 60, 0.2
    x, y = np.meshgrid(np.arange(side, dtype=float), np.arange(side, dtype=float))
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    points[:, 2] += noise * np.random.default_rng(1).standard_normal(len(points))
    radius = smoothing_radius(noise, 1.0)
    found, _ = moved_to_quadrics(points, radius)
    height = found[:, 2].reshape(side, side)[10:-10, 10:-10]
    slopes = np.diff(height, axis=1)
    assert 0.5 * LENGTHENED < (slopes**2).mean() / 2 < 2 * LENGTHENED


@pytest.mark.parametrize("noise", [0.0, 0.03, 0.3])
def test_noise_over_faces_is_told_from_what_bends(noise: float) -> None:
    """A grid that is bent like a saddle and folded once."""
    y, x = np.mgrid[:50, :50].astype(float)
    height = (x * x - y * y) / 500 + 0.3 * np.maximum(x - 20, 0)
    points = np.stack([x, y, height + noise * np.random.default_rng(0).standard_normal(x.shape)], axis=2)
    number = np.arange(2500).reshape(50, 50)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    faces = np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(-1, 3)
    normals = Patch(points.reshape(-1, 3), faces, np.arange(2500)).vertex_normals
    found = noise_over_faces(points.reshape(-1, 3), faces, normals)
    assert found == pytest.approx(noise, rel=0.15, abs=0.002)
    assert noise_over_faces(points.reshape(-1, 3), faces[:0], normals) == 0


def test_points_that_face_the_other_way_do_not_count() -> None:
    one = patch_of(900)
    other = one + np.array([0, 0, 0.5])
    normals = np.repeat([[0, 0, -1.0], [0, 0, 1.0]], 900, axis=0)
    both = np.concatenate([one, other])
    found, directions = moved_to_quadrics(both, 3.0, normals)
    inner = np.abs(both[:, :2]).max(axis=1) < 10
    assert np.abs(found - both)[inner].max() < 0.01
    assert (directions[:, 2] * normals[:, 2] > 0).all()
    mixed, _ = moved_to_quadrics(both, 3.0)
    assert np.abs(mixed - both)[inner].max() > 0.1


def test_some_rows_are_as_among_all() -> None:
    points, rows = patch_of(400), np.array([3, 77, 200])
    for some, every in zip(
        moved_to_quadrics(points, 3.0, rows=rows), moved_to_quadrics(points, 3.0), strict=True
    ):
        assert np.allclose(some, every[rows])


@pytest.mark.parametrize("points", [np.zeros((20, 3)), np.arange(60.0).reshape(20, 3), np.eye(3)])
def test_points_that_tell_no_surface_stay_finite(points: np.ndarray) -> None:
    found, normals = moved_to_quadrics(points, 1.0)
    assert np.isfinite(found).all()
    assert np.isfinite(normals).all()


def test_little_noise_needs_none() -> None:
    assert smoothing_radius(0.0, 1.0) == 0
    assert smoothing_radius(0.005, 1.0) == 0
    assert smoothing_radius(0.2, 1.0) == pytest.approx(2 * smoothing_radius(0.05, 1.0))


def test_thinned_points_are_apart_and_near_all() -> None:
    points = patch_of(800)
    rows = rows_apart(points, 1.0)
    kept = points[rows]
    apart = np.linalg.norm(kept[:, None] - kept, axis=2) + 9 * np.eye(len(kept))
    assert apart.min() > 1.0
    assert np.linalg.norm(points[:, None] - kept, axis=2).min(axis=1).max() <= 1.0
    assert rows_apart(points[:1], 1.0).tolist() == [0]
