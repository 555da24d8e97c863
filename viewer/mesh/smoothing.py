"""Points with less of their noise: each moved to the quadric through those around it, along its normal.

A path over noise climbs it. Quadrics through the points within r of each, weighted by (1 - (d / r)^2)^2,
move each to a weighted mean of these: K(d) = (8 - 20 d^2 / r^2) (1 - d^2 / r^2)^2 / (pi r^2) (Fan and
Gijbels 1996, 3.2.2, for two dimensions). Where points lie s apart, with a standard deviation e off their
surface, the slope of what is made of them has the variance e^2 s^2 times the integral of (dK / dx)^2, which
is 48 / (pi r^4), and a path over it is longer by half of that. `smoothing_radius` is the r that makes it
2e-4. A quadric follows what bends; planes would shrink it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..task import checkpoint

Points = NDArray[np.float64]  # (N, 3)

LENGTHENED = 2e-4  # by how much noise may lengthen a path that runs over what is smoothed
_TERMS = 6  # of a quadric
_LEAST = 12  # points that tell one
_MOST = 192
_CHUNK = 1 << 12  # points at a time
_SAMPLE = 64  # points whose neighbours are counted
_MEDIANS_OFF = (
    0.73,
    0.92,
)  # of deviations: 0.67 of a normal distribution, times 1.08 and 1.36 of six neighbours
_EXACT = 1e-10  # of the weights, added so that points in a line tell something


def smoothing_radius(deviation: float, spacing: float) -> float:
    """How far around points are to be averaged, scan units; 0 where noise is too little to matter.

    deviation: standard deviation of points off their surface. spacing: between neighbours. Scan units.
    """
    radius = (24 / (math.pi * LENGTHENED)) ** 0.25 * math.sqrt(deviation * spacing)
    return radius if math.pi * radius**2 >= _TERMS * spacing**2 else 0.0


def noise_over_faces(points: Points, faces: NDArray[np.integer], normals: Points) -> float:
    """The standard deviation of vertices (N, 3) along their normals (N, 3), of any length; scan units.

    It is told by how far each is off the mean of those that faces (F, 3) join it with, or by how much more
    than these are: the lesser of both, as bends count in the first, and edges of a coarse mesh in the
    second; the medians, as most vertices are on no edge.
    """
    from scipy.sparse import coo_array

    corners = np.concatenate([faces, faces[:, ::-1]])
    ends = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2).T
    joined = coo_array((np.ones(ends.shape[1]), tuple(ends)), shape=(len(points), len(points))).tocsr()
    degrees = np.asarray(joined.sum(axis=1))
    used = degrees > 0
    if not used.any():
        return 0.0
    degrees = np.maximum(degrees, 1)[:, None]
    length = np.maximum(np.linalg.norm(normals, axis=1), np.finfo(float).tiny)
    off, deviations = points, []
    for median in _MEDIANS_OFF:
        off = off - (joined @ off) / degrees
        usual = np.median(np.abs((off * normals).sum(axis=1) / length)[used])
        deviations.append(float(usual) / median)
    return min(deviations)


def moved_to_quadrics(
    points: Points, radius: float, normals: NDArray[np.floating] | None = None, rows: NDArray | None = None
) -> tuple[Points, Points]:
    """Points (M, 3) moved along their normals to quadrics, and the unit normals of these, (M, 3).

    points: (N, 3). radius: of those around that count, less the farther; at least 12 do. normals: (N, 3);
    points that face the other way are of another surface and do not count, and those that are returned face
    as these do; None: either way. rows: (M,), of the points that are wanted, which all others help; None:
    all.
    """
    from scipy.spatial import cKDTree

    tree = cKDTree(points)
    rows = np.arange(len(points)) if rows is None else rows
    moved, directions = np.empty((len(rows), 3)), np.empty((len(rows), 3))
    some = points[:: max(1, len(points) // _SAMPLE)]
    usual = np.median(tree.query_ball_point(some, radius, return_length=True))
    most = min(int(np.clip(1.5 * usual, _LEAST, _MOST)), len(points))
    for start in range(0, len(rows), _CHUNK):
        checkpoint()
        part = rows[start : start + _CHUNK]
        away, near = tree.query(points[part], most)
        away, near = away.reshape(len(part), -1), near.reshape(len(part), -1)
        reach = np.minimum(np.maximum(radius, away[:, min(_LEAST, most) - 1]), away[:, -1])
        reach = np.maximum(reach * (1 + 1e-6), np.finfo(float).tiny)[:, None]
        weights = (1 - np.minimum(away / reach, 1) ** 2) ** 2
        if normals is not None:
            own = normals[part].astype(np.float64)
            weights = weights * (np.einsum("nki,ni->nk", normals[near], own) >= 0)
        found = _quadrics((points[near] - points[part, None]) / reach[..., None], weights)
        height, direction = found
        if normals is not None:
            direction = np.where((direction * own).sum(axis=1, keepdims=True) < 0, -direction, direction)
        moved[start : start + _CHUNK] = points[part] + reach * height
        directions[start : start + _CHUNK] = direction
    return moved, directions


def _quadrics(offsets: NDArray[np.float64], weights: NDArray[np.float64]) -> tuple[Points, Points]:
    """The ways from the middle to the quadric through points around it, along the normal of their plane,
    and the quadric's normal there, (N, 3) each. offsets: (N, K, 3), at most 1 long."""
    total = weights.sum(axis=1)[:, None]
    centered = offsets - np.einsum("nk,nki->ni", weights, offsets)[:, None] / total[:, None]
    axes = np.linalg.eigh(np.einsum("nk,nki,nkj->nij", weights, centered, centered))[1]
    z, x, y = np.moveaxis(offsets @ axes, 2, 0)
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=2)
    weighted = terms * weights[:, :, None]
    system = weighted.transpose(0, 2, 1) @ terms + (_EXACT * total)[:, :, None] * np.eye(_TERMS)
    factors = np.linalg.solve(system, weighted.transpose(0, 2, 1) @ z[:, :, None])[:, :, 0]
    up, right, ahead = axes.transpose(2, 0, 1)
    normals = up - factors[:, 1:2] * right - factors[:, 2:3] * ahead
    return factors[:, :1] * up, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def rows_apart(points: Points, least: float) -> NDArray[np.intp]:
    """Rows of points of which no two are nearer than `least`, and none is farther from the rest; ascending.

    Of those too near, the one of the lowest row stays.
    """
    from scipy.spatial import cKDTree

    pairs = cKDTree(points).query_pairs(least, output_type="ndarray")
    first, second = pairs.min(axis=1), pairs.max(axis=1)
    is_open, stays = np.ones(len(points), bool), np.zeros(len(points), bool)
    while is_open.any():
        beaten = np.zeros(len(points), bool)
        beaten[second[is_open[first] & is_open[second]]] = True
        chosen = is_open & ~beaten
        stays |= chosen
        is_open &= ~chosen
        is_open[second[chosen[first]]] = False
        is_open[first[chosen[second]]] = False
    return np.flatnonzero(stays)
