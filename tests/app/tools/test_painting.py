"""Painted regions: the eraser removes points, and spheres that no longer count are dropped."""

from __future__ import annotations

import numpy as np

from viewer.app.tools._painting import painted_region, simplified
from viewer.scan.points import PointCloud

LINE = PointCloud.from_arrays(np.array([[x, 0.0, 0.0] for x in range(10)]))


def rows(*spheres: tuple[float, float, float, float]) -> list[int]:
    kept = simplified(spheres)
    found = painted_region(kept).rows(LINE, {}).tolist()
    assert found == painted_region(spheres).rows(LINE, {}).tolist(), "it is the same region"
    return found


def test_the_eraser_removes_what_was_painted_before() -> None:
    large, hole = (4.0, 0, 0, 3.5), (4.0, 0, 0, -1.0)
    assert rows(large, hole) == [1, 2, 6, 7]
    assert rows(hole, large) == [1, 2, 3, 4, 5, 6, 7]
    assert rows(large, hole, (4.0, 0, 0, 0.5)) == [1, 2, 4, 6, 7]


def test_spheres_that_do_not_count_are_dropped() -> None:
    small, eraser, away = (4.0, 0, 0, 1.0), (4.5, 0, 0, -2.0), (9.0, 0, 0, -1.0)
    assert simplified((small, away)) == (small,), "it erases nothing"
    assert simplified((small, eraser)) == (), "nothing is left"
    assert simplified(((0.0, 0, 0, 3.0), small, eraser)) == ((0.0, 0, 0, 3.0), eraser)
