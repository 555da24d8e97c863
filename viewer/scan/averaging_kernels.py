"""The inner loops of averaging frames, compiled by numba; see `averaging`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled, inlined

_BITS = 21  # of each coordinate in a code
_HASH = 0x9E3779B97F4A7C15 >> 1  # odd, spreads codes over the table
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


@compiled
def label_cells(
    points: NDArray[np.float32], low: NDArray[np.float32], edge: float, labels: NDArray[np.int32]
) -> int:
    """Number the cubic cells that points (N, 3) lie in, in the order of their first points.

    low: (3,), the corner of the first cell. labels: (N,), written; a cell farther than 2^21 edges off counts
    as the last one there. Returns the number of cells.
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
    return count


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
