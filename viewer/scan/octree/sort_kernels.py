"""The inner loops of sorting points by their Morton codes (level 21, 63 bits), compiled by numba.

Each lets other threads go on. Imported where points are sorted, as numba takes a while.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled
from .octree import DEEPEST

BUCKET_BITS = 12  # of a code: the first four levels
BUCKETS = 1 << BUCKET_BITS
CROWD = 64  # different positions in one cell that are compared one by one
_BUCKET_SHIFT = np.uint64(3 * DEEPEST - BUCKET_BITS)
_BLOCK = 4096  # points whose codes are made at a time, so that they stay in the processor's cache
_FEW = 16  # codes that insertion sorts fastest
_DIGIT = 9  # bits that a larger bucket is divided by at most


@compiled
def widen(positions: NDArray[np.float32], low: NDArray[np.float64], high: NDArray[np.float64]) -> None:
    """Make low and high, (3,) each, hold all positions (N, 3)."""
    for i in range(len(positions)):
        for axis in range(3):
            low[axis] = min(low[axis], positions[i, axis])
            high[axis] = max(high[axis], positions[i, axis])


@compiled
def _spread(cell: np.uint64) -> np.uint64:
    """The 21 bits of a coordinate, two zeros between each and the next."""
    cell = (cell | cell << np.uint64(32)) & np.uint64(0x1F00000000FFFF)
    cell = (cell | cell << np.uint64(16)) & np.uint64(0x1F0000FF0000FF)
    cell = (cell | cell << np.uint64(8)) & np.uint64(0x100F00F00F00F00F)
    cell = (cell | cell << np.uint64(4)) & np.uint64(0x10C30C30C30C30C3)
    return (cell | cell << np.uint64(2)) & np.uint64(0x1249249249249249)


@compiled
def encode(
    positions: NDArray[np.float32],
    steps_per_unit: float,
    low: NDArray[np.float64],
    cells_per_step: float,
    codes: NDArray[np.uint64],
    counts: NDArray[np.int64],
) -> None:
    """The codes (N,) of positions (N, 3) in a `cube.Grid`; counts (BUCKETS,) of them are added to."""
    cells = np.empty((3, _BLOCK), np.uint64)
    last = float((1 << DEEPEST) - 1)
    for start in range(0, len(positions), _BLOCK):
        part = positions[start : start + _BLOCK]
        for i in range(len(part)):
            for axis in range(3):
                steps = np.floor(part[i, axis] * steps_per_unit) - low[axis]
                cells[axis, i] = np.uint64(np.int64(min(max((steps + 0.5) * cells_per_step, 0.0), last)))
        for i in range(len(part)):
            x, y, z = _spread(cells[0, i]), _spread(cells[1, i]), _spread(cells[2, i])
            codes[start + i] = x | y << np.uint64(1) | z << np.uint64(2)
            counts[codes[start + i] >> _BUCKET_SHIFT] += 1


@compiled
def fill_buckets(
    unsorted: NDArray[np.uint64],
    first_row: int,
    heads: NDArray[np.int64],
    codes: NDArray[np.uint64],
    rows: NDArray[np.uint32],
) -> None:
    """Put codes (N,) and their rows where their buckets' heads (BUCKETS,) point, and move those on."""
    for i in range(len(unsorted)):
        bucket = unsorted[i] >> _BUCKET_SHIFT
        place = heads[bucket]
        heads[bucket] = place + 1
        codes[place], rows[place] = unsorted[i], first_row + i


class _SortRoom(NamedTuple):
    """Room that a radix sort works in."""

    codes: NDArray[np.uint64]  # as many as the largest bucket has
    rows: NDArray[np.uint32]
    ends: NDArray[np.int64]  # of each digit
    waiting: NDArray[np.int64]  # (parts, 2), first and last + 1 of parts that are not sorted yet


@compiled
def sort_buckets(codes: NDArray[np.uint64], rows: NDArray[np.uint32], starts: NDArray[np.int64]) -> None:
    """Sort each bucket's codes, and the rows with them; equal codes keep their order.

    starts: (buckets + 1,), ascending.
    """
    largest = 0
    for k in range(len(starts) - 1):
        largest = max(largest, starts[k + 1] - starts[k])
    # A division leaves at most 2^9 parts to do, of nine bits fewer each.
    waiting = np.empty(((1 << _DIGIT) * (1 + DEEPEST), 2), np.int64)
    ends = np.empty((1 << _DIGIT) + 1, np.int64)
    room = _SortRoom(np.empty(largest, np.uint64), np.empty(largest, np.uint32), ends, waiting)
    for k in range(len(starts) - 1):
        waiting[0, 0], waiting[0, 1] = starts[k], starts[k + 1]
        count = 1
        while count:
            count -= 1
            begin, end = waiting[count, 0], waiting[count, 1]
            if end - begin <= _FEW:
                _insertion_sort(codes[begin:end], rows[begin:end])
            else:
                count = _divide(codes, rows, begin, end, room, count)


@compiled
def _insertion_sort(codes: NDArray[np.uint64], rows: NDArray[np.uint32]) -> None:
    for i in range(1, len(codes)):
        code, row = codes[i], rows[i]
        place = i
        while place > 0 and codes[place - 1] > code:
            codes[place], rows[place] = codes[place - 1], rows[place - 1]
            place -= 1
        codes[place], rows[place] = code, row


@compiled
def _first_digit(codes: NDArray[np.uint64]) -> tuple[np.uint64, int]:
    """Place of the highest bits that differ, and how many of them to divide by; 0: codes are equal."""
    differing = np.uint64(0)
    for i in range(len(codes)):
        differing |= codes[i] ^ codes[0]
    # On a surface a level divides by four: more bits than that gives parts for are a waste.
    bits, parts = 3, 8
    while bits < _DIGIT and parts < len(codes):
        bits, parts = bits + 3, parts * 4
    shift = np.uint64(0)
    while differing >> shift >> np.uint64(bits):
        shift += np.uint64(3)
    return shift, bits if differing else 0


@compiled
def _divide(
    codes: NDArray[np.uint64],
    rows: NDArray[np.uint32],
    begin: int,
    end: int,
    room: _SortRoom,
    count: int,
) -> int:
    """One step of a radix sort: by the highest bits that differ. Returns how many parts wait then."""
    spare_codes, spare_rows, ends, waiting = room
    shift, bits = _first_digit(codes[begin:end])
    if not bits:
        return count
    digits, last = 1 << bits, np.uint64((1 << bits) - 1)
    for digit in range(digits + 1):
        ends[digit] = 0
    for i in range(begin, end):
        ends[(codes[i] >> shift & last) + np.uint64(1)] += 1
    place = begin
    for digit in range(1, digits + 1):
        size = ends[digit]
        if size > 1 and shift > 0:
            waiting[count, 0], waiting[count, 1] = place, place + size
            count += 1
        place += size
        ends[digit] = place - begin
    for i in range(begin, end):
        part = codes[i] >> shift & last
        slot = ends[part]
        ends[part] = slot + 1
        spare_codes[slot], spare_rows[slot] = codes[i], rows[i]
    for i in range(begin, end):
        codes[i], rows[i] = spare_codes[i - begin], spare_rows[i - begin]
    return count


@compiled
def apart(
    first: NDArray[np.uint64],
    second: NDArray[np.uint64],
    levels: NDArray[np.uint8],
    histogram: NDArray[np.int64],
) -> None:
    """The first level at which each two codes differ, 22 where they are equal; and how often it is which.

    first, second, levels: (N,). histogram: (23,), added to.
    """
    for i in range(len(first)):
        differing = first[i] ^ second[i]
        level = DEEPEST + 1
        if differing:
            # The bit below the highest is cleared, so that the conversion does not round up.
            number = np.float64(np.int64(differing & ~(differing >> np.uint64(1))))
            highest = (number.view(np.int64) >> 52) - 1023
            level = DEEPEST - int(highest) // 3
        levels[i] = level
        histogram[level] += 1


@compiled
def count_distinct(
    positions: NDArray[np.float32],
    rows: NDArray[np.uint32],
    levels: NDArray[np.uint8],
    crowds: NDArray[np.int64],
) -> tuple[int, int]:
    """How many different positions there are, but for crowds; and how many of these.

    A crowd is a cell of level 21 with more than 64 different positions: its first and last + 1 point, in the
    order of the codes, are written to crowds (C, 2).
    """
    found, crowded, total = np.empty(CROWD, np.int64), 0, 0
    begin, count = 0, len(levels)
    while begin < count:
        end = begin + 1
        while end < count and levels[end] > DEEPEST:
            end += 1
        known = 0
        for i in range(begin, end):
            x, y, z = positions[rows[i], 0], positions[rows[i], 1], positions[rows[i], 2]
            k = 0
            while k < known and not (
                positions[found[k], 0] == x and positions[found[k], 1] == y and positions[found[k], 2] == z
            ):
                k += 1
            if k == known:
                if known == CROWD:
                    crowds[crowded, 0], crowds[crowded, 1] = begin, end
                    crowded, known = crowded + 1, 0
                    break
                found[known] = rows[i]
                known += 1
        total += known
        begin = end
    return total, crowded
