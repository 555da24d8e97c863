"""The inner loops of winding numbers, compiled by numba; see `winding`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled

_FOUR_PI = 4.0 * np.pi
_DEEPEST = 64  # levels of a tree: as many as a stack holds
_FAR_SOFT = 100.0  # in the softening of distances, squared: so far, it does not count


class Groups(NamedTuple):
    """Points in C groups. points, vectors: (N, 3), the vectors area times normal. order: (N,), rows. borders:
    (C, 2), first and last + 1 of each group in `order`."""

    points: NDArray[np.float64]
    vectors: NDArray[np.float64]
    order: NDArray[np.int64]
    borders: NDArray[np.int64]


class Clusters(NamedTuple):
    """The first three terms of the fields of C groups of points, for places afar (Barill et al. 2018).

    centers: (C, 3). radii: (C,), around the centres. With v area times normal of a point, and d its offset
    from the centre, sums over the points of a group: dipoles, (C, 3), of v. spreads, (C, 9), of d v, row by
    row. bends, (C, 13), of what d d v adds: of 2 (d v) d + (d d) v, then the coefficients of xxx, yyy, zzz,
    xxy, xxz, yyx, yyz, zzx, zzy and xyz in (d r) (d r) (v r).
    """

    centers: NDArray[np.float64]
    radii: NDArray[np.float64]
    dipoles: NDArray[np.float64]
    spreads: NDArray[np.float64]
    bends: NDArray[np.float64]


@compiled
def _bend(d: NDArray[np.float64], v: NDArray[np.float64], bend: NDArray[np.float64]) -> None:
    """Add what a point adds to the bends of its cluster, (13,). d: (3,), its offset. v: (3,)."""
    both, squared = 0.0, 0.0
    for axis in range(3):
        both += d[axis] * v[axis]
        squared += d[axis] * d[axis]
    for axis in range(3):
        bend[axis] += 2.0 * both * d[axis] + squared * v[axis]
        bend[3 + axis] += d[axis] * d[axis] * v[axis]
    entry = 6
    for twice in range(3):
        for once in range(3):
            if once != twice:
                bend[entry] += d[twice] * (2.0 * d[once] * v[twice] + d[twice] * v[once])
                entry += 1
    bend[12] += 2.0 * (d[0] * d[1] * v[2] + d[0] * d[2] * v[1] + d[1] * d[2] * v[0])


@compiled
def summarize(groups: Groups, clusters: Clusters) -> None:
    """Fill the clusters of groups."""
    points, vectors, order, borders = groups
    centers, radii, dipoles, spreads, bends = clusters
    off = np.empty(3)
    for c in range(len(borders)):
        total = 0.0
        for axis in range(3):
            centers[c, axis], dipoles[c, axis] = 0.0, 0.0
        for n in range(borders[c, 0], borders[c, 1]):
            i = order[n]
            area = np.sqrt(vectors[i, 0] ** 2 + vectors[i, 1] ** 2 + vectors[i, 2] ** 2)
            total += area
            for axis in range(3):
                centers[c, axis] += area * points[i, axis]
                dipoles[c, axis] += vectors[i, axis]
        for axis in range(3):
            centers[c, axis] /= total if total > 0.0 else 1.0
        spreads[c], bends[c] = 0.0, 0.0
        farthest = 0.0
        for n in range(borders[c, 0], borders[c, 1]):
            i, squared = order[n], 0.0
            for axis in range(3):
                off[axis] = points[i, axis] - centers[c, axis]
                squared += off[axis] * off[axis]
                for other in range(3):
                    spreads[c, 3 * axis + other] += off[axis] * vectors[i, other]
            _bend(off, vectors[i], bends[c])
            farthest = max(farthest, squared)
        radii[c] = np.sqrt(farthest)


@compiled
def _from_afar(clusters: Clusters, c: int, x: float, y: float, z: float) -> float:
    """The field of a cluster, times 4 pi, whose centre is (x, y, z) away."""
    d, s, b = clusters.dipoles[c], clusters.spreads[c], clusters.bends[c]
    squared = x * x + y * y + z * z
    cubed = squared * np.sqrt(squared)
    along = (
        x * (s[0] * x + s[1] * y + s[2] * z)
        + y * (s[3] * x + s[4] * y + s[5] * z)
        + z * (s[6] * x + s[7] * y + s[8] * z)
    )
    bent = (
        x * x * (b[3] * x + b[6] * y + b[7] * z)
        + y * y * (b[8] * x + b[4] * y + b[9] * z)
        + z * z * (b[10] * x + b[11] * y + b[5] * z)
        + b[12] * x * y * z
    )
    second = 7.5 * bent / squared - 1.5 * (b[0] * x + b[1] * y + b[2] * z)
    first = s[0] + s[4] + s[8] - 3.0 * along / squared
    return (d[0] * x + d[1] * y + d[2] * z + first + second / squared) / cubed


@compiled
def _from_near(
    points: NDArray[np.float64],
    vectors: NDArray[np.float64],
    rows: NDArray[np.int64],
    place: NDArray[np.float64],
    soft: float,
) -> float:
    """The field of points, times 4 pi, at a place, (3,). One at the place itself adds nothing. soft: squared
    distance that is added to those to points."""
    total = 0.0
    for i in rows:
        x, y, z = points[i, 0] - place[0], points[i, 1] - place[1], points[i, 2] - place[2]
        squared = x * x + y * y + z * z
        if squared > 0.0:
            squared += soft
            total += (vectors[i, 0] * x + vectors[i, 1] * y + vectors[i, 2] * z) / (
                squared * np.sqrt(squared)
            )
    return total


@compiled
def field(
    nodes: Groups,
    clusters: Clusters,
    queries: NDArray[np.float64],
    soft: NDArray[np.float64],
    found: NDArray[np.float64],
    far: float,
) -> None:
    """Fill the winding numbers, (Q,), at queries (Q, 3) by a tree.

    nodes: the children of node c are 2c + 1 and 2c + 2; leaves have none. soft: (Q,), as in `fields`. far: in
    radii of a node, the distance from which its cluster stands for its points.
    """
    points, vectors, order, borders = nodes
    stack = np.empty(_DEEPEST, np.int64)
    for q in range(len(queries)):
        total, held = 0.0, 1
        stack[0] = 0
        while held:
            held -= 1
            c = stack[held]
            x, y, z = clusters.centers[c] - queries[q]
            reach = far * clusters.radii[c]
            if x * x + y * y + z * z > reach * reach + _FAR_SOFT * soft[q]:
                total += _from_afar(clusters, c, x, y, z)
            elif 2 * c + 2 < len(borders):
                stack[held], stack[held + 1] = 2 * c + 1, 2 * c + 2
                held += 2
            else:
                rows = order[borders[c, 0] : borders[c, 1]]
                total += _from_near(points, vectors, rows, queries[q], soft[q])
        found[q] = total / _FOUR_PI


@compiled
def fields(
    groups: Groups,
    clusters: Clusters,
    targets: NDArray[np.int64],
    soft: NDArray[np.float64],
    sum_of: NDArray[np.int64],
    found: NDArray[np.float32],
    far: float,
) -> None:
    """Add the winding number of each group alone at some of the points to sums, found (T, S).

    targets: (T,), rows. sum_of: (C,), the sum of each group. soft: (T,), squared distances that are added to
    those between points: below these, nothing is known of the surface. far: in radii of a group, as in
    `field`.
    """
    points, vectors, order, borders = groups
    for t in range(len(targets)):
        place = points[targets[t]]
        for c in range(len(borders)):
            x, y, z = clusters.centers[c] - place
            reach = far * clusters.radii[c]
            if x * x + y * y + z * z > reach * reach + _FAR_SOFT * soft[t]:
                total = _from_afar(clusters, c, x, y, z)
            else:
                total = _from_near(points, vectors, order[borders[c, 0] : borders[c, 1]], place, soft[t])
            found[t, sum_of[c]] += total / _FOUR_PI


@compiled
def fall_fastest(
    points: NDArray[np.float64],
    vectors: NDArray[np.float64],
    near: NDArray[np.int32],
    rows: NDArray[np.integer],
    soft: NDArray[np.float64],
    directions: NDArray[np.float64],
) -> None:
    """Fill the directions in which the winding number of neighbours falls fastest at some points, (R, 3).

    near: (N, K), each point and its neighbours. rows: (R,). soft: (R,), as in `fields`.
    """
    falling = np.empty(3)
    for n in range(len(rows)):
        i = rows[n]
        falling[:] = 0.0
        for k in range(near.shape[1]):
            j, along, squared = near[i, k], 0.0, soft[n]
            for axis in range(3):
                step = points[j, axis] - points[i, axis]
                along += step * vectors[j, axis]
                squared += step * step
            cubed = squared * np.sqrt(squared)
            for axis in range(3):
                step = points[j, axis] - points[i, axis]
                falling[axis] += (vectors[j, axis] - 3.0 * step * along / squared) / cubed
        length = np.sqrt((falling * falling).sum())
        for axis in range(3):
            directions[n, axis] = falling[axis] / length
