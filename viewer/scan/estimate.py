"""Attributes that a scan lacks, estimated from the points alone: normals, radii, fake colours.

Copies of a point count once: estimates are made on distinct positions and handed to the copies.
So neither a scan full of duplicates nor a handful of points gives NaN, zero or infinity.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..task import checkpoint
from .points import PointCloud
from .pose import Pose
from .range_view import merged_normals

Vectors = NDArray[np.float64]  # (N, 3)

_FLOAT = np.finfo(np.float32)

# The outside of a surface is the side that more views see, from both ends of each axis.
_AXES = 13
_FRONT_BONUS = 0.5  # so that a sheet which is seen from both sides faces the front
_AGREEING = 8  # neighbours that settle on a side together; they reach out to one `reach`
_CELL = 1.4  # of a view's grid, in reaches: wide enough to leave no holes in a surface
_DEPTH = 1.8  # in reaches: so far behind the first point of its cell a point still counts as seen
_GRID = 1024  # cells along an axis at most


def estimate(pose: Pose, names: Sequence[str]) -> dict[str, NDArray[np.float32]]:
    """The attributes named, "normals" and "radii", by name. See `cloud_normals`, `cloud_radii`; the
    normals of range views are those of their grids (`merged_normals`)."""
    work = {"normals": _normals, "radii": lambda pose: cloud_radii(pose.cloud)}
    return {name: work[name](pose) for name in names}


def _normals(pose: Pose) -> NDArray[np.float32]:
    return merged_normals(pose.views, pose.cloud) if pose.views else cloud_normals(pose.cloud)


def cloud_normals(cloud: PointCloud, k: int = 16, viewpoint: ArrayLike | None = None) -> NDArray[np.float32]:
    """Unit normals of the planes through each point's k nearest neighbours, (N, 3) float32.

    viewpoint: (3,), where the scanner stood, in absolute scan units: normals face it. None:
    normals face the side from which the points can be seen; those of a sheet that can be seen
    from both sides face the front (+z). Where neighbours span no plane, some unit vector
    across them. Raises InputError where the viewpoint is not finite.
    """
    if not len(cloud):
        return np.empty((0, 3), np.float32)
    points, copies = _distinct(cloud.positions)
    checkpoint(0.1)
    normals = _plane_normals(points, k)
    checkpoint(0.5)
    if viewpoint is None:
        near, distances = _neighbors(points, _AGREEING)
        checkpoint(0.8)
        normals = _facing(normals, _seen_from(points, float(np.median(distances[:, -1]))))
        normals = _facing(normals, normals[near].sum(axis=1))
    else:
        eye = np.asarray(viewpoint, np.float64)
        if eye.shape != (3,) or not np.isfinite(eye).all():
            raise InputError(f"{viewpoint} is not a viewpoint", hint="Give x, y and z in scan units")
        normals = _facing(normals, eye - cloud.origin - points)
    return normals.astype(np.float32)[copies]


def cloud_radii(cloud: PointCloud, k: int = 7) -> NDArray[np.float32]:
    """Splat radii that close the surface between points, (N,) float32, scan units, above 0.

    The distance to the k-th nearest other point, so that about k splats overlap at each place
    (on a square grid of spacing s: s sqrt(2)), kept within a factor of two of what is usual
    among those neighbours, so that a stray point does not get a huge splat. 1 where all points
    coincide.
    """
    if not len(cloud):
        return np.empty(0, np.float32)
    points, copies = _distinct(cloud.positions)
    if len(points) == 1:
        return np.ones(len(cloud), np.float32)
    checkpoint(0.2)
    near, distances = _neighbors(points, k + 1)
    checkpoint(0.6)
    radii = distances[:, -1]
    usual = np.median(radii[near], axis=1)
    radii = np.clip(radii, usual / 2, usual * 2)
    return np.clip(radii, _FLOAT.tiny, _FLOAT.max).astype(np.float32)[copies]


def fake_color(normals: NDArray[np.floating]) -> NDArray[np.uint8]:
    """A colour that tells the direction of a normal, for scans without texture, (N, 4) uint8.

    x, y and z from -1 to 1 become red, green and blue from 0 to 255. Slomp 2014, III.
    """
    rgba = np.full((len(normals), 4), 255, np.uint8)
    rgba[:, :3] = np.rint(np.clip(np.nan_to_num(normals) * 0.5 + 0.5, 0, 1) * 255)
    return rgba


def _distinct(positions: NDArray[np.float32]) -> tuple[Vectors, NDArray[np.intp]]:
    """The distinct positions, (M, 3), and for each point its row among them, (N,)."""
    order = np.lexsort(positions.T)
    ordered = positions[order]
    first = np.ones(len(ordered), bool)
    first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    row = np.empty(len(ordered), np.intp)
    row[order] = np.cumsum(first) - 1
    return ordered[first].astype(np.float64), row


def _neighbors(points: Vectors, k: int) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Each point and its nearest others, k together or all there are: rows and distances, (N, K)."""
    from open3d import core

    search = core.nns.NearestNeighborSearch(core.Tensor.from_numpy(points), core.Dtype.Int32)
    search.knn_index()
    rows, squared = search.knn_search(core.Tensor.from_numpy(points), min(k, len(points)))
    return rows.numpy(), np.sqrt(squared.numpy())


def _plane_normals(points: Vectors, k: int) -> Vectors:
    """(N, 3), unit length, of either sign."""
    from open3d import geometry, utility

    cloud = geometry.PointCloud(utility.Vector3dVector(points))
    cloud.estimate_normals(geometry.KDTreeSearchParamKNN(k))
    normals = np.array(cloud.normals)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    usable = np.isfinite(length) & (length > 0.5)
    return np.where(usable, normals / np.where(usable, length, 1), (0.0, 0.0, 1.0))


def _facing(normals: Vectors, directions: NDArray[np.floating]) -> Vectors:
    """The normals, turned round where they point away from their direction."""
    away = np.einsum("ij,ij->i", normals, directions) < 0
    return np.where(away[:, None], -normals, normals)


def _seen_from(points: Vectors, reach: float) -> NDArray[np.float32]:
    """Sums for each point of the directions from which nothing hides it, (N, 3)."""
    center = np.median(points, axis=0)
    half = 2 * np.quantile(np.linalg.norm(points - center, axis=1), 0.98)  # strays beyond go to the rim
    cell = max(_CELL * reach, 2 * half / _GRID) or 1.0
    local = np.clip((points - center) / cell, -_GRID, _GRID).astype(np.float32)  # in cells
    seen_from = np.zeros_like(local)
    for axis in _half_sphere(_AXES).astype(np.float32):
        from_front, from_back = _visible(local, axis, side=int(2 * half / cell) + 1)
        votes = from_front * (1 + _FRONT_BONUS * axis[2]) - from_back * (1 - _FRONT_BONUS * axis[2])
        seen_from += votes[:, None] * axis
    return seen_from


def _visible(
    points: NDArray[np.float32], axis: NDArray[np.float32], side: int
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Whether each point is seen from the two ends of an axis, the positive one first, (N,).

    points: in cells. A view looks at side x side cells; in each the first points are seen, and
    those little behind them.
    """
    across = np.cross(axis, np.eye(3, dtype=np.float32)[np.abs(axis).argmin()])
    across /= np.linalg.norm(across)
    x, y, depth = (points @ np.stack([across, np.cross(axis, across), axis], axis=1)).T
    column, row = (np.clip(v + np.float32(side / 2), 0, side - 1).astype(np.intp) for v in (x, y))
    at = row * side + column
    nearest, farthest = (np.full(side * side, none, np.float32) for none in (-np.inf, np.inf))
    np.maximum.at(nearest, at, depth)
    np.minimum.at(farthest, at, depth)
    little = np.float32(_DEPTH / _CELL)
    return depth >= nearest[at] - little, depth <= farthest[at] + little


def _half_sphere(count: int) -> Vectors:
    """Directions spread evenly over the half sphere around +z, (count, 3)."""
    place = np.arange(count) + 0.5
    z = place / count
    turn = place * np.pi * (3 - np.sqrt(5))  # the golden angle
    return np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)
