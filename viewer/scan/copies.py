"""Copies: points in the same place."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def distinct_rows(positions: NDArray[np.floating]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The first row of each position (N, 3), (M,), and which of these positions each row has, (N,).

    Other threads go on meanwhile, unlike during `np.unique` of rows.
    """
    order = np.lexsort(positions.T)
    ordered = positions[order]
    first = np.ones(len(order), bool)
    first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    group = np.empty(len(order), np.intp)
    group[order] = np.cumsum(first) - 1
    return order[first], group
