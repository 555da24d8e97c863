"""A surface that is clicked faces where the picture shows it to."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scenes import looking_down_z, plane, rarely_together, sphere

from viewer.analysis.seen_normal import seen_normal
from viewer.camera import Camera
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud

Draw = Callable[..., Surface]
SIZE = (180, 120)


@pytest.mark.parametrize(
    ("backend", "projection", "count"),
    [
        ("points", "orthographic", 40_000),
        ("surfels", "perspective", 10_000),
        *rarely_together(("points", "perspective", 40_000), ("surfels", "orthographic", 10_000)),
    ],
)
def test_a_floor_faces_up_whatever_stands_on_it(
    draw: Draw, backend: str, projection: str, count: int
) -> None:
    rng = np.random.default_rng(3)
    up = np.array([0.1, 0.2, 0.97]) / np.linalg.norm([0.1, 0.2, 0.97])
    floor = rng.uniform(-1, 1, (count, 3)) * (1, 1, 0)
    floor[:, 2] = -(floor[:, :2] @ up[:2]) / up[2] + rng.normal(0, 0.002, len(floor))
    pole = rng.uniform(-0.02, 0.02, (1000, 3)) + np.linspace(0, 0.6, 1000)[:, None] * up
    cloud = PointCloud.from_arrays(np.concatenate([floor, pole]))
    for azimuth in (0, 130):
        camera = Camera.orbit(cloud.bounds(), azimuth, 40, up="+z", projection=projection)
        found = seen_normal(draw(cloud, camera, SIZE, backend), 95, 66)
        assert found is not None
        assert found @ up > np.cos(np.radians(1.0))


def test_a_ball_faces_the_eye_in_its_middle(draw: Draw) -> None:
    cloud = sphere(20_000)
    camera = Camera.orbit(cloud.bounds(), 25, 40)
    found = seen_normal(draw(cloud, camera, SIZE, "surfels"), 90, 60)
    assert found is not None
    assert found @ camera.rotation()[2] > np.cos(np.radians(3.0))


def test_nothing_faces_nowhere(draw: Draw) -> None:
    cloud = sphere(2_000)
    surface = draw(cloud, Camera.orbit(cloud.bounds()), SIZE, "surfels")
    assert seen_normal(surface, 2, 2) is None
    alone = draw(plane(1, depth=4.0), looking_down_z(), SIZE, "points")
    seen = np.argwhere(np.isfinite(alone.depth))
    row, column = seen[len(seen) // 2]
    assert seen_normal(alone, int(column), int(row)) is None, "one point is no surface"
