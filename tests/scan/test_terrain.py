"""Grids of heights as range views from above: where they lie, which way they are turned, degrees."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from viewer.errors import InputError
from viewer.scan.terrain import Ground, metres_of_a_degree, terrain_view

UTM = Ground(left=376_000.0, first=3_808_000.0, right=30.0, down=-20.0, degrees=False, unit="m")
HEIGHTS = np.arange(12, dtype=np.int16).reshape(3, 4) * 10
ALL = np.ones((3, 4), bool)


def test_cells_lie_where_the_ground_says() -> None:
    there = ALL.copy()
    there[1, 2] = False
    view = terrain_view(HEIGHTS, there, UTM, "terrain")
    row, column = np.nonzero(there)
    expected = np.stack([376_000 + 30 * (column + 0.5), 3_808_000 - 20 * (row + 0.5), HEIGHTS[there]], axis=1)
    assert view.kind == "height"
    assert view.positions() == pytest.approx(expected, abs=1e-8)
    assert (view.unit, view.name, view.depth.dtype) == ("m", "terrain", np.float32)


@pytest.mark.parametrize(("right", "down"), [(30.0, 20.0), (-30.0, -20.0), (-30.0, 20.0)])
def test_other_orders_of_rows_and_columns(right: float, down: float) -> None:
    ground = replace(UTM, right=right, down=down)
    view = terrain_view(HEIGHTS, HEIGHTS != 60, ground, "terrain")
    row, column = np.nonzero((HEIGHTS != 60)[ground.turned])
    x, y = UTM.left + right * (np.arange(4) + 0.5), UTM.first + down * (np.arange(3) + 0.5)
    heights = HEIGHTS[ground.turned][row, column]
    expected = np.stack([np.sort(x)[column], np.sort(y)[::-1][row], heights], axis=1)
    assert view.positions() == pytest.approx(expected, abs=1e-8)
    slope = right / abs(right) * 10 / 30, down / abs(down) * 40 / 20
    normal = np.array([-slope[0], -slope[1], 1]) / np.linalg.norm([*slope, 1])
    flat = terrain_view(HEIGHTS, ALL, ground, "terrain")
    assert flat.normals() == pytest.approx(np.tile(normal, (12, 1)), abs=1e-5)


def test_degrees_are_as_long_as_on_the_earth() -> None:
    """Against the ellipsoid's radii of curvature."""
    a, e2 = 6_378_137.0, 0.006_694_379_990_14
    for latitude in (0.0, 36.6, -52.0, 80.0):
        sine = np.sin(np.radians(latitude))
        east = np.radians(a / np.sqrt(1 - e2 * sine**2)) * np.cos(np.radians(latitude))
        north = np.radians(a * (1 - e2) / (1 - e2 * sine**2) ** 1.5)
        assert metres_of_a_degree(latitude) == pytest.approx((east, north), abs=0.1)
    assert metres_of_a_degree(45.0)[1] == pytest.approx(111_131.75, abs=0.05)


def test_degrees_become_lengths_around_the_middle() -> None:
    ground = Ground(left=-84.0, first=36.0, right=0.001, down=-0.001, degrees=True, unit="ft")
    view = terrain_view(HEIGHTS, ALL, ground, "terrain")
    x, y, z = view.positions().T
    east, north = np.array(metres_of_a_degree(36 - 0.0015)) / 0.3048
    assert np.ptp(x) == pytest.approx(0.003 * east, rel=1e-9)
    assert np.ptp(y) == pytest.approx(0.002 * north, rel=1e-9)
    assert (x.mean(), y.mean()) == pytest.approx((0, 0), abs=1e-9)
    assert z.tolist() == HEIGHTS.ravel().tolist()


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"right": 0.0}, "the cells have the unusable size 0 x -20, starting at 376000"),
        ({"down": np.nan}, "the cells have the unusable size 30 x nan"),
        ({"left": np.inf}, "starting at inf"),
        ({"degrees": True}, "the centre of the terrain is at .* degrees of latitude"),
        ({"degrees": True, "first": 40.0, "down": -0.1, "unit": "units"}, "the heights are in 'units', but"),
    ],
)
def test_grounds_that_are_none(changes: dict[str, object], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        terrain_view(HEIGHTS, ALL, replace(UTM, **changes), "terrain")
