"""Splats that are near and far at once: where lists are too long, small ones are sent to their pixels."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scenes import looking_down_z, rarely_together
from splat_scenes import assert_agree, assert_covers_the_same

from viewer.bench.scenes import samples
from viewer.camera import Camera
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud

pytestmark = pytest.mark.backend("surfels")
Draw = Callable[..., Surface]
SIZE = (200, 150)
SENT = "lists of small splats"
OTHERS = 0.01  # of the pixels: at the far end, many splats of a pixel are as near but for rounding


def hall(count: int) -> PointCloud:
    return PointCloud.from_arrays(**samples.hall(count))


CLOUD = hall(300_000)


@pytest.fixture
def surfels(draw: Draw) -> Draw:
    """surfels(cloud, camera, size, instancing=..., ...): one finished Surface of the nearest splats."""

    def surfels(cloud: PointCloud, camera: Camera, size: tuple[int, int] = SIZE, **params: object) -> Surface:
        return draw(cloud, camera, size, "surfels", params={"passes": "one", **params})

    return surfels


@pytest.mark.parametrize(
    ("cull_back", "yaw"), [(False, 0.0), (True, 0.3), *rarely_together((True, 0.0), (False, 0.3))]
)
def test_both_together_are_the_picture_of_quads(surfels: Draw, cull_back: bool, yaw: float) -> None:
    camera = Camera((0.2, 0.1, 0.0), (yaw, 0.0, -1.0), fov_y=60)
    by_tiles, by_quads = (
        surfels(CLOUD, camera, instancing=way, cull_back=cull_back) for way in ("tiles", "gs")
    )
    assert SENT in by_tiles.stats.skipped
    assert SENT not in by_quads.stats.skipped
    assert_agree(by_tiles, by_quads, others=OTHERS)


def test_large_splats_hide_small_ones_and_are_hidden_by_them(surfels: Draw) -> None:
    camera = looking_down_z(fov_y=60)
    walls = PointCloud.from_arrays(
        [[0.4, 0.0, -0.3], [0.0, -4.0, -20.0]], normals=[[0, 0, 1]] * 2, radii=[0.31, 4.0]
    )
    positions, normals, radii = (
        np.concatenate(both)
        for both in zip(*((c.world(), c.normals, c.radii) for c in (CLOUD, walls)), strict=True)
    )
    cloud = PointCloud.from_arrays(positions, normals=normals, radii=radii)
    by_tiles, by_quads = (surfels(cloud, camera, instancing=way) for way in ("tiles", "gs"))
    assert {SENT, "large splats in tiles"} <= by_tiles.stats.skipped.keys()
    assert_covers_the_same(by_tiles, by_quads)
    for wall in (len(CLOUD), len(CLOUD) + 1):
        assert np.count_nonzero(by_quads.row == wall) > 50
        assert np.count_nonzero((by_tiles.row == wall) != (by_quads.row == wall)) <= 3, "its border"
    assert_agree(by_tiles, by_quads, others=OTHERS)


@pytest.mark.slow
def test_a_second_pass_of_enlarged_ones_goes_on_from_there(surfels: Draw) -> None:
    camera = Camera((0.2, 0.1, 0.0), (0.1, 0.0, -1.0), fov_y=60)
    two = {"passes": "two", "enlarge": 1.5}
    by_tiles, by_quads = (surfels(CLOUD, camera, instancing=way, **two) for way in ("tiles", "gs"))
    assert SENT in by_tiles.stats.skipped
    assert_covers_the_same(by_tiles, by_quads)
    assert_agree(by_tiles, by_quads, others=OTHERS)


def test_where_lists_are_short_enough_all_are_listed(surfels: Draw) -> None:
    camera = Camera((0.2, 0.1, 0.0), (0.0, 0.0, -1.0), fov_y=60)
    skipped = surfels(hall(100_000), camera, instancing="tiles").stats.skipped
    assert skipped.keys().isdisjoint({SENT, "tiles"})


def test_the_same_picture_twice(surfels: Draw) -> None:
    camera = Camera((0.2, 0.1, 0.0), (0.1, 0.0, -1.0), fov_y=60)
    first, second = (surfels(CLOUD, camera, instancing="tiles").arrays() for _ in range(2))
    for channel, values in first.items():
        np.testing.assert_array_equal(values, second[channel], channel)
