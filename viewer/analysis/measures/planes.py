"""Planes of landmarks, in all frames at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Vectors = NDArray[np.float64]  # (..., 3)

THROUGH, BETWEEN = "through", "between"
PLANES = (THROUGH, BETWEEN)  # how landmarks tell a plane
_LINE = 1e-10  # squared width by squared length, below which points tell no plane


def plane_of(points: Vectors, how: str) -> tuple[Vectors, Vectors]:
    """A point of the plane of some points (..., K, 3), and its unit normal, (..., 3) each; NaN where they
    tell none.

    how: "through" is the plane with the least squared distances to them, which three lie in. Seen from where
    the normal points to, they run counterclockwise. "between" is that of which the least squared distances
    are from each point's mirror image to its partner: the first two are partners, and so on; one of the
    middle stands twice. The normal points to the first of each pair.
    """
    if how == BETWEEN:
        first, second = points[..., 0::2, :], points[..., 1::2, :]
        across, middles = first - second, (first + second) / 2
        center = middles.mean(axis=-2)
        offsets = middles - center[..., None, :]
        spread = 4 * _scatter(offsets) - _scatter(across)
        facing = across.sum(axis=-2)
    else:
        center = points.mean(axis=-2)
        offsets = points - center[..., None, :]
        spread = _scatter(offsets)
        facing = np.cross(offsets, np.roll(offsets, -1, axis=-2)).sum(axis=-2)
    there = np.asarray(np.isfinite(spread).all(axis=(-1, -2)))
    widths, axes = np.linalg.eigh(np.where(there[..., None, None], spread, np.eye(3)))
    normal = axes[..., 0]
    normal = np.where((normal * facing).sum(axis=-1, keepdims=True) < 0, -normal, normal)
    is_plane = there & (widths[..., 1] - widths[..., 0] > _LINE * np.abs(widths).max(axis=-1))
    return np.where(is_plane[..., None], center, np.nan), np.where(is_plane[..., None], normal, np.nan)


def _scatter(vectors: Vectors) -> Vectors:
    return np.einsum("...ki,...kj->...ij", vectors, vectors)
