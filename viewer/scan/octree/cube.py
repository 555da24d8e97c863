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


class Cube(NamedTuple):
    """The cube of an octree. low: (3,) float64, absolute; edge: both in scan units."""

    low: NDArray[np.float64]
    edge: float

    @classmethod
    def around(cls, low: NDArray[np.float64], high: NDArray[np.float64]) -> Cube:
        """The cube around a box, absolute, scan units; its upper faces are beyond all of the box.

        Lowest corner and edge are numbers of few bits, so that borders between cells are exact.
        """
        farthest = float(np.abs([low, high]).max())
        extents = float((high - low).max()), farthest / 2**20, 1.0
        extent = next(extent for extent in extents if extent > _LEAST)
        grid = max(_step(extent), 2.0 ** (math.frexp(farthest)[1] - 52))
        low = np.floor(low / grid) * grid
        extent = max(extent, float((high - low).max()))
        cell = 2**DEEPEST * _step(extent)
        return cls(low, (math.floor(extent / cell) + 1) * cell)

    @classmethod
    def of(cls, cloud: PointCloud) -> Cube:
        """The cube around the points of a cloud, which has some."""
        low, high = extremes(cloud.positions)
        return cls.around(_sum_below(low, cloud.origin), -_sum_below(-high, -cloud.origin))

    def checked(self, cloud: PointCloud) -> Cube:
        """The cube with its edge made a number of few bits; raises InputError where points lie outside."""
        if not (math.isfinite(self.edge) and self.edge > 0 and np.isfinite(self.low).all()):
            raise InputError(f"an octree's cube has an edge of {self.edge} from {self.low}")
        cell = 2**DEEPEST * _step(self.edge)
        cube = Cube(np.asarray(self.low, np.float64), math.ceil(self.edge / cell) * cell)
        low, high = extremes(cloud.positions)
        offset = cloud.origin - cube.low
        if (low + offset < 0).any() or (high + offset > cube.edge).any():
            raise InputError(f"points lie outside the octree's cube of edge {cube.edge:g} from {cube.low}")
        return cube


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
