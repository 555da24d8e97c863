"""The inner loops of finding on which side of a surface normals point, compiled by numba; see `sides`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled


@compiled
def link(
    points: NDArray[np.float64],
    normals: NDArray[np.float32],
    near: NDArray[np.int32],
    links: NDArray[np.int32],
    weights: NDArray[np.float32],
) -> int:
    """Link points to their neighbours, each pair once; returns how many links there are.

    points, normals: (N, 3). near: (N, K), each point and its neighbours. Gets links (L, 2) and weights (L,),
    L at least N (K - 1): from 1, where normals certainly point to the same side, to -1, to opposite ones.

    Normals on a circle through both points mirror each other (Xie et al. 2003), so that links across sharp
    edges and between the two sides of a thin sheet tell the same as others. Where neighbours lie along a
    normal they tell nothing: that may be noise, a second layer, or the other side.
    """
    found = 0
    for i in range(len(near)):
        for k in range(near.shape[1]):
            j = near[i, k]
            if j == i:
                continue
            if j < i:
                is_linked = False  # by the other one
                for n in range(near.shape[1]):
                    is_linked |= near[j, n] == i
                if is_linked:
                    continue
            along, along_other, cosine, squared = 0.0, 0.0, 0.0, 0.0
            for axis in range(3):
                step = points[j, axis] - points[i, axis]
                along += step * normals[i, axis]
                along_other += step * normals[j, axis]
                cosine += normals[i, axis] * normals[j, axis]
                squared += step * step
            one, other = along * along / squared, along_other * along_other / squared
            links[found, 0], links[found, 1] = i, j
            mirrored = cosine - 2.0 * along * along_other / squared
            weights[found] = mirrored * (1.0 - min(one, 1.0)) * (1.0 - min(other, 1.0))
            found += 1
    return found


@compiled
def join(
    links: NDArray[np.int32],
    weights: NDArray[np.float32],
    order: NDArray[np.integer],
    most: int,
    size: NDArray[np.int32],
    roots: NDArray[np.int32],
    signs: NDArray[np.int8],
) -> None:
    """Join things to patches of size `most` at most, along links in an order, and make them agree.

    links: (L, 2), weights: (L,). size: (N,), of each thing; it is written over. Gets roots (N,), the patch of
    each thing, numbered from 0 up, and signs (N,), 1 or -1, that make the things of a patch agree.
    """
    for i in range(len(roots)):
        roots[i], signs[i] = i, 1
    for n in order:
        a, b, sign = links[n, 0], links[n, 1], np.int8(1 if weights[n] > 0 else -1)
        while roots[a] != a:
            sign *= signs[a]
            a = roots[a]
        while roots[b] != b:
            sign *= signs[b]
            b = roots[b]
        if a == b or size[a] + size[b] > most:
            continue
        if size[a] < size[b]:
            a, b = b, a
        roots[b], signs[b] = a, sign
        size[a] += size[b]
    numbers = size  # of patches, at their roots
    found = 0
    for i in range(len(roots)):
        if roots[i] == i:
            numbers[i] = found
            found += 1
    # The trees are left as they are till all are read.
    patches, agreeing = np.empty(len(roots), np.int32), np.empty(len(roots), np.int8)
    for i in range(len(roots)):
        at, sign = np.int32(i), np.int8(1)
        while roots[at] != at:
            sign *= signs[at]
            at = roots[at]
        patches[i], agreeing[i] = numbers[at], sign
    roots[:], signs[:] = patches, agreeing


@compiled
def settle(
    links: NDArray[np.int32],
    weights: NDArray[np.floating],
    seen: NDArray[np.floating],
    turns: int,
    signs: NDArray[np.int8],
) -> None:
    """Turn things round, one by one, that disagree with the sum of their links and of `seen`, as long as
    there are any, in `turns` rounds at most.

    links: (L, 2), weights: (L,), seen: (N,), signs: (N,), which change.
    """
    first = np.zeros(len(signs) + 2, np.int64)
    for n in range(len(links)):
        first[links[n, 0] + 2] += 1
        first[links[n, 1] + 2] += 1
    for i in range(1, len(first)):
        first[i] += first[i - 1]
    other, weight = np.empty(2 * len(links), np.int32), np.empty(2 * len(links), np.float32)
    for n in range(len(links)):
        for end in range(2):
            at = first[links[n, end] + 1]
            other[at], weight[at] = links[n, 1 - end], weights[n]
            first[links[n, end] + 1] += 1
    for _ in range(turns):
        is_settled = True
        for i in range(len(signs)):
            total = seen[i]
            for n in range(first[i], first[i + 1]):
                total += weight[n] * signs[other[n]]
            if total * signs[i] < 0.0:
                signs[i] = -signs[i]
                is_settled = False
        if is_settled:
            break


@compiled
def see(
    x: NDArray[np.float32],
    y: NDArray[np.float32],
    depth: NDArray[np.float32],
    side: int,
    little: np.float32,
    front: NDArray[np.float32],
    back: NDArray[np.float32],
) -> None:
    """Fill how far points are seen from the front and from the back of a view, 0 to 1, both (N,).

    x, y, depth: (N,), in cells of a view of side x side; a point with more depth is nearer to the front.
    little: so far behind the first point of its cell a point is not seen.
    """
    nearest = np.full(side * side, -np.inf, np.float32)
    farthest = np.full(side * side, np.inf, np.float32)
    cell = np.empty(len(x), np.int64)
    none, half, last = np.float32(0), np.float32(side / 2), np.float32(side - 1)
    for i in range(len(x)):
        row, column = min(max(y[i] + half, none), last), min(max(x[i] + half, none), last)
        cell[i] = np.int64(row) * side + np.int64(column)
        nearest[cell[i]] = max(nearest[cell[i]], depth[i])
        farthest[cell[i]] = min(farthest[cell[i]], depth[i])
    for i in range(len(x)):
        front[i] = max(np.float32(1) - (nearest[cell[i]] - depth[i]) / little, none)
        back[i] = max(np.float32(1) - (depth[i] - farthest[cell[i]]) / little, none)
