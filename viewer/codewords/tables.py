"""Tables of shapes: which pixels a disc covers, by its quantised size and normal.

Maršík 2010, 2.2: 17 sizes and 61 x 61 normals n' of k (n'_x, n'_y, 1). A disc's centre lies on the corner of
four pixels, so that its shape is symmetric about this point: rows above it tell those below. A row of a
convex shape is its first and its last pixel.

The rule, in whole numbers: with `size` in steps of 1 / size_parts pixels of the radius, the normal (i, j) in
steps of 1 / normal_parts, and the pixel whose centre is (x + 1/2, y + 1/2) pixels right of and below the
disc's, u = 2 x + 1 and v = 2 y + 1, the pixel is covered where

    size_parts^2 (normal_parts^2 (u^2 + v^2) + (i u + j v)^2) <= (2 size normal_parts)^2

that is where its centre is inside of the ellipse or on it. n'_x counts to the right and n'_y down.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

BITMAP = 8  # pixels along an edge of the bitmap that a word stands for
EMPTY_ROW = 0b000111  # first column 7, last column 0: no pixel
LARGE = 1 << 31  # in an entry of a table: the rest is the index of its rows
_HALF = BITMAP // 2
_NEVER = (1, 0)  # first and last pixel of an empty row
_MOST_RADIUS = 64  # pixels, of the sizes of a table; rows of larger shapes are found one by one


@dataclass(frozen=True)
class Steps:
    """Steps in which sizes and normals are quantised; by default as in the paper.

    sizes: how many radii a table has, 0, 1, 2, ... steps of 1 / size_parts pixels. normals: how many values
    n'_x and n'_y each may take, an odd number, in steps of 1 / normal_parts about 0. Raises InputError.

    The paper gives the numbers of steps and not their widths. Half a pixel makes shapes up to 16 pixels wide,
    its "practically 2 x 2" bitmaps; a fifth reaches to 6, discs that are tilted by 80.5 degrees.
    """

    sizes: int = 17
    size_parts: int = 2
    normals: int = 61
    normal_parts: int = 5

    def __post_init__(self) -> None:
        if min(self.sizes, self.size_parts, self.normals, self.normal_parts) < 1:
            raise InputError("steps of code words must be at least 1")
        if self.normals % 2 == 0:
            raise InputError(
                f"the number of values of n'x in the table must be odd, not {self.normals}",
                hint="Use an odd number",
            )
        if (self.sizes - 1) / self.size_parts > _MOST_RADIUS:
            raise InputError(f"radii in a table of code words must not exceed {_MOST_RADIUS} pixels")

    @property
    def steepest(self) -> int:
        """The largest number of steps that n'_x and n'_y may have."""
        return self.normals // 2

    @property
    def half_count(self) -> int:
        """Number of normals of which none is another one's opposite: these have the same shape."""
        return self.normals * self.normals // 2 + 1


PAPER = Steps()


@dataclass(frozen=True, eq=False)
class ShapeTable:
    """Shapes by size and normal, packed.

    entries: (sizes, half_count) uint32. Below `LARGE` it is the SCANS field itself of a word in mode 0: a
    shape that fits into one bitmap. Else what is left without that bit is the index in `rows` of the first of
    the shape's `reach` rows below the middle, downwards; those above are the same turned by half.
    rows: (R,) uint16, each the first column, in the lower 8 bits, and the last one, both counted from the
    middle and offset by `reach`; first > last: empty. reach: pixels from the middle to the farthest row.

    See `shape_index` for where a normal stands.
    """

    steps: Steps
    entries: NDArray[np.uint32]
    rows: NDArray[np.uint16]
    reach: int

    @property
    def nbytes(self) -> int:
        """Bytes of the table."""
        return self.entries.nbytes + self.rows.nbytes

    @property
    def bitmap_bytes(self) -> int:
        """Bytes that the shapes take as bitmaps, a bit for a pixel: 8 x 8, and tiles of these for larger
        ones."""
        small = self.entries < LARGE
        tiles = (-(-self.reach // _HALF)) ** 2
        turned = np.full(self.steps.half_count, 2)
        turned[self.steps.half_count - 1] = 1  # the disc that faces the eye
        return int((np.where(small, 1, tiles) * turned * BITMAP * BITMAP // 8).sum())

    def spans(self, size: int, i: int, j: int) -> NDArray[np.int32]:
        """First and last column of all rows of a shape, (2 reach, 2), from the middle; the first row is that
        `reach` above the middle. An empty one has its first behind its last."""
        entry = int(self.entries[size, shape_index(self.steps, i, j)])
        below = np.tile(np.array(_NEVER, np.int32), (self.reach, 1))
        if entry < LARGE:
            for row in range(_HALF):  # of the bitmap, from its top
                first, last = entry >> 6 * row & 7, entry >> 6 * row + 3 & 7
                if first <= last:
                    below[_HALF - 1 - row] = BITMAP - 1 - last - _HALF, BITMAP - 1 - first - _HALF
        else:
            packed = self.rows[entry - LARGE : entry - LARGE + self.reach]
            below = np.stack([packed & 0xFF, packed >> 8], axis=1).astype(np.int32) - self.reach
        empty = below[:, 0] > below[:, 1]
        above = -1 - below[::-1, ::-1]
        above[empty[::-1]] = _NEVER
        return np.concatenate([above, below])


def shape_index(steps: Steps, i: int, j: int) -> int:
    """The index of a normal among those of a table: opposite ones share one."""
    at = (j + steps.steepest) * steps.normals + i + steps.steepest
    return min(at, steps.normals * steps.normals - 1 - at)


@cache
def shape_table(steps: Steps = PAPER) -> ShapeTable:
    """The shapes of all sizes and normals; found once in a process, as that is sooner done than read."""
    reach = max(_HALF, -(-(steps.sizes - 1) // steps.size_parts))
    first, last = _lower_halves(steps, reach)  # (sizes, half_count, reach), from the middle downwards
    empty = first > last
    small = empty[..., _HALF:].all(axis=2) & (empty | ((first >= -_HALF) & (last < _HALF))).all(axis=2)

    # Of the upper rows, which are the lower ones turned by half: row 0 of a bitmap is the outermost.
    scans = np.zeros(first.shape[:2], np.uint32)
    for row in range(_HALF):
        lower = _HALF - 1 - row
        left, right = _HALF - 1 - last[..., lower], _HALF - 1 - first[..., lower]
        field = np.where(empty[..., lower], EMPTY_ROW, left | right << 3)
        scans |= field.astype(np.uint32) << np.uint32(6 * row)
    large = ~small
    entries = scans
    entries[large] = LARGE + reach * np.arange(np.count_nonzero(large), dtype=np.uint32)
    rows = ((first[large] + reach) | (last[large] + reach) << 8).astype(np.uint16).ravel()
    for array in (entries, rows):
        array.setflags(write=False)
    return ShapeTable(steps, entries, rows, reach)


def _lower_halves(steps: Steps, reach: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """First and last columns of the rows below the middle, by the rule, (sizes, half_count, reach) each."""
    index = np.arange(steps.half_count)
    i = (index % steps.normals - steps.steepest)[:, None]
    j = (index // steps.normals - steps.steepest)[:, None]
    x = np.arange(-reach, reach)
    u = 2 * x + 1
    first = np.empty((steps.sizes, steps.half_count, reach), np.int32)
    last = np.empty_like(first)
    limits = (2 * np.arange(steps.sizes) * steps.normal_parts) ** 2
    for row in range(reach):
        v = 2 * row + 1
        form = steps.size_parts**2 * (steps.normal_parts**2 * (u * u + v * v) + (i * u + j * v) ** 2)
        for size, limit in enumerate(limits):
            inside = form <= limit  # (half_count, columns), without a gap, as the shape is convex
            begins = inside.argmax(axis=1)
            ends = 2 * reach - 1 - inside[:, ::-1].argmax(axis=1)
            some = inside.any(axis=1)
            first[size, :, row] = np.where(some, x[begins], _NEVER[0])
            last[size, :, row] = np.where(some, x[ends], _NEVER[1])
    return first, last
