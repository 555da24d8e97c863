"""A ball of splats, its cameras, and what two pictures of it have in common."""

from __future__ import annotations

import numpy as np
import pytest
from hardware import at_borders, moved
from numpy.typing import NDArray
from scenes import NOTHING, sphere

from viewer.camera import Camera
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud

SIZE = (320, 240)
CLOUD = sphere(12_000)  # several ranges of uniform blocks
CAMERAS = {
    "perspective": Camera.orbit(CLOUD.bounds(), 30, 20, aspect=4 / 3),
    "orthographic": Camera.orbit(CLOUD.bounds(), 30, 20, aspect=4 / 3, projection="orthographic"),
    "inside": Camera((0.0, 0.1, 0.2), (0.6, 0.3, 0.5), fov_y=70),
    "near plane": Camera((0.0, 0.1, 1.05), (0.6, 0.3, 0.5), fov_y=70, near=0.08),
}
every_camera = pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)


def assert_equal(one: Surface, other: Surface) -> None:
    """Same points and depths, bit for bit."""
    np.testing.assert_array_equal(one.row, other.row)
    np.testing.assert_array_equal(one.depth, other.depth)


def assert_covers_the_same(one: Surface, other: Surface) -> None:
    """Something is seen at the same pixels, but at outlines where a rasteriser moved corners."""
    differ = (one.row != NOTHING) != (other.row != NOTHING)
    assert np.count_nonzero(differ) <= at_borders(one)


def assert_agree(one: Surface, other: Surface, others: float) -> None:
    """Same splats: they cover the same pixels, and where they show another one, the depths are the same
    but for rounding, or the pixel lies on a splat's border. others: the share that may be another one in
    software; on hardware any, as which of those that are as near is shown goes by last bits."""
    covered, both = one.row != NOTHING, (one.row != NOTHING) & (other.row != NOTHING)
    few = max(1, round(1e-4 * np.count_nonzero(covered)), at_borders(one))
    assert np.count_nonzero(covered != (other.row != NOTHING)) <= few
    another = both & (one.row != other.row)
    if one.gpu.software:
        assert np.count_nonzero(another) <= max(few, others * np.count_nonzero(covered))
    error, rounding = np.zeros(one.depth.shape), moved(one) + moved(other)
    error[both] = np.abs(one.depth[both] / other.depth[both] - 1)
    assert np.count_nonzero((error > 5e-5 + rounding)[another]) <= few
    assert (error < 2e-4 + rounding)[both & ~another].all()
    levels = np.abs(one.color - other.color).max(axis=-1) >= 0.009  # a level of the brightest
    assert np.count_nonzero(levels[both & ~another]) <= at_borders(one)


def elliptical(cloud: PointCloud, stretch: float = 3.0, seed: int = 1) -> PointCloud:
    """The same points with ellipses in their discs, narrower in one direction by up to so much."""
    assert cloud.radii is not None
    assert cloud.normals is not None
    rng = np.random.default_rng(seed)
    tangents = np.cross(cloud.normals, rng.normal(size=(len(cloud), 3)))
    lengths = cloud.radii[:, None] * stretch ** -rng.uniform((0, 0), (1, 0), (len(cloud), 2))
    lengths = rng.permuted(lengths, axis=1)
    tangents *= (lengths[:, 0] / np.linalg.norm(tangents, axis=1))[:, None]
    return with_axes(cloud, np.column_stack([tangents, lengths[:, 1]]))


def with_axes(cloud: PointCloud, axes: NDArray[np.floating]) -> PointCloud:
    return PointCloud.from_arrays(
        cloud.positions, normals=cloud.normals, colors=cloud.colors, radii=cloud.radii, axes=axes
    )


ELLIPSES = elliptical(CLOUD)
