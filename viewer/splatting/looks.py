"""Looks: what splats give where they are blended, two words a point (shaders/surfels/passes/look.glsl)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..gpu import gl
from ..scan.points import PointCloud
from ..srgb import roots_from_bytes
from .amplify import Points

_CHUNK = 1 << 15  # points packed at a time, so that they stay near the processor


def looks_of(points: Points) -> gl.BufferTexture:
    """Colour and normal of each row: what the points bring, else the pose's, made when first asked for."""
    return points.buffers.get("looks") or points.pose.packed(_pack_looks, texel_format=gl.RG32UI)


def _pack_looks(cloud: PointCloud) -> NDArray[np.uint32]:
    """Colour and normal of each point in two words, (N, 2): square roots of linear light, 3 x 10 bits, and
    what common/octahedron.glsl makes of normals."""
    looks = np.zeros((len(cloud), 2), np.uint32)
    for first in range(0, len(cloud), _CHUNK):
        part = slice(first, first + _CHUNK)
        if cloud.colors is not None:
            red, green, blue, _ = cloud.colors[part].T
            looks[part, 0] = _ROOTS[0][red] | _ROOTS[1][green] | _ROOTS[2][blue]
        if cloud.normals is not None:
            looks[part, 1] = _folded(cloud.normals[part])
    return looks


def _folded(normals: NDArray[np.float32]) -> NDArray[np.uint32]:
    """Words of normals of any length, (N, 3), as common/octahedron.glsl has them; 0 where one is missing."""
    x, y, z = np.ascontiguousarray(normals.T)  # by columns: numpy is slow along the short axis
    with np.errstate(all="ignore"):
        # Of its largest, so that no sum of the three is beyond float32.
        largest = np.maximum(np.maximum(np.abs(x), np.abs(y)), np.abs(z))
        x, y, z = x / largest, y / largest, z / largest
        length = np.abs(x) + np.abs(y) + np.abs(z)
        x, y, z = x / length, y / length, z / length
        usable = np.isfinite(x + y + z)
    x, y, z = (np.where(usable, column, np.float32(0)) for column in (x, y, z))
    under = z < 0
    turned_x, turned_y = (np.copysign(1 - np.abs(b), a) for a, b in ((x, y), (y, x)))
    net = np.stack([np.where(under, turned_x, x), np.where(under, turned_y, y)], axis=1)
    words = np.rint(net * 32767).astype("<i2").view("<u4")[:, 0].astype(np.uint32)
    return np.where(usable, np.maximum(words, 1), np.uint32(0))


_ROOTS = [
    roots_from_bytes(np.arange(256, dtype=np.uint8)).astype(np.uint32) << shift for shift in (0, 10, 20)
]
