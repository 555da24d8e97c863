"""The inner loop of projecting points as elements of code words, compiled by numba; see `encode`.

Elements are points that the picture may show. Of each there is a row in `shapes` and in `planes`:

    shapes (int32)    x, y of the corner of pixels that its centre is rounded to, size, i, j, diffuse index,
                      specular index; of exact outlines no size and normal, and any corner
    planes (float64)  depth at the centre, or its inverse in perspective; of exact outlines also the rest, see
                      `outline_kernels`
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from .outline_kernels import is_outline_seen, project_outline, seen_range

X, Y, SIZE, NORMAL_I, NORMAL_J, DIFFUSE, SPECULAR = range(7)
SHAPE_COLUMNS = 7
Real = float | np.floating
_UNKNOWN = 3e38
_FARTHEST = 1e6  # pixels: what is centred farther away is left out
_FLATTEST = 1e-6  # of |n_z|: a disc that is seen more edge on shows nothing


@compiled
def project(
    positions: NDArray[np.float32],
    normals: NDArray[np.float32],
    radii: NDArray[np.float32],
    axes: NDArray[np.float32],
    frame: NDArray[np.float64],
    lens: NDArray[np.float64],
    splats: NDArray[np.float64],
    light: NDArray[np.float64],
    steps: NDArray[np.int64],
    flags: NDArray[np.bool_],
    rows: NDArray[np.uint32],
    shapes: NDArray[np.int32],
    planes: NDArray[np.float64],
    spread: NDArray[np.float64],
) -> int:
    """Fill `rows` (numbers of points), `shapes` and `planes` of the points that the picture may show; how
    many.

    frame: (3, 4), rotation and translation to view space. lens: width, height, centre's x and y, scale,
    near, far. splats: radius of points without one, factor on radii, least radius in pixels. light: towards
    it (3,), shininess. steps: of `Steps`, sizes per pixel, steepest normal, normals per unit. flags:
    perspective, lit, light from the eye, leave out what faces away, exact outlines. spread: becomes the least
    and the largest depth, of centres, or of whole discs where outlines are exact.
    """
    at_x, at_y, scale, near, far = lens[2:]
    width, height = int(lens[0]), int(lens[1])
    perspective, lit, from_eye, cull, exact = flags
    size_parts, steepest, normal_parts = steps
    n, u, v, c, eye = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    left, right = np.empty(height, np.int32), np.empty(height, np.int32)
    count = 0
    spread[0], spread[1] = np.inf, -np.inf
    for row in range(len(positions)):
        for k in range(3):
            c[k] = frame[k, 3]
            for m in range(3):
                c[k] += frame[k, m] * positions[row, m]
        depth, distance = -c[2], math.sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2])
        if not (depth <= far and distance < _UNKNOWN) or (perspective and distance == 0.0):
            continue
        held = max(depth, near)
        s = scale / held if perspective else scale
        x, y = at_x + c[0] * s, at_y - c[1] * s
        is_near = abs(x) < _FARTHEST and abs(y) < _FARTHEST
        if not exact and not (depth >= near and is_near):
            continue

        # The frame of the disc: its normal towards the eye, and half-axes u, v of unit length.
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
            n[:] = eye
            length = 1.0
        facing = 0.0
        for k in range(3):
            n[k] /= length
            facing += n[k] * eye[k]
        if cull and facing <= 0.0:
            continue
        if facing < 0.0:
            facing = -facing
            for k in range(3):
                n[k] = -n[k]
        if facing <= _FLATTEST:
            continue
        first = second = _radius(radii[row] if len(radii) else np.float32(0.0), splats, s)
        _tangents(n, u, v)
        if len(axes):
            first, second = _half_axes(axes[row], frame, n, u, v, first, second, splats, s)

        shape, plane = shapes[count], planes[count]
        plane[0] = 1.0 / held if perspective else held
        if exact:
            reach_z = math.sqrt((first * u[2]) ** 2 + (second * v[2]) ** 2)
            if not depth + reach_z >= near:
                continue
            corner_x = corner_y = 0.0
            if not perspective or reach_z < depth:
                if not is_near:
                    continue
                corner_x, corner_y = np.rint(x), np.rint(y)
            shape[X], shape[Y], shape[SIZE] = np.int32(corner_x), np.int32(corner_y), 0
            shape[NORMAL_I], shape[NORMAL_J] = 0, 0
            off_x, off_y = corner_x - at_x, corner_y - at_y
            project_outline(c, n, u, v, first, second, off_x, off_y, scale, perspective, near, plane)
            if not is_outline_seen(plane, corner_x, corner_y, width, height):
                continue
            nearest, farthest = depth - reach_z, depth + reach_z
            if nearest < near:
                low, high = seen_range(plane, shape[X], shape[Y], width, height, left, right)
                if low > high:
                    continue
                nearest, farthest = (1.0 / high, 1.0 / low) if perspective else (low, high)
        else:
            # The image of its half-axes, pixels right and down; with it the ellipse's squared widths.
            tilt_x, tilt_y = (c[0] / depth, c[1] / depth) if perspective else (0.0, 0.0)
            a_x, a_y = first * s * (u[0] + tilt_x * u[2]), -first * s * (u[1] + tilt_y * u[2])
            b_x, b_y = second * s * (v[0] + tilt_x * v[2]), -second * s * (v[1] + tilt_y * v[2])
            xx, xy, yy = a_x * a_x + b_x * b_x, a_x * a_y + b_x * b_y, a_y * a_y + b_y * b_y
            reach_x, reach_y = math.sqrt(xx) + 1.0, math.sqrt(yy) + 1.0
            if x + reach_x < 0 or x - reach_x > width or y + reach_y < 0 or y - reach_y > height:
                continue
            shape[X], shape[Y] = np.int32(np.rint(x)), np.int32(np.rint(y))
            _quantise(xx, xy, yy, size_parts, steepest, normal_parts, shape)
            nearest = farthest = depth
        spread[0], spread[1] = min(spread[0], nearest), max(spread[1], farthest)
        shape[DIFFUSE], shape[SPECULAR] = 127, 0
        if lit:
            _shade(n, eye, light, from_eye, shape)
        rows[count] = row
        count += 1
    return count


@compiled
def _radius(stored: Real, splats: NDArray[np.float64], s: float) -> float:
    """Radius of a splat, scan units. s: pixels in one."""
    radius = stored if stored > 0.0 and stored < _UNKNOWN else splats[0]
    return max(radius * splats[1], splats[2] / s)


@compiled
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


@compiled
def _cross(a: NDArray[np.float64], b: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@compiled
def _half_axes(
    axes: NDArray[np.float32],
    frame: NDArray[np.float64],
    n: NDArray[np.float64],
    u: NDArray[np.float64],
    v: NDArray[np.float64],
    first: float,
    second: float,
    splats: NDArray[np.float64],
    s: float,
) -> tuple[float, float]:
    """Lengths of the half-axes of an elliptical splat, and their directions in u and v; as they are where it
    is a round one."""
    tangent = np.empty(3)
    length = along = 0.0
    for k in range(3):
        tangent[k] = 0.0
        for m in range(3):
            tangent[k] += frame[k, m] * axes[m]
        length += tangent[k] * tangent[k]
        along += tangent[k] * n[k]
    length = math.sqrt(length)
    if not length > 0.0:
        return first, second
    left = 0.0
    for k in range(3):
        tangent[k] = (tangent[k] - along * n[k]) / length
        left += tangent[k] * tangent[k]
    if left <= 1e-6:
        return first, second
    for k in range(3):
        u[k] = tangent[k] / math.sqrt(left)
    _cross(n, u, v)
    return _radius(length, splats, s), _radius(axes[3], splats, s)


@compiled
def _quantise(
    xx: float,
    xy: float,
    yy: float,
    size_parts: int,
    steepest: int,
    normal_parts: int,
    shape: NDArray[np.int32],
) -> None:
    """Size and normal of the disc whose image in a parallel view is the ellipse of these squared widths: of
    radius R, the longer half-axis, and normal n', whose length tells the shorter one, R / sqrt(1 + n'^2)."""
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


@compiled
def _shade(
    n: NDArray[np.float64],
    eye: NDArray[np.float64],
    light: NDArray[np.float64],
    from_eye: bool,
    shape: NDArray[np.int32],
) -> None:
    """Diffuse and specular index by Phong, as shade/shade.comp has them."""
    facing = seen = between = 0.0
    for k in range(3):
        towards = eye[k] if from_eye else light[k]
        facing += n[k] * towards
        seen += n[k] * eye[k]
        between += towards * eye[k]
    highlight = 0.0
    if facing > 0.0:
        highlight = max(2.0 * facing * seen - between, 0.0) ** light[3]
    shape[DIFFUSE] = np.int32(np.rint(127.0 * min(max(facing, 0.0), 1.0)))
    shape[SPECULAR] = np.int32(np.rint(127.0 * min(highlight, 1.0)))
