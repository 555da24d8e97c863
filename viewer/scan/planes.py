"""Normals of either side: of planes through the neighbours of points, as many as noise asks for.

Few neighbours follow the surface, many average noise out. So a plane goes through the seven nearest where
noise hardly turns it; elsewhere through as many as leave the least error, of noise and of curvature together.
The distances to planes show the noise: planes of fewer and of more neighbours. Both are judged over the
points around, as one neighbourhood says little about its own error.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..task import checkpoint
from ..threads import together

Vectors = NDArray[np.float64]  # (N, 3)

AROUND = 20  # points that are judged together
_COUNTS = (7, 10, 14, 20, 28, 40, 56, 80, 96)  # of neighbours, the point itself included
_MOST = (20, 96)  # of them that are looked at first, and where noise asks for more
_LEAST_TOLD = 3  # numbers of neighbours by which noise is known
_QUIET = 0.003  # mean square of the angle by which noise turns a normal of the fewest: 3 degrees
_SETTLED = 0.015  # of the normals that others are compared with: 7 degrees
_AT_ONCE = 1 << 16  # points whose neighbourhoods are held at a time
_PART = 1 << 13  # points of one call of a compiled loop


class NeighborSearch:
    """The nearest neighbours of distinct points, (N, 3) float64."""

    def __init__(self, points: Vectors) -> None:
        from open3d import core

        self.points = points
        self._search = core.nns.NearestNeighborSearch(core.Tensor.from_numpy(points), core.Dtype.Int32)
        self._search.knn_index()

    def of(self, points: Vectors, k: int) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """The k nearest to each of some points, or all there are: rows and squared distances, (M, K), nearest
        first."""
        from open3d import core

        rows, squared = self._search.knn_search(core.Tensor.from_numpy(points), min(k, len(self.points)))
        return rows.numpy(), squared.numpy()

    def of_all(self, k: int) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Each point and its nearest others, k together or all there are, (N, K), nearest first; and the
        distance to the last one, (N,)."""
        near = np.empty((len(self.points), min(k, len(self.points))), np.int32)
        farthest = np.empty(len(self.points))
        for start, end in _parts(len(near), _AT_ONCE):
            near[start:end], squared = self.of(self.points[start:end], k)
            farthest[start:end] = np.sqrt(squared[:, -1])
        return near, farthest


def plane_normals(search: NeighborSearch, near: NDArray[np.int32]) -> NDArray[np.float32]:
    """Unit normals of either sign, (N, 3).

    near: (N, K), each point and its nearest others, 20 together or all there are. Where neighbours span no
    plane, some unit vector across them.
    """
    normals = np.empty((len(near), 3), np.float32)
    rows = np.arange(len(near))
    for most in _MOST:
        further = np.zeros(len(rows), bool)
        for start, end in _parts(len(rows), _AT_ONCE):
            some = rows[start:end]
            normals[some], further[start:end] = _chosen(search, near, some, most)
        rows = rows[further]
    return normals


def _chosen(
    search: NeighborSearch, around: NDArray[np.int32], rows: NDArray[np.intp], most: int
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """The normals of some points, (M, 3), of as many neighbours, up to `most`, as leave the least error; and
    whether more may leave less, (M,). around: (N, K), the points that are judged together."""
    from . import plane_kernels

    points = search.points
    usable = [count for count in _COUNTS if count <= min(most, len(points))] or [len(points)]
    counts = np.array(usable)
    taking_part = np.unique(np.append(around[rows], rows))
    normals = np.empty((len(taking_part), len(counts), 3), np.float32)
    widths = np.empty((len(taking_part), len(counts), 3))
    for start, end in _parts(len(taking_part), _AT_ONCE // 4):
        some = taking_part[start:end]
        near = around[some] if usable[-1] <= around.shape[1] else search.of(points[some], usable[-1])[0]

        def fit(first: int, last: int, start: int = start, near: NDArray[np.int32] = near) -> None:
            part = slice(start + first, start + last)
            plane_kernels.fit_nested(
                points, taking_part[part], near[first:last], counts, normals[part], widths[part]
            )

        _share(end - start, fit)
    in_part = np.full(len(points), -1, np.int32)
    in_part[taking_part] = np.arange(len(taking_part))
    if len(counts) < _LEAST_TOLD:
        return normals[in_part[rows], 0], np.zeros(len(rows), bool)
    chosen, further = np.empty((len(rows), 3), np.float32), np.empty(len(rows), bool)
    fits = plane_kernels.NestedFits(counts, normals, widths)
    limits = plane_kernels.TurnLimits(_QUIET, _SETTLED)

    def choose(first: int, last: int) -> None:
        part, some = slice(first, last), rows[first:last]
        plane_kernels.choose(some, around[some], in_part, fits, limits, chosen[part], further[part])

    _share(len(rows), choose)
    return chosen, further if most < len(points) else np.zeros(len(rows), bool)


def _share(count: int, work: Callable[[int, int], object]) -> None:
    """Do some work on all of `count` points, some of them at a time."""

    def checked(start: int, end: int) -> None:
        checkpoint()
        work(start, end)

    together(count, [partial(checked, *part) for part in _parts(count, _PART)])


def _parts(count: int, size: int) -> Iterator[tuple[int, int]]:
    """(first, last + 1) of parts of this size of `count` points."""
    for start in range(0, count, size):
        checkpoint()
        yield start, min(start + size, count)
