"""Rotations nearest to matrices, compiled by numba; see `registration.rotations`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled

Float = NDArray[np.float64]

_SWEEPS = 12  # at most; half as many do
_ACROSS = 1e-30  # squared cosine of columns that are perpendicular
_HELD = 1e-14  # of a matrix: so much of the identity tells the rotation where the matrix leaves it open
_TINY = 1e-120  # a smaller matrix tells none


@compiled
def nearest_rotations(matrices: Float, found: Float) -> None:
    """Fill the rotations (N, 3, 3) nearest to matrices (N, 3, 3).

    Turns make the columns perpendicular (one-sided Jacobi: Hestenes 1958). The two longest tell the rotation.
    """
    a, v, squares = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for n in range(len(matrices)):
        held = _HELD * np.sqrt((matrices[n] ** 2).sum()) + _TINY
        a[:], v[:] = matrices[n] + held * np.eye(3), np.eye(3)
        for _ in range(_SWEEPS):
            if not _turn_columns(a, v):
                break
        for p in range(3):
            squares[p] = max(a[0, p] ** 2 + a[1, p] ** 2 + a[2, p] ** 2, _TINY**2)
        p = int(np.argmin(squares))
        q, r = (p + 1) % 3, (p + 2) % 3
        for k in range(3):
            a[k, q] /= np.sqrt(squares[q])
            a[k, r] /= np.sqrt(squares[r])
        for k in range(3):
            x, y = (k + 1) % 3, (k + 2) % 3
            a[k, p] = a[x, q] * a[y, r] - a[y, q] * a[x, r]
        for k in range(3):
            for m in range(3):
                found[n, k, m] = a[k, 0] * v[m, 0] + a[k, 1] * v[m, 1] + a[k, 2] * v[m, 2]


@compiled
def _turn_columns(a: Float, v: Float) -> bool:
    """Turn each pair of columns of a (3, 3) to be perpendicular, and those of v alike; False where all
    are."""
    is_turned = False
    for p in range(2):
        for q in range(p + 1, 3):
            one, other, both = 0.0, 0.0, 0.0
            for k in range(3):
                one += a[k, p] * a[k, p]
                other += a[k, q] * a[k, q]
                both += a[k, p] * a[k, q]
            if not both * both > _ACROSS * one * other:
                continue
            is_turned = True
            away = 0.5 * (other - one) / both
            tangent = (1.0 if away >= 0.0 else -1.0) / (abs(away) + np.sqrt(1.0 + away * away))
            cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
            sine = cosine * tangent
            for k in range(3):
                a[k, p], a[k, q] = cosine * a[k, p] - sine * a[k, q], sine * a[k, p] + cosine * a[k, q]
                v[k, p], v[k, q] = cosine * v[k, p] - sine * v[k, q], sine * v[k, p] + cosine * v[k, q]
    return is_turned
