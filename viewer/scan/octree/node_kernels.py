"""The inner loops that make nodes of sorted points, compiled by numba.

`levels` (N,) says for each point, in the order of the codes, the first level at which it is in another node
than the point before, 0 for the first point and 22 where there is none; `ends` (N,) the level of the leaf
that it lies in. Arrays over nodes are level after level; `starts` (depth + 1,) says where each level begins.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled
from ..points import NOTHING
from .octree import DEEPEST

_BLOCK = 4096  # points that are fetched and then worked on
_NONE = np.uint32(NOTHING)
_FIXED = float(1 << 30)  # steps of a unit normal: sums of whole numbers do not depend on their order
_CANCELLED = 1e-6 * _FIXED  # length of a mean normal that is rounding alone
_8, _16, _24, _BYTE = np.uint32(8), np.uint32(16), np.uint32(24), np.uint32(255)
_SLACK = np.float32(1e-6)  # that cones are opened by, for rounding


@compiled
def fill_masks(
    codes: NDArray[np.uint64],
    levels: NDArray[np.uint8],
    ends: NDArray[np.uint8],
    starts: NDArray[np.int64],
    masks: NDArray[np.uint8],
) -> None:
    """The masks of all nodes, level after level.

    starts: (depth + 1,), where each level begins. masks: (nodes,), zeros before.
    """
    node = starts - 1
    for i in range(len(codes)):
        for level in range(levels[i], ends[i] + 1):
            node[level] += 1
            if level:
                child = codes[i] >> np.uint64(3 * (DEEPEST - level)) & np.uint64(7)
                masks[node[level - 1]] |= np.uint8(1) << np.uint8(child)


@compiled
def gather_colors(colors: NDArray[np.uint32], rows: NDArray[np.uint32], gathered: NDArray[np.uint32]) -> None:
    """The colours (N,), four bytes each, of some rows (M,)."""
    for i in range(len(rows)):
        gathered[i] = colors[rows[i]]


@compiled
def gather_units(normals: NDArray[np.float32], rows: NDArray[np.uint32], units: NDArray[np.float32]) -> None:
    """The normals (N, 3) of some rows (M,), of length 1; 0 where there is none or it is not finite."""
    for start in range(0, len(rows), _BLOCK):
        end = min(start + _BLOCK, len(rows))
        for i in range(start, end):  # nothing else, so that many are on their way from memory at a time
            row = rows[i]
            units[i, 0], units[i, 1], units[i, 2] = normals[row, 0], normals[row, 1], normals[row, 2]
        for i in range(start, end):
            x, y, z = np.float64(units[i, 0]), np.float64(units[i, 1]), np.float64(units[i, 2])
            squared = x * x + y * y + z * z
            some = 0 < squared < math.inf
            scale = 1 / math.sqrt(squared) if some else 0.0
            units[i, 0] = x * scale if some else 0.0
            units[i, 1] = y * scale if some else 0.0
            units[i, 2] = z * scale if some else 0.0


# The walks below go over the points once. When the next point is not below some nodes any more, these are
# written, the deepest first. `held` are sums over what is below a node and came before; the sums of the last
# child wander up, and where nothing is held, as mostly, a node shows what its only child shows.


@compiled
def lowest_rows(
    levels: NDArray[np.uint8],
    ends: NDArray[np.uint8],
    rows: NDArray[np.uint32],
    starts: NDArray[np.int64],
    node_rows: NDArray[np.uint32],
) -> None:
    """The lowest row (nodes,) below each node."""
    held, node = np.full(len(starts), _NONE), starts.copy()
    for i in range(len(rows)):
        lowest, leaf = rows[i], ends[i]
        stay = levels[i + 1] if i + 1 < len(rows) else 0
        for level in range(leaf, stay - 1, -1):
            lowest = min(lowest, held[level])
            held[level] = _NONE
            node_rows[node[level]] = lowest
            node[level] += 1
        above = min(stay - 1, leaf) if stay else 0
        held[above] = min(held[above], lowest)


@compiled
def mean_colors(
    levels: NDArray[np.uint8],
    ends: NDArray[np.uint8],
    colors: NDArray[np.uint32],
    starts: NDArray[np.int64],
    light: NDArray[np.int64],
    encoded: NDArray[np.uint32],
    node_colors: NDArray[np.uint32],
) -> None:
    """Mean colours (nodes,) of colours (N,), four bytes each: of their light, and of alpha.

    light: (256,), of each byte. encoded: the byte of each 16th of a step of light.
    """
    held, node = np.zeros((len(starts), 5), np.int64), starts.copy()
    for i in range(len(colors)):
        mean, leaf = colors[i], ends[i]
        a, b, c, d = mean & _BYTE, mean >> _8 & _BYTE, mean >> _16 & _BYTE, mean >> _24
        sum_a, sum_b, sum_c, sum_d, points = light[a], light[b], light[c], int(d), 1
        stay = levels[i + 1] if i + 1 < len(colors) else 0
        for level in range(leaf, stay - 1, -1):
            if held[level, 4]:
                sum_a, sum_b = sum_a + held[level, 0], sum_b + held[level, 1]
                sum_c, sum_d = sum_c + held[level, 2], sum_d + held[level, 3]
                points += held[level, 4]
                for k in range(5):
                    held[level, k] = 0
                # A quarter is less than what is missing to the next whole number, and more than rounding.
                half, share = 0.5 * points + 0.25, 1.0 / points
                mean = (
                    encoded[int((16 * sum_a + half) * share)]
                    | encoded[int((16 * sum_b + half) * share)] << _8
                    | encoded[int((16 * sum_c + half) * share)] << _16
                    | np.uint32(int((sum_d + half) * share)) << _24
                )
            node_colors[node[level]] = mean
            node[level] += 1
        above = min(stay - 1, leaf) if stay else 0
        held[above, 0] += sum_a
        held[above, 1] += sum_b
        held[above, 2] += sum_c
        held[above, 3] += sum_d
        held[above, 4] += points


@compiled
def mean_normals(
    levels: NDArray[np.uint8],
    ends: NDArray[np.uint8],
    units: NDArray[np.float32],
    starts: NDArray[np.int64],
    node_normals: NDArray[np.float32],
) -> None:
    """Mean directions (nodes, 3) of unit normals (N, 3); 0 where these cancel."""
    held, node = np.zeros((len(starts), 4), np.int64), starts.copy()
    for i in range(len(units)):
        x, y, z, leaf = units[i, 0], units[i, 1], units[i, 2], ends[i]
        sum_x, sum_y, sum_z, points = int(x * _FIXED), int(y * _FIXED), int(z * _FIXED), 1
        stay = levels[i + 1] if i + 1 < len(units) else 0
        for level in range(leaf, stay - 1, -1):
            if held[level, 3] or level == leaf:  # also of one point, as of copies of it
                sum_x, sum_y = sum_x + held[level, 0], sum_y + held[level, 1]
                sum_z, points = sum_z + held[level, 2], points + held[level, 3]
                for k in range(4):
                    held[level, k] = 0
                squared = float(sum_x) * sum_x + float(sum_y) * sum_y + float(sum_z) * sum_z
                length = math.sqrt(squared)
                scale = 1 / length if length > _CANCELLED * points else 0.0
                x, y, z = np.float32(sum_x * scale), np.float32(sum_y * scale), np.float32(sum_z * scale)
            at = node[level]
            node_normals[at, 0], node_normals[at, 1], node_normals[at, 2] = x, y, z
            node[level] = at + 1
        above = min(stay - 1, leaf) if stay else 0
        held[above, 0] += sum_x
        held[above, 1] += sum_y
        held[above, 2] += sum_z
        held[above, 3] += points


@compiled
def open_cones(
    levels: NDArray[np.uint8],
    ends: NDArray[np.uint8],
    units: NDArray[np.float32],
    starts: NDArray[np.int64],
    normals: NDArray[np.float32],
    cones: NDArray[np.float32],
) -> None:
    """Cosines of the cones (nodes,) about the normals (nodes, 3) that hold the units (N, 3) below.

    -1 where the node, or a point below, has no normal.
    """
    depth = len(starts)
    x, y, z = np.zeros(depth, np.float32), np.zeros(depth, np.float32), np.zeros(depth, np.float32)
    least, node = np.zeros(depth, np.float32), starts.copy()
    for i in range(len(levels)):
        leaf = ends[i]
        for level in range(levels[i], leaf + 1):
            at = node[level]
            x[level], y[level], z[level] = normals[at, 0], normals[at, 1], normals[at, 2]
            least[level] = 1 if x[level] != 0 or y[level] != 0 or z[level] != 0 else -1
        unit_x, unit_y, unit_z = units[i, 0], units[i, 1], units[i, 2]
        if unit_x == 0 and unit_y == 0 and unit_z == 0:
            for level in range(leaf + 1):
                least[level] = -1
        for level in range(leaf + 1):
            cosine = unit_x * x[level] + unit_y * y[level] + unit_z * z[level]
            least[level] = cosine if cosine < least[level] else least[level]
        stay = levels[i + 1] if i + 1 < len(levels) else 0
        for level in range(leaf, stay - 1, -1):
            cones[node[level]] = max(least[level] - _SLACK, np.float32(-1))
            node[level] += 1
