"""Exact outlines of discs in the picture, compiled by numba; see `encode`.

A row of `planes` (float64) has of a disc the depth at its centre, or its inverse in perspective; that at the
corner of pixels that its centre is rounded to, how much it grows a pixel to the right and down; and the form
of its outline, six numbers: a place (x, y) off the corner is inside where
a x^2 + 2 b x y + c y^2 + 2 d x + 2 e y + f <= 0.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..scan.octree.compiled import compiled

PLANE_COLUMNS = 10
Whole = int | np.integer


@compiled
def project_outline(
    c: NDArray[np.float64],
    n: NDArray[np.float64],
    u: NDArray[np.float64],
    v: NDArray[np.float64],
    first: float,
    second: float,
    corner_x: float,
    corner_y: float,
    scale: float,
    perspective: bool,
    plane: NDArray[np.float64],
) -> None:
    """The plane of a disc over the picture, and the form of its outline, from the corner that its centre is
    rounded to: (corner_x, corner_y) from the line of sight, pixels.

    A ray of the picture meets the plane where the inverse of its depth, and the disc's two coordinates times
    that, are linear in pixels. In parallel views coordinates and depth are.
    """
    lines = np.empty((3, 3))  # coordinate along u, along v, and 1; each: at the corner, a pixel right, down
    at = np.array([corner_x / scale, -corner_y / scale])
    step = np.array([1.0 / scale, -1.0 / scale])
    ray, off = np.empty(3), np.empty(3)
    across = n[0] * c[0] + n[1] * c[1] + n[2] * c[2]
    for k in range(3):  # the corner, a pixel right, a pixel down
        ray[0] = (at[0] if k == 0 else 0.0) + (step[0] if k == 1 else 0.0)
        ray[1] = (at[1] if k == 0 else 0.0) + (step[1] if k == 2 else 0.0)
        if perspective:
            ray[2] = -1.0 if k == 0 else 0.0
            weight = (n[0] * ray[0] + n[1] * ray[1] + n[2] * ray[2]) / across
            for m in range(3):
                off[m] = ray[m] - weight * c[m]
            plane[1 + k] = weight
        else:
            weight = 1.0 if k == 0 else 0.0
            off[0] = ray[0] - weight * c[0]
            off[1] = ray[1] - weight * c[1]
            off[2] = -(n[0] * off[0] + n[1] * off[1]) / n[2]
            plane[1 + k] = -weight * c[2] - off[2]
        lines[0, k] = (off[0] * u[0] + off[1] * u[1] + off[2] * u[2]) / first
        lines[1, k] = (off[0] * v[0] + off[1] * v[1] + off[2] * v[2]) / second
        lines[2, k] = weight
    depth = -c[2] if perspective else 1.0
    form = plane[4:]
    for k in range(6):
        form[k] = 0.0
    for k in range(3):
        sign = (1.0 if k < 2 else -1.0) * depth * depth  # near 1 whatever the scan's unit
        one, right, down = lines[k]
        form[0] += sign * right * right
        form[1] += sign * right * down
        form[2] += sign * down * down
        form[3] += sign * right * one
        form[4] += sign * down * one
        form[5] += sign * one * one


@compiled
def _extent(a: float, b: float, c: float, d: float, e: float, f: float) -> tuple[float, float]:
    """Least and largest y of a form's outline; the first is the larger one where there is none."""
    p, q, r = a * c - b * b, a * e - b * d, a * f - d * d
    root = q * q - p * r
    if not (a > 0.0 and p > 0.0 and root >= 0.0):
        return 1.0, -1.0
    root = math.sqrt(root)
    return (-q - root) / p, (-q + root) / p


@compiled
def is_outline_seen(plane: NDArray[np.float64], x: float, y: float, width: float, height: float) -> bool:
    """Whether the box around an outline reaches into the picture."""
    a, b, c, d, e, f = plane[4], plane[5], plane[6], plane[7], plane[8], plane[9]
    top, bottom = _extent(a, b, c, d, e, f)
    left, right = _extent(c, b, a, e, d, f)
    return (
        top <= bottom
        and left <= right
        and x + right > 0
        and x + left < width
        and y + bottom > 0
        and y + top < height
    )


@compiled
def exact_rows(
    plane: NDArray[np.float64],
    x: int,
    y: int,
    width: int,
    height: int,
    first: NDArray[np.int32],
    last: NDArray[np.int32],
) -> tuple[Whole, Whole]:
    """Fill the rows of an exact outline, cut to the picture."""
    a, b, c, d, e, f = plane[4], plane[5], plane[6], plane[7], plane[8], plane[9]
    low, high = _extent(a, b, c, d, e, f)
    top = np.int64(max(math.ceil(y + low - 0.5), 0.0))
    bottom = np.int64(min(math.floor(y + high - 0.5), height - 1.0))
    for row in range(top, bottom + 1):
        off = row + 0.5 - y
        p, q = b * off + d, off * (c * off + 2.0 * e) + f
        first[row], last[row] = 1, 0
        root = p * p - a * q
        if root < 0.0:
            continue
        root = math.sqrt(root)
        begin = max(math.ceil(x + (-p - root) / a - 0.5), 0.0)
        end = min(math.floor(x + (-p + root) / a - 0.5), width - 1.0)
        if begin <= end:
            first[row], last[row] = np.int32(begin), np.int32(end)
    return top, bottom
