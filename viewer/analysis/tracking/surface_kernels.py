"""Loops over the surface that points of one moment show, compiled by numba; see `surface`.

Around a point the surface is a parabola over its tangent plane, and so is each channel of colour: fitted to
the nearest points by weighted least squares (moving least squares: Levin 1998), where and when it is first
needed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, inlined
from ...scan.plane_kernels import fit_plane

NEAREST = 20  # points that a parabola is fitted to
FEWEST = 9  # that tell one: half again as many as it has unknowns
_TERMS = 6  # of a parabola: 1, u, v, u^2, uv, v^2
_SOFT = 1e-3  # of the weights' sum: holds curvature where points leave it open
_RINGS = 3  # times that the reach is doubled where points are few
_MOST = 512  # points that are looked at for one fit
COPIES = 1e-6  # spacings: points that are nearer to each other are copies
OWN_SPACING = 0.396  # of the reach of 20 points in a circle

Float = NDArray[np.float64]


class Cells(NamedTuple):
    """The points of one moment in a grid of cells, and what has been fitted around them so far.

    points: (N, 3) relative to an origin, scan units. colors: (N, C), perhaps of no channel. normals: (N, 3)
    that tell the side, or none, (0, 3). low: (3,) the grid's corner. cell: the edge of a cell, scan units.
    size: (3,) cells along each axis. starts: (cells + 1,) in order, (N,), rows by cell. spacing: between
    neighbours, scan units. state: (N,), 0: not fitted, 1: fitted, -1: no surface. frames: (N, 3, 3), two
    tangents and the normal, of either side. parabolas: (N, 1 + C, 6), of the height over the tangent plane
    and of the colours. reaches: (N,), how far the points are that it is fitted to.
    """

    points: Float
    colors: NDArray[np.float32]
    normals: NDArray[np.float32]
    low: Float
    cell: float
    size: NDArray[np.int64]
    starts: NDArray[np.int32]
    order: NDArray[np.int32]
    spacing: float
    state: NDArray[np.int8]
    frames: NDArray[np.float32]
    parabolas: NDArray[np.float32]
    reaches: NDArray[np.float32]


@compiled
def grid_cells(
    points: Float,
    low: Float,
    cell: float,
    size: NDArray[np.int64],
    starts: NDArray[np.int32],
    order: NDArray[np.int32],
) -> None:
    """Sort points (N, 3) into a grid of cells: order (N,), rows by cell; starts (cells + 1,) in it.

    low: (3,) the grid's corner. size: (3,) cells along each axis. What lies outside goes to the nearest
    cell.
    """
    count = len(points)
    cells = np.empty(count, np.int32)
    starts[:] = 0
    for i in range(count):
        number = 0
        for axis in range(3):
            along = int((points[i, axis] - low[axis]) / cell)
            number = number * size[axis] + min(max(along, 0), size[axis] - 1)
        cells[i] = number
        starts[number + 1] += 1
    for number in range(len(starts) - 1):
        starts[number + 1] += starts[number]
    filled = starts[:-1].copy()
    for i in range(count):
        order[filled[cells[i]]] = i
        filled[cells[i]] += 1


@compiled
def rows_within(
    held: Cells,
    x: float,
    y: float,
    z: float,
    reach: float,
    rows: NDArray[np.int32],
    squared: Float,
) -> int:
    """How many points lie within reach of a position, as many as `rows` has room for; gets rows and squared
    distances."""
    points, low, cell, size = held.points, held.low, held.cell, held.size
    starts, order = held.starts, held.order
    found, most = 0, len(rows)
    x0, x1 = max(int((x - reach - low[0]) / cell), 0), min(int((x + reach - low[0]) / cell), size[0] - 1)
    y0, y1 = max(int((y - reach - low[1]) / cell), 0), min(int((y + reach - low[1]) / cell), size[1] - 1)
    z0, z1 = max(int((z - reach - low[2]) / cell), 0), min(int((z + reach - low[2]) / cell), size[2] - 1)
    within = reach * reach
    for i in range(x0, x1 + 1):
        for j in range(y0, y1 + 1):
            base = (i * size[1] + j) * size[2]
            for at in range(starts[base + z0], starts[base + z1 + 1]) if z1 >= z0 else range(0):
                row = order[at]
                dx, dy, dz = points[row, 0] - x, points[row, 1] - y, points[row, 2] - z
                d = dx * dx + dy * dy + dz * dz
                if d <= within and found < most:
                    rows[found], squared[found] = row, d
                    found += 1
    return found


@compiled
def nearest_within(
    held: Cells,
    x: float,
    y: float,
    z: float,
    reach: float,
) -> int:
    """The row of the point nearest to a position, or -1 where none is within reach."""
    points, low, cell, size = held.points, held.low, held.cell, held.size
    starts, order = held.starts, held.order
    best, least = -1, reach * reach
    near = 0.5 * cell
    while True:
        near = min(near, reach)
        x0, x1 = max(int((x - near - low[0]) / cell), 0), min(int((x + near - low[0]) / cell), size[0] - 1)
        y0, y1 = max(int((y - near - low[1]) / cell), 0), min(int((y + near - low[1]) / cell), size[1] - 1)
        z0, z1 = max(int((z - near - low[2]) / cell), 0), min(int((z + near - low[2]) / cell), size[2] - 1)
        for i in range(x0, x1 + 1):
            for j in range(y0, y1 + 1):
                base = (i * size[1] + j) * size[2]
                for at in range(starts[base + z0], starts[base + z1 + 1]) if z1 >= z0 else range(0):
                    row = order[at]
                    dx, dy, dz = points[row, 0] - x, points[row, 1] - y, points[row, 2] - z
                    d = dx * dx + dy * dy + dz * dz
                    if d < least or (d == least and (best < 0 or row < best)):
                        best, least = row, d
        if near >= reach or (best >= 0 and least <= near * near):
            return best
        near *= 2.0


@compiled
def _keep_nearest(rows: NDArray[np.int32], squared: Float, found: int, kept: int) -> int:
    """Put the nearest `kept` of the points found first, in no order (quickselect)."""
    if found <= kept:
        return found
    first, last = 0, found - 1
    while first < last:
        pivot = squared[(first + last) // 2]
        i, j = first, last
        while i <= j:
            while squared[i] < pivot:
                i += 1
            while squared[j] > pivot:
                j -= 1
            if i <= j:
                squared[i], squared[j] = squared[j], squared[i]
                rows[i], rows[j] = rows[j], rows[i]
                i += 1
                j -= 1
        if kept - 1 <= j:
            last = j
        elif kept - 1 >= i:
            first = i
        else:
            break
    return kept


@compiled
def fit_at(
    held: Cells,
    row: int,
) -> bool:
    """Whether there is a surface around a point, which is fitted unless it has been."""
    points, colors, spacing, state = held.points, held.colors, held.spacing, held.state
    frames, parabolas, reaches = held.frames, held.parabolas, held.reaches
    if state[row] != 0:
        return state[row] > 0
    rows, squared = np.empty(_MOST, np.int32), np.empty(_MOST)
    px, py, pz = points[row, 0], points[row, 1], points[row, 2]
    reach, found = 2.6 * spacing, 0
    for _ in range(_RINGS):
        found = rows_within(held, px, py, pz, reach, rows, squared)
        if found >= NEAREST:
            break
        reach *= 2.0
    if found == _MOST:  # far denser than elsewhere: those within less
        while found == _MOST and reach > COPIES * spacing:
            reach *= 0.5
            found = rows_within(held, px, py, pz, reach, rows, squared)
    found = _keep_nearest(rows, squared, found, NEAREST)
    if found < FEWEST:
        state[row] = -1
        return False
    farthest = 0.0
    for i in range(found):
        farthest = max(farthest, squared[i])
    if not farthest > 0.0:
        state[row] = -1
        return False
    reach = np.sqrt(farthest)

    sums, a, v = np.zeros(9), np.empty((3, 3)), np.empty((3, 3))
    normal, widths = np.empty(3, np.float32), np.empty(3)
    total = 0.0
    for i in range(found):
        weight = (1.0 - 0.8 * squared[i] / farthest) ** 2
        x, y, z = points[rows[i], 0] - px, points[rows[i], 1] - py, points[rows[i], 2] - pz
        total += weight
        sums[0] += weight * x
        sums[1] += weight * y
        sums[2] += weight * z
        sums[3] += weight * x * x
        sums[4] += weight * y * y
        sums[5] += weight * z * z
        sums[6] += weight * x * y
        sums[7] += weight * y * z
        sums[8] += weight * z * x
    fit_plane(sums, total, a, v, normal, widths)
    nx, ny, nz = float(normal[0]), float(normal[1]), float(normal[2])
    if len(held.normals):
        side = held.normals[row]
        if nx * side[0] + ny * side[1] + nz * side[2] < 0.0:
            nx, ny, nz = -nx, -ny, -nz
    # Tangents by the axis that the normal is farthest from.
    if abs(nx) <= abs(ny) and abs(nx) <= abs(nz):
        tx, ty, tz = 0.0, nz, -ny
    elif abs(ny) <= abs(nz):
        tx, ty, tz = -nz, 0.0, nx
    else:
        tx, ty, tz = ny, -nx, 0.0
    length = np.sqrt(tx * tx + ty * ty + tz * tz)
    tx, ty, tz = tx / length, ty / length, tz / length
    bx, by, bz = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx

    channels = colors.shape[1]
    system, sides = np.zeros((_TERMS, _TERMS)), np.zeros((_TERMS, 1 + channels))
    terms = np.empty(_TERMS)
    for i in range(found):
        weight = (1.0 - 0.8 * squared[i] / farthest) ** 2
        x, y, z = points[rows[i], 0] - px, points[rows[i], 1] - py, points[rows[i], 2] - pz
        u, w = (tx * x + ty * y + tz * z) / reach, (bx * x + by * y + bz * z) / reach
        height = nx * x + ny * y + nz * z
        terms[0], terms[1], terms[2] = 1.0, u, w
        terms[3], terms[4], terms[5] = u * u, u * w, w * w
        for p in range(_TERMS):
            for q in range(p + 1):
                system[p, q] += weight * terms[p] * terms[q]
            sides[p, 0] += weight * terms[p] * height
            for c in range(channels):
                sides[p, 1 + c] += weight * terms[p] * colors[rows[i], c]
    for p in range(1, _TERMS):
        system[p, p] += (_SOFT if p > 2 else 1e-9) * total
    if not solve_in_place(system, sides):
        state[row] = -1
        return False
    for c in range(1 + channels):
        for p in range(_TERMS):
            parabolas[row, c, p] = sides[p, c] / (1.0 if p == 0 else reach if p < 3 else reach * reach)
    frames[row, 0, 0], frames[row, 0, 1], frames[row, 0, 2] = tx, ty, tz
    frames[row, 1, 0], frames[row, 1, 1], frames[row, 1, 2] = bx, by, bz
    frames[row, 2, 0], frames[row, 2, 1], frames[row, 2, 2] = nx, ny, nz
    reaches[row] = reach
    state[row] = 1
    return True


@inlined
def in_frame(frame: NDArray[np.float32], position: Float, middle: Float) -> tuple[float, float, float]:
    """The coordinates of a position (3,) about a middle (3,), in a frame (3, 3) of tangents and normal."""
    f = frame
    x, y, z = position[0] - middle[0], position[1] - middle[1], position[2] - middle[2]
    return (
        f[0, 0] * x + f[0, 1] * y + f[0, 2] * z,
        f[1, 0] * x + f[1, 1] * y + f[1, 2] * z,
        f[2, 0] * x + f[2, 1] * y + f[2, 2] * z,
    )


@inlined
def parabola_height(parabola: NDArray[np.float32], u: float, v: float) -> float:
    """The value of a parabola (6,) at (u, v) of its tangent plane."""
    p = parabola
    return p[0] + (p[1] + p[3] * u + p[4] * v) * u + (p[2] + p[5] * v) * v


@inlined
def parabola_slopes(parabola: NDArray[np.float32], u: float, v: float) -> tuple[float, float]:
    """How a parabola (6,) grows along u and along v at (u, v)."""
    p = parabola
    return p[1] + 2.0 * p[3] * u + p[4] * v, p[2] + p[4] * u + 2.0 * p[5] * v


@compiled
def solve_in_place(system: Float, sides: Float) -> bool:
    """Solve a symmetric system (P, P) for sides (P, S), which get the solutions; the lower half is read and
    gets the factor of Cholesky. False where it has no single solution."""
    count = len(system)
    for p in range(count):
        for q in range(p + 1):
            value = system[p, q]
            for k in range(q):
                value -= system[p, k] * system[q, k]
            if p == q:
                if not value > 0.0:
                    return False
                system[p, p] = np.sqrt(value)
            else:
                system[p, q] = value / system[q, q]
    for s in range(sides.shape[1]):
        for p in range(count):
            value = sides[p, s]
            for k in range(p):
                value -= system[p, k] * sides[k, s]
            sides[p, s] = value / system[p, p]
        for p in range(count - 1, -1, -1):
            value = sides[p, s]
            for k in range(p + 1, count):
                value -= system[k, p] * sides[k, s]
            sides[p, s] = value / system[p, p]
    return True
