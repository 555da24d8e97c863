"""Attributes that a scan lacks, estimated from the points alone: normals, radii, fake colours.

Copies of a point count once: estimates are made on distinct positions and handed to the copies.
So neither a scan full of duplicates nor a handful of points gives NaN or infinity, or radii of zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..task import checkpoint
from .morton import morton_codes
from .planes import AROUND, NeighborSearch, plane_normals
from .points import FLIPPED, Orientation, PointCloud, checked_viewpoint
from .pose import Pose
from .range_view import merged_normals
from .sides import FoundSides, Method, facing, facing_out

Vectors = NDArray[np.float64]  # (N, 3)

_FLOAT = np.finfo(np.float32)
_METHODS: dict[str, Method | None] = {"auto": None, "quick": "quick", "fine": "fine"}


class Estimates(NamedTuple):
    """Estimated attributes of a pose.

    arrays: (N, 3) or (N,) float32 by name. sides: how Scan4D found the sides of normals; None where it did
    not have to.
    """

    arrays: dict[str, NDArray[np.float32]]
    sides: FoundSides | None = None


def estimate(pose: Pose, names: Sequence[str]) -> Estimates:
    """The attributes named, "normals" and "radii". See `cloud_normals`, `cloud_radii`; the normals of range
    views are those of their grids (`merged_normals`)."""
    arrays: dict[str, NDArray[np.float32]] = {}
    sides = None
    if "normals" in names:
        if pose.views:
            arrays["normals"] = merged_normals(pose.views, pose.cloud)
        else:
            arrays["normals"], sides = oriented_normals(pose.cloud)
    if "radii" in names:
        arrays["radii"] = cloud_radii(pose.cloud)
    return Estimates(arrays, sides)


def with_estimates(pose: Pose, names: Sequence[str]) -> Pose:
    """The pose with the attributes named, estimated. The record of its scan gets how Scan4D found sides."""
    found = estimate(pose, names)
    pose.scan.note_sides(found.sides)
    arrays: dict[str, Any] = {**found.arrays}
    return pose.with_cloud(replace(pose.cloud, **arrays))


def cloud_normals(
    cloud: PointCloud, viewpoint: ArrayLike | None = None, orientation: Orientation | None = None
) -> NDArray[np.float32]:
    """Unit normals of the planes through each point's nearest neighbours, (N, 3) float32.

    As many neighbours as the noise around asks for, 7 to 96, see `planes`.

    viewpoint: (3,), where the scanner stood, in absolute scan units: normals face it. orientation: how Scan4D
    finds the side without it; None: that of the cloud. "auto": normals face the viewpoint of the cloud;
    without one, they face outwards, and those of a sheet that can be seen from both sides face the front
    (+z). "quick", "fine": outwards, by one method, see `facing_out`. "-flipped" turns all normals round.
    Where all neighbours lie in a line, to rounding, the normal is zero, which stands for none. Raises
    InputError where the viewpoint is not finite.
    """
    return oriented_normals(cloud, viewpoint, orientation)[0]


def oriented_normals(
    cloud: PointCloud, viewpoint: ArrayLike | None = None, orientation: Orientation | None = None
) -> tuple[NDArray[np.float32], FoundSides | None]:
    """The normals of `cloud_normals`, and how Scan4D found their sides; None where they face a viewpoint."""
    name = orientation or cloud.orientation
    word = name.removesuffix(FLIPPED)
    eye = cloud.viewpoint if word == "auto" else None
    eye = eye if viewpoint is None else checked_viewpoint(viewpoint)
    if not len(cloud):
        return np.empty((0, 3), np.float32), None
    points, copies = _distinct(cloud.positions)
    checkpoint(0.1)
    search = NeighborSearch(points)
    near, _ = search.of_all(AROUND)
    checkpoint(0.3)
    normals = plane_normals(search, near)
    checkpoint(0.7)
    sides = None
    if eye is None:
        normals, sides = facing_out(points, normals, near, _METHODS[word])
    else:
        normals = facing(normals, eye - cloud.origin - points)
    normals[_in_lines(points, near)] = 0
    return -normals[copies] if name.endswith(FLIPPED) else normals[copies], sides


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
