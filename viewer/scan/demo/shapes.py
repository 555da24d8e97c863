"""Solids as functions that are negative inside, zero on the surface and about a distance near it.

All take numbers or `Dual` numbers. Source of the formulas: Inigo Quilez, "Distance functions" and
"Smooth minimum".
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

Scalar: TypeAlias = Any  # (N,) array or Dual; mypy cannot follow ufuncs through a union of both
Triple: TypeAlias = tuple[float, float, float]

_TINY = 1e-6  # keeps square roots differentiable where their argument vanishes


def length(*parts: Scalar) -> Scalar:
    """The Euclidean norm of the parts, rounded off below a micrometre."""
    total = np.square(parts[0])
    for part in parts[1:]:
        total = total + np.square(part)
    return np.sqrt(total + _TINY)


def ellipsoid(x: Scalar, y: Scalar, z: Scalar, center: Triple, radii: Triple) -> Scalar:
    """An ellipsoid along the axes; exact on the surface, about a distance near it."""
    a, b, c = ((v - m) / r for v, m, r in zip((x, y, z), center, radii, strict=True))
    norm = length(a, b, c)
    slope = np.sqrt(sum(np.square(v / r) for v, r in zip((a, b, c), radii, strict=True)) + 1e-9)
    return norm * (norm - 1.0) / slope


def limb(
    x: Scalar, y: Scalar, z: Scalar, start: Triple, end: Triple, start_radius: float, end_radius: float
) -> Scalar:
    """A rounded rod from start to end whose radius goes smoothly from one to the other."""
    axis = [b - a for a, b in zip(start, end, strict=True)]
    offset = [v - a for v, a in zip((x, y, z), start, strict=True)]
    along = sum(v * a for v, a in zip(offset, axis, strict=True)) / sum(a * a for a in axis)
    along = np.minimum(np.maximum(along, 0.0), 1.0)
    distance = length(*(v - along * a for v, a in zip(offset, axis, strict=True)))
    return distance - (start_radius + (end_radius - start_radius) * np.square(along) * (3.0 - 2.0 * along))


def union(a: Scalar, b: Scalar, blend: float) -> Scalar:
    """The union of two solids, their seam filled where they are within `blend` of each other (C2)."""
    near = np.maximum(1.0 - np.absolute(a - b) / blend, 0.0)
    return np.minimum(a, b) - np.square(near) * near * (blend / 6.0)


def intersection(a: Scalar, b: Scalar, blend: float) -> Scalar:
    """The intersection of two solids, its edge rounded over `blend`."""
    return -union(-a, -b, blend)


def carve(a: Scalar, b: Scalar, blend: float) -> Scalar:
    """The solid a without b, the edge rounded over `blend`."""
    return intersection(a, -b, blend)


def bell(value: Scalar, center: float, width: float) -> Scalar:
    """A Gaussian of height 1 and standard deviation `width`."""
    return np.exp(-0.5 * np.square((value - center) / width))


def bump(x: Scalar, y: Scalar, z: Scalar, center: Triple, widths: Triple) -> Scalar:
    """A Gaussian of height 1 in space, with a standard deviation for each axis."""
    squares = (np.square((v - m) / s) for v, m, s in zip((x, y, z), center, widths, strict=True))
    return np.exp(-0.5 * sum(squares))


def ramp(value: Scalar, low: float, high: float) -> Scalar:
    """A smooth ramp from 0 at `low` to 1 at `high`."""
    part = np.minimum(np.maximum((value - low) / (high - low), 0.0), 1.0)
    return np.square(part) * (3.0 - 2.0 * part)
