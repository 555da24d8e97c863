"""Points near a ray are all that are near it, and no others."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.gpu.chunks import in_coarse_order, in_file_order
from viewer.scan.points import PointCloud
from viewer.scan.rays import Ray, rows_along

RAY = Ray(np.array([0.2, -0.1, 3.0]), np.array([0.1, 0.3, -2.0]))
REACH = 0.1


@pytest.fixture
def cloud() -> PointCloud:
    points = np.random.default_rng(0).uniform(-1, 1, (300_000, 3))
    return PointCloud.from_arrays(points, origin=np.zeros(3))


def test_points_near_a_ray_are_found_wherever_they_are_on_it(cloud: PointCloud) -> None:
    along = RAY.step / np.linalg.norm(RAY.step)
    away = np.linalg.norm(np.cross(cloud.positions - RAY.start, along), axis=1)
    np.testing.assert_allclose(RAY.away(cloud.positions), away, atol=1e-12)
    found = rows_along(cloud, RAY, REACH)
    assert len(found) > 1000
    assert set(np.flatnonzero(away < REACH - 1e-6)) <= set(found) <= set(np.flatnonzero(away < REACH + 1e-6))
    assert (np.diff(found) > 0).all()


def test_chunks_near_a_ray_hold_all_points_near_it(cloud: PointCloud) -> None:
    found = rows_along(cloud, RAY, REACH)
    for order in (in_file_order(cloud), in_coarse_order(cloud)):
        near = order.along(RAY, REACH)
        rows = order.rows_of(near, len(cloud))
        np.testing.assert_array_equal(rows_along(cloud, RAY, REACH, rows), found)
    assert len(near) < 0.2 * len(order.low)
