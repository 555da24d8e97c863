"""The inner loops that find mean positions and discs of nodes, compiled by numba.

Each goes over the nodes of one level; the children of consecutive nodes are consecutive. An offset is a
position within its node's cell, in 65536ths of its edge, the first of them from 0 to 1.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled
from .cube import Grid
from .octree import DEEPEST

_CHILDREN = np.bitwise_count(np.arange(256, dtype=np.uint8)).astype(np.int64)
_ONLY = np.array([mask.bit_length() - 1 if mask.bit_count() == 1 else -1 for mask in range(256)])
STEPS = 65536  # of a cell's edge
_ENOUGH = 4.0  # leaves that tell how far apart they are
_TOGETHER = (  # as in octree.py
    (np.uint64(2), np.uint64(0x10C30C30C30C30C3)),
    (np.uint64(4), np.uint64(0x100F00F00F00F00F)),
    (np.uint64(8), np.uint64(0x1F0000FF0000FF)),
    (np.uint64(16), np.uint64(0x1F00000000FFFF)),
    (np.uint64(32), np.uint64(0x1FFFFF)),
)


@compiled
def _coordinate(code: np.uint64) -> float:
    """The coordinate that the bits 0, 3, 6... of a Morton code hold."""
    bits = code & np.uint64(0x1249249249249249)
    for shift, mask in _TOGETHER:
        bits = (bits | bits >> shift) & mask
    return float(bits)


class CodeOrder(NamedTuple):
    """N points in the order of their codes, see `node_kernels`."""

    rows: NDArray[np.uint32]  # (N,)
    codes: NDArray[np.uint64]  # (N,)
    levels: NDArray[np.uint8]  # (N,)
    ends: NDArray[np.uint8]  # (N,)
    starts: NDArray[np.int64]  # (depth + 1,)


@compiled
def leaf_offsets(
    positions: NDArray[np.float32], order: CodeOrder, grid: Grid, offsets: NDArray[np.uint16]
) -> None:
    """The mean positions (nodes, 3) of the points in each leaf; those of other nodes stay as they are.

    positions: (N, 3) of the cloud.
    """
    rows, codes, levels, ends, starts = order
    steps_per_unit, low, cells_per_step = grid
    node = starts - 1
    sums, points = np.zeros(3, np.int64), 0
    for i in range(len(rows)):
        end = ends[i]
        for level in range(levels[i], end + 1):
            node[level] += 1
        cell = 1.0 / (1 << (DEEPEST - end))
        row, code = rows[i], codes[i] >> np.uint64(3 * (DEEPEST - end))
        for axis in range(3):
            place = (positions[row, axis] * steps_per_unit - low[axis]) * cells_per_step * cell
            within = (place - _coordinate(code >> np.uint64(axis))) * STEPS
            sums[axis] += int(min(max(within, 0.0), STEPS - 1.0))
        points += 1
        if i + 1 == len(rows) or levels[i + 1] <= end:
            at = node[end]
            for axis in range(3):
                offsets[at, axis] = (2 * sums[axis] + points) // (2 * points)
                sums[axis] = 0
            points = 0


@compiled
def gather_leaves(
    masks: NDArray[np.uint8],
    below_offsets: NDArray[np.uint16],
    below_leaves: NDArray[np.float32],
    below_spread: NDArray[np.float32],
    offsets: NDArray[np.uint16],
    leaves: NDArray[np.float32],
    spread: NDArray[np.float32],
) -> None:
    """The mean position, the number and the spread of the leaves below each inner node (n,).

    spread: the sum of squared distances from the mean, in squared edges of the node.
    """
    child = 0
    for i in range(len(masks)):
        mask = masks[i]
        if not mask:
            continue
        only = _ONLY[mask]
        if only >= 0:  # as most above the leaves of a scan
            offsets[i, 0] = (STEPS * (only & 1) + below_offsets[child, 0]) >> 1
            offsets[i, 1] = (STEPS * (only >> 1 & 1) + below_offsets[child, 1]) >> 1
            offsets[i, 2] = (STEPS * (only >> 2) + below_offsets[child, 2]) >> 1
            leaves[i], spread[i] = below_leaves[child], below_spread[child] / 4
            child += 1
            continue
        first, total, x, y, z = child, 0.0, 0.0, 0.0, 0.0
        for octant in range(8):
            if mask >> octant & 1:
                weight = below_leaves[child]
                total += weight
                x += weight * ((octant & 1) + below_offsets[child, 0] / STEPS)
                y += weight * ((octant >> 1 & 1) + below_offsets[child, 1] / STEPS)
                z += weight * ((octant >> 2) + below_offsets[child, 2] / STEPS)
                child += 1
        x, y, z = x / total, y / total, z / total
        squares, child = 0.0, first
        for octant in range(8):
            if mask >> octant & 1:
                dx = (octant & 1) + below_offsets[child, 0] / STEPS - x
                dy = (octant >> 1 & 1) + below_offsets[child, 1] / STEPS - y
                dz = (octant >> 2) + below_offsets[child, 2] / STEPS - z
                squares += below_spread[child] + below_leaves[child] * (dx * dx + dy * dy + dz * dz)
                child += 1
        half = STEPS / 2
        offsets[i, 0] = min(int(x * half), STEPS - 1)
        offsets[i, 1] = min(int(y * half), STEPS - 1)
        offsets[i, 2] = min(int(z * half), STEPS - 1)
        leaves[i], spread[i] = total, squares / 4


@compiled
def _spacing(leaves: float, spread: float) -> float:
    """The distance between neighbours among leaves that lie evenly in a disc, from their spread.

    The mean squared distance from the centre of a disc of radius R is R^2 / 2, and its area pi R^2.
    """
    return math.sqrt(2 * math.pi * spread / (leaves * (leaves - 1)))


@compiled
def take_root(leaves: NDArray[np.float32], spread: NDArray[np.float32]) -> None:
    """Turn leaves and spread of the root, (0 or 1,), into its spacing, as `spread_spacing` does for others; a
    single leaf tells none: 0."""
    for i in range(len(leaves)):
        found = _spacing(leaves[i], spread[i]) if leaves[i] > 1 else 0.0
        leaves[i], spread[i] = found, found


@compiled
def spread_spacing(
    masks: NDArray[np.uint8],
    own: NDArray[np.float32],
    spacing: NDArray[np.float32],
    leaves: NDArray[np.float32],
    spread: NDArray[np.float32],
) -> None:
    """Turn leaves and spread of the level below (m,) into `own` and `spacing`, given those of a level (n,).

    Both are in edges of their nodes. own: the spacing of the leaves below a node, where these are enough.
    spacing: the harmonic mean of that and its parent's, which is less by chance; else that of the parent.
    """
    child = 0
    for i in range(len(masks)):
        above, inherited = 2 * own[i], 2 * spacing[i]
        for _ in range(_CHILDREN[masks[i]]):
            if leaves[child] >= _ENOUGH:
                found = _spacing(leaves[child], spread[child])
                leaves[child], spread[child] = found, 2 * found * above / (found + above)
            else:
                leaves[child], spread[child] = above, inherited
            child += 1


@compiled
def cover(
    masks: NDArray[np.uint8],
    below_offsets: NDArray[np.uint16],
    below_radii: NDArray[np.float32],
    offsets: NDArray[np.uint16],
    edge: float,
    radii: NDArray[np.float32],
) -> None:
    """The radii of a level's inner nodes, scan units, as far as the discs of their children reach.

    edge: of a node.
    """
    child, step = 0, edge / (2 * STEPS)
    for i in range(len(masks)):
        mask = masks[i]
        if not mask:
            continue
        if _ONLY[mask] >= 0:
            radii[i] = below_radii[child] + step
            child += 1
            continue
        reach = 0.0
        for octant in range(8):
            if mask >> octant & 1:
                dx = (octant & 1) * STEPS + below_offsets[child, 0] - 2.0 * offsets[i, 0]
                dy = (octant >> 1 & 1) * STEPS + below_offsets[child, 1] - 2.0 * offsets[i, 1]
                dz = (octant >> 2) * STEPS + below_offsets[child, 2] - 2.0 * offsets[i, 2]
                reach = max(reach, math.sqrt(dx * dx + dy * dy + dz * dz) * step + below_radii[child])
                child += 1
        radii[i] = reach
