"""Splats in three words: packed, unpacked and estimated the slow way; a backend that draws them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from viewer.backends import Backend, FrameView
from viewer.camera import Camera
from viewer.gpu import gl
from viewer.gpu.context import Gpu
from viewer.gpu.pose import GpuPose
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.splatting.amplify import Points
from viewer.srgb import roots_from_bytes
from viewer.view import View

ROUND = 0xFFFF


@dataclass(frozen=True, eq=False)
class Packed:
    """Splats of a cloud's points. words: (N, 3) uint32, as shaders/amplify/packed.glsl reads them. rows: of
    the points that have one, ascending; None: all."""

    words: NDArray[np.uint32]
    rows: NDArray[np.uint32] | None = None

    @classmethod
    def of(cls, cloud: PointCloud) -> Packed:
        """The splats that a cloud has of its own."""
        assert cloud.normals is not None
        assert cloud.radii is not None
        if cloud.axes is None:
            return cls(pack(cloud.normals, cloud.radii))
        first, other = cloud.axes[:, :3], cloud.axes[:, 3]
        length = np.linalg.norm(first, axis=1)
        unit = first / length[:, None]
        longer = np.where((length >= other)[:, None], unit, np.cross(cloud.normals, unit))
        low, high = np.minimum(length, other), np.maximum(length, other)
        return cls(pack(cloud.normals, low, longer, low / high))

    def on(self, cloud: PointCloud, elliptical: bool = True) -> PointCloud:
        """The cloud with these as its own arrays."""
        normals, radii, axes = unpack(self.words)
        ellipses = (self.words[:, 2] >> 16 != ROUND) & elliptical
        return replace(
            cloud,
            normals=normals.astype(np.float32),
            radii=radii,
            axes=axes.astype(np.float32) if ellipses.any() else None,
        )


def pack(
    normals: NDArray,
    radii: NDArray,
    longer: NDArray | None = None,
    ratio: NDArray | float = 1.0,
) -> NDArray[np.uint32]:
    """(N, 3) words of unit normals (N, 3), shorter half-axes (N,), and the directions (N, 3) of the longer
    ones with the shorter one's share of each (N,); None: round."""
    n = normals / np.abs(normals).sum(axis=1, keepdims=True)
    sign = np.where(n[:, :2] < 0, -1.0, 1.0)
    net = np.where(n[:, 2:] < 0, (1 - np.abs(n[:, 1::-1])) * sign, n[:, :2])
    x, y = np.rint(np.clip(net, -1, 1) * 32767).astype(np.int16).view(np.uint16).astype(np.uint32).T
    words = np.empty((len(normals), 3), np.uint32)
    words[:, 0] = np.maximum(x | y << 16, 1)
    words[:, 1] = radii.astype(np.float32).view(np.uint32)
    words[:, 2] = ROUND << 16
    if longer is not None:
        u, v = _frame(unpack(words)[0])
        angle = np.arctan2((longer * v).sum(axis=1), (longer * u).sum(axis=1)) % np.pi
        turn = np.rint(angle / np.pi * ROUND).astype(np.uint32)
        words[:, 2] = turn | np.rint(np.broadcast_to(ratio, len(words)) * ROUND).astype(np.uint32) << 16
    return words


def unpack(words: NDArray[np.uint32]) -> tuple[NDArray, NDArray[np.float32], NDArray]:
    """Normals (N, 3), shorter half-axes (N,), and the longer ones with those, (N, 4); 0 where round."""
    net = np.ascontiguousarray(words[:, 0]).view(np.int16).reshape(-1, 2).clip(-32767) / 32767
    n = np.column_stack([net, 1 - np.abs(net).sum(axis=1)])
    under = np.maximum(-n[:, 2:], 0)
    n[:, :2] -= np.where(n[:, :2] < 0, -under, under)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    radii = np.ascontiguousarray(words[:, 1]).view(np.float32)
    angle, ratio = (words[:, 2] & ROUND) / ROUND * np.pi, np.maximum(words[:, 2] >> 16, 1) / ROUND
    u, v = _frame(n)
    longer = (np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v) * (radii / ratio)[:, None]
    axes = np.column_stack([longer, radii])
    axes[words[:, 2] >> 16 == ROUND] = 0
    return n, radii, axes


def _frame(n: NDArray) -> tuple[NDArray, NDArray]:
    """The directions in a plane that angles are counted from and towards: common/tangent.glsl."""
    u = np.cross([0.0, 1.0, 0.0], n)
    u = np.where((u**2).sum(axis=1, keepdims=True) < 1e-8, np.cross([0.0, 0.0, -1.0], n), u)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return u, np.cross(n, u)


def looks(cloud: PointCloud, normals: NDArray) -> NDArray[np.uint32]:
    """(N, 2) words as surfels/passes/look.glsl reads them."""
    words = np.zeros((len(cloud), 2), np.uint32)
    if cloud.colors is not None:
        roots = roots_from_bytes(cloud.colors).astype(np.uint32)
        words[:, 0] = roots[:, 0] | roots[:, 1] << 10 | roots[:, 2] << 20
    words[:, 1] = pack(normals, np.ones(len(normals)))[:, 0]
    return words


def estimate(cloud: PointCloud, camera: Camera, size: tuple[int, int], k: int = 10) -> Packed:
    """The splats of the points that are the nearest of their pixels, from their k nearest among these
    (Preiner 2012, 4 and 6)."""
    view = View.of(camera, size, cloud.origin, cloud.bounds())
    rows = visible_rows(cloud, view)
    points = cloud.positions[rows].astype(np.float64)
    distances, found = cKDTree(points).query(points, k=min(k, len(points)))
    offsets = points[found] - points[:, None]
    offsets -= offsets.mean(axis=1, keepdims=True)
    values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", offsets, offsets))
    normals, longer = vectors[:, :, 0], vectors[:, :, 2]
    normals[view.faces_away(points, normals)] *= -1
    radii = 2 * distances[:, -1] / np.sqrt(k)
    ratio = np.sqrt(np.maximum(values[:, 1], 0) / np.maximum(values[:, 2], 1e-30))
    words = np.zeros((len(cloud), 3), np.uint32)
    words[rows] = pack(normals, radii, longer, np.maximum(ratio, 0.1))
    return Packed(words, rows)


def visible_rows(cloud: PointCloud, view: View) -> NDArray[np.uint32]:
    """The rows of the points that are the nearest of their pixels, ascending."""
    pixels, depths = view.project(cloud.positions.astype(np.float64))
    at = np.floor(pixels).astype(int)
    inside = (depths >= view.near) & (at >= 0).all(axis=1) & (at < view.size).all(axis=1)
    rows = np.flatnonzero(inside)
    cells = at[rows, 1] * view.size[0] + at[rows, 0]
    order = np.lexsort((rows, depths[rows], cells))
    first = np.unique(cells[order], return_index=True)[1]
    return np.sort(rows[order][first]).astype(np.uint32)


@dataclass(frozen=True)
class NoParams:
    """Parameters: none."""


class _Splats(Backend):
    """Draws packed splats with a function of points and surface."""

    title = "Packed splats"
    good_for = "Tests"
    blends = True
    params_class = NoParams

    def __init__(
        self, packed: Packed, drawing: Callable[[Points, Surface], object], elliptical: bool
    ) -> None:
        super().__init__("packed")
        self._packed, self._drawing, self._elliptical = packed, drawing, elliptical

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        gpu, packed = pose.gpu, self._packed
        made = [
            _texels(gpu, packed.words, gl.RGB32UI),
            _texels(gpu, looks(pose.stored, unpack(packed.words)[0]), gl.RG32UI),
        ]
        rows = None if packed.rows is None else _texels(gpu, packed.rows, gl.R32UI)
        points = Points(
            pose,
            use_radii=True,
            count=len(pose.stored) if packed.rows is None else len(packed.rows),
            rows=rows,
            buffers=dict(zip(("splats", "looks"), made, strict=True)),
            elliptical=self._elliptical,
        )
        self._drawing(points, surface)
        gpu.discard(*made, rows)
        return False


def backend(
    packed: Packed, drawing: Callable[[Points, Surface], object], elliptical: bool = False
) -> Backend:
    """A backend that draws these splats, and does so with a function of points and surface."""
    return _Splats(packed, drawing, elliptical)


def _texels(gpu: Gpu, words: NDArray[np.uint32], texel_format: int) -> gl.BufferTexture:
    return gl.BufferTexture(
        gpu.ctx.buffer(np.ascontiguousarray(words) if words.size else bytes(16)), texel_format
    )
