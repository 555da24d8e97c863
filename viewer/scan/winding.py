"""Winding numbers: how often a surface of points with normals surrounds a place.

The winding number is 1 inside a closed surface and 0 outside. An open surface gives values between, the share
of directions in which it lies, so that the number also tells inside and outside where a surface has holes. It
is the sum of the fields of dipoles, one for each point; a tree sums far ones together (Barill et al. 2018).
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..task import checkpoint
from ..threads import together
from .morton import morton_codes

if TYPE_CHECKING:
    from .winding_kernels import Clusters, Groups

_LEAF = 8  # points of a leaf, about
_FAR = 2.5  # radii of a node, the distance from which its cluster stands for its points
_PART = 1 << 12  # queries of one call of a compiled loop


def winding_number(
    points: ArrayLike, normals: ArrayLike, areas: ArrayLike, queries: ArrayLike
) -> NDArray[np.float64]:
    """The winding number of a surface at places, (Q,): 1 inside, 0 outside, 1/2 on the surface.

    points: (N, 3) on the surface. normals: (N, 3), unit length, outwards. areas: (N,), the area of the
    surface that each point stands for, squared units of the points. queries: (Q, 3), the places. A point at a
    place adds nothing there. Less than two distances between points off the surface, the number is that of
    single points. The error of the tree is less than 0.01.

    Raises InputError where shapes do not fit, or numbers are not finite.
    """
    given = [np.asarray(array, np.float64) for array in (points, normals, areas, queries)]
    at, facing, of_points, places = given
    count = (len(at), 3)
    if at.shape != count or facing.shape != count or of_points.shape != count[:1]:
        shapes = ", ".join(str(array.shape) for array in given[:3])
        raise InputError(f"points, normals and areas have shapes {shapes}, expected (N, 3), (N, 3) and (N,)")
    if places.ndim != 2 or places.shape[1] != 3:
        raise InputError(f"queries have shape {places.shape}, expected (Q, 3)")
    if not all(np.isfinite(array).all() for array in given):
        raise InputError("points, normals, areas or queries are not finite")
    if not len(at):
        return np.zeros(len(places))
    return WindingField(at, facing * of_points[:, None]).at(places)


class WindingField:
    """The field of winding numbers of dipoles. points, vectors: (N, 3), N at least 1, the vectors area times
    normal, outwards."""

    def __init__(self, points: NDArray[np.float64], vectors: NDArray[np.float64]) -> None:
        from .winding_kernels import Groups

        order = morton_codes(points).argsort(kind="stable")
        self._nodes = Groups(points, vectors, order, _halves(len(points)))
        self._clusters = clusters_of(self._nodes)

    def at(self, places: NDArray[np.float64], soft: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """The winding number at places (Q, 3), (Q,). soft: (Q,), squared distances that are added to those
        between places and points; None: 0."""
        from . import winding_kernels

        found = np.empty(len(places))
        added = np.zeros(len(places)) if soft is None else soft

        def part(start: int) -> None:
            checkpoint()
            some = slice(start, start + _PART)
            winding_kernels.field(self._nodes, self._clusters, places[some], added[some], found[some], _FAR)

        together(len(places), [partial(part, start) for start in range(0, len(places), _PART)])
        return found


def clusters_of(groups: Groups) -> Clusters:
    """The clusters of groups: their fields from afar."""
    from .winding_kernels import Clusters, summarize

    count = len(groups.borders)
    clusters = Clusters(
        *(np.empty((count, *shape)) for shape in ((3,), (), (3,), (9,), (13,))),
    )
    summarize(groups, clusters)
    return clusters


def _halves(count: int) -> NDArray[np.int64]:
    """First and last + 1 of the points of each node of a tree that halves `count` points again and again,
    (C, 2): the children of node c are 2c + 1 and 2c + 2."""
    depth = int(np.ceil(np.log2(max(count / _LEAF, 1))))
    levels = []
    for level in range(depth + 1):
        cuts = np.arange((1 << level) + 1, dtype=np.int64) * count >> level
        levels.append(np.column_stack([cuts[:-1], cuts[1:]]))
    return np.concatenate(levels)
