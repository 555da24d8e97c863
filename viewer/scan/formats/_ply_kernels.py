"""The loop over rows with lists of a binary PLY, compiled by numba."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled
from ._ply_header import Layout


@compiled
def pack_rows(
    data: NDArray[np.uint8],
    layout: Layout,
    big_endian: bool,
    kept: int,
    packed: NDArray[np.uint8],
    counts: NDArray[np.uint32],
) -> tuple[int, int, int, bool]:
    """Copy what is no list of each row, or the items of one list, one row behind the other.

    Returns how many rows were whole, their bytes, the bytes copied, and whether the next row has a list of a
    negative length.

    data: (B,), from the first row on. layout: of a row. kept: the number of the list, or -1. packed:
    bytes enough. counts: (N,) for as many rows as are wanted; gets the length of the list that is kept.
    """
    sizes, lengths, signed = layout
    at, filled = 0, 0
    for row in range(len(counts)):
        here, end = at, filled
        for p in range(len(sizes)):
            items = np.int64(1)
            if lengths[p]:
                if lengths[p] > len(data) - here:
                    return row, at, filled, False
                items = np.int64(0)
                for i in range(lengths[p]):
                    byte = i if big_endian else lengths[p] - 1 - i
                    items = items << 8 | data[here + byte]
                here += lengths[p]
                if signed[p] and items >> (8 * lengths[p] - 1):
                    return row, at, filled, True
            if items > (len(data) - here) // sizes[p]:
                return row, at, filled, False
            if p == kept or (kept < 0 and not lengths[p]):
                for i in range(items * sizes[p]):
                    packed[end + i] = data[here + i]
                end += items * sizes[p]
                counts[row] = items
            here += items * sizes[p]
        at, filled = here, end
    return len(counts), at, filled, False
