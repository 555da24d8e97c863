"""The inner loops of averaging frames, compiled by numba; see `averaging`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled, inlined
from .plane_kernels import fit_plane

_BITS = 21  # of each coordinate in a code
_HASH = 0x9E3779B97F4A7C15 >> 1  # odd, spreads codes over the table
# The weight of a cell beside another. Points then spread as widely as a quadratic B-spline, 1/4 of a squared
# edge, so the mean of planes does not lie inside a surface that bends.
_BESIDE = 0.1
_FREE = -1  # in the table: no cell here


class RunSums(NamedTuple):
    """The runs of frames of N points.

    sums: (N, 3) float32, of differences to the current frame. counts: (N,) uint8, frames in the run. is_open:
    (N,) bool, whether an earlier frame may still join.
    """

    sums: NDArray[np.float32]
    counts: NDArray[np.uint8]
    is_open: NDArray[np.bool_]


class Frames(NamedTuple):
    """Two frames of the same N points, with three numbers each: a position, a colour or a normal.

    now: (N, 3) float32, the current frame. then: (N, 3) float32, an earlier one. shift: (3,) float32, added
    to the earlier one. is_there: (N,) bool, whether the earlier frame has the point.
    """

    now: NDArray[np.float32]
    then: NDArray[np.float32]
    shift: NDArray[np.float32]
    is_there: NDArray[np.bool_]


@inlined
def _find(code: int, table: NDArray[np.int64], codes: NDArray[np.int64]) -> int:
    """The slot in the table of a code, or the free one that it goes to."""
    last = len(table) - 1
    slot = ((code * _HASH) >> 17) & last
    while table[slot] != _FREE and codes[table[slot]] != code:
        slot = (slot + 1) & last
    return slot


class CellGrid(NamedTuple):
    """Numbered cubic cells. low: (3,) float32, the corner of the first. edge: of a cell. table: number of the
    cell by slot. codes: (M,) of the cells, 21 bits for each coordinate."""

    low: NDArray[np.float32]
    edge: float
    table: NDArray[np.int64]
    codes: NDArray[np.int64]


@compiled
def label_cells(
    points: NDArray[np.float32], low: NDArray[np.float32], edge: float, labels: NDArray[np.int32]
) -> CellGrid:
    """Number the cubic cells that points (N, 3) lie in, in the order of their first points.

    low: (3,), the corner of the first cell. labels: (N,), written; a cell farther than 2^21 edges off counts
    as the last one there.
    """
    most, scale = (1 << _BITS) - 1, 1.0 / edge
    table = np.full(1 << 10, _FREE, np.int64)
    codes = np.empty(len(table) // 2, np.int64)
    count = 0
    for i in range(len(points)):
        code = 0
        for axis in range(3):
            cell = int(min(max((points[i, axis] - low[axis]) * scale, 0.0), float(most)))
            code = (code << _BITS) | cell
        slot = _find(code, table, codes)
        if table[slot] == _FREE:
            if count == len(codes):
                table = np.full(2 * len(table), _FREE, np.int64)
                longer = np.empty(2 * len(codes), np.int64)
                longer[:count] = codes
                codes = longer
                for cell in range(count):
                    table[_find(codes[cell], table, codes)] = cell
                slot = _find(code, table, codes)
            codes[count] = code
            table[slot] = count
            count += 1
        labels[i] = table[slot]
    return CellGrid(low, edge, table, codes[:count])


@compiled
def sum_moments(
    points: NDArray[np.float32], shift: NDArray[np.float32], grid: CellGrid, sums: NDArray[np.float32]
) -> None:
    """Sum the moments of points (N, 3) in the cells of a grid, in edges from the corner of each cell.

    shift: (3,), added to the points. sums: (M, 10), added to: number, x y z, xx yy zz, xy yz zx.
    """
    low, table, codes = grid.low, grid.table, grid.codes
    scale, most = 1.0 / grid.edge, (1 << _BITS) - 1
    left, lower, back = shift[0] - low[0], shift[1] - low[1], shift[2] - low[2]
    for i in range(len(points)):
        x, y, z = (points[i, 0] + left) * scale, (points[i, 1] + lower) * scale, (points[i, 2] + back) * scale
        if min(x, y, z) < 0.0 or max(x, y, z) > most:
            continue
        column, row, layer = int(x), int(y), int(z)
        cell = table[_find((((column << _BITS) | row) << _BITS) | layer, table, codes)]
        if cell == _FREE:
            continue
        a, b, c = np.float32(x - column), np.float32(y - row), np.float32(z - layer)
        of_cell = sums[cell]
        of_cell[0] += np.float32(1)
        of_cell[1] += a
        of_cell[2] += b
        of_cell[3] += c
        of_cell[4] += a * a
        of_cell[5] += b * b
        of_cell[6] += c * c
        of_cell[7] += a * b
        of_cell[8] += b * c
        of_cell[9] += c * a


@compiled
def fit_cells(sums: NDArray[np.float64], planes: NDArray[np.float64]) -> None:
    """Fit a plane to the points of each cell, by their moments (M, 10) as `sum_moments` has them.

    planes: (M, 7), written: the mean point, the unit normal, and the variance along it, all in edges from
    the corner of the cell; the variance is infinite where there are fewer than four points.
    """
    a, v, widths = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    normal = np.empty(3, np.float32)
    for cell in range(len(sums)):
        count = sums[cell, 0]
        planes[cell, 6] = np.inf
        if count < 4.0:
            planes[cell, :6] = 0.0
            continue
        fit_plane(sums[cell, 1:], count, a, v, normal, widths)
        for axis in range(3):
            planes[cell, axis] = sums[cell, 1 + axis] / count
            planes[cell, 3 + axis] = normal[axis]
        planes[cell, 6] = widths[0] * count / (count - 3.0)


@inlined
def _spline(apart: float) -> float:
    """The quadratic B-spline."""
    apart = abs(apart)
    if apart < 0.5:
        return 0.75 - apart * apart
    return 0.5 * (1.5 - apart) * (1.5 - apart) if apart < 1.5 else 0.0


@compiled
def smooth_planes(grid: CellGrid, sums: NDArray[np.float64], near: NDArray[np.int32]) -> NDArray[np.float64]:
    """Fit planes to the points of each cell and the cells around, as `fit_cells` has them.

    sums: (M, 10), as `sum_moments` has them. near: (M, 27), written: the numbers of the cells around, x
    first, -1 where there is none.
    """
    table, codes, count = grid.table, grid.codes, len(grid.codes)
    around, planes = np.zeros((count, 10)), np.empty((count, 7))
    for cell in range(count):
        total = around[cell]
        for number in range(27):
            x, y, z = number // 9 - 1, number // 3 % 3 - 1, number % 3 - 1
            code = codes[cell] + (x << (2 * _BITS)) + (y << _BITS) + z
            other = table[_find(code, table, codes)]
            near[cell, number] = other
            if other == _FREE:
                continue
            weight = _BESIDE ** (abs(x) + abs(y) + abs(z))
            own, n = sums[other], sums[other, 0]
            total[0] += weight * n
            total[1] += weight * (own[1] + n * x)
            total[2] += weight * (own[2] + n * y)
            total[3] += weight * (own[3] + n * z)
            total[4] += weight * (own[4] + x * (2.0 * own[1] + n * x))
            total[5] += weight * (own[5] + y * (2.0 * own[2] + n * y))
            total[6] += weight * (own[6] + z * (2.0 * own[3] + n * z))
            total[7] += weight * (own[7] + own[1] * y + own[2] * x + n * x * y)
            total[8] += weight * (own[8] + own[2] * z + own[3] * y + n * y * z)
            total[9] += weight * (own[9] + own[3] * x + own[1] * z + n * z * x)
    fit_cells(around, planes)
    return planes


@compiled
def move_to_surface(
    points: NDArray[np.float32],
    labels: NDArray[np.int32],
    grid: CellGrid,
    planes: NDArray[np.float64],
    near: NDArray[np.int32],
    limits: NDArray[np.float64],
    counts: NDArray[np.uint8],
) -> NDArray[np.float32]:
    """Move points (N, 3) to the means over frames of their distances from a smooth surface.

    The surface is the mean of the planes of the cells around, weighted by a B-spline. In other frames, the
    surface of a still cell passes through it. labels: (N,), the cell of each point. planes, near: as
    `smooth_planes` has them. limits: (M,), edges that a point may lie off the surface. counts: (N,), frames;
    of points that lie farther off, written as 1.
    """
    low, edge = grid.low, grid.edge
    moved, weights = points.copy(), np.empty((3, 3))
    for i in range(len(points)):
        cell = labels[i]
        if counts[i] < 2:
            continue
        x, y, z = (
            (points[i, 0] - low[0]) / edge,
            (points[i, 1] - low[1]) / edge,
            (points[i, 2] - low[2]) / edge,
        )
        x, y, z = x - np.floor(x), y - np.floor(y), z - np.floor(z)
        for step in range(3):
            weights[0, step] = _spline(x + 0.5 - step)
            weights[1, step] = _spline(y + 0.5 - step)
            weights[2, step] = _spline(z + 0.5 - step)
        own = planes[cell]
        total, height, a, b, c = 0.0, 0.0, 0.0, 0.0, 0.0
        for number in range(27):
            other = near[cell, number]
            if other < 0 or planes[other, 6] == np.inf:
                continue
            column, row, layer = number // 9, number // 3 % 3, number % 3
            weight = weights[0, column] * weights[1, row] * weights[2, layer]
            plane = planes[other]
            u, v, w = x - column + 1, y - row + 1, z - layer + 1
            facing = plane[3] * own[3] + plane[4] * own[4] + plane[5] * own[5]
            sign = weight if facing >= 0.0 else -weight
            total += weight
            height += sign * (
                plane[3] * (u - plane[0]) + plane[4] * (v - plane[1]) + plane[5] * (w - plane[2])
            )
            a += sign * plane[3]
            b += sign * plane[4]
            c += sign * plane[5]
        length = np.sqrt(a * a + b * b + c * c)
        if total == 0.0 or length < 0.5 * total or abs(height) > limits[cell] * total:
            counts[i] = 1
            continue
        step = edge * height / total * (1.0 - 1.0 / counts[i]) / length
        moved[i, 0] = points[i, 0] - step * a
        moved[i, 1] = points[i, 1] - step * b
        moved[i, 2] = points[i, 2] - step * c
    return moved


@compiled
def sum_steps(frames: Frames, labels: NDArray[np.int32], cells: NDArray[np.float32]) -> None:
    """Sum how far the points of each cell move from one frame to another.

    labels: (N,), the cell of each point. cells: (M, 5), added to: points, squared distances, distances along
    x, y and z.
    """
    now, then, shift, is_there = frames.now, frames.then, frames.shift, frames.is_there
    for i in range(len(labels)):
        if is_there[i]:
            x, y, z = (
                then[i, 0] - now[i, 0] + shift[0],
                then[i, 1] - now[i, 1] + shift[1],
                then[i, 2] - now[i, 2] + shift[2],
            )
            of_cell = cells[labels[i]]
            of_cell[0] += np.float32(1)
            of_cell[1] += x * x + y * y + z * z
            of_cell[2] += x
            of_cell[3] += y
            of_cell[4] += z


@compiled
def join_frame(
    frames: Frames,
    run: RunSums,
    labels: NDArray[np.int32],
    limits: NDArray[np.float32],
    shares: NDArray[np.float32],
    cells: NDArray[np.float32],
    joined: NDArray[np.bool_],
) -> None:
    """Let an earlier frame join the runs of the points that it has near their means, and end the runs of
    the others.

    limits: (M,), of each cell, the square of how far a point may be from the mean of a long run. shares: one
    divided by 0 to 255; the first number means nothing. cells: (M, 9), added to: of all open points, their
    number, their shares, and their distances along x, y and z from the means of their runs; of those that
    join, their number and their distances from the current frame. joined: (N,), written.
    """
    now, then, shift, is_there = frames.now, frames.then, frames.shift, frames.is_there
    sums, counts, is_open = run.sums, run.counts, run.is_open
    for i in range(len(labels)):
        joined[i] = False
        if not (is_open[i] and is_there[i]):
            continue
        x, y, z = (
            then[i, 0] - now[i, 0] + shift[0],
            then[i, 1] - now[i, 1] + shift[1],
            then[i, 2] - now[i, 2] + shift[2],
        )
        share = shares[counts[i]]
        a, b, c = x - sums[i, 0] * share, y - sums[i, 1] * share, z - sums[i, 2] * share
        of_cell = cells[labels[i]]
        of_cell[0] += np.float32(1)
        of_cell[1] += share
        of_cell[2] += a
        of_cell[3] += b
        of_cell[4] += c
        if a * a + b * b + c * c > limits[labels[i]] * (np.float32(1) + share):
            is_open[i] = False
            continue
        joined[i] = True
        counts[i] += 1
        sums[i, 0] += x
        sums[i, 1] += y
        sums[i, 2] += z
        of_cell[5] += np.float32(1)
        of_cell[6] += x
        of_cell[7] += y
        of_cell[8] += z


@compiled
def judge_cells(
    cells: NDArray[np.float32],
    variances: NDArray[np.float64],
    limits: tuple[float, float],
    number: int,
    drifts: NDArray[np.float64],
    has_moved: NDArray[np.bool_],
) -> bool:
    """Find the cells that have moved, and note where the points of the others are; whether any has moved.

    cells: (M, 9), as `join_frame` sums them. variances: (M,), of a point in one frame. limits: squared
    deviations beyond which the mean of a cell has moved, and points of a cell whose mean counts. number: t,
    of the frame. drifts: (M, 10), added to: frames, sums of t and t^2, points, sums of the mean distances d
    along x, y and z, and sums of t d. has_moved: (M,), written.
    """
    found = False
    beyond, fewest = limits
    for cell in range(len(cells)):
        count = cells[cell, 0]
        has_moved[cell] = False
        if count >= fewest:
            squared = cells[cell, 2] ** 2 + cells[cell, 3] ** 2 + cells[cell, 4] ** 2
            has_moved[cell] = squared > beyond * variances[cell] * (count + cells[cell, 1])
        found |= has_moved[cell]
        joined = cells[cell, 5]
        if joined >= fewest and not has_moved[cell]:
            drifts[cell, 0] += 1
            drifts[cell, 1] += number
            drifts[cell, 2] += number * number
            drifts[cell, 3] += joined
            for axis in range(3):
                mean = cells[cell, 6 + axis] / joined
                drifts[cell, 4 + axis] += mean
                drifts[cell, 7 + axis] += number * mean
    return found


@compiled
def end_cells(
    frames: Frames,
    run: RunSums,
    labels: NDArray[np.int32],
    has_moved: NDArray[np.bool_],
    joined: NDArray[np.bool_],
) -> None:
    """End the runs of all points of cells that have moved, without the frame that joined last.

    has_moved: (M,). joined: (N,), the points that the frame has joined; those of such cells become False.
    """
    now, then, shift = frames.now, frames.then, frames.shift
    sums, counts, is_open = run.sums, run.counts, run.is_open
    for i in range(len(labels)):
        if not has_moved[labels[i]]:
            continue
        is_open[i] = False
        if joined[i]:
            joined[i] = False
            counts[i] -= 1
            for axis in range(3):
                sums[i, axis] -= then[i, axis] - now[i, axis] + shift[axis]


@compiled
def write_means(now: NDArray[np.float32], run: RunSums, means: NDArray[np.float32]) -> None:
    """Write the means of runs, (N, 3); a run of one frame has the very bits of the current frame."""
    sums, counts = run.sums, run.counts
    for i in range(len(now)):
        for axis in range(3):
            means[i, axis] = now[i, axis]
            if counts[i] > 1:
                means[i, axis] = np.float32(np.float64(now[i, axis]) + np.float64(sums[i, axis]) / counts[i])
