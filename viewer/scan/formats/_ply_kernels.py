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
    big_endian: bool,
    packed: NDArray[np.uint8],
) -> tuple[int, int]:
    """Copy what is no list of each row, one row behind the other; how many rows were whole, and their bytes.

    data: (B,), from the first row on. sizes: (P,), bytes of each property, or of an item of its list.
    lengths: (P,), bytes of the length in front of the list, 0: no list. packed: (N, bytes), or (N, 0).
    """
    at = 0
    for row in range(len(packed)):
        here, filled = at, 0
        for p in range(len(sizes)):
            if lengths[p]:
                if lengths[p] > len(data) - here:
                    return row, at
                items = np.int64(0)
                for i in range(lengths[p]):
                    byte = i if big_endian else lengths[p] - 1 - i
                    items = items << 8 | data[here + byte]
                here += lengths[p]
                if items > (len(data) - here) // sizes[p]:
                    return row, at
                here += items * sizes[p]
                continue
            if sizes[p] > len(data) - here:
                return row, at
            if packed.shape[1]:
                for i in range(sizes[p]):
                    packed[row, filled + i] = data[here + i]
                filled += sizes[p]
            here += sizes[p]
        at = here
    return len(packed), at
