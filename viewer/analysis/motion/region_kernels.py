"""The surface at some points of a moment, compiled by numba; see `registration`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled
from ..tracking.surface_kernels import Cells, fit_at, nearest_within

Float = NDArray[np.float64]


@compiled
def fit_rows(
    surface: Cells, rows: NDArray[np.int64], points: Float, normals: Float, fitted: NDArray[np.bool_]
) -> None:
    """Fit the surface at rows (n,): fills points (n, 3), moved onto it, its normals (n, 3), and whether there
    is one, (n,)."""
    normal = np.empty(3)
    for i in range(len(rows)):
        row = rows[i]
        fitted[i] = fit_at(surface, row)
        if not fitted[i]:
            continue
        f, p = surface.frames[row], surface.parabolas[row]
        squared = 0.0
        for k in range(3):
            points[i, k] = surface.points[row, k] + p[0, 0] * f[2, k]
            normal[k] = f[2, k] - p[0, 1] * f[0, k] - p[0, 2] * f[1, k]
            squared += normal[k] * normal[k]
        for k in range(3):
            normals[i, k] = normal[k] / np.sqrt(squared)


@compiled
def rows_nearest(surface: Cells, positions: Float, reach: float) -> NDArray[np.int64]:
    """The row of the point nearest to each position (n, 3), -1 where none is within reach."""
    rows = np.empty(len(positions), np.int64)
    for i in range(len(positions)):
        rows[i] = nearest_within(surface, positions[i, 0], positions[i, 1], positions[i, 2], reach)
    return rows
