"""Points, numbers and normals found of those that are seen: a backend for tests of looks that show them.

Rows that no pixel has get numbers that would be noticed.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from viewer.backends import FrameView, Suited
from viewer.backends import points as plain
from viewer.gpu import gl
from viewer.gpu.context import Gpu
from viewer.gpu.pose import GpuPose
from viewer.look import ValueKind
from viewer.picture.surface import NOTHING, Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

VALUES = {
    "gap": ValueKind("Distance to the point before, scan units", is_length=True, is_log=True),
    "slope": ValueKind("How steep the line to the origin is, unknown on the left"),
    "odd": ValueKind("1 where the row is odd, 0 elsewhere", range=(0.0, 1.0)),
}
UNSEEN = np.float32(1e20)


def normals(cloud: PointCloud) -> NDArray[np.float32]:
    """What is found as normals, (N, 3): away from the origin, of no certain length."""
    return cloud.positions


def numbers(cloud: PointCloud) -> Mapping[str, NDArray[np.float32]]:
    """All that is found of a cloud, (N,) each: the plain twin too."""
    positions = cloud.positions.astype(float)
    gap = np.linalg.norm(np.diff(positions, axis=0, prepend=positions[:1]), axis=1)
    steep = np.abs(positions[:, 1]) / np.maximum(np.linalg.norm(positions, axis=1), 1e-9)
    found = {
        "gap": gap,
        "slope": np.where(positions[:, 0] < -0.5, np.nan, steep),
        "odd": np.arange(len(cloud)) % 2,
    }
    return {name: values.astype(np.float32) for name, values in found.items()}


class _Found:
    """A number of each row on the GPU."""

    def __init__(self, gpu: Gpu, _: tuple[int, int]) -> None:
        self._gpu, self.nbytes = gpu, 0
        self.texels: gl.BufferTexture | None = None

    def write(self, values: NDArray[np.float32]) -> gl.BufferTexture:
        self.release()
        data = values if values.size else np.zeros(1, np.float32)
        self.texels, self.nbytes = gl.BufferTexture(self._gpu.ctx.buffer(data), gl.R32F), data.nbytes
        return self.texels

    def release(self) -> None:
        if self.texels is not None:
            self.texels.release()
            self.texels = None


class Finding(plain.PointSquares):
    """Points that find numbers and normals."""

    title = "Finding"
    good_for = "Tests"
    accumulates = False
    finds_normals = True
    values = VALUES

    def suits(self, pose: Pose) -> Suited | None:
        """No scan."""
        return None

    def offers(self, pose: Pose) -> tuple[dict[str, object], ...]:
        """Nothing."""
        return ()

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Scatter the points, and give the normals, and the number that is wanted, of those that are seen."""
        refinable = super().draw(pose, frame, surface)
        rows = surface.row
        is_seen = rows != NOTHING
        own = np.zeros((*rows.shape, 3), np.float32)
        own[is_seen] = normals(pose.cloud)[rows[is_seen]]
        surface.own("normal").buffer.write(own)
        if (name := surface.wanted) is not None:
            values = np.full(len(pose.cloud), UNSEEN)
            values[rows[is_seen]] = numbers(pose.cloud)[name][rows[is_seen]]
            surface.give(surface.cached(_Found).write(values))
        return refinable


BACKEND = Finding("finding")
