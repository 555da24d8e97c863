"""Image reconstruction of points by pull and push, on the CPU: the plain twin of `pull_push.comp`.

A cell is a row of 12 float32: nearest and farthest depth, infinite where nothing is; centre (x, y) and
radius of a disc, pixels of the picture; its normal in view space, y down, towards the eye; linear colour;
mean depth. Cells of a level lie row by row, from `start` on."""

from __future__ import annotations

from typing import Any

import numpy as np

from viewer.compiled import compiled, inlined

CELL = 12
STEEPEST = np.float32(0.1)  # least cosine of a disc's tilt: 84 degrees
_EMPTY = np.float32(np.inf)


@inlined
def reaches(cell: Any, x: Any, y: Any) -> Any:
    """Whether the ellipse of a cell's disc, projected in parallel, holds a position in the picture."""
    right, down = x - cell[2], y - cell[3]
    away = (cell[5] * right + cell[6] * down) / max(cell[7], STEEPEST)
    return right * right + down * down + away * away <= cell[4] * cell[4]


@inlined
def place(point: Any, view: Any, cell: Any) -> Any:
    """Write the disc of a point (10,) to a cell; whether it is before the eye. view: (3, 5), rotation,
    translation, and in the last column the centre x and y of the picture, and the scale, negative for
    parallel rays."""
    across = view[0, 0] * point[0] + view[0, 1] * point[1] + view[0, 2] * point[2] + view[0, 3]
    up = view[1, 0] * point[0] + view[1, 1] * point[1] + view[1, 2] * point[2] + view[1, 3]
    depth = -(view[2, 0] * point[0] + view[2, 1] * point[1] + view[2, 2] * point[2] + view[2, 3])
    if depth <= 0:
        return False
    scale = view[2, 4] / depth if view[2, 4] > 0 else -view[2, 4]
    cell[0], cell[1], cell[11] = depth, depth + point[9], depth
    cell[2], cell[3], cell[4] = view[0, 4] + across * scale, view[1, 4] - up * scale, point[9] * scale
    for k in range(3):
        cell[5 + k] = view[k, 0] * point[3] + view[k, 1] * point[4] + view[k, 2] * point[5]
        cell[8 + k] = point[6 + k]
    cell[6] = -cell[6]
    facing = cell[7] * depth + cell[6] * up - cell[5] * across if view[2, 4] > 0 else cell[7]
    if facing < 0:
        for k in range(5, 8):
            cell[k] = -cell[k]
    return True


@compiled
def project(points: Any, view: Any, size: Any, cells: Any) -> None:
    """Write the nearest point of each pixel to the cells of the picture.

    points: (N, 10), positions, normals, linear colours and radii. view: see `place`. size: (width, height).
    """
    width, height = size
    for i in range(width * height):
        cells[i, 0] = _EMPTY
    disc = np.empty(CELL, np.float32)
    for i in range(len(points)):
        if not place(points[i], view, disc):
            continue
        x, y = disc[2], disc[3]
        if x >= 0 and y >= 0 and x < width and y < height:
            cell = cells[int(y) * width + int(x)]
            if disc[0] < cell[0]:
                cell[:] = disc


@inlined
def middle(at: Any, edge: Any) -> Any:
    """The middle of a cell along an axis, pixels of the picture."""
    return (np.float32(at) + np.float32(0.5)) * edge


@inlined
def _finish(sums: Any, total: Any, cell: Any) -> None:
    """Means of a cell, from sums of weighted ones."""
    for k in range(2, CELL):
        cell[k] = sums[k] / total
    length = np.sqrt(cell[5] * cell[5] + cell[6] * cell[6] + cell[7] * cell[7])
    if length > 0:
        for k in range(5, 8):
            cell[k] /= length


@compiled
def pull(cells: Any, fine: Any, fine_size: Any, start: Any, size: Any, edge: Any) -> None:
    """Average cells of a level into the next. fine, start: where both levels begin. edge: of the cells of
    the coarser one, pixels."""
    sums = np.empty(CELL, np.float32)
    for y in range(size[1]):
        for x in range(size[0]):
            middle_x, middle_y = middle(x, edge), middle(y, edge)
            near = far = _EMPTY
            out = cells[start + y * size[0] + x]
            for k in range(4):
                column, row = 2 * x + k % 2, 2 * y + k // 2
                if column < fine_size[0] and row < fine_size[1]:
                    cell = cells[fine + row * fine_size[0] + column]
                    if cell[0] < near and reaches(cell, middle_x, middle_y):
                        near, far = cell[0], cell[1]
            out[0] = near
            if near == _EMPTY:
                continue
            sums[:] = 0
            total, farthest = np.float32(0), far
            for k in range(4):
                column, row = 2 * x + k % 2, 2 * y + k // 2
                if column < fine_size[0] and row < fine_size[1]:
                    cell = cells[fine + row * fine_size[0] + column]
                    if cell[0] <= far and reaches(cell, middle_x, middle_y):
                        for j in range(2, CELL):
                            sums[j] += cell[j]
                        farthest = max(farthest, cell[1])
                        total += np.float32(1)
            out[1] = farthest
            _finish(sums, total, out)


@compiled
def push(cells: Any, start: Any, size: Any, coarse: Any, coarse_size: Any, edge: Any) -> None:
    """Fill the cells of a level that are empty, or behind those around them in the coarser one, from there.
    start, coarse: where both levels begin. edge: of the cells of the finer one, pixels."""
    sums = np.empty(CELL, np.float32)
    for y in range(size[1]):
        for x in range(size[0]):
            middle_x, middle_y = middle(x, edge), middle(y, edge)
            left, top = (x + 1) // 2 - 1, (y + 1) // 2 - 1
            near = far = _EMPTY
            for k in range(4):
                column, row = left + k % 2, top + k // 2
                if column >= 0 and row >= 0 and column < coarse_size[0] and row < coarse_size[1]:
                    cell = cells[coarse + row * coarse_size[0] + column]
                    if cell[0] < near and reaches(cell, middle_x, middle_y):
                        near, far = cell[0], cell[1]
            out = cells[start + y * size[0] + x]
            if near == _EMPTY or out[0] <= far:
                continue
            sums[:] = 0
            total, farthest = np.float32(0), far
            for k in range(4):
                column, row = left + k % 2, top + k // 2
                if column >= 0 and row >= 0 and column < coarse_size[0] and row < coarse_size[1]:
                    cell = cells[coarse + row * coarse_size[0] + column]
                    if cell[0] <= far and reaches(cell, middle_x, middle_y):
                        weight = np.float32(0.75) if k % 2 == x % 2 ^ 1 else np.float32(0.25)
                        weight *= np.float32(0.75) if k // 2 == y % 2 ^ 1 else np.float32(0.25)
                        for j in range(2, CELL):
                            sums[j] += weight * cell[j]
                        farthest = max(farthest, cell[1])
                        total += weight
            out[0], out[1] = near, farthest
            _finish(sums, total, out)
