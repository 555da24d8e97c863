from __future__ import annotations

import numpy as np
import pytest

from viewer.scan.points import PointCloud
from viewer.scan.spacing import nearest_row, typical_spacing


def grid(edge: int, step: float) -> np.ndarray:
    x, y = np.meshgrid(np.arange(edge) * step, np.arange(edge) * step)
    return np.stack([x.ravel(), y.ravel(), np.zeros(edge * edge)], axis=1)


@pytest.mark.parametrize("step", [1e-4, 1.0, 1e5])
@pytest.mark.parametrize("copies", [1, 2, 10])
def test_spacing_of_a_grid_with_copies(step: float, copies: int) -> None:
    rng = np.random.default_rng(0)
    points = grid(120, step) + rng.normal(scale=0.1 * step, size=(14400, 3)) * [1, 1, 0]
    points = rng.permutation(np.repeat(points, copies, axis=0))
    assert typical_spacing(PointCloud.from_arrays(points)) == pytest.approx(step, rel=0.15)


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.zeros((1, 3)), np.zeros((50, 3))])
def test_degenerate_clouds_have_a_spacing(points: np.ndarray) -> None:
    assert typical_spacing(PointCloud.from_arrays(points)) == 1.0


def test_two_points() -> None:
    assert 0 < typical_spacing(PointCloud.from_arrays([[0.0, 0, 0], [3, 0, 0]])) < 10


def test_the_nearest_point_is_found_in_any_part_of_the_file() -> None:
    points = np.random.default_rng(3).random((50_000, 3)) + np.array([1e6, 0, -1e6])
    cloud = PointCloud.from_arrays(points)
    for row in (0, 16383, 16384, 49_999):
        place = points[row] + 1e-5
        assert nearest_row(cloud, place) == (row, pytest.approx(3**0.5 * 1e-5, rel=0.02))
