"""The inner loops of encoding points as code words, compiled by numba; see `encode`.

Elements are points that the picture may show. Of each there is a row in `shapes` and in `planes`:

    shapes (int32)    x, y of the corner of pixels that its centre is rounded to, size, i, j, diffuse index,
                      specular index
    planes (float64)  depth at the centre, or its inverse in perspective; of exact outlines also that at the
                      corner, how much it grows a pixel to the right and down, and their form, six numbers: a
                      place (x, y) off the corner is inside where
                      a x^2 + 2 b x y + c y^2 + 2 d x + 2 e y + f <= 0
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scan.octree.compiled import compiled

X, Y, SIZE, NORMAL_I, NORMAL_J, DIFFUSE, SPECULAR = range(7)
SHAPE_COLUMNS, PLANE_COLUMNS = 7, 10
Whole = int | np.integer
Real = float | np.floating
_UNKNOWN = 3e38
_FARTHEST = 1e6  # pixels: what is centred farther away is left out
_FLATTEST = 1e-6  # of |n_z|: a disc that is seen more edge on shows nothing
_EMPTY_ROW = 7
_LARGE = 1 << 31
_MOST_KEY = float(1 << 30)


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
    width, height, at_x, at_y, scale, near, far = lens
    perspective, lit, from_eye, cull, exact = flags
    size_parts, steepest, normal_parts = steps
    n, u, v, c, eye = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    count = 0
    spread[0], spread[1] = np.inf, -np.inf
    for row in range(len(positions)):
        for k in range(3):
            c[k] = frame[k, 3]
            for m in range(3):
                c[k] += frame[k, m] * positions[row, m]
        depth = -c[2]
        if not (depth >= near and depth <= far):
            continue
        s = scale / depth if perspective else scale
        x, y = at_x + c[0] * s, at_y - c[1] * s
        if not (abs(x) < _FARTHEST and abs(y) < _FARTHEST):
            continue

        # The frame of the disc: its normal towards the eye, and half-axes u, v of unit length.
        distance = math.sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]) if perspective else 1.0
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

        # The image of its half-axes, pixels right and down; with it the ellipse's squared widths.
        tilt_x, tilt_y = (c[0] / depth, c[1] / depth) if perspective else (0.0, 0.0)
        a_x, a_y = first * s * (u[0] + tilt_x * u[2]), -first * s * (u[1] + tilt_y * u[2])
        b_x, b_y = second * s * (v[0] + tilt_x * v[2]), -second * s * (v[1] + tilt_y * v[2])
        xx, xy, yy = a_x * a_x + b_x * b_x, a_x * a_y + b_x * b_y, a_y * a_y + b_y * b_y
        reach_x, reach_y = math.sqrt(xx) + 1.0, math.sqrt(yy) + 1.0
        reach_z = math.sqrt((first * u[2]) ** 2 + (second * v[2]) ** 2)
        if exact and perspective and reach_z >= depth:
            continue  # it reaches the eye's plane, and has no outline
        if not exact and (x + reach_x < 0 or x - reach_x > width or y + reach_y < 0 or y - reach_y > height):
            continue
        corner_x, corner_y = np.rint(x), np.rint(y)
        shape, plane = shapes[count], planes[count]
        shape[X], shape[Y] = np.int32(corner_x), np.int32(corner_y)
        _quantise(xx, xy, yy, size_parts, steepest, normal_parts, shape)
        plane[0] = 1.0 / depth if perspective else depth
        if exact:
            _outline(c, n, u, v, first, second, corner_x - at_x, corner_y - at_y, scale, perspective, plane)
            if not _is_seen(plane, corner_x, corner_y, width, height):
                continue
            spread[0], spread[1] = min(spread[0], depth - reach_z), max(spread[1], depth + reach_z)
        else:
            spread[0], spread[1] = min(spread[0], depth), max(spread[1], depth)
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
def _outline(
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
def _is_seen(plane: NDArray[np.float64], x: float, y: float, width: float, height: float) -> bool:
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


@compiled
def emit(
    size: tuple[int, int],
    stride: int,
    steps: NDArray[np.int64],
    entries: NDArray[np.uint32],
    table_rows: NDArray[np.uint16],
    reach: int,
    exact: bool,
    rows: NDArray[np.uint32],
    materials: NDArray[np.uint8],
    shapes: NDArray[np.int32],
    planes: NDArray[np.float64],
    depths: NDArray[np.int32],
    finer: NDArray[np.float64],
    cursor: NDArray[np.int64],
    words: NDArray[np.uint64],
    ids: NDArray[np.uint32],
    fine: NDArray[np.int32],
) -> None:
    """Write the words of elements, or count them, where `words` is empty.

    entries, table_rows, reach: of the table. rows: of `project`, ids of the elements (M,). materials: (M,).
    depths: (M,), Z of each. finer: (M, 3), in steps, at the corner and a pixel right and down. cursor:
    (strips * height,), where the next word of each line goes; it is moved on.
    """
    width, height = size
    first, last = np.empty(height, np.int32), np.empty(height, np.int32)
    for number in range(len(rows)):
        shape = shapes[number]
        x, y = shape[X], shape[Y]
        head = (
            np.uint64(shape[DIFFUSE]) << np.uint64(25)
            | np.uint64(shape[SPECULAR]) << np.uint64(32)
            | np.uint64(materials[number]) << np.uint64(39)
            | np.uint64(depths[number]) << np.uint64(55)
        )
        from_strip = 0
        if exact:
            top, bottom = _exact_rows(planes[number], x, y, width, height, first, last)
        elif shape[SIZE] >= len(entries):
            top, bottom = _computed_rows(shape, steps, width, height, first, last)
        else:
            entry = entries[shape[SIZE], _place(shape[NORMAL_I], shape[NORMAL_J], steps)]
            if entry < _LARGE and x >= 4 and y >= 4 and x - 4 < width and y - 4 < height:
                strip = (x - 4) // stride
                word = (
                    head
                    | np.uint64(entry) << np.uint64(1)
                    | np.uint64(x - 4 - strip * stride) << np.uint64(46)
                )
                _put(word, strip * height + y - 4, rows[number], cursor, words, ids)
                from_strip = strip + 1
                if x + 3 < min(from_strip * stride, width) or from_strip * stride >= width:
                    continue
            top, bottom = _table_rows(entry, table_rows, reach, x, y, width, height, first, last)
        while top <= bottom and first[top] > last[top]:
            top += 1
        for begin in range(top, bottom + 1, 4):
            end = min(begin + 3, bottom)
            left, right = width, -1
            for row in range(begin, end + 1):
                if first[row] <= last[row]:
                    left, right = min(left, first[row]), max(right, last[row])
            for strip in range(max(left // stride, from_strip), right // stride + 1):
                strip_end = min((strip + 1) * stride, width) - 1
                for column in range(max(left, strip * stride), min(right, strip_end) + 1, 8):
                    scans, some = 0, False
                    for k in range(4):
                        row, field = begin + k, _EMPTY_ROW
                        if row <= end:
                            a, b = max(first[row], column), min(last[row], column + 7, strip_end)
                            if a <= b:
                                field, some = a - column | (b - column) << 3, True
                        scans |= field << 6 * k
                    if not some:
                        continue
                    word = head | np.uint64(1) | np.uint64(scans) << np.uint64(1)
                    word |= np.uint64(column - strip * stride) << np.uint64(46)
                    at = _put(word, strip * height + begin, rows[number], cursor, words, ids)
                    if at >= 0 and len(fine):
                        q, right_step, down_step = finer[number]
                        q += right_step * (column + 0.5 - x) + down_step * (begin + 0.5 - y)
                        fine[at, 0] = np.int32(np.rint(min(max(q, -_MOST_KEY), _MOST_KEY)))
                        fine[at, 1] = np.int32(np.rint(right_step))
                        fine[at, 2] = np.int32(np.rint(down_step))


@compiled
def _put(
    word: Whole,
    line: Whole,
    id: Whole,
    cursor: NDArray[np.int64],
    words: NDArray[np.uint64],
    ids: NDArray[np.uint32],
) -> int:
    """Write a word where its line goes on, and move this; its place, -1 where words are but counted."""
    at = cursor[line]
    cursor[line] += 1
    if len(words) == 0:
        return -1
    words[at], ids[at] = word, id
    return at


@compiled
def _place(i: int, j: int, steps: NDArray[np.int64]) -> int:
    """See `tables.shape_place`."""
    normals = 2 * steps[1] + 1
    at = (j + steps[1]) * normals + i + steps[1]
    return min(at, normals * normals - 1 - at)


@compiled
def _table_rows(
    entry: int,
    table_rows: NDArray[np.uint16],
    reach: int,
    x: int,
    y: int,
    width: int,
    height: int,
    first: NDArray[np.int32],
    last: NDArray[np.int32],
) -> tuple[Whole, Whole]:
    """Fill the rows of a shape of the table, cut to the picture; the first and the last one."""
    small = entry < _LARGE
    half = 4 if small else reach
    top, bottom = max(y - half, 0), min(y + half, height) - 1
    for row in range(top, bottom + 1):
        k = row - y if row >= y else y - 1 - row  # of the lower half, from the middle
        if small:
            field = np.int64(entry) >> (6 * (3 - k))
            a, b = 3 - (field >> 3 & 7), 3 - (field & 7)
        else:
            packed = np.int64(table_rows[entry - _LARGE + k])
            a, b = (packed & 255) - reach, (packed >> 8) - reach
        if row < y:
            a, b = -1 - b, -1 - a
        a, b = x + a, x + b
        first[row], last[row] = a if a > 0 else 0, b if b < width else width - 1
        if a > b:
            first[row], last[row] = 1, 0
    return top, bottom


@compiled
def _computed_rows(
    shape: NDArray[np.int32],
    steps: NDArray[np.int64],
    width: int,
    height: int,
    first: NDArray[np.int32],
    last: NDArray[np.int32],
) -> tuple[Whole, Whole]:
    """Fill the rows of a shape that is larger than those of the table, by the same rule."""
    size_parts, _, normal_parts = steps
    x, y = shape[X], shape[Y]
    i, j = np.int64(shape[NORMAL_I]), np.int64(shape[NORMAL_J])
    unit, scaled = normal_parts * normal_parts, size_parts * size_parts
    limit = (2 * np.int64(shape[SIZE]) * normal_parts) ** 2
    half = shape[SIZE] // size_parts + 1
    top, bottom = max(y - half, 0), min(y + half, height) - 1
    a = float(scaled * (unit + i * i))
    for row in range(top, bottom + 1):
        v = np.int64(2 * (row - y) + 1)
        b, c = float(scaled * i * j * v), float(scaled * (unit + j * j) * v * v - limit)
        first[row], last[row] = 1, 0
        root = b * b - a * c
        middle = -b / a
        reach = math.sqrt(max(root, 0.0)) / a
        # Rounding may be off by a pixel, which the rule in whole numbers sets right.
        begin = max(np.int64(math.ceil((middle - reach - 1.0) / 2.0)) - 1, -np.int64(x))
        end = min(np.int64(math.floor((middle + reach - 1.0) / 2.0)) + 1, np.int64(width - 1 - x))
        while begin <= end and not _inside(2 * begin + 1, v, i, j, unit, scaled, limit):
            begin += 1
        while begin <= end and not _inside(2 * end + 1, v, i, j, unit, scaled, limit):
            end -= 1
        if begin <= end:
            first[row], last[row] = x + begin, x + end
    return top, bottom


@compiled
def _inside(u: Whole, v: Whole, i: Whole, j: Whole, unit: Whole, scaled: Whole, limit: Whole) -> Any:
    """The rule of `tables`."""
    across = i * u + j * v
    return scaled * (unit * (u * u + v * v) + across * across) <= limit


@compiled
def _exact_rows(
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
