"""Normals of a range image: of a plane through each pixel and its neighbours.

In a pinhole's picture, one over the depth of a plane is linear in the pixel's position, and in a parallel
projection the depth itself, so that the plane is found by linear least squares (Badino et al. 2011).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_WEIGHTS = (1.0, 2.0, 3.0, 2.0, 1.0)  # of neighbours, by how far they are along a row or a column
_REACH = len(_WEIGHTS) // 2  # pixels
STEEPEST = 10.0  # the steepest depth step on a surface, in pixel footprints: 84 degrees
_AT_ONCE = 1 << 15  # pixels worked on together: what fits a cache
_LEAST_SPREAD = 1e-6  # of the neighbours, below which they lie on a line; 15 and more where they do not


def normals_of_grid(
    depth: NDArray[np.floating],
    focal: tuple[float, float],
    center: tuple[float, float],
    parallel: bool = False,
    positions: NDArray[np.floating] | None = None,
) -> NDArray[np.float64]:
    """Normals of the pixels that have a depth, in row order, (N, 3), of unit length, towards the eye, in
    camera space (right, up, back).

    depth: (H, W), along the view axis; NaN: none. focal, center: pixels; of a parallel projection, focal is
    pixels for a unit of depth. positions: (2, H, W), what the pixels see, in pixels right and down of the
    center; None: their own positions. Neighbours across an edge, whose depth steps by more than ten
    pixel footprints, do not count. Pixels whose neighbours span no plane face the eye.
    """
    height, width = depth.shape
    around = np.pad(np.asarray(depth, np.float64), _REACH, constant_values=np.nan)
    if positions is not None:
        seen = np.where(np.isfinite(depth), positions, 0.0)
        positions = np.pad(seen, ((0, 0), (_REACH, _REACH), (_REACH, _REACH)))
    rows = max(1, _AT_ONCE // width)
    parts = []
    for top in range(0, height, rows):
        strip = slice(top, top + rows + 2 * _REACH)
        own = None if positions is None else positions[:, strip]
        parts.append(_normals(around[strip], top, focal, center, parallel, own))
    return np.concatenate(parts)


def _normals(
    around: NDArray[np.float64],
    top: int,
    focal: tuple[float, float],
    center: tuple[float, float],
    parallel: bool,
    positions: NDArray[np.floating] | None,
) -> NDArray[np.float64]:
    """Normals of a strip of rows, the first of which is `top`. around: its depths, positions: those of its
    pixels, both with a margin."""
    slope_x, slope_y, level, seen = _fit(around, STEEPEST / min(focal), parallel, positions)
    alone = np.isnan(slope_x)
    across = np.stack([slope_x * focal[0], -slope_y * focal[1]], axis=1)
    if parallel:  # depth rises by `across` with a unit to the right and one up
        across[alone] = 0
        normals = np.column_stack([across, np.ones(len(across))])
        return normals / np.linalg.norm(normals, axis=1, keepdims=True)
    row, column = np.nonzero(seen)
    if positions is None:
        right, down = column + 0.5 - center[0], row + top + 0.5 - center[1]
    else:
        right, down = positions[:, _REACH + row, _REACH + column]
    ray = np.stack([right / focal[0], -down / focal[1]], axis=1)
    # Along a ray (x, y, -1), depth of the pixel / depth of the plane = away . (x, y, -1).
    away = np.column_stack([across, (across * ray).sum(axis=1) - level])
    away[alone] = np.column_stack([ray[alone], np.full(np.count_nonzero(alone), -1.0)])
    return -away / np.linalg.norm(away, axis=1, keepdims=True)


def _fit(
    around: NDArray[np.float64], steepest: float, parallel: bool, positions: NDArray[np.floating] | None
) -> tuple[NDArray, NDArray, NDArray, NDArray[np.bool_]]:
    """How a value changes with a pixel to the right and one down, and what it is at the pixel, for those with
    a depth, (N,); NaN where neighbours span no plane. And which they are, (H, W).

    The value is one over depth times the pixel's depth, or in a parallel projection one and the depth less
    the pixel's. steepest: the depth step that is an edge, as a part of the depth, or in a parallel projection
    as it is.
    """
    height, width = (edge - 2 * _REACH for edge in around.shape)
    own = slice(_REACH, _REACH + height), slice(_REACH, _REACH + width)
    depth, sums = around[own], np.zeros((9, height, width))
    for down in range(2 * _REACH + 1):
        for right in range(2 * _REACH + 1):
            there = slice(down, down + height), slice(right, right + width)
            other = around[there]
            if parallel:
                same = np.abs(other - depth) <= steepest
                change = np.subtract(other, depth, out=np.zeros_like(depth), where=same)
            else:
                same = np.abs(other - depth) <= steepest * np.minimum(other, depth)
                change = np.divide(depth, other, out=np.ones_like(depth), where=same) - 1
            if positions is None:
                x, y = right - _REACH, down - _REACH
            else:
                x, y = positions[:, *there] - positions[:, *own]
            weight = _WEIGHTS[down] * _WEIGHTS[right] * same
            value = weight * change
            for term_number, term in enumerate((1, x, y, x * x, x * y, y * y)):
                sums[term_number] += weight * term
            for term_number, term in enumerate((1, x, y), 6):
                sums[term_number] += value * term
    seen = np.isfinite(depth)
    total, x, y, xx, xy, yy, value, value_x, value_y = sums[:, seen]
    xx, xy, yy = xx - x * x / total, xy - x * y / total, yy - y * y / total
    value_x, value_y = value_x - x * value / total, value_y - y * value / total
    spread = xx * yy - xy * xy
    spread = np.where(spread > _LEAST_SPREAD, spread, np.nan)
    slope_x, slope_y = (yy * value_x - xy * value_y) / spread, (xx * value_y - xy * value_x) / spread
    return slope_x, slope_y, 1 + (value - slope_x * x - slope_y * y) / total, seen
