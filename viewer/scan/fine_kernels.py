"""The inner loops of finding the sides of patches that agree best, compiled by numba; see `fine_sides`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled


@compiled
def _strongest(strength: NDArray[np.float64], alive: NDArray[np.bool_], row: int) -> tuple[int, float]:
    """The column of the strongest bond of a row, the first of equal ones, and its size; -1 for none."""
    at, most = -1, 0.0
    for column in range(len(strength)):
        if alive[column] and column != row and abs(strength[row, column]) > most:
            at, most = column, abs(strength[row, column])
    return at, most


@compiled
def contract(strength: NDArray[np.float64]) -> NDArray[np.float64]:
    """1 or -1 for each of M things, (M,), so that bonds between equal ones are above 0 as far as can be.

    strength: (M, M), symmetric, the bonds; it is written over. The two things with the strongest bond become
    one, whose bonds are the sums of theirs, and so on, as `sides._agreement` does for few bonds.
    """
    count = len(strength)
    alive, signs = np.ones(count, np.bool_), np.ones(count)
    best, size = np.empty(count, np.int64), np.empty(count)
    weaker = np.zeros(count, np.bool_)  # rows whose strongest bond became weaker: size is a bound
    gone, kept_by, agrees = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count)
    for row in range(count):
        best[row], size[row] = _strongest(strength, alive, row)
    joined = 0
    while True:
        first, most = -1, 0.0
        for row in range(count):
            if alive[row] and size[row] > most:
                first, most = row, size[row]
        if first < 0:
            break
        if weaker[first]:
            best[first], size[first] = _strongest(strength, alive, first)
            weaker[first] = False
            continue
        kept, lost = min(first, best[first]), max(first, best[first])
        sign = 1.0 if strength[kept, lost] >= 0.0 else -1.0
        alive[lost] = False
        gone[joined], kept_by[joined], agrees[joined] = lost, kept, sign
        joined += 1
        for row in range(count):
            if alive[row] and row != kept:
                strength[kept, row] += sign * strength[lost, row]
                strength[row, kept] = strength[kept, row]
                if abs(strength[row, kept]) > size[row]:
                    best[row], size[row], weaker[row] = kept, abs(strength[row, kept]), False
                elif best[row] == kept or best[row] == lost:
                    weaker[row] = True
        best[kept], size[kept] = _strongest(strength, alive, kept)
        weaker[kept] = False
    for n in range(joined - 1, -1, -1):
        signs[gone[n]] = agrees[n] * signs[kept_by[n]]
    return signs


@compiled
def climb(strength: NDArray[np.float64], signs: NDArray[np.float64]) -> None:
    """Turn the one of M - 1 things that gains most, and so on, until none gains. The last one stays.

    strength: (M, M), symmetric, zero on its diagonal. signs: (M,), 1 or -1, which change.
    """
    count = len(signs)
    pull = np.zeros(count)
    for row in range(count):
        for column in range(count):
            pull[row] += strength[row, column] * signs[column]
    for _ in range(10 * count):
        worst, least = -1, -1e-9
        for row in range(count - 1):
            if signs[row] * pull[row] < least:
                worst, least = row, signs[row] * pull[row]
        if worst < 0:
            break
        for row in range(count):
            pull[row] -= 2.0 * strength[row, worst] * signs[worst]
        signs[worst] = -signs[worst]
