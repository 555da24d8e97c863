"""Surfaces of stretched splats: few close them, they blend no deeper than they are wide, outlines stay."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import NOTHING, sphere
from test_elliptical import rays

from viewer.bench.scenes import samples
from viewer.camera import Camera
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.view import View

pytestmark = pytest.mark.backend("surfels")
Draw = Callable[..., Surface]
SIZE = (320, 240)


@pytest.fixture
def surfels(draw: Draw) -> Draw:
    """surfels(cloud, camera, size, instancing=..., ...): one finished Surface."""

    def surfels(cloud: PointCloud, camera: Camera, size: tuple[int, int] = SIZE, **params: object) -> Surface:
        return draw(cloud, camera, size, "surfels", params=params)

    return surfels


def cylinder(rings: int, around: int) -> PointCloud:
    """Rings of ellipses that just close it."""
    return PointCloud.from_arrays(**samples.rings(rings, around))


def holes_and_spill(surfels: Draw, cloud: PointCloud) -> tuple[int, int]:
    """Pixels of the cylinder, but for its ends, that stay empty, and pixels beside it that do not."""
    camera = Camera((0.0, 0.0, 6.0), (0, 0, 0), fov_y=45)
    start, step = rays(View.of(camera, SIZE, np.zeros(3), cloud.bounds()))
    start = start + np.array([0, 0, 6.0])
    a, b, c = ((v[..., ::2] * w[..., ::2]).sum(-1) for v, w in ((step, step), (step, start), (start, start)))
    root = b * b - a * (c - 1)
    height = start[..., 1] - (b + np.sqrt(np.maximum(root, 0))) / a * step[..., 1]
    body, beside = (root > 0) & (np.abs(height) < 1.5), root <= 0
    drawn = surfels(cloud, camera, SIZE, cull_back=True).row != NOTHING
    return int(np.count_nonzero(body & ~drawn)), int(np.count_nonzero(drawn & beside))


def test_stretched_splats_close_what_needs_many_more_round_ones(surfels: Draw) -> None:
    """Rings far apart. Circles of the same area leave holes, circles as large as the ellipses are long stick
    out; circles that do neither are five times as many."""
    few = cylinder(rings=8, around=60)
    assert holes_and_spill(surfels, few) == (0, 0)
    assert holes_and_spill(surfels, replace(few, axes=None))[0] > 1000
    assert holes_and_spill(surfels, as_long(few))[1] > 500
    assert holes_and_spill(surfels, as_long(cylinder(rings=20, around=60)))[1] > 50
    assert holes_and_spill(surfels, as_long(cylinder(rings=40, around=60))) == (0, 0)


def as_long(cloud: PointCloud) -> PointCloud:
    """Circles with the ellipses' longer half-axes."""
    return replace(cloud, axes=None, radii=longer(cloud))


def longer(cloud: PointCloud) -> NDArray[np.float32]:
    """The longer half-axes, (N,)."""
    assert cloud.axes is not None
    return np.maximum(np.linalg.norm(cloud.axes[:, :3], axis=1), cloud.axes[:, 3])


def ellipsoid(count: int, stretch: float = 6.0) -> PointCloud:
    """A stretched sphere, its splats the ellipses that the sphere's discs become."""
    cloud, scale = sphere(count), np.array([1.0, stretch, 1.0])
    assert cloud.normals is not None
    assert cloud.radii is not None
    n = cloud.normals.astype(np.float64)
    u = np.cross(n, np.roll(n, 1, axis=1))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    half = np.stack([u, np.cross(n, u)], axis=2) * scale[:, None] * cloud.radii[:, None, None]
    directions, lengths, _ = np.linalg.svd(half, full_matrices=False)
    axes = np.column_stack([directions[:, :, 0] * lengths[:, :1], lengths[:, 1]])
    return PointCloud.from_arrays(cloud.positions * scale, normals=n / scale, colors=cloud.colors, axes=axes)


def test_the_far_side_of_what_is_thin_does_not_blend_in(surfels: Draw) -> None:
    """The second pass goes as deep as the radius of a circle of the same area. As deep as ellipses are long,
    it would reach through the body."""
    camera, params = Camera((9.0, 5.0, 14.0), (0, 0, 0), fov_y=45), {"passes": "two", "enlarge": 1.0}
    cloud = ellipsoid(1600)
    both, front = (surfels(cloud, camera, SIZE, cull_back=cull_back, **params) for cull_back in (False, True))
    deep = surfels(replace(cloud, radii=longer(cloud)), camera, SIZE, **params)
    covered = (both.row != NOTHING) & (front.row != NOTHING)
    away, away_if_deep = (np.abs(surface.color - front.color)[covered].mean() for surface in (both, deep))
    assert away_if_deep > 5 * away


@pytest.mark.parametrize("way", ["tiles", "gs"])
def test_enlarging_closes_gaps_and_keeps_the_outline(surfels: Draw, way: str) -> None:
    """What was filled is taken back by as much as ellipses grow in each direction: by a radius for all, more
    gaps would stay open, or the outline would grow."""
    camera, size = Camera((9.0, 5.0, 14.0), (0, 0, 0), fov_y=30), (320, 320)
    cloud, truth = ellipsoid(1600), np.isfinite(surfels(ellipsoid(50_000), camera, size).depth)
    params = {"instancing": way, "passes": "two", "cull_back": True}

    def holes_and_beyond(radius_scale: float, enlarge: float) -> tuple[int, int]:
        drawn = np.isfinite(
            surfels(cloud, camera, size, radius_scale=radius_scale, enlarge=enlarge, **params).depth
        )
        return int(np.count_nonzero(truth & ~drawn)), int(np.count_nonzero(drawn & ~truth))

    open_before, beyond_before = holes_and_beyond(0.4, enlarge=1.0)
    open_after, beyond_after = holes_and_beyond(0.4, enlarge=2.0)
    assert open_before > 300
    assert open_after < open_before / 20
    outline = 2 * size[1]
    assert beyond_after < beyond_before + outline / 8
