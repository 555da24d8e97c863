"""Exact outlines of discs in the picture, compiled by numba; see `encode`.

A row of `planes` (float64) has of a disc the depth at its centre, or its inverse in perspective; that at the
corner of pixels that its centre is rounded to, how much it grows a pixel to the right and down; and the form
of its outline, six numbers: a position (x, y) off the corner is inside where
a x^2 + 2 b x y + c y^2 + 2 d x + 2 e y + f <= 0. Then the least and the largest y of the outline, infinite
for a disc that reaches the plane of the eye, whose outline is a branch of a hyperbola; and what the near
plane leaves of it, three numbers: positions where g + h x + i y <= 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled

PLANE_COLUMNS = 15
Whole = int | np.integer


CENTER, NORMAL, U, V, EYE, LENGTHS = range(6)  # rows of a disc, (6, 3), in view space, see `Disc`

# What compiled loops hold of a disc, one array that each element fills anew: its centre, its unit normal
# towards the eye, unit vectors along its half-axes, the unit vector to the eye, and the half-axes' lengths.
Disc = NDArray[np.float64]
# The pixels that a shape covers in each row of a picture, (2, H): first and last; none where first > last.
RowSpans = NDArray[np.int32]


class PictureView(NamedTuple):
    """A view as compiled loops have it."""

    width: int
    height: int
    center_x: float  # of the line of sight, pixels
    center_y: float
    scale: float  # pixels in a scan unit, at depth 1 in perspective
    near: float
    far: float
    perspective: bool


@compiled
def project_outline(
    disc: Disc, view: PictureView, corner_x: float, corner_y: float, plane: NDArray[np.float64]
) -> None:
    """The plane of a disc over the picture, and its outline, from a corner of pixels: (corner_x, corner_y)
    from the line of sight, pixels.

    A ray of the picture meets the plane where the inverse of its depth, and the disc's two coordinates times
    that, are linear in pixels. In parallel views coordinates and depth are.
    """
    c, n, u, v = disc[CENTER], disc[NORMAL], disc[U], disc[V]
    first, second = disc[LENGTHS, 0], disc[LENGTHS, 1]
    scale, near, perspective = view.scale, view.near, view.perspective
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
    unit = math.sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]) if perspective else 1.0
    form = plane[4:10]
    for k in range(6):
        form[k] = 0.0
    for k in range(3):
        sign = (1.0 if k < 2 else -1.0) * unit * unit  # near 1 whatever the scan's unit
        one, right, down = lines[k]
        form[0] += sign * right * right
        form[1] += sign * right * down
        form[2] += sign * down * down
        form[3] += sign * right * one
        form[4] += sign * down * one
        form[5] += sign * one * one
    reach = math.sqrt((first * u[2]) ** 2 + (second * v[2]) ** 2)
    if perspective and reach >= -c[2]:
        plane[10], plane[11] = -np.inf, np.inf
    else:
        plane[10], plane[11] = _extent(form[0], form[1], form[2], form[3], form[4], form[5])
    side = 1.0 if perspective else -1.0
    for k in range(3):
        plane[12 + k] = side * plane[1 + k]
    plane[12] -= side * (1.0 / near if perspective else near)


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
    top, bottom = plane[10], plane[11]
    if top == -np.inf:
        return True
    a, b, c, d, e, f = plane[4], plane[5], plane[6], plane[7], plane[8], plane[9]
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
    plane: NDArray[np.float64], x: int, y: int, width: int, spans: RowSpans
) -> tuple[Whole, Whole]:
    """Fill the rows of an exact outline, cut to the picture and at the near plane; gives the first and the
    last of them."""
    first, last, height = spans[0], spans[1], spans.shape[1]
    a, b, c, d, e, f = plane[4], plane[5], plane[6], plane[7], plane[8], plane[9]
    is_open = plane[10] == -np.inf
    top = np.int64(max(math.ceil(max(y + plane[10], -1.0) - 0.5), 0.0))
    bottom = np.int64(min(math.floor(min(y + plane[11], height + 1.0) - 0.5), height - 1.0))
    for row in range(top, bottom + 1):
        off = row + 0.5 - y
        p, q = b * off + d, off * (c * off + 2.0 * e) + f
        first[row], last[row] = 1, 0
        root = p * p - a * q
        if root < 0.0:
            continue
        root = math.sqrt(root)
        if is_open:
            left, right = _before_the_eye(a, p, q, root, plane[1] + off * plane[3], plane[2])
        else:
            left, right = (-p - root) / a, (-p + root) / a
        cut = plane[12] + off * plane[14]
        if plane[13] > 0.0:
            right = min(right, -cut / plane[13])
        elif plane[13] < 0.0:
            left = max(left, -cut / plane[13])
        elif cut > 0.0:
            continue
        begin = max(math.ceil(max(x + left, -1.0) - 0.5), 0.0)
        end = min(math.floor(min(x + right, width + 1.0) - 0.5), width - 1.0)
        if begin <= end:
            first[row], last[row] = np.int32(begin), np.int32(end)
    return top, bottom


@compiled
def seen_range(
    plane: NDArray[np.float64], x: int, y: int, width: int, spans: RowSpans
) -> tuple[float, float]:
    """The least and the largest depth, or inverse of it in perspective, of the pixels inside an outline; the
    first is the larger one where there are none. spans: get the rows of `exact_rows`."""
    low, high = np.inf, -np.inf
    first, last = spans[0], spans[1]
    top, bottom = exact_rows(plane, x, y, width, spans)
    for row in range(top, bottom + 1):
        if first[row] <= last[row]:
            for column in (first[row], last[row]):
                value = plane[1] + plane[2] * (column + 0.5 - x) + plane[3] * (row + 0.5 - y)
                low, high = min(low, value), max(high, value)
    return low, high


@compiled
def _before_the_eye(
    a: float, p: float, q: float, root: float, inverse: float, step: float
) -> tuple[float, float]:
    """The places x of a row of a hyperbola, a x^2 + 2 p x + q <= 0, that lie before the eye, not behind it:
    where the inverse of depth, which grows by step, is above 0. The first is the larger one where none do."""
    if a > 0.0:
        in_front = inverse - step * p / a > 0.0
        return ((-p - root) / a, (-p + root) / a) if in_front else (1.0, -1.0)
    k = -p - math.copysign(root, p)  # without cancellation
    if k == 0.0:
        return 1.0, -1.0
    one, other = k / (a if a < 0.0 else -1e-300), q / k
    return (max(one, other), np.inf) if step > 0.0 else (-np.inf, min(one, other))
