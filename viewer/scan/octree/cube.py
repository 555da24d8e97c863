"""The cube of an octree, and which of its cells a position lies in, without rounding."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..points import PointCloud
from .octree import DEEPEST

_LEAST = 1e-60  # an extent: less than float32 can hold, and a step of it is no denormal number
_STEP_BITS = 20  # a cell of level 21 is so many bits of steps, see `Grid`
_SLACK = 4  # steps of the grid of lowest corners that an edge is longer than its box at least
_MOST_OUTSIDE = 1 / 64  # of the points: more are a part of the scan


class Cube(NamedTuple):
    """The cube of an octree. low: (3,) float64, absolute; edge: both in scan units."""

    low: NDArray[np.float64]
    edge: float

    @classmethod
    def around(cls, low: NDArray[np.float64], high: NDArray[np.float64]) -> Cube:
        """The cube around a box, absolute, scan units, and about its centre (Slomp 2014, VI-A); its faces are
        beyond all of the box.

        Lowest corner and edge are numbers of few bits, so that borders between cells are exact.
        """
        farthest = float(np.abs([low, high]).max())
        extents = float((high - low).max()), farthest / 2**20, 1.0
        extent = next(extent for extent in extents if extent > _LEAST)
        grid = max(2 * _step(extent), 2.0 ** (math.frexp(farthest)[1] - 52))
        cell = 2**DEEPEST * _step(extent)
        edge = (math.floor((extent + _SLACK * grid) / cell) + 1) * cell
        return cls(np.floor((low / 2 + high / 2 - edge / 2) / grid) * grid, edge)

    @classmethod
    def holding(cls, cloud: PointCloud) -> Cube:
        """The cube around all points of a cloud, which has some."""
        low, high = extremes(cloud.positions)
        return cls.around(_sum_below(low, cloud.origin), -_sum_below(-high, -cloud.origin))

    @classmethod
    def of(cls, cloud: PointCloud) -> Cube:
        """The cube around the body of the points of a cloud, which has some: those outside are few, such as
        one far away that would leave the others few octants. Around all where many lie apart."""
        body = cloud.bounds()
        cube = cls.around(body.low, body.high)
        return cube if len(cube.outside(cloud)) <= _MOST_OUTSIDE * len(cloud) else cls.holding(cloud)

    def checked(self) -> Cube:
        """The cube with its edge made a number of few bits; raises InputError where it is none."""
        if not (math.isfinite(self.edge) and self.edge > 0 and np.isfinite(self.low).all()):
            raise InputError(
                f"the cube of an octree has the unusable edge {self.edge}, starting at {self.low}"
            )
        cell = 2**DEEPEST * _step(self.edge)
        return Cube(np.asarray(self.low, np.float64), math.ceil(self.edge / cell) * cell)

    def outside(self, cloud: PointCloud) -> NDArray[np.uint32]:
        """The rows of a cloud's points that lie outside, (s,), ascending."""
        low, high = self.low - cloud.origin, self.low + self.edge - cloud.origin
        lowest, highest = extremes(cloud.positions)
        if (lowest >= low).all() and (highest <= high).all():
            return np.empty(0, np.uint32)
        outside = np.zeros(len(cloud), bool)
        for axis in range(3):  # column by column: numpy is slow along the short axis
            values = cloud.positions[:, axis].astype(np.float64)
            outside |= (values < low[axis]) | (values > high[axis])
        return np.flatnonzero(outside).astype(np.uint32)


class Grid(NamedTuple):
    """How positions become cells of level 21.

    A cell's edge is a whole number of steps, at most 2^20, and a step a power of two. A position in steps
    is exact in float64, and so are its floor and that less the cube's lowest corner, whole numbers less
    than 2^42 apart. Half a step more is farther from the borders of cells than products round.
    """

    steps_per_unit: float
    low: NDArray[np.float64]  # (3,), steps from the cloud's origin
    cells_per_step: float

    @classmethod
    def of(cls, cube: Cube, origin: NDArray[np.float64]) -> Grid:
        """The cube as seen from an origin; within a step where it is no whole number of steps away."""
        step = _step(cube.edge)
        return cls(1 / step, np.floor((cube.low - origin) / step), 2**DEEPEST * step / cube.edge)


def extremes(positions: NDArray[np.float32]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The least and the greatest coordinates, (3,) each, of positions (N, 3), N > 0."""
    from . import sort_kernels

    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    sort_kernels.widen(np.ascontiguousarray(positions), low, high)
    return low, high


def _step(extent: float) -> float:
    """The power of two that a cell of level 21 is 2^19 to 2^20 of."""
    return 2.0 ** (math.frexp(extent)[1] - DEEPEST - _STEP_BITS)


def _sum_below(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """a + b, rounded down where it has to be rounded (the error is Knuth's two-sum)."""
    total = a + b
    part = total - a
    error = (a - (total - part)) + (b - part)
    with np.errstate(under="ignore"):  # the number below 0 is one that underflows
        return np.where(error < 0, np.nextafter(total, -np.inf), total)
