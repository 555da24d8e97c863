"""Splats that are near and far at once: small ones are sent to their pixels, others listed by tiles."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scenes import NOTHING, looking_down_z
from test_instancing import assert_agree

from viewer.camera import Camera
from viewer.gpu.surface import Surface
from viewer.scan.points import PointCloud

pytestmark = pytest.mark.backend("surfels")
Draw = Callable[..., Surface]
SIZE = (200, 150)
SENT = "lists of small splats"


def hall(count: int) -> PointCloud:
    """The wall of a round hall about the eye's axis, 60 times as deep as wide, some of it inside out."""
    rng = np.random.default_rng(3)
    around, depth = rng.uniform(0, 2 * np.pi, count), rng.uniform(0.5, 60, count)
    wall = np.stack([np.cos(around), np.sin(around), 0 * around], axis=1)
    inwards = wall * np.where(rng.random(count) < 0.9, -1, 1)[:, None]
    positions = wall - np.outer(depth, [0.0, 0.0, 1.0])
    radii = np.full(count, 1.2 * np.sqrt(2 * np.pi * 60 / count))
    return PointCloud.from_arrays(positions, normals=inwards, colors=wall * 0.5 + 0.5, radii=radii)


CLOUD = hall(150_000)


@pytest.fixture
def surfels(draw: Draw) -> Draw:
    """surfels(cloud, camera, size, instancing=..., ...): one finished Surface of the nearest splats."""

    def surfels(cloud: PointCloud, camera: Camera, size: tuple[int, int] = SIZE, **params: object) -> Surface:
        return draw(cloud, camera, size, "surfels", params={"passes": "one", **params})

    return surfels


@pytest.mark.parametrize("cull_back", [False, True])
@pytest.mark.parametrize("yaw", [0.0, 0.3])
def test_both_together_are_the_picture_of_quads(surfels: Draw, cull_back: bool, yaw: float) -> None:
    camera = Camera((0.2, 0.1, 0.0), (yaw, 0.0, -1.0), fov_y=60)
    by_tiles, by_quads = (
        surfels(CLOUD, camera, instancing=way, cull_back=cull_back) for way in ("tiles", "gs")
    )
    assert SENT in by_tiles.stats.skipped
    assert SENT not in by_quads.stats.skipped
    assert_agree(by_tiles, by_quads, others=0.005)


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
    np.testing.assert_array_equal(by_tiles.row == NOTHING, by_quads.row == NOTHING)
    for wall in (len(CLOUD), len(CLOUD) + 1):
        assert np.count_nonzero(by_quads.row == wall) > 50
        assert np.count_nonzero((by_tiles.row == wall) != (by_quads.row == wall)) <= 3, "its border"
    assert (by_tiles.row != by_quads.row).mean() < 0.005


def test_a_second_pass_of_enlarged_ones_goes_on_from_there(surfels: Draw) -> None:
    camera = Camera((0.2, 0.1, 0.0), (0.1, 0.0, -1.0), fov_y=60)
    two = {"passes": "two", "enlarge": 1.5}
    by_tiles, by_quads = (surfels(CLOUD, camera, instancing=way, **two) for way in ("tiles", "gs"))
    assert SENT in by_tiles.stats.skipped
    np.testing.assert_array_equal(by_tiles.row == NOTHING, by_quads.row == NOTHING)
    assert_agree(by_tiles, by_quads, others=0.005)


def test_of_fewer_points_than_pixels_all_are_listed(surfels: Draw) -> None:
    few = hall(20_000)
    assert SENT not in surfels(few, Camera((0.2, 0.1, 0.0), (0.0, 0.0, -1.0), fov_y=60)).stats.skipped


def test_the_same_picture_twice(surfels: Draw) -> None:
    camera = Camera((0.2, 0.1, 0.0), (0.1, 0.0, -1.0), fov_y=60)
    first, second = (surfels(CLOUD, camera, instancing="tiles").arrays() for _ in range(2))
    for channel, values in first.items():
        np.testing.assert_array_equal(values, second[channel], channel)
