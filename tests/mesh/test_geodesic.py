"""Paths over patches against exact ones (Mitchell, Mount and Papadimitriou 1987) and analytic shapes."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.mesh.geodesic import Geodesics, kinked, length_of
from viewer.mesh.patch import Patch
from viewer.mesh.smoothing import moved_to_quadrics, smoothing_radius


def grid_patch(height: np.ndarray, step: float = 1.0) -> Patch:
    """The patch of heights (N, M) over a grid."""
    rows, columns = height.shape
    y, x = np.mgrid[:rows, :columns] * step
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (n.ravel() for n in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Patch.of(np.stack([x, y, height], axis=2).reshape(-1, 3), faces)


def test_paths_are_as_short_as_exact_ones() -> None:
    from pygeodesic.geodesic import PyGeodesicAlgorithmExact

    y, x = np.mgrid[-20:21, -20:21] / 20
    patch = grid_patch(6 * (x * x - y * y) + 2 * np.sin(4 * x))
    exact = PyGeodesicAlgorithmExact(patch.vertices, patch.faces.astype(np.int32))
    paths, rng = Geodesics(patch), np.random.default_rng(0)
    for start, end in rng.integers(0, len(patch.vertices), (20, 2)):
        path = paths.path(int(start), int(end))
        assert path is not None
        least, _ = exact.geodesicDistance(int(start), int(end))
        assert length_of(path) == pytest.approx(least, rel=1e-3)
        assert length_of(path) >= least * (1 - 1e-9)
        assert (path[[0, -1]] == patch.vertices[[start, end]]).all()


def test_the_path_over_a_fold_is_that_of_the_unfolded_sheet() -> None:
    fold = grid_patch(np.abs(np.arange(11.0) - 5)[:, None] * np.ones(11))
    start, end = (int(np.flatnonzero(fold.sources == corner)[0]) for corner in (0, 120))
    path = Geodesics(fold).path(start, end)
    assert path is not None
    assert length_of(path) == pytest.approx(np.hypot(10 * np.sqrt(2), 10))


def test_there_is_no_path_where_nothing_joins() -> None:
    corners = np.random.default_rng(0).random((6, 3))
    paths = Geodesics(Patch.of(corners, np.array([[0, 1, 2], [3, 4, 5]])))
    assert paths.path(0, 4) is None
    same = paths.path(1, 1)
    assert same is not None
    assert length_of(same) == 0


@pytest.mark.parametrize(("noise", "most"), [(0.0, 0.002), (0.2, 0.005)])
def test_paths_over_points_of_a_sphere(noise: float, most: float) -> None:
    """R = 100 mm, 40 000 points, in mm."""
    rng, radius, spacing = np.random.default_rng(3), 100.0, np.sqrt(4 * np.pi * 1e4 / 40_000)
    points = rng.standard_normal((40_000, 3))
    points *= (radius + noise * rng.standard_normal((40_000, 1))) / np.linalg.norm(points, axis=1)[:, None]
    ends = radius * np.array([[1, 0, 0], [0.6, 0.8, 0]])
    true = radius * np.arccos(0.6)
    near = points[np.linalg.norm(points[:, None] - ends, axis=2).sum(axis=1) < 1.1 * true]
    reach = smoothing_radius(noise, spacing)
    smooth, normals = moved_to_quadrics(near, max(reach, 2 * spacing), near)
    patch = Patch.of_points(smooth if reach else near, normals, spacing)
    patch, start = patch.with_point(patch.nearest(ends[0]))
    patch, end = patch.with_point(patch.nearest(ends[1]))
    path = Geodesics(patch).path(start, end)
    assert path is not None
    assert length_of(path) == pytest.approx(true, rel=most)
    raw = Patch.of_points(near, normals, spacing)
    raw, start = raw.with_point(raw.nearest(ends[0]))
    raw, end = raw.with_point(raw.nearest(ends[1]))
    rough = Geodesics(raw).path(start, end)
    assert rough is not None
    if noise:
        assert length_of(rough) > true * 1.005  # what smoothing is for


def test_kinks_tell_of_chords_and_of_zigzags() -> None:
    turn = np.linspace(0, np.pi / 2, 40)
    arc = 100 * np.stack([np.cos(turn), np.sin(turn), np.zeros(40)], axis=1)
    short = 50 * np.pi - length_of(arc)
    assert short < kinked(arc, 4.0) < 8 * short
    assert kinked(arc, 8.0) == pytest.approx(4 * kinked(arc, 4.0), rel=0.1)
    zigzag = np.stack([np.arange(41.0), np.tile([0, 0.1], 21)[:41], np.zeros(41)], axis=1)
    assert kinked(zigzag, 1.0) == pytest.approx(2 * (length_of(zigzag) - 40), rel=0.2)
    assert kinked(arc[:1], 1.0) == kinked(arc[:2], 9.0) == 0
