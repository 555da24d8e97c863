"""The inner loops of moving points to planes, compiled by numba; see `noise`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from .plane_kernels import fit_plane

_BITS = 21  # of each coordinate in a code


@compiled
def _weight(apart: float) -> float:
    """The quadratic B-spline."""
    apart = abs(apart)
    if apart < 0.5:
        return 0.75 - apart * apart
    return 0.5 * (1.5 - apart) ** 2 if apart < 1.5 else 0.0


@compiled
def _middle(code: int, middle: NDArray[np.float64]) -> None:
    """The middle of a cell, (3,), from the corner of the first."""
    last = (1 << _BITS) - 1
    middle[0] = (code >> (2 * _BITS)) + 0.5
    middle[1] = (code >> _BITS & last) + 0.5
    middle[2] = (code & last) + 0.5


@compiled
def _shift(sums: NDArray[np.float64], x: float, y: float, z: float, shifted: NDArray[np.float64]) -> None:
    """Sums (10,) of points that lie (x, y, z) farther off."""
    n = sums[0]
    shifted[0] = n
    shifted[1], shifted[2], shifted[3] = sums[1] + n * x, sums[2] + n * y, sums[3] + n * z
    shifted[4] = sums[4] + x * (2.0 * sums[1] + n * x)
    shifted[5] = sums[5] + y * (2.0 * sums[2] + n * y)
    shifted[6] = sums[6] + z * (2.0 * sums[3] + n * z)
    shifted[7] = sums[7] + sums[1] * y + sums[2] * x + n * x * y
    shifted[8] = sums[8] + sums[2] * z + sums[3] * y + n * y * z
    shifted[9] = sums[9] + sums[3] * x + sums[1] * z + n * z * x


@compiled
def move_to_planes(
    in_cells: NDArray[np.float64],
    rows: NDArray[np.intp],
    firsts: NDArray[np.intp],
    codes: NDArray[np.int64],
    enough: float,
    farthest: float,
    planes: NDArray[np.float64],
) -> None:
    """Planes of least squares through the points around each point, weighted by a B-spline: (N, 6), the move
    of the point to its plane, and the normal.

    in_cells: (N, 3), in edges of cells from the corner of the first. rows: of points in the order of their
    cells, of which `firsts` (M + 1,) are the first ones of each, and codes (M,) the cells, ascending: x, y
    and z, 21 bits each, none 0. What has fewer than `enough` around, by their weights, stays. farthest: that
    one is moved, edges.
    """
    count = len(codes)
    cells = np.zeros((count, 10))  # number, x y z, xx yy zz, xy yz zx, from the middle
    middle = np.empty(3)
    for cell in range(count):
        _middle(codes[cell], middle)
        sums = cells[cell]
        for row in rows[firsts[cell] : firsts[cell + 1]]:
            x, y, z = (
                in_cells[row, 0] - middle[0],
                in_cells[row, 1] - middle[1],
                in_cells[row, 2] - middle[2],
            )
            sums[0] += 1.0
            sums[1] += x
            sums[2] += y
            sums[3] += z
            sums[4] += x * x
            sums[5] += y * y
            sums[6] += z * z
            sums[7] += x * y
            sums[8] += y * z
            sums[9] += z * x
    around, steps = np.empty((27, 10)), np.empty((27, 3))
    sums, a, v = np.empty(10), np.empty((3, 3)), np.empty((3, 3))
    normal, widths = np.empty(3, np.float32), np.empty(3)
    for cell in range(count):
        _middle(codes[cell], middle)
        found = 0
        for number in range(27):
            x, y, z = number // 9 - 1, number // 3 % 3 - 1, number % 3 - 1
            code = codes[cell] + (x << (2 * _BITS)) + (y << _BITS) + z
            at = np.searchsorted(codes, code)
            if at < count and codes[at] == code:
                _shift(cells[at], x, y, z, around[found])
                steps[found, 0], steps[found, 1], steps[found, 2] = x, y, z
                found += 1
        for row in rows[firsts[cell] : firsts[cell + 1]]:
            x, y, z = (
                in_cells[row, 0] - middle[0],
                in_cells[row, 1] - middle[1],
                in_cells[row, 2] - middle[2],
            )
            sums[:] = 0.0
            for i in range(found):
                weight = _weight(x - steps[i, 0]) * _weight(y - steps[i, 1]) * _weight(z - steps[i, 2])
                for j in range(10):
                    sums[j] += weight * around[i, j]
            if sums[0] < enough:
                continue
            fit_plane(sums[1:], sums[0], a, v, normal, widths)
            off = normal[0] * (x - sums[1] / sums[0])
            off += normal[1] * (y - sums[2] / sums[0]) + normal[2] * (z - sums[3] / sums[0])
            off = min(max(off, -farthest), farthest)
            for i in range(3):
                planes[row, i] = -off * normal[i]
                planes[row, 3 + i] = normal[i]
