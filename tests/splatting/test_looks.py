"""Looks of points, packed on the GPU, are to the bit what a plain version on the CPU makes of them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.drawing.renderer import Renderer
from viewer.gpu.pose import GpuPose
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.splatting.looks import PackedLooks
from viewer.srgb import roots_from_bytes

COUNT = 50_000


def folded(normals: NDArray[np.float32]) -> NDArray[np.uint32]:
    """The words of normals of any length, (N, 3); 0 where one is missing."""
    x, y, z = normals.T
    with np.errstate(all="ignore"):
        largest = np.abs(normals).max(axis=1)
        x, y, z = x / largest, y / largest, z / largest
        length = np.abs(x) + np.abs(y) + np.abs(z)
        x, y, z = x / length, y / length, z / length
        usable = np.isfinite(x + y + z)
    x, y, z = (np.where(usable, column, np.float32(0)) for column in (x, y, z))
    turned_x, turned_y = (np.copysign(1 - np.abs(b), a) for a, b in ((x, y), (y, x)))
    net = np.stack([np.where(z < 0, turned_x, x), np.where(z < 0, turned_y, y)], axis=1)
    words = np.rint(net * 32767).astype("<i2").view("<u4")[:, 0]
    return np.where(usable, np.maximum(words, 1), np.uint32(0))


def clouds() -> dict[str, PointCloud]:
    rng = np.random.default_rng(2)
    normals = rng.normal(size=(COUNT, 3)).astype(np.float32)
    normals[::2] /= np.linalg.norm(normals[::2], axis=1, keepdims=True)
    normals[:9] = [
        [0, 0, 1], [0, 0, -1], [0, 0, 0], [np.nan, 0, 1], [-0.0, 0.0, -1.0], [1e30, 1e30, -1e30],
        [0, -3, 0], [np.inf, 0, 0], [-1e-20, 1e-20, 0],
    ]  # fmt: skip
    colors = rng.integers(0, 256, (COUNT, 3), np.uint8)
    colors[:256] = np.arange(256, dtype=np.uint8)[:, None]
    positions = rng.random((COUNT, 3))
    return {
        "both": PointCloud.from_arrays(positions, normals=normals, colors=colors),
        "colors": PointCloud.from_arrays(positions, colors=colors),
        "normals": PointCloud.from_arrays(positions, normals=normals),
        "neither": PointCloud.from_arrays(positions),
    }


@pytest.mark.parametrize("name", ["both", "colors", "normals", "neither"])
def test_looks_are_those_of_the_plain_version(renderer: Renderer, name: str) -> None:
    """On graphics cards, whose divisions round, within one step of the net."""
    cloud, gpu = clouds()[name], renderer.gpu
    packed = GpuPose(gpu, Pose(0, 0.0, name, cloud)).cached(PackedLooks)
    looks = gpu.read(packed.texels.buffer, np.uint32).reshape(-1, 2)
    light, shape = np.zeros((2, COUNT), np.uint32)
    if cloud.colors is not None:
        red, green, blue = roots_from_bytes(cloud.colors[:, :3]).astype(np.uint32).T
        light = red | green << 10 | blue << 20
    if cloud.normals is not None:
        shape = folded(cloud.normals)
    assert (looks[:, 0] == light).all()
    if gpu.software:
        assert (looks[:, 1] == shape).all()
    steps = (each.astype("<u4").view("<i2").astype(int) for each in (looks[:, 1].copy(), shape))
    assert np.abs(np.subtract(*steps)).max() <= 1
