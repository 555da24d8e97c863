"""The loop over rows with lists of a binary PLY, compiled by numba."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..octree.compiled import compiled


@compiled
def pack_rows(
    data: NDArray[np.uint8],
    sizes: NDArray[np.int64],
    lengths: NDArray[np.int64],
    signed: NDArray[np.bool_],
    big_endian: bool,
    packed: NDArray[np.uint8],
) -> tuple[int, int, bool]:
    """Copy what is no list of each row, one row behind the other; how many rows were whole, and their bytes.

    Ends in front of a row with a list of a negative length, and tells so.

    data: (B,), from the first row on. sizes: (P,), bytes of each property, or of an item of its list.
    lengths: (P,), bytes of the length in front of the list, 0: no list. signed: (P,), whether
    that length may be negative. packed: (N, bytes), or (N, 0).
    """
    at = 0
    for row in range(len(packed)):
        here, filled = at, 0
        for p in range(len(sizes)):
            if lengths[p]:
                if lengths[p] > len(data) - here:
                    return row, at, False
                items = np.int64(0)
                for i in range(lengths[p]):
                    byte = i if big_endian else lengths[p] - 1 - i
                    items = items << 8 | data[here + byte]
                here += lengths[p]
                if signed[p] and items >> (8 * lengths[p] - 1):
                    return row, at, True
                if items > (len(data) - here) // sizes[p]:
                    return row, at, False
                here += items * sizes[p]
                continue
            if sizes[p] > len(data) - here:
                return row, at, False
            if packed.shape[1]:
                for i in range(sizes[p]):
                    packed[row, filled + i] = data[here + i]
                filled += sizes[p]
            here += sizes[p]
        at = here
    return len(packed), at, False
