"""The inner loops of finding how far apart points lie, compiled by numba; see `spacing`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled


@compiled
def note_spacings(
    others: NDArray[np.float32],
    other_cells: NDArray[np.int64],
    points: NDArray[np.float32],
    cells: NDArray[np.int64],
    reach: float,
    counts: tuple[int, int, int],
    spacings: NDArray[np.float32],
) -> None:
    """The spacings (M,) that the nearest others of points (M, 3) tell; NaN where too few lie within reach.

    others: (N, 3), in the order of their cells. other_cells: (N,), ascending, and cells (M,): numbers of
    cells of an edge of `reach`: column << 42 | line << 21 | layer, where each has neighbours on both sides.
    counts: the first and the last of the nearest others that tell a spacing, and how many must lie within
    reach.
    """
    fewest, nearest, enough = counts
    squares = np.empty(nearest)  # of distances, ascending
    starts, ends = np.empty(9, np.int64), np.empty(9, np.int64)
    own, farthest = np.int64(-1), reach * reach
    for i in range(len(points)):
        if cells[i] != own:
            own = cells[i]
            for n in range(9):
                middle = own + ((n // 3 - 1) << 42) + ((n % 3 - 1) << 21)
                starts[n] = np.searchsorted(other_cells, middle - 1)
                ends[n] = np.searchsorted(other_cells, middle + 2)
        x, y, z = np.float64(points[i, 0]), np.float64(points[i, 1]), np.float64(points[i, 2])
        squares[:] = farthest
        found = 0
        for n in range(9):
            for j in range(starts[n], ends[n]):
                away_x, away_y, away_z = others[j, 0] - x, others[j, 1] - y, others[j, 2] - z
                square = away_x * away_x + away_y * away_y + away_z * away_z
                if square >= squares[nearest - 1] or square == 0.0:
                    continue
                found += 1
                at = nearest - 1
                while at > 0 and squares[at - 1] > square:
                    squares[at] = squares[at - 1]
                    at -= 1
                squares[at] = square
        most = 0.0
        for k in range(fewest, nearest + 1):
            most = max(most, squares[k - 1] / k)
        # Of one point for each square of the spacing, the k-th nearest lies within k / pi of them.
        spacings[i] = np.sqrt(np.pi * most) if found >= enough else np.nan
