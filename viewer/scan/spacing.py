"""How far apart the points of a cloud are, in a few milliseconds."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ..task import checkpoint
from .points import PointCloud

ENOUGH = 24  # nearest points, of which some may be copies of others, that tell a spacing
PLANE = 12  # nearest points, itself among them, whose plane tells how rough a surface is
_FLAT = 4  # points, of which fewer lie in a plane
_DISTANCES = 2_000_000  # point-to-point distances looked at
_NEAREST = (128, 8192)  # of these: six neighbours, each with twenty copies or with a thousand
_NEIGHBOR = 6  # on a surface, the ring of nearest neighbours
_CHUNK = 1 << 14  # points compared at a time, so that they stay in the processor's cache
_SPARSEST = 2.0  # times the usual spacing: what is sparser is left aside
_RUN = 64 * _CHUNK  # points between two looks at whether the search was cancelled
_LOADING = 64_000_000  # distances, which numpy compares in the time that numba takes to load
_CUT = 4  # times the points that are wanted: so many candidates are thinned out

_compared = 0  # distances in this process so far


def typical_spacing(cloud: PointCloud) -> float:
    """The median distance between neighbours, scan units; 1.0 where all points coincide.

    See `spacings`.
    """
    return float(np.median(spacings(cloud)))


def sparse_spacing(cloud: PointCloud) -> float:
    """The distance between neighbours where they are far apart, scan units: the 90 % quantile, but at most
    twice the median. See `spacings`."""
    usual, sparse = (cloud.remember(spacing_quantile, share) for share in (0.5, 0.9))
    return min(sparse, _SPARSEST * usual)


def spacing_quantile(cloud: PointCloud, share: float) -> float:
    """The distance between neighbours that so large a share of `spacings` does not exceed, scan units."""
    return float(np.quantile(spacings(cloud), share))


def spacings(cloud: PointCloud) -> NDArray[np.float64]:
    """The distance between neighbours at some positions of a cloud, (P,), scan units; P > 0.

    A few points are compared with all others. On a surface of one point per s^2 there are
    k points within s sqrt(k / pi), so the distance to the sixth neighbour gives s; copies of
    a point do not count. Found once for each cloud.
    """
    return cloud.remember(_spacings)


def roughness(cloud: PointCloud) -> float:
    """How far points lie off the planes through their neighbours, root mean square, scan units: by noise, or
    as the surface bends between them. The median over the positions of `spacings`; 0 of fewer than four
    points. Found once for each cloud."""
    return cloud.remember(_roughness)


def plane_residual(points: NDArray[np.floating]) -> float:
    """The root mean square distance of points (K, 3) from the plane that fits them best."""
    offsets = points - points.mean(axis=0, dtype=np.float64)
    return float(np.linalg.svd(offsets, compute_uv=False)[-1] / math.sqrt(max(len(points), 1)))


def spacing_at(cloud: PointCloud, row: int) -> float | None:
    """The distance between neighbours around one point, scan units; None where all points are
    copies of it.

    It looks at every point once: 5 to 15 ms for a million, by the processor's load. See `spacings`.
    """
    return _spacings_at(cloud.positions, [row])[0]


def nearest_rows(cloud: PointCloud, rows: Sequence[int], count: int = ENOUGH) -> list[NDArray[np.intp]]:
    """Rows of the points nearest to each of some points, itself among them, in any order. It looks at every
    point once."""
    return _nearest(cloud.positions, rows, count)


def nearest_row(cloud: PointCloud, position: NDArray[np.float64]) -> tuple[int, float]:
    """(row, distance) of the point nearest to a position, scan units. It looks at every point once."""
    offset = (position - cloud.origin).astype(np.float32)
    row, least = 0, math.inf
    for start, part, x in _chunks(cloud.positions):
        near, squared = _within(part, x, offset, least)
        if len(near) and squared.min() < least:
            row, least = start + int(near[squared.argmin()]), float(squared.min())
    return row, math.sqrt(least)


def _spacings(cloud: PointCloud) -> NDArray[np.float64]:
    count = len(cloud)
    if count < 2:
        return np.ones(1)
    found = [spacing for spacing in _spacings_at(cloud.positions, _sample_rows(count)) if spacing is not None]
    return np.array(found or [1.0])


def _sample_rows(count: int) -> list[int]:
    """Rows of some points, of so many, at which neighbours are looked at."""
    return np.linspace(0, count - 1, max(8, min(64, _DISTANCES // count))).astype(int).tolist()


def _roughness(cloud: PointCloud) -> float:
    if len(cloud) < _FLAT:
        return 0.0
    nearest = _nearest(cloud.positions, _sample_rows(len(cloud)), PLANE)
    return float(np.median([plane_residual(cloud.positions[rows]) for rows in nearest]))


def _spacings_at(points: NDArray[np.float32], rows: Sequence[int]) -> list[float | None]:
    """`spacing_at` for some rows."""
    distances: dict[int, NDArray[np.float32]] = {}
    for nearest in _NEAREST:
        lacking = [row for row in rows if len(distances.get(row, ())) < _NEIGHBOR]
        for row, near in zip(lacking, _nearest(points, lacking, nearest), strict=True):
            distances[row] = _distances(points, row, near)
        if nearest >= len(points):
            break
    return [_spacing(distances[row]) for row in rows]


def _spacing(distances: NDArray[np.float32]) -> float | None:
    """Spacings from the squared distances to the nearest distinct points, ascending."""
    k = min(_NEIGHBOR, len(distances))
    return float(np.sqrt(distances[k - 1] / (k / np.pi))) if k else None


def _distances(points: NDArray[np.float32], row: int, near: NDArray[np.intp]) -> NDArray[np.float32]:
    """The squared distances of a point to the distinct others among those near, ascending."""
    distinct = np.unique(points[near], axis=0)
    return np.sort(_squared(distinct.T, points[row]))[1:]


def _nearest(points: NDArray[np.float32], rows: Sequence[int], count: int) -> list[NDArray[np.intp]]:
    """Rows of the `count` points nearest to each of some points, itself included, in any order.

    Each one's own surroundings in the file give a distance that nearly all others exceed, so that
    few remain to be compared with one another.
    """
    count = min(count, len(points))
    limits = np.array([_limit(points, row, count) for row in rows], np.float32)
    search = _compiled_near if points.flags.carray and _is_compiling_worth(len(points) * len(rows)) else _near
    return search(points, rows, limits, count)


def _limit(points: NDArray[np.float32], row: int, count: int) -> float:
    """A squared distance of a point that `count` points do not exceed, by those around it in the file."""
    start = min(max(row - _CHUNK // 2, 0), max(len(points) - _CHUNK, 0))
    around = _squared(points[start : start + max(_CHUNK, count)].T, points[row])
    return float(np.partition(around, count - 1)[count - 1]) if len(around) >= count else np.inf


def _is_compiling_worth(distances: int) -> bool:
    """Whether to search with the compiled loop: once all searches so far have taken as long as it takes to
    load numba, which would keep a first picture waiting."""
    global _compared
    _compared += distances
    return _compared > _LOADING


def _near(
    points: NDArray[np.float32], rows: Sequence[int], limits: NDArray[np.float32], count: int
) -> list[NDArray[np.intp]]:
    """`_nearest` among points within squared distances (R,), by numpy."""
    near = [np.empty(0, np.intp)] * len(rows)
    far = [np.empty(0, np.float32)] * len(rows)
    for start, part, x in _chunks(points):
        for number, row in enumerate(rows):
            chosen, squared = _within(part, x, points[row], limits[number])
            near[number] = np.append(near[number], chosen + start)
            far[number] = np.append(far[number], squared)
            if len(near[number]) > _CUT * count:
                near[number], far[number] = _least(near[number], far[number], count)
                limits[number] = far[number].max()
    return [_least(some, squared, count)[0] for some, squared in zip(near, far, strict=True)]


def _compiled_near(
    points: NDArray[np.float32], rows: Sequence[int], limits: NDArray[np.float32], count: int
) -> list[NDArray[np.intp]]:
    """`_near` by a compiled loop, to the same bits, in a quarter of the time; other threads go on."""
    from .spacing_kernels import Near, note_near

    most = _CUT * count
    shape = len(rows), most + _CHUNK
    near = Near(np.empty(shape, np.int64), np.empty(shape, np.float32), np.zeros(len(rows), np.int64), limits)
    start, at = 0, points[list(rows)]
    while start < len(points):
        checkpoint()
        start = note_near(points[: start + _RUN], at, near, start, _CHUNK, most)
        for number in np.flatnonzero(near.held > most).tolist():
            found, squared = near.of(number)
            near.rows[number, :count], near.squared[number, :count] = _least(found, squared, count)
            near.held[number], limits[number] = count, near.squared[number, :count].max()
    return [_least(*near.of(number), count)[0] for number in range(len(rows))]


def _least(
    rows: NDArray[np.intp], squared: NDArray[np.float32], count: int
) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """The entries with the `count` least squared distances, in any order."""
    chosen = np.argpartition(squared, count - 1)[:count]
    return rows[chosen], squared[chosen]


def _chunks(
    points: NDArray[np.float32],
) -> Iterator[tuple[int, NDArray[np.float32], NDArray[np.float32]]]:
    """The points in parts: number of the first one, (C, 3) positions, (C,) their x side by side."""
    for start in range(0, len(points), _CHUNK):
        checkpoint()
        part = points[start : start + _CHUNK]
        yield start, part, np.ascontiguousarray(part[:, 0])


def _within(
    part: NDArray[np.float32], x: NDArray[np.float32], point: NDArray[np.float32], limit: float
) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """Numbers and squared distances of the points whose squared distance is `limit` at most.

    x alone rules most of them out, in a fraction of the time.
    """
    beside = np.flatnonzero(np.square(x - point[0]) <= limit)
    squared = _squared(part[beside].T, point)
    chosen = squared <= limit
    return beside[chosen], squared[chosen]


def _squared(columns: NDArray[np.float32], point: NDArray[np.float32]) -> NDArray[np.float32]:
    """Squared distances to a point, (N,). columns: (3, N)."""
    x, y, z = (columns[axis] - point[axis] for axis in range(3))
    return x * x + y * y + z * z
