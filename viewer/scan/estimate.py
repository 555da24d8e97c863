"""Attributes that a scan lacks, estimated from the points alone: normals, radii, fake colours.

Copies of a point count once: estimates are made on distinct positions and handed to the copies.
So neither a scan full of duplicates nor a handful of points gives NaN or infinity, or radii of zero.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..task import checkpoint
from .morton import morton_codes
from .planes import AROUND, NeighborSearch, plane_normals
from .points import PointCloud, checked_viewpoint
from .pose import Pose
from .range_view import merged_normals
from .sides import Orientation, facing, facing_out

Vectors = NDArray[np.float64]  # (N, 3)

_FLOAT = np.finfo(np.float32)


def estimate(pose: Pose, names: Sequence[str]) -> dict[str, NDArray[np.float32]]:
    """The attributes named, "normals" and "radii", by name. See `cloud_normals`, `cloud_radii`; the
    normals of range views are those of their grids (`merged_normals`)."""
    work = {"normals": _normals, "radii": lambda pose: cloud_radii(pose.cloud)}
    return {name: work[name](pose) for name in names}


def _normals(pose: Pose) -> NDArray[np.float32]:
    return merged_normals(pose.views, pose.cloud) if pose.views else cloud_normals(pose.cloud)


def cloud_normals(
    cloud: PointCloud, viewpoint: ArrayLike | None = None, orientation: Orientation = "auto"
) -> NDArray[np.float32]:
    """Unit normals of the planes through each point's nearest neighbours, (N, 3) float32.

    As many neighbours as the noise around asks for, 7 to 96, see `planes`.

    viewpoint: (3,), where the scanner stood, in absolute scan units: normals face it; None: the cloud's.
    orientation: "quick", "fine" or "auto", how Scan4D finds the side without a viewpoint, see `facing_out`.
    Without one, normals face outwards, those of a sheet that can be seen from both sides the front (+z), see
    `sides`. Where all neighbours lie in a line, to rounding, nothing tells a normal: zero, which
    stands for none. Raises InputError where the viewpoint is not finite.
    """
    eye = cloud.viewpoint if viewpoint is None else checked_viewpoint(viewpoint)
    if not len(cloud):
        return np.empty((0, 3), np.float32)
    points, copies = _distinct(cloud.positions)
    checkpoint(0.1)
    search = NeighborSearch(points)
    near, _ = search.of_all(AROUND)
    checkpoint(0.3)
    normals = plane_normals(search, near)
    checkpoint(0.7)
    if eye is None:
        normals = facing_out(points, normals, near, orientation)
    else:
        normals = facing(normals, eye - cloud.origin - points)
    normals[_in_lines(points, near)] = 0
    return normals[copies]


def cloud_radii(cloud: PointCloud, k: int = 7) -> NDArray[np.float32]:
    """Splat radii that close the surface between points, (N,) float32, scan units, above 0.

    The distance to the k-th nearest other point, so that about k splats overlap everywhere
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
    near, radii = NeighborSearch(points).of_all(k + 1)
    checkpoint(0.6)
    usual = np.median(radii[near], axis=1)
    radii = np.clip(radii, usual / 2, usual * 2)
    return np.clip(radii, _FLOAT.tiny, _FLOAT.max).astype(np.float32)[copies]


def _in_lines(points: Vectors, near: NDArray[np.int32]) -> NDArray[np.intp]:
    """The rows of points (N, 3) that lie in a line with all their neighbours, near (N, K), the farthest last;
    as far as float32 tells, which points were stored in."""
    rows = np.arange(len(points))
    rounding = 4 * _FLOAT.eps * np.maximum(np.abs(points), np.abs(points[near[:, -1]])).max(axis=1)
    for column in range(1, near.shape[1] - 1):  # the first decides most points
        off, along = (points[near[rows, to]] - points[rows] for to in (column, -1))
        aside = np.linalg.norm(np.cross(off, along), axis=1)
        rows = rows[aside <= rounding[rows] * np.linalg.norm(along, axis=1)]
    return rows


def _distinct(positions: NDArray[np.float32]) -> tuple[Vectors, NDArray[np.intp]]:
    """The distinct positions, (M, 3), and for each point its row among them, (N,).

    They stand in an order of their own, whatever that of the points is: near ones together (by Morton codes),
    so that neighbours are found in less time.
    """
    order = np.lexsort((*positions.T, morton_codes(positions)))
    ordered = positions[order]
    first = np.ones(len(ordered), bool)
    first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    row = np.empty(len(ordered), np.intp)
    row[order] = np.cumsum(first) - 1
    return ordered[first].astype(np.float64), row
