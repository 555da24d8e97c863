"""The inner loops that read and write attributes of octrees, compiled by numba."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled


@compiled
def cells_of(normals: NDArray[np.float32], cells: NDArray[np.uint16]) -> None:
    """Cells of normals (n, 3) on the unfolded octahedron, see `coding.normal_bytes`: 256 times the first
    byte and the second."""
    for i in range(len(normals)):
        x, y, z = normals[i, 0], normals[i, 1], normals[i, 2]
        length = np.float32(np.float32(abs(x) + abs(y)) + abs(z))
        cells[i] = 0
        if length > 0:
            u, v = np.float32(x / length), np.float32(y / length)
            if z < 0:
                across, along = np.float32(np.float32(1) - abs(v)), np.float32(np.float32(1) - abs(u))
                u, v = -across if u < 0 else across, -along if v < 0 else along
            first, second = np.rint(np.float64(u) * 127), np.rint(np.float64(v) * 127)
            cells[i] = np.int64(first + 128) << 8 | np.int64(second + 128)


@compiled
def expect(
    above: NDArray[np.uint8],
    masks: NDArray[np.uint8],
    nodes: NDArray[np.int32],
    before: NDArray[np.uint8],
    expected: NDArray[np.uint8],
    stored: NDArray[np.int32],
) -> None:
    """Fill the bytes expected of a level, (n, k), and the nodes of which differences are stored.

    above: (m, k), the parents' bytes. masks: (m,), their children. nodes: (n,), the same octants in the tree
    before, -1 for none, or (0,): it tells nothing. before: (b, k), its bytes.
    """
    width = above.shape[1]
    known, child = 0, 0
    for parent in range(len(masks)):
        count = _children(masks[parent])
        for node in range(child, child + count):
            is_known = count > 1 and len(nodes) > 0 and nodes[node] >= 0
            known += is_known
            for i in range(width):
                expected[node, i] = before[nodes[node], i] if is_known else above[parent, i]
        child += count
    first, other, child = 0, known, 0
    for parent in range(len(masks)):
        count = _children(masks[parent])
        if count > 1:
            for node in range(child, child + count):
                if len(nodes) > 0 and nodes[node] >= 0:
                    stored[first] = node
                    first += 1
                else:
                    stored[other] = node
                    other += 1
        child += count


@compiled
def _children(mask: int) -> int:
    count = 0
    while mask:
        mask &= mask - 1
        count += 1
    return count


@compiled
def add(values: NDArray[np.uint8], rows: NDArray[np.int32], differences: NDArray[np.uint8]) -> None:
    """Add differences (k, r), modulo 256, to rows (r,) of values (n, k)."""
    for i in range(values.shape[1]):
        for j in range(len(rows)):
            values[rows[j], i] += differences[i, j]
