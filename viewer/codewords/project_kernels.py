"""The inner loop of projecting points as elements of code words, compiled by numba; see `encode`.

Elements are points that the picture may show. Of each there is a row in `shapes` and in `planes`:

    shapes (int32)    x, y of the corner of pixels that its centre is rounded to, size, i, j, diffuse index,
                      specular index; of exact outlines no size and normal, and any corner
    planes (float64)  depth at the centre, or its inverse in perspective; of exact outlines also the rest, see
                      `outline_kernels`
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled, inlined
from .outline_kernels import (
    CENTER,
    EYE,
    LENGTHS,
    NORMAL,
    Disc,
    PictureView,
    RowSpans,
    U,
    V,
    is_outline_seen,
    project_outline,
    seen_range,
)

X, Y, SIZE, NORMAL_I, NORMAL_J, DIFFUSE, SPECULAR = range(7)
SHAPE_COLUMNS = 7
Real = float | np.floating
_UNKNOWN = 3e38
_FARTHEST = 1e6  # pixels: what is centred farther away is left out
_FLATTEST = 1e-6  # of |n_z|: a disc that is seen more edge on shows nothing


class ElementArrays(NamedTuple):
    """N elements in front of a view; arrays that they lack have length 0."""

    frame: NDArray[np.float64]  # (3, 4), rotation and translation of a view
    positions: NDArray[np.float32]  # (N, 3)
    normals: NDArray[np.float32]  # (N, 3) or (0, 3)
    radii: NDArray[np.float32]  # (N,) or (0,)
    axes: NDArray[np.float32]  # (N, 4) or (0, 4)


class SplatRules(NamedTuple):
    """How large elements are, how they are rounded, and which are left out."""

    radius: float  # of points without one
    factor: float  # on radii
    least: float  # radius in pixels
    size_parts: int  # steps of a size in a pixel, see `Steps`
    steepest: int
    normal_parts: int
    cull: bool  # whether elements that face away are left out
    exact: bool  # whether outlines are exact


class LightRules(NamedTuple):
    """White light on elements."""

    shininess: float  # Phong's exponent
    is_lit: bool
    from_eye: bool  # whether it is where the eye is


class ProjectedArrays(NamedTuple):
    """Room for the elements that a picture may show."""

    rows: NDArray[np.uint32]  # (N,)
    shapes: NDArray[np.int32]  # (N, 7)
    planes: NDArray[np.float64]  # (N, 15)
    spread: NDArray[np.float64]  # (2,), least and largest depth: of centres, or of whole discs if exact


@compiled
def project(
    elements: ElementArrays,
    view: PictureView,
    splats: SplatRules,
    light: LightRules,
    towards: NDArray[np.float64],
    out: ProjectedArrays,
) -> int:
    """Fill the elements that the picture may show; gives how many there are. towards: (3,), to the light.

    Arrays leave their tuples before the loops: taking one out counts a reference each time.
    """
    frame, positions, normals, radii, axes = elements
    rows, shapes, planes, spread = out
    spans, disc = np.empty((2, view.height), np.int32), np.empty((6, 3))
    c = disc[CENTER]
    count = 0
    spread[0], spread[1] = np.inf, -np.inf
    for row in range(len(positions)):
        for k in range(3):
            c[k] = frame[k, 3]
            for m in range(3):
                c[k] += frame[k, m] * positions[row, m]
        depth, distance = -c[2], math.sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2])
        if not (depth <= view.far and distance < _UNKNOWN) or (view.perspective and distance == 0.0):
            continue
        held = max(depth, view.near)
        s = view.scale / held if view.perspective else view.scale
        x, y = view.center_x + c[0] * s, view.center_y - c[1] * s
        is_near = abs(x) < _FARTHEST and abs(y) < _FARTHEST
        if not splats.exact and not (depth >= view.near and is_near):
            continue
        if _face_eye(normals, row, frame, distance, view.perspective, splats.cull, disc) <= _FLATTEST:
            continue
        _span_disc(radii, axes, row, frame, splats, s, disc)
        shape, plane = shapes[count], planes[count]
        plane[0] = 1.0 / held if view.perspective else held
        if splats.exact:
            nearest, farthest = _exact_shape(disc, view, x, y, spans, shape, plane)
            if nearest > farthest:
                continue
        else:
            if not _table_shape(disc, view, s, splats, x, y, shape):
                continue
            nearest = farthest = depth
        spread[0], spread[1] = min(spread[0], nearest), max(spread[1], farthest)
        shape[DIFFUSE], shape[SPECULAR] = 127, 0
        if light.is_lit:
            _shade(disc, towards, light, shape)
        rows[count] = row
        count += 1
    return count


@inlined
def _face_eye(
    normals: NDArray[np.float32], row: int, frame: NDArray[np.float64], distance: float,
    perspective: bool, cull: bool, disc: Disc,
) -> float:  # fmt: skip
    """Fill the direction to the eye, and the unit normal of an element that faces it; gives the cosine
    between both, 0 where the element faces away and is left out."""
    c, n, eye = disc[CENTER], disc[NORMAL], disc[EYE]
    for k in range(3):
        eye[k] = -c[k] / distance if perspective else (1.0 if k == 2 else 0.0)
    length = 0.0
    if len(normals):
        for k in range(3):
            n[k] = 0.0
            for m in range(3):
                n[k] += frame[k, m] * normals[row, m]
            length += n[k] * n[k]
        length = math.sqrt(length)
    if not (length > 0.0 and length < _UNKNOWN):
        for k in range(3):
            n[k] = eye[k]
        length = 1.0
    facing = 0.0
    for k in range(3):
        n[k] /= length
        facing += n[k] * eye[k]
    if facing < 0.0:
        if cull:
            return 0.0
        facing = -facing
        for k in range(3):
            n[k] = -n[k]
    return facing


@inlined
def _span_disc(
    radii: NDArray[np.float32], axes: NDArray[np.float32], row: int, frame: NDArray[np.float64],
    splats: SplatRules, s: float, disc: Disc,
) -> None:  # fmt: skip
    """Fill the half-axes of an element: two directions and their lengths. s: pixels in a scan unit."""
    radius = _radius(radii[row] if len(radii) else np.float32(0.0), splats, s)
    disc[LENGTHS, 0] = disc[LENGTHS, 1] = radius
    _tangents(disc[NORMAL], disc[U], disc[V])
    if len(axes):
        length = _turn_to_axes(axes[row], frame, disc)
        if length > 0.0:
            disc[LENGTHS, 0] = _radius(length, splats, s)
            disc[LENGTHS, 1] = _radius(axes[row, 3], splats, s)


@inlined
def _exact_shape(
    disc: Disc, view: PictureView, x: float, y: float, spans: RowSpans,
    shape: NDArray[np.int32], plane: NDArray[np.float64],
) -> tuple[float, float]:  # fmt: skip
    """Fill shape and plane of an exact outline; gives its least and largest depth, the first one the larger
    if the picture does not show it. x, y: of the centre, pixels."""
    depth, first, second = -disc[CENTER, 2], disc[LENGTHS, 0], disc[LENGTHS, 1]
    reach_z = math.sqrt((first * disc[U, 2]) ** 2 + (second * disc[V, 2]) ** 2)
    if not depth + reach_z >= view.near:
        return 1.0, -1.0
    corner_x = corner_y = 0.0
    if not view.perspective or reach_z < depth:
        if not (abs(x) < _FARTHEST and abs(y) < _FARTHEST):
            return 1.0, -1.0
        corner_x, corner_y = np.rint(x), np.rint(y)
    shape[X], shape[Y], shape[SIZE] = np.int32(corner_x), np.int32(corner_y), 0
    shape[NORMAL_I], shape[NORMAL_J] = 0, 0
    project_outline(disc, view, corner_x - view.center_x, corner_y - view.center_y, plane)
    if not is_outline_seen(plane, corner_x, corner_y, view.width, view.height):
        return 1.0, -1.0
    nearest, farthest = depth - reach_z, depth + reach_z
    if nearest < view.near:
        low, high = seen_range(plane, shape[X], shape[Y], view.width, spans)
        if low > high:
            return 1.0, -1.0
        nearest, farthest = (1.0 / high, 1.0 / low) if view.perspective else (low, high)
    return nearest, farthest


@inlined
def _table_shape(
    disc: Disc, view: PictureView, s: float, splats: SplatRules, x: float, y: float,
    shape: NDArray[np.int32],
) -> bool:  # fmt: skip
    """Fill the shape of an element with a size and normal of the table; False if the picture does not show
    it. x, y: of the centre, pixels."""
    c, u, v = disc[CENTER], disc[U], disc[V]
    first, second, depth = disc[LENGTHS, 0], disc[LENGTHS, 1], -c[2]
    # The image of its half-axes, pixels right and down; with it the ellipse's squared widths.
    tilt_x, tilt_y = (c[0] / depth, c[1] / depth) if view.perspective else (0.0, 0.0)
    a_x, a_y = first * s * (u[0] + tilt_x * u[2]), -first * s * (u[1] + tilt_y * u[2])
    b_x, b_y = second * s * (v[0] + tilt_x * v[2]), -second * s * (v[1] + tilt_y * v[2])
    xx, xy, yy = a_x * a_x + b_x * b_x, a_x * a_y + b_x * b_y, a_y * a_y + b_y * b_y
    reach_x, reach_y = math.sqrt(xx) + 1.0, math.sqrt(yy) + 1.0
    if x + reach_x < 0 or x - reach_x > view.width or y + reach_y < 0 or y - reach_y > view.height:
        return False
    shape[X], shape[Y] = np.int32(np.rint(x)), np.int32(np.rint(y))
    _quantise(xx, xy, yy, splats, shape)
    return True


@inlined
def _radius(stored: Real, splats: SplatRules, s: float) -> float:
    """Radius of a splat, scan units. s: pixels in one."""
    radius = stored if stored > 0.0 and stored < _UNKNOWN else splats.radius
    return float(max(radius * splats.factor, splats.least / s))


@inlined
def _tangents(n: NDArray[np.float64], u: NDArray[np.float64], v: NDArray[np.float64]) -> None:
    """Two unit vectors at right angles to n and to each other."""
    least = 0 if abs(n[0]) <= abs(n[1]) and abs(n[0]) <= abs(n[2]) else 1 if abs(n[1]) <= abs(n[2]) else 2
    length = 0.0
    for k in range(3):
        u[k] = (1.0 if k == least else 0.0) - n[least] * n[k]
        length += u[k] * u[k]
    for k in range(3):
        u[k] /= math.sqrt(length)
    _cross(n, u, v)


@inlined
def _cross(a: NDArray[np.float64], b: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@inlined
def _turn_to_axes(axes: NDArray[np.float32], frame: NDArray[np.float64], disc: Disc) -> float:
    """Turn the half-axes of a disc to those of an elliptical splat, (4,); gives the length of the first, 0
    where it is a round one."""
    tangent, n, u = np.empty(3), disc[NORMAL], disc[U]
    length = along = 0.0
    for k in range(3):
        tangent[k] = 0.0
        for m in range(3):
            tangent[k] += frame[k, m] * axes[m]
        length += tangent[k] * tangent[k]
        along += tangent[k] * n[k]
    length = math.sqrt(length)
    if not length > 0.0:
        return 0.0
    left = 0.0
    for k in range(3):
        tangent[k] = (tangent[k] - along * n[k]) / length
        left += tangent[k] * tangent[k]
    if left <= 1e-6:
        return 0.0
    for k in range(3):
        u[k] = tangent[k] / math.sqrt(left)
    _cross(n, u, disc[V])
    return length


@inlined
def _quantise(xx: float, xy: float, yy: float, splats: SplatRules, shape: NDArray[np.int32]) -> None:
    """Size and normal of the disc whose image in a parallel view is the ellipse of these squared widths: of
    radius R, the longer half-axis, and normal n', whose length tells the shorter one, R / sqrt(1 + n'^2)."""
    size_parts, steepest, normal_parts = splats.size_parts, splats.steepest, splats.normal_parts
    half, apart = 0.5 * (xx + yy), math.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
    longest = half + apart
    shortest = max((xx * yy - xy * xy) / longest, longest * 1e-12)
    slope = math.sqrt(max(longest / shortest - 1.0, 0.0))
    # Of the shorter axis: at right angles to that of the eigenvalue `longest`.
    cos2 = 0.5 * (xx - yy) / apart if apart > 0.0 else 1.0
    along_x = math.sqrt(max(0.5 * (1.0 - cos2), 0.0))
    along_y = math.sqrt(max(0.5 * (1.0 + cos2), 0.0))
    if xy > 0.0:
        along_y = -along_y
    i, j = slope * along_x * normal_parts, slope * along_y * normal_parts
    beyond = max(abs(i), abs(j)) / steepest if steepest else 0.0
    if steepest == 0:
        i = j = 0.0
    elif beyond > 1.0:
        i, j = i / beyond, j / beyond
    least = math.ceil(0.7072 * size_parts)  # of which the four pixels round the centre are in
    shape[SIZE] = max(min(np.rint(math.sqrt(longest) * size_parts), 1e6), least)
    shape[NORMAL_I], shape[NORMAL_J] = np.int32(np.rint(i)), np.int32(np.rint(j))


@inlined
def _shade(disc: Disc, direction: NDArray[np.float64], light: LightRules, shape: NDArray[np.int32]) -> None:
    """Diffuse and specular index by Phong, as shade/shade.comp has them. direction: (3,), to the light."""
    n, eye = disc[NORMAL], disc[EYE]
    facing = seen = between = 0.0
    for k in range(3):
        towards = eye[k] if light.from_eye else direction[k]
        facing += n[k] * towards
        seen += n[k] * eye[k]
        between += towards * eye[k]
    highlight = 0.0
    if facing > 0.0:
        highlight = max(2.0 * facing * seen - between, 0.0) ** light.shininess
    shape[DIFFUSE] = np.int32(np.rint(127.0 * min(max(facing, 0.0), 1.0)))
    shape[SPECULAR] = np.int32(np.rint(127.0 * min(highlight, 1.0)))
