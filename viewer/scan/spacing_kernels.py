"""The inner loop of finding the nearest of all points, compiled by numba; see `spacing`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled

_BLOCK = 64  # points whose distances are compared at once, before any of them is noted


class Near(NamedTuple):
    """The points near each of R positions that were found so far.

    rows: (R, C), of which the first `held` (R,) count. squared: (R, C) float32, their squared distances.
    limits: (R,) float32, the squared distances that others may have at most.
    """

    rows: NDArray[np.int64]
    squared: NDArray[np.float32]
    held: NDArray[np.int64]
    limits: NDArray[np.float32]

    def of(self, number: int) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """The rows, and their squared distances, of one position."""
        held = self.held[number]
        return self.rows[number, :held], self.squared[number, :held]


@compiled
def _are_none_within(columns: NDArray[np.float32], x: float, y: float, z: float, limit: float) -> bool:
    """Whether no point, columns (3, P), has a squared distance of `limit` at most. It has no branch, so that
    the processor compares several at once."""
    hits = 0
    for i in range(columns.shape[1]):
        dx, dy, dz = columns[0, i] - x, columns[1, i] - y, columns[2, i] - z
        hits += dx * dx + dy * dy + dz * dz <= limit
    return hits == 0


@compiled
def note_near(
    points: NDArray[np.float32], at: NDArray[np.float32], near: Near, start: int, chunk: int, most: int
) -> int:
    """Note the points near positions `at` (R, 3), from a point on, chunk by chunk; the point to go on with.

    chunk: points, a multiple of `_BLOCK`. It stops after the chunk in which one of the positions comes to
    hold more than `most`.
    """
    rows, squared, held, limits = near
    blocks = np.zeros((chunk // _BLOCK, 3, _BLOCK), np.float32)
    is_full = False
    while start < len(points) and not is_full:
        size = min(chunk, len(points) - start)
        for i in range(size):
            block, place = i // _BLOCK, i % _BLOCK
            for axis in range(3):
                blocks[block, axis, place] = points[start + i, axis]
        for number in range(len(at)):
            x, y, z, limit = at[number, 0], at[number, 1], at[number, 2], limits[number]
            count = held[number]
            for first in range(0, size, _BLOCK):
                columns = blocks[first // _BLOCK]
                if _are_none_within(columns, x, y, z, limit):
                    continue
                for i in range(min(_BLOCK, size - first)):
                    dx, dy, dz = columns[0, i] - x, columns[1, i] - y, columns[2, i] - z
                    distance = dx * dx + dy * dy + dz * dz
                    if distance <= limit:
                        rows[number, count] = start + first + i
                        squared[number, count] = distance
                        count += 1
            held[number] = count
            is_full = is_full or count > most
        start += size
    return start
