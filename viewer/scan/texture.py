"""Textures of meshes: the colours that pictures give the vertices, and points between the vertices."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_AT_ONCE = 1 << 17  # positions worked on together
_HALVINGS = 40  # steps in which a density is found


@dataclass(frozen=True, eq=False)
class TexturedMesh:
    """Faces with a texture.

    sizes:    (F,) int64, corners of each face
    vertices: (C,) int64, the row of the point of each corner, face after face
    corners:  (C,) int64, the row of `uv` of each corner; one that `uv` does not have: none
    groups:   (F,) int64, which material each face has, counted from 0; -1: none
    uv:       (K, 2) float64, positions in the picture, u to the right and v up, 0..1; beyond, it repeats
    """

    sizes: NDArray[np.int64]
    vertices: NDArray[np.int64]
    corners: NDArray[np.int64]
    groups: NDArray[np.int64]
    uv: NDArray[np.float64]

    @property
    def corner_groups(self) -> NDArray[np.int64]:
        """The material of each corner, (C,)."""
        return np.repeat(self.groups, self.sizes)

    def uv_of(self, corners: NDArray[np.int64]) -> NDArray[np.float64]:
        """The positions of rows of `uv`, (..., 2); NaN where there is none."""
        if not len(self.uv):
            return np.full((*corners.shape, 2), np.nan)
        found = self.uv[np.clip(corners, 0, len(self.uv) - 1)]
        found[(corners < 0) | (corners >= len(self.uv))] = np.nan
        return found


class Samples(NamedTuple):
    """Positions at which pictures are sampled, material by material.

    rows: (S,) int64, the row of the point of each. groups: (S,) int64, its material, increasing. uv: (S, 2)
    float64, NaN where there is none.
    """

    rows: NDArray[np.int64]
    groups: NDArray[np.int64]
    uv: NDArray[np.float64]


def vertex_samples(mesh: TexturedMesh, count: int) -> Samples:
    """The positions that the corners of `count` vertices have in the texture, each once a vertex."""
    groups = mesh.corner_groups
    usable = np.flatnonzero((mesh.vertices >= 0) & (mesh.vertices < count) & (groups >= 0))
    vertices, corners, groups = mesh.vertices[usable], mesh.corners[usable], groups[usable]
    named = np.where((corners >= 0) & (corners < len(mesh.uv)), corners, -1) + 1
    numbers = (groups * (len(mesh.uv) + 1) + named) * count + vertices
    _, first = np.unique(numbers, return_index=True)
    return Samples(vertices[first], groups[first], mesh.uv_of(corners[first]))


@dataclass(frozen=True, eq=False)
class PointsBetween:
    """Points on textured triangles, material by material.

    Each triangle is divided into k² triangles of one shape, and the points are their middles.

    triangles: (T, 3) int64, rows of vertices. divisions: (T,) int64, k of each. groups: (T,) int64, its
    material, increasing. uv: (P, 2) float32. name: the same for the same points.
    """

    triangles: NDArray[np.int64]
    divisions: NDArray[np.int64]
    groups: NDArray[np.int64]
    uv: NDArray[np.float32]
    name: str

    def __len__(self) -> int:
        return len(self.uv)

    def count_by_group(self, groups: int) -> NDArray[np.int64]:
        """Points of each of so many materials, (groups,)."""
        return np.bincount(self.groups, self.divisions**2, groups).astype(np.int64)

    def interpolate(self, values: NDArray, found: NDArray) -> None:
        """Put values of the points into `found` (P,), from those of the vertices (N,): means of numbers;
        whole numbers are those of the nearest vertex."""
        at_corners = values[self.triangles]
        for part, triangles, weights in _runs(self.divisions):
            corners = at_corners[triangles]
            if values.dtype.kind == "f":
                found[part] = (corners @ weights.T.astype(values.dtype)).ravel()
            else:
                found[part] = corners[:, weights.argmax(axis=1)].ravel()


def _runs(divisions: NDArray[np.int64]) -> Iterator[tuple[slice, slice, NDArray[np.float64]]]:
    """Neighbouring triangles with as many divisions: their points, the triangles, and the shares of the
    corners, (k², 3)."""
    ends = np.r_[np.flatnonzero(np.diff(divisions)) + 1, len(divisions)]
    first, point = 0, 0
    for end in ends.tolist():
        sides = int(divisions[first]) if end else 0
        most = max(1, _AT_ONCE // max(sides * sides, 1))
        weights = _middles(sides)
        for start in range(first, end, most):
            stop = min(start + most, end)
            size = (stop - start) * sides * sides
            yield slice(point, point + size), slice(start, stop), weights
            point += size
        first = end


class _Triangles(NamedTuple):
    """Triangles of faces: rows of vertices (T, 3), positions in the texture (T, 3, 2), materials (T,)."""

    vertices: NDArray[np.int64]
    uv: NDArray[np.float64]
    groups: NDArray[np.int64]


def _triangles(mesh: TexturedMesh, count: int) -> _Triangles:
    """The triangles between `count` vertices of which every corner has a position in the texture."""
    fans = np.maximum(mesh.sizes, 2) - 2
    first = np.repeat(np.cumsum(mesh.sizes) - mesh.sizes, fans)
    step = np.arange(len(first)) - np.repeat(np.cumsum(fans) - fans, fans)
    corners = np.stack([first, first + step + 1, first + step + 2], axis=1)
    vertices, groups = mesh.vertices[corners], np.repeat(mesh.groups, fans)
    uv = mesh.uv_of(mesh.corners[corners])
    usable = (groups >= 0) & ((vertices >= 0) & (vertices < count)).all(axis=1)
    usable &= np.isfinite(uv).all(axis=(1, 2))
    return _Triangles(vertices[usable], uv[usable], groups[usable])


def _texels(triangles: _Triangles, texels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Texels that each triangle covers, (T,). texels: (G,), of the picture of each material."""
    (au, av), (bu, bv) = ((triangles.uv[:, k] - triangles.uv[:, 0]).T for k in (1, 2))
    return np.abs(au * bv - av * bu) / 2 * texels[triangles.groups]


def texels_covered(mesh: TexturedMesh, count: int, texels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Texels that the triangles of each material cover, (G,). texels: (G,), of their pictures."""
    triangles = _triangles(mesh, count)
    covered = np.bincount(triangles.groups, _texels(triangles, texels), len(texels))
    return covered.astype(np.float64, copy=False)


def points_between(mesh: TexturedMesh, count: int, texels: NDArray[np.float64], most: int) -> PointsBetween:
    """Points on the triangles between `count` vertices: one a texel, at most `most`, evenly in the texture.

    texels: (G,), of the picture of each material; 0: its triangles get none.
    """
    triangles = _triangles(mesh, count)
    wanted = np.sqrt(_texels(triangles, texels))
    divisions = np.rint(wanted * _share(wanted, most)).astype(np.int64)
    name = hashlib.blake2b(divisions.astype("<i8").tobytes(), digest_size=16).hexdigest()
    order = np.lexsort((divisions, triangles.groups))
    order = order[divisions[order] > 0]
    divisions, corners = divisions[order], triangles.uv[order]
    uv = np.empty((int((divisions**2).sum()), 2), np.float32)
    for part, rows, weights in _runs(divisions):
        uv[part] = np.einsum("tck,pc->tpk", corners[rows], weights).reshape(-1, 2)
    return PointsBetween(triangles.vertices[order], divisions, triangles.groups[order], uv, name)


def _share(wanted: NDArray[np.float64], most: int) -> float:
    """The factor of divisions of triangles (T,), at most 1, by which they come to at most so many points."""

    def points(share: float) -> float:
        return float((np.rint(wanted * share) ** 2).sum())

    if points(1.0) <= most:
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if points(middle) <= most else (low, middle)
    return low


def _middles(divisions: int) -> NDArray[np.float64]:
    """The shares of the corners, (k², 3), at the middles of the parts of a triangle of k divisions.

    The parts lie in rows of 1, 3, 5, ... from the first corner on, every second one upside down.
    """
    number = np.arange(divisions * divisions)
    row = np.sqrt(number + 0.5).astype(np.int64)
    column = number - row * row
    is_turned = column % 2
    along = (row + (2 - is_turned) / 3) / max(divisions, 1)
    across = (column // 2 + (1 + is_turned) / 3) / max(divisions, 1)
    return np.stack([1 - along, along - across, across], axis=1)


class Bilinear(NamedTuple):
    """The pixels of a picture around positions.

    at: (4, S) int64, pixels by number, row after row. shares: (4, S) float32, of each in the colour.
    """

    at: NDArray[np.int64]
    shares: NDArray[np.float32]

    def of(self, image: NDArray[np.uint8]) -> NDArray[np.float32]:
        """The colours of a picture of that size there, (S, 3), 0..255.

        image: (H, W, 3) sRGB, or (H, W, 4) with alpha, by which its colours count.
        """
        pixels = image.reshape(-1, image.shape[2])
        corners = [pixels[at] for at in self.at]
        mean = _weighted(corners, self.shares)
        if image.shape[2] < 4:
            return mean
        alphas = np.stack([corner[:, 3] * share for corner, share in zip(corners, self.shares, strict=True)])
        opaque = alphas.sum(axis=0)
        visible = _weighted(corners, alphas) / np.where(opaque > 0, opaque, 1)[:, None]
        return np.where(opaque[:, None] > 0, visible, mean)


def _weighted(corners: Sequence[NDArray[np.uint8]], shares: NDArray[np.float32]) -> NDArray[np.float32]:
    found = np.zeros((len(corners[0]), 3), np.float32)
    for corner, share in zip(corners, shares, strict=True):
        found += corner[:, :3] * share[:, None]
    return found


def bilinear(size: tuple[int, int], uv: NDArray[np.floating], is_clamped: bool = False) -> Bilinear:
    """The pixels around positions (S, 2) in a picture, weighted between their middles.

    size: height and width. u points right and v up, both from 0 to 1; beyond, the picture repeats, or its
    edge goes on where `is_clamped`.
    """
    height, width = size
    u, v = _within(uv, is_clamped).T
    x = np.clip(u * width - 0.5, 0, width - 1)
    y = np.clip((1 - v) * height - 0.5, 0, height - 1)
    left, top = x.astype(np.int64), y.astype(np.int64)
    right, bottom = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    to_right, down = (x - left).astype(np.float32), (y - top).astype(np.float32)
    top, bottom = top * width, bottom * width
    return Bilinear(
        np.stack([top + left, top + right, bottom + left, bottom + right]),
        np.stack(
            [
                (1 - to_right) * (1 - down),
                to_right * (1 - down),
                (1 - to_right) * down,
                to_right * down,
            ]
        ),
    )


def pixels_at(size: tuple[int, int], uv: NDArray[np.floating], is_clamped: bool = False) -> NDArray[np.int32]:
    """The pixels in which positions (S, 2) lie, (S,), by number; otherwise as `bilinear`."""
    height, width = size
    found = np.empty(len(uv), np.int32)
    for start in range(0, len(uv), _AT_ONCE):
        u, v = _within(uv[start : start + _AT_ONCE], is_clamped).T
        x = np.clip((u * width).astype(np.int32), 0, width - 1)
        y = np.clip(((1 - v) * height).astype(np.int32), 0, height - 1)
        found[start : start + _AT_ONCE] = y * width + x
    return found


def _within(uv: NDArray[np.floating], is_clamped: bool) -> NDArray[np.floating]:
    if is_clamped:
        return np.clip(uv, 0, 1)
    return np.where((uv < 0) | (uv > 1), uv - np.floor(uv), uv)


def means_of_rows(rows: NDArray[np.int64], colors: NDArray[np.floating], count: int) -> NDArray[np.uint8]:
    """The mean of the colours (S, 3) that each of `count` rows has, (count, 3); white where it has none."""
    found = np.bincount(rows, minlength=count)
    sums = np.stack([np.bincount(rows, channel, count) for channel in colors.T], axis=1)
    mean = np.where(found[:, None] > 0, sums / np.maximum(found, 1)[:, None], 255)
    return np.rint(np.clip(mean, 0, 255)).astype(np.uint8)
