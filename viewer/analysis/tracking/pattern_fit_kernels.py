"""Maps of patterns of points from one surface to another: turned, and fitted.

Compiled by numba; see `pattern`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled

Float = NDArray[np.float64]

FREE = 3  # points that a map along the surface has as many unknowns as
_HOLD = 0.3  # points that count as much as the map from which a fit begins
_TURN = 0.5  # cosine of the angle that a pattern may be turned by besides what is expected


@compiled
def apply_map(linear: Float, x: float, y: float, z: float, out: Float) -> None:
    """Fill a vector (3,) as a map (3, 3) takes it."""
    for k in range(3):
        out[k] = linear[k, 0] * x + linear[k, 1] * y + linear[k, 2] * z


@compiled
def mapped_normal(linear: Float, frame: Float, normal: Float) -> None:
    """Map the normal of a tangent frame (3, 3): the unit vector across the mapped tangents."""
    a, b = np.empty(3), np.empty(3)
    apply_map(linear, frame[0, 0], frame[0, 1], frame[0, 2], a)
    apply_map(linear, frame[1, 0], frame[1, 1], frame[1, 2], b)
    _across(a, b, normal)


@compiled
def _across(a: Float, b: Float, normal: Float) -> None:
    """The unit vector across two; 0 where they lie along each other."""
    normal[0] = a[1] * b[2] - a[2] * b[1]
    normal[1] = a[2] * b[0] - a[0] * b[2]
    normal[2] = a[0] * b[1] - a[1] * b[0]
    length = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    for k in range(3):
        normal[k] /= length if length > 0.0 else 1.0


@compiled
def stand_up(linear: Float, frame: Float, there: NDArray[np.float32], upright: Float) -> bool:
    """Turn a map so that a patch's normal goes to that of another surface, of either side, by the shortest
    way; False where that is too far. frame, there: (3, 3), tangents and normal of both."""
    one, other, axis = np.empty(3), np.empty(3), np.empty(3)
    mapped_normal(linear, frame, one)
    cosine = one[0] * there[2, 0] + one[1] * there[2, 1] + one[2] * there[2, 2]
    for k in range(3):
        other[k] = there[2, k] if cosine >= 0.0 else -there[2, k]
    if abs(cosine) < _TURN:
        return False
    axis[0] = one[1] * other[2] - one[2] * other[1]
    axis[1] = one[2] * other[0] - one[0] * other[2]
    axis[2] = one[0] * other[1] - one[1] * other[0]
    _turned(linear, axis, abs(cosine), upright)
    return True


@compiled
def turn_to(linear: Float, arm: Float, wanted: Float, there: NDArray[np.float32]) -> bool:
    """Turn a map about a surface's normal, so that an arm points along one that is wanted; False where that
    is too far."""
    now, axis, out = np.empty(3), np.empty(3), np.empty((3, 3))
    apply_map(linear, arm[0], arm[1], arm[2], now)
    u, v, p, q = 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        u += there[0, k] * now[k]
        v += there[1, k] * now[k]
        p += there[0, k] * wanted[k]
        q += there[1, k] * wanted[k]
    lengths = np.sqrt((u * u + v * v) * (p * p + q * q))
    if not lengths > 0.0:
        return False
    cosine, sine = (u * p + v * q) / lengths, (u * q - v * p) / lengths
    if cosine < _TURN:
        return False
    across = np.empty(3)
    across[0] = there[0, 1] * there[1, 2] - there[0, 2] * there[1, 1]
    across[1] = there[0, 2] * there[1, 0] - there[0, 0] * there[1, 2]
    across[2] = there[0, 0] * there[1, 1] - there[0, 1] * there[1, 0]
    for k in range(3):
        axis[k] = sine * across[k]
    _turned(linear, axis, cosine, out)
    linear[:] = out
    return True


@compiled
def _turned(linear: Float, axis: Float, cosine: float, out: Float) -> None:
    """A map turned further about an axis as long as the angle's sine (Rodrigues): out gets it."""
    for q in range(3):
        x, y, z = linear[0, q], linear[1, q], linear[2, q]
        along = (axis[0] * x + axis[1] * y + axis[2] * z) / (1.0 + cosine)
        out[0, q] = cosine * x + axis[1] * z - axis[2] * y + along * axis[0]
        out[1, q] = cosine * y + axis[2] * x - axis[0] * z + along * axis[1]
        out[2, q] = cosine * z + axis[0] * y - axis[1] * x + along * axis[2]


@compiled
def fit_map(
    offsets: Float,
    targets: Float,
    weights: Float,
    frame: Float,
    spacing: float,
    linear: Float,
    position: Float,
) -> bool:
    """Fit the map of a surface's patch: affine along its tangents, with heights over them kept.

    offsets: (n, 3) from the patch's centre. targets: (n, 3). weights: (n,). frame: (3, 3), tangents and
    normal. linear: (3, 3), the map from which it begins, gets the one found; position: (3,) gets where the
    centre goes.
    """
    normal = np.empty(3)
    mapped_normal(linear, frame, normal)
    s00, s01, s02, s11, s12, s22 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    sides = np.zeros((3, 3))
    for i in range(len(offsets)):
        weight = weights[i]
        if weight == 0.0:
            continue
        u, v, w = 0.0, 0.0, 0.0
        for k in range(3):
            u += frame[0, k] * offsets[i, k]
            v += frame[1, k] * offsets[i, k]
            w += frame[2, k] * offsets[i, k]
        s00 += weight
        s01 += weight * u
        s02 += weight * v
        s11 += weight * u * u
        s12 += weight * u * v
        s22 += weight * v * v
        for k in range(3):
            y = targets[i, k] - w * normal[k]
            sides[0, k] += weight * y
            sides[1, k] += weight * u * y
            sides[2, k] += weight * v * y
    hold = _HOLD * spacing * spacing * s00 / max(1.0, float(len(offsets)))
    s11 += hold
    s22 += hold
    for k in range(3):
        for axis in range(2):
            along = 0.0
            for q in range(3):
                along += linear[k, q] * frame[axis, q]
            sides[1 + axis, k] += hold * along
    det = s00 * (s11 * s22 - s12 * s12) - s01 * (s01 * s22 - s12 * s02) + s02 * (s01 * s12 - s11 * s02)
    if not det > 0.0:
        return False
    i00, i01, i02 = (
        (s11 * s22 - s12 * s12) / det,
        (s02 * s12 - s01 * s22) / det,
        (s01 * s12 - s02 * s11) / det,
    )
    i11, i12, i22 = (
        (s00 * s22 - s02 * s02) / det,
        (s01 * s02 - s00 * s12) / det,
        (s00 * s11 - s01 * s01) / det,
    )
    a, b = np.empty(3), np.empty(3)
    for k in range(3):
        position[k] = i00 * sides[0, k] + i01 * sides[1, k] + i02 * sides[2, k]
        a[k] = i01 * sides[0, k] + i11 * sides[1, k] + i12 * sides[2, k]
        b[k] = i02 * sides[0, k] + i12 * sides[1, k] + i22 * sides[2, k]
    _across(a, b, normal)
    for k in range(3):
        for q in range(3):
            linear[k, q] = a[k] * frame[0, q] + b[k] * frame[1, q] + normal[k] * frame[2, q]
    return True
