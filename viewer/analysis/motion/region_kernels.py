"""The surface at some points of a moment, compiled by numba; see `registration`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled
from ..tracking.surface_kernels import (
    OWN_SPACING,
    Cells,
    fit_at,
    in_frame,
    nearest_within,
    parabola_height,
    parabola_slopes,
)

Float = NDArray[np.float64]
_HOLE = 1.6  # spacings to the nearest point beyond which there is a hole, as of correspondences


@compiled
def rows_nearest(surface: Cells, positions: Float, reach: float) -> NDArray[np.int64]:
    """The row of the point nearest to each position (n, 3), -1 where none is within reach."""
    rows = np.empty(len(positions), np.int64)
    for i in range(len(positions)):
        rows[i] = nearest_within(surface, positions[i, 0], positions[i, 1], positions[i, 2], reach)
    return rows


@compiled
def heights_over(surface: Cells, positions: Float, reach: float) -> tuple[Float, Float]:
    """The heights of positions (n, 3) over the parabola around the nearest point, (n,), along its normals,
    (n, 3); NaN where no point is within reach, and over holes."""
    heights, normals = np.full(len(positions), np.nan), np.full((len(positions), 3), np.nan)
    for i in range(len(positions)):
        row = nearest_within(surface, positions[i, 0], positions[i, 1], positions[i, 2], reach)
        if row < 0 or not fit_at(surface, row):
            continue
        f, p = surface.frames[row], surface.parabolas[row]
        u, v, w = in_frame(f, positions[i], surface.points[row])
        if u * u + v * v > (_HOLE * (surface.reaches[row] * OWN_SPACING)) ** 2:
            continue
        slope_u, slope_v = parabola_slopes(p[0], u, v)
        slant = np.sqrt(1.0 + slope_u * slope_u + slope_v * slope_v)
        heights[i] = (w - parabola_height(p[0], u, v)) / slant
        for k in range(3):
            normals[i, k] = (f[2, k] - slope_u * f[0, k] - slope_v * f[1, k]) / slant
    return heights, normals
