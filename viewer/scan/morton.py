"""Points by Morton codes, so that near ones are near each other in memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_GRID = 1 << 10  # cells along an axis
_SPREAD = (
    (16, 0x030000FF),
    (8, 0x0300F00F),
    (4, 0x030C30C3),
    (2, 0x09249249),
)  # of ten bits, with two between each


def morton_codes(positions: NDArray[np.floating]) -> NDArray[np.uint32]:
    """The Morton codes of the cells of points (N, 3), N at least 1: (N,)."""
    low = positions.min(axis=0)
    extent = (positions.max(axis=0) - low).max() or positions.dtype.type(1)
    codes = np.zeros(len(positions), np.uint32)
    for axis in range(3):
        cells = ((positions[:, axis] - low[axis]) / extent * (_GRID - 1)).astype(np.uint32)
        for shift, mask in _SPREAD:
            cells = (cells | cells << np.uint32(shift)) & np.uint32(mask)
        codes |= cells << np.uint32(axis)
    return codes
