"""The inner loop of writing elements as code words, compiled by numba; see `encode` and `project_kernels`."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled, inlined
from .outline_kernels import RowSpans, exact_rows
from .project_kernels import DIFFUSE, NORMAL_I, NORMAL_J, SIZE, SPECULAR, X, Y

Whole = int | np.integer
_EMPTY_ROW = 7
_LARGE = 1 << 31
_MOST_KEY = float(1 << 30)


class TableArrays(NamedTuple):
    """A table of shapes as compiled loops have it, see `tables`."""

    entries: NDArray[np.uint32]
    rows: NDArray[np.uint16]
    reach: int
    steps: NDArray[np.int64]  # of `Steps`: sizes per pixel, steepest normal, normals per unit


class EmittedElements(NamedTuple):
    """M elements that words are written of."""

    ids: NDArray[np.uint32]  # (M,)
    materials: NDArray[np.uint8]  # (M,)
    shapes: NDArray[np.int32]  # (M, 7), see `project_kernels`
    planes: NDArray[np.float64]  # (M, 15)
    depths: NDArray[np.int32]  # (M,), Z
    finer: NDArray[np.float64]  # (M, 3), in steps, at the corner and a pixel right and down


class WordArrays(NamedTuple):
    """Room for words; of length 0 where they are only counted."""

    cursor: NDArray[np.int64]  # (strips * height,), where the next word of each line goes; it is moved on
    words: NDArray[np.uint64]
    ids: NDArray[np.uint32]
    fine: NDArray[np.int32]  # (words, 3), of exact outlines


@compiled
def emit(
    size: tuple[int, int],
    stride: int,
    exact: bool,
    table: TableArrays,
    elements: EmittedElements,
    out: WordArrays,
) -> None:
    """Write the words of elements, or count them.

    size: of the picture. stride: of its strips. exact: whether outlines are.
    """
    width, height = size
    entries, table_rows, reach, steps = table
    numbers, materials, shapes, planes, depths, finer = elements
    cursor, words, ids, fine = out
    spans = np.empty((2, height), np.int32)
    first, last = spans[0], spans[1]
    for number in range(len(numbers)):
        shape = shapes[number]
        x, y = shape[X], shape[Y]
        head = (
            np.uint64(shape[DIFFUSE]) << np.uint64(25)
            | np.uint64(shape[SPECULAR]) << np.uint64(32)
            | np.uint64(materials[number]) << np.uint64(39)
            | np.uint64(depths[number]) << np.uint64(55)
        )
        from_strip = 0
        if exact:
            top, bottom = exact_rows(planes[number], x, y, width, spans)
        elif shape[SIZE] >= len(entries):
            top, bottom = _computed_rows(shape, steps, width, spans)
        else:
            entry = entries[shape[SIZE], _shape_index(shape[NORMAL_I], shape[NORMAL_J], steps)]
            if entry < _LARGE and x >= 4 and y >= 4 and x - 4 < width and y - 4 < height:
                strip = (x - 4) // stride
                word = (
                    head
                    | np.uint64(entry) << np.uint64(1)
                    | np.uint64(x - 4 - strip * stride) << np.uint64(46)
                )
                _put(word, strip * height + y - 4, numbers[number], cursor, words, ids)
                from_strip = strip + 1
                if x + 3 < min(from_strip * stride, width) or from_strip * stride >= width:
                    continue
            top, bottom = _table_rows(entry, table_rows, reach, x, y, width, spans)
        while top <= bottom and first[top] > last[top]:
            top += 1
        for begin in range(top, bottom + 1, 4):
            end = min(begin + 3, bottom)
            left, right = width, -1
            for row in range(begin, end + 1):
                if first[row] <= last[row]:
                    left, right = min(left, first[row]), max(right, last[row])
            for strip in range(max(left // stride, from_strip), right // stride + 1):
                strip_end = min((strip + 1) * stride, width) - 1
                for column in range(max(left, strip * stride), min(right, strip_end) + 1, 8):
                    scans, some = 0, False
                    for k in range(4):
                        row, field = begin + k, _EMPTY_ROW
                        if row <= end:
                            a, b = max(first[row], column), min(last[row], column + 7, strip_end)
                            if a <= b:
                                field, some = a - column | (b - column) << 3, True
                        scans |= field << 6 * k
                    if not some:
                        continue
                    word = head | np.uint64(1) | np.uint64(scans) << np.uint64(1)
                    word |= np.uint64(column - strip * stride) << np.uint64(46)
                    at = _put(word, strip * height + begin, numbers[number], cursor, words, ids)
                    if at >= 0 and len(fine):
                        q, right_step, down_step = finer[number]
                        q += right_step * (column + 0.5 - x) + down_step * (begin + 0.5 - y)
                        fine[at, 0] = np.int32(np.rint(min(max(q, -_MOST_KEY), _MOST_KEY)))
                        fine[at, 1] = np.int32(np.rint(right_step))
                        fine[at, 2] = np.int32(np.rint(down_step))


@inlined
def _put(
    word: Whole,
    line: Whole,
    id: Whole,
    cursor: NDArray[np.int64],
    words: NDArray[np.uint64],
    ids: NDArray[np.uint32],
) -> int:
    """Append a word to its line; gives its index, -1 where words are only counted."""
    at = cursor[line]
    cursor[line] += 1
    if len(words) == 0:
        return -1
    words[at], ids[at] = word, id
    return at


@inlined
def _shape_index(i: int, j: int, steps: NDArray[np.int64]) -> int:
    """See `tables.shape_index`."""
    normals = 2 * steps[1] + 1
    at = (j + steps[1]) * normals + i + steps[1]
    return min(at, normals * normals - 1 - at)


@inlined
def _table_rows(
    entry: int,
    table_rows: NDArray[np.uint16],
    reach: int,
    x: int,
    y: int,
    width: int,
    spans: RowSpans,
) -> tuple[Whole, Whole]:
    """Fill the rows of a shape of the table, cut to the picture; gives the first and the last of them."""
    first, last, height = spans[0], spans[1], spans.shape[1]
    small = entry < _LARGE
    half = 4 if small else reach
    top, bottom = max(y - half, 0), min(y + half, height) - 1
    for row in range(top, bottom + 1):
        k = row - y if row >= y else y - 1 - row  # of the lower half, from the middle
        if small:
            field = np.int64(entry) >> (6 * (3 - k))
            a, b = 3 - (field >> 3 & 7), 3 - (field & 7)
        else:
            packed = np.int64(table_rows[entry - _LARGE + k])
            a, b = (packed & 255) - reach, (packed >> 8) - reach
        if row < y:
            a, b = -1 - b, -1 - a
        a, b = x + a, x + b
        first[row], last[row] = a if a > 0 else 0, b if b < width else width - 1
        if a > b:
            first[row], last[row] = 1, 0
    return top, bottom


@inlined
def _computed_rows(
    shape: NDArray[np.int32], steps: NDArray[np.int64], width: int, spans: RowSpans
) -> tuple[Whole, Whole]:
    """Fill the rows of a shape that is larger than those of the table, by the same rule."""
    first, last, height = spans[0], spans[1], spans.shape[1]
    size_parts, _, normal_parts = steps
    x, y = shape[X], shape[Y]
    i, j = np.int64(shape[NORMAL_I]), np.int64(shape[NORMAL_J])
    unit, scaled = normal_parts * normal_parts, size_parts * size_parts
    limit = (2 * np.int64(shape[SIZE]) * normal_parts) ** 2
    half = shape[SIZE] // size_parts + 1
    top, bottom = max(y - half, 0), min(y + half, height) - 1
    a = float(scaled * (unit + i * i))
    for row in range(top, bottom + 1):
        v = np.int64(2 * (row - y) + 1)
        b, c = float(scaled * i * j * v), float(scaled * (unit + j * j) * v * v - limit)
        first[row], last[row] = 1, 0
        root = b * b - a * c
        middle = -b / a
        reach = math.sqrt(max(root, 0.0)) / a
        # Rounding may be off by a pixel, which the rule in whole numbers sets right.
        begin = max(np.int64(math.ceil((middle - reach - 1.0) / 2.0)) - 1, -np.int64(x))
        end = min(np.int64(math.floor((middle + reach - 1.0) / 2.0)) + 1, np.int64(width - 1 - x))
        while begin <= end and not _inside(2 * begin + 1, v, i, j, unit, scaled, limit):
            begin += 1
        while begin <= end and not _inside(2 * end + 1, v, i, j, unit, scaled, limit):
            end -= 1
        if begin <= end:
            first[row], last[row] = x + begin, x + end
    return top, bottom


@inlined
def _inside(u: Whole, v: Whole, i: Whole, j: Whole, unit: Whole, scaled: Whole, limit: Whole) -> Any:
    """The rule of `tables`."""
    across = i * u + j * v
    return scaled * (unit * (u * u + v * v) + across * across) <= limit
