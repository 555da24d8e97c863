"""Octrees of points (Slomp 2014, VI-A): Morton codes, sorted; all else is read off their order."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...params import describe, param
from ...task import checkpoint
from ...threads import ranges, shares, together
from ..points import PointCloud
from .attributes import Sorted, attributes_of
from .cube import Cube, Grid
from .octree import DEEPEST, Octree

STOPS = ("delta", "depth", "occupancy")

_PARTS = 8  # for each thread, as they are of all sizes


@dataclass(frozen=True)
class Stop:
    """A rule where subdivision ends. Raises InputError where a value is out of its range."""

    rule: str = param(
        "delta",
        "When Scan4D stops dividing octants. delta: when few positions share a leaf; depth: at a fixed "
        "level; occupancy: when an octant holds few points",
        choices=STOPS,
        affects="derive",
    )
    delta: float = param(
        0.05,
        "Share of the positions that may lie in the same leaf as other positions",
        low=0,
        high=1,
        affects="derive",
    )
    depth: int = param(10, "Level of the leaves", low=0, high=DEEPEST, affects="derive")
    occupancy: int = param(
        8, "Scan4D does not divide octants with at most this many points", low=1, affects="derive"
    )

    def __post_init__(self) -> None:
        for parameter in describe(type(self)):
            parameter.parse(getattr(self, parameter.name))


def build(
    cloud: PointCloud, stop: Stop | None = None, cube: Cube | None = None, attributes: bool = True
) -> Octree:
    """The octree of a cloud's points; one without nodes where there is no point in it.

    cube: that of other poses, for trees of the same octants; None: around the body of the points. Points
    outside are the tree's strays. attributes: means for every node of what the cloud has. Positions are
    distinct where they differ in float32, relative to the cloud's origin.
    """
    stop = stop or Stop()
    cube = Cube(*(cube or (Cube.of(cloud) if len(cloud) else (cloud.origin, 1.0)))).checked()
    strays = cube.outside(cloud)
    count = len(cloud) - len(strays)
    if not count:
        return Octree(cube.low, cube.edge, (), 0, 0, strays=strays)
    grid = Grid.of(cube, cloud.origin)
    points = _sorted(cloud, strays, grid)
    checkpoint()
    ends, counts = _ends(points, stop)
    masks = _masks(points, ends, counts)
    found = attributes_of(cloud, points, grid, cube.edge, ends, masks, counts) if attributes else ()
    return Octree(cube.low, cube.edge, masks, count, points.distinct, found, strays)


def _sorted(cloud: PointCloud, strays: NDArray[np.uint32], grid: Grid) -> Sorted:
    """The points that are no strays."""
    if not len(strays):
        return sort_points(cloud.positions, grid)
    inside = np.delete(np.arange(len(cloud), dtype=np.uint32), strays)
    points = sort_points(cloud.positions[inside], grid)
    return points._replace(rows=inside[points.rows])


def shortfall(octree: Octree, stop: Stop) -> str | None:
    """Why a tree tells fewer positions apart than its rule asks for; None where it does not."""
    if stop.rule != "delta" or octree.loss <= stop.delta:
        return None
    return (
        f"the octree reached its deepest level, {octree.depth}: {octree.loss:.2%} of the positions still "
        "share a leaf with other positions"
    )


def sort_points(positions: NDArray[np.float32], grid: Grid) -> Sorted:
    """Sort positions (N, 3), N > 0.

    The points are put into a bucket for each octant of level 4; then each bucket is sorted by radix, within
    the processor's cache as a rule. Large clouds are shared out among threads; the result is the same.
    """
    from . import sort_kernels

    positions, count = np.ascontiguousarray(positions), len(positions)
    chunks = shares(count)
    unsorted = np.empty(count, np.uint64)
    sizes = np.zeros((len(chunks), sort_kernels.BUCKETS), np.int64)
    together(
        count,
        [
            partial(sort_kernels.encode, positions[a:b], *grid, unsorted[a:b], size)
            for (a, b), size in zip(chunks, sizes, strict=True)
        ],
    )
    starts = np.concatenate([[0], np.cumsum(sizes.sum(axis=0))])
    heads = starts[:-1] + np.cumsum(sizes, axis=0) - sizes  # of each chunk in each bucket
    codes, rows = np.empty(count, np.uint64), np.empty(count, np.uint32)
    together(
        count,
        [
            partial(sort_kernels.fill_buckets, unsorted[a:b], a, head, codes, rows)
            for (a, b), head in zip(chunks, heads, strict=True)
        ],
    )
    del unsorted  # before sorting takes memory of its own
    parts = _PARTS * len(chunks) if len(chunks) > 1 else 1
    cuts = np.searchsorted(starts, np.linspace(0, count, parts + 1))
    together(
        count,
        [
            partial(sort_kernels.sort_buckets, codes, rows, starts[a : b + 1])
            for a, b in ranges(np.unique([0, *cuts, sort_kernels.BUCKETS]))
        ],
    )
    levels, histogram = np.zeros(count, np.uint8), np.zeros(DEEPEST + 2, np.int64)
    sort_kernels.apart(codes[:-1], codes[1:], levels[1:], histogram)
    distinct = count if histogram[-1] == 0 else _distinct(positions, rows, levels)
    return Sorted(codes, rows, levels, 1 + np.cumsum(histogram[:-1]), distinct)


def _distinct(positions: NDArray[np.float32], rows: NDArray[np.uint32], levels: NDArray[np.uint8]) -> int:
    """How many different positions there are; the cells alone distinguish most."""
    from . import sort_kernels

    crowds = np.empty((len(rows) // sort_kernels.CROWD + 1, 2), np.int64)
    total, crowded = sort_kernels.count_distinct(positions, rows, levels, crowds)
    for begin, end in crowds[:crowded]:
        crowd = positions[rows[begin:end]].T
        ordered = crowd[:, np.lexsort(crowd)]
        total += 1 + int(np.count_nonzero((ordered[:, 1:] != ordered[:, :-1]).any(axis=0)))
    return total


def _ends(points: Sorted, stop: Stop) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """The level of each point's leaf, (N,), and how many nodes each level has down to the deepest."""
    if stop.rule == "occupancy":
        ends = np.minimum(_occupied(points.codes, stop.occupancy), DEEPEST).astype(np.uint8)
        levels = np.arange(int(ends.max()) + 1, dtype=np.uint8)
        counts = [np.count_nonzero((points.levels <= level) & (level <= ends)) for level in levels]
        return ends, np.array(counts, np.int64)
    depth = stop.depth
    if stop.rule == "delta":
        enough = np.flatnonzero(points.counts[:DEEPEST] >= (1 - stop.delta) * points.distinct)
        depth = int(enough[0]) if len(enough) else DEEPEST
    return np.full(len(points.codes), depth, np.uint8), points.counts[: depth + 1]


def _occupied(codes: NDArray[np.uint64], most: int) -> NDArray[np.uint8]:
    """(N,): the first level at which each point's octant holds at most so many points, 22 where none does.

    An octant with more holds two points that are `most` apart in the order of the codes: the deepest such
    octant around a point is the greatest level over a window, found by doubling the window.
    """
    from . import sort_kernels

    count = len(codes)
    most = min(most, count)
    levels = np.zeros(count + most, np.uint8)
    if count > most:
        sort_kernels.apart(codes[:-most], codes[most:], levels[most:count], np.zeros(DEEPEST + 2, np.int64))
    width = 1
    while 2 * width <= most + 1:
        levels, width = np.maximum(levels[:-width], levels[width:]), 2 * width
    rest = most + 1 - width
    return np.maximum(levels[:count], levels[rest : rest + count])


def _masks(
    points: Sorted, ends: NDArray[np.uint8], counts: NDArray[np.int64]
) -> tuple[NDArray[np.uint8], ...]:
    from . import node_kernels

    starts = np.cumsum(counts) - counts
    masks = np.zeros(int(starts[-1]), np.uint8)
    node_kernels.fill_masks(points.codes, points.levels, ends, starts, masks)
    return tuple(np.split(masks, starts[1:-1])) if len(starts) > 1 else ()
