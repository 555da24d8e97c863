"""Bare points with a camera before them, whose neighbourhoods are hard to find in one way or another."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.bounds import Bounds
from viewer.camera import Camera
from viewer.scan.points import PointCloud

Points = NDArray[np.float64]  # (N, 3)

SIZE = (160, 120)


@dataclass(frozen=True, eq=False)
class BareScene:
    """Points and how they are looked at."""

    cloud: PointCloud
    camera: Camera
    size: tuple[int, int] = SIZE


def on_unit_sphere(count: int, seed: int = 0) -> Points:
    """Random points on the unit sphere, as dense everywhere."""
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def bumpy(count: int = 6000) -> Points:
    """A sphere with bumps, whose points are six times as dense at one end as at the other."""
    points = on_unit_sphere(3 * count, 1)
    keep = np.random.default_rng(2).random(len(points)) < 0.3 + 0.25 * points[:, 1]
    points = points[keep]
    return points * (1 + 0.1 * np.sin(9 * points).prod(axis=1, keepdims=True))


def seen(points: Points, size: tuple[int, int] = SIZE, turn: float = 20, **fields: object) -> BareScene:
    """Points seen whole, from a little above."""
    cloud = PointCloud.from_arrays(points)
    camera = Camera.orbit(cloud.bounds(), turn, 15, aspect=size[0] / size[1], **fields)  # type: ignore[arg-type]
    return BareScene(cloud, camera, size)


def _sphere() -> BareScene:
    return seen(on_unit_sphere(5000))


def _bumpy() -> BareScene:
    return seen(bumpy())


def _two_scales() -> BareScene:
    """A sphere on top of one that is 30 times as large, each of as many points (Fig. 7)."""
    small = on_unit_sphere(4000, 3) / 30 + np.array([0.0, 1.02, 0.1])
    return seen(np.concatenate([on_unit_sphere(4000, 4), small]), (320, 240))


def _noisy() -> BareScene:
    rng = np.random.default_rng(5)
    points = on_unit_sphere(5000, 6)
    strays = rng.uniform(-1.5, 1.5, (60, 3))
    return seen(np.concatenate([points * rng.normal(1, 0.02, (len(points), 1)), strays]))


def _copied() -> BareScene:
    """A fifth of the points lie where others do, one of them thirty times."""
    points = on_unit_sphere(4000, 7)
    points[800:1600] = points[:800]
    nearest = points[np.argmax(points[:, 2])]
    return seen(np.random.default_rng(8).permutation(np.concatenate([points, np.tile(nearest, (30, 1))])))


def _one_place() -> BareScene:
    return seen(np.tile([0.25, -0.5, 2.0], (50, 1)))


def _line() -> BareScene:
    return seen(np.linspace([-1, -0.4, 0.3], [1, 0.5, -0.3], 300))


def _lattice() -> BareScene:
    """A plane of squares, askew to the picture: every distance there is several times over."""
    x, y = np.meshgrid(np.arange(64) / 64, np.arange(64) / 64)
    return seen(np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1), turn=35)


def _cubes() -> BareScene:
    """A lattice in space: what is seen lies behind what is seen, and all distances are equal."""
    steps = np.arange(12) / 16
    return seen(np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3))


def _few(count: int) -> Callable[[], BareScene]:
    points = np.array([[0.0, 0.0, 0.0], [0.125, 0.0, 0.0], [0.0, 0.25, 0.0]])[:count]

    def make() -> BareScene:
        return BareScene(PointCloud.from_arrays(points), Camera((0.1, 0.1, 2.0), (0.1, 0.1, 0.0)))

    return make


def _far_away() -> BareScene:
    return seen(bumpy() + np.array([1e7, 5e6, -2e7]))


def _scaled(factor: float) -> Callable[[], BareScene]:
    return lambda: seen(bumpy() * factor)


def _from_inside() -> BareScene:
    """The eye among the points: half of them are behind it, some very near."""
    points = np.concatenate([on_unit_sphere(6000, 9), 0.05 * on_unit_sphere(400, 10)])
    return BareScene(PointCloud.from_arrays(points), Camera((0.0, 0.0, 0.01), (0.0, 0.1, -1.0), fov_y=90.0))


def _orthographic() -> BareScene:
    return seen(bumpy(), projection="orthographic")


def _cut() -> BareScene:
    """So near that the picture's borders cut the surface."""
    whole = seen(bumpy(20_000))
    return BareScene(whole.cloud, whole.camera.at_distance(1.6))


def _sheets() -> BareScene:
    """Twelve sheets behind each other, the nearer the sparser: what is behind shows between."""
    rng = np.random.default_rng(11)
    sheets = [
        np.column_stack(
            [rng.uniform(-1, 1, (200 + 150 * number, 2)), np.full(200 + 150 * number, -0.2 * number)]
        )
        for number in range(12)
    ]
    return seen(np.concatenate(sheets), turn=3)


def _strays() -> BareScene:
    """A surface, pairs and threes of points far from it, and one point very far away."""
    rng = np.random.default_rng(12)
    groups = [
        place + rng.normal(0, 1e-3, (1 + number % 3, 3))
        for number, place in enumerate(rng.uniform(-3, 3, (24, 3)))
    ]
    cloud = PointCloud.from_arrays(
        np.concatenate([on_unit_sphere(3000, 13), *groups, [[300.0, 20.0, -900.0]]])
    )
    bounds = Bounds(np.full(3, -3.0), np.full(3, 3.0))
    return BareScene(cloud, Camera.orbit(bounds, 10, 10, aspect=SIZE[0] / SIZE[1]))


def ring_scan(noise: float = 0.0) -> Points:
    """The ground and a wall as a scanner that turns sees them: 720 points a ring, and rings up to eight times
    as far apart as ten of their points reach. noise: of distances, scan units."""
    rng = np.random.default_rng(14)
    turned, below = np.meshgrid(np.radians(np.arange(0, 360, 0.5)), np.radians(np.arange(-34, 20, 1.5)))
    turned = turned + np.radians(rng.uniform(0, 0.5, (len(turned), 1)))  # rings begin anywhere
    rays = np.stack([np.cos(turned) * np.cos(below), np.sin(turned) * np.cos(below), np.sin(below)], axis=-1)
    rays = rays.reshape(-1, 3)
    with np.errstate(divide="ignore"):
        ground, wall = -1.5 / rays[:, 2], 9.0 / rays[:, 0]
    distance = np.minimum(np.where(ground > 0, ground, np.inf), np.where(wall > 0, wall, np.inf))
    kept = distance < 12.0
    distance = distance[kept] + rng.normal(0, noise, np.count_nonzero(kept)) if noise else distance[kept]
    return rays[kept] * distance[:, None]


def ring_scene(noise: float = 0.0, size: tuple[int, int] = (320, 240)) -> BareScene:
    """Ground and wall seen from above the scanner, with the place below it at the border of the picture."""
    camera = Camera((-9.0, -6.0, 7.0), (2.5, 0.0, -0.8), up=(0.0, 0.0, 1.0), fov_y=50.0)
    return BareScene(PointCloud.from_arrays(ring_scan(noise)), camera, size)


SCENES: dict[str, Callable[[], BareScene]] = {
    "sphere": _sphere,
    "bumpy": _bumpy,
    "two-scales": _two_scales,
    "noisy": _noisy,
    "copied": _copied,
    "one-place": _one_place,
    "line": _line,
    "lattice": _lattice,
    "cubes": _cubes,
    "one-point": _few(1),
    "two-points": _few(2),
    "three-points": _few(3),
    "far-away": _far_away,
    "tiny": _scaled(1e-6),
    "huge": _scaled(1e6),
    "from-inside": _from_inside,
    "orthographic": _orthographic,
    "cut": _cut,
    "sheets": _sheets,
    "strays": _strays,
    "rings": ring_scene,
}

every_scene = pytest.mark.parametrize("name", SCENES)
