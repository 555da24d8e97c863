"""Loops of a body's motion, compiled by numba; see `body`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scan.octree.compiled import compiled

_FAR = 4.0  # deviations from which on a target does not belong to a node
_ENOUGH = 1e-10  # of the squared residual of a solution, at which it is one
_MOST = 300  # steps to a solution

Float = NDArray[np.float64]


@compiled
def spread_out(points: Float, chosen: NDArray[np.int64]) -> float:
    """Choose points (P, 3), each the farthest from those before: the rows (n,) are filled, n at most P.

    Gives how far the next one would be.
    """
    squared = np.full(len(points), np.inf)
    row, farthest = 0, 0.0
    for n in range(len(chosen)):
        chosen[n] = row
        x, y, z = points[row, 0], points[row, 1], points[row, 2]
        farthest = -1.0
        for i in range(len(points)):
            away = (points[i, 0] - x) ** 2 + (points[i, 1] - y) ** 2 + (points[i, 2] - z) ** 2
            squared[i] = min(squared[i], away)
            if squared[i] > farthest:
                farthest, row = squared[i], i
    return np.sqrt(max(farthest, 0.0))


@compiled
def share_out(
    places: Float, targets: Float, deviation: float, stray: float, weights: Float, wanted: Float
) -> None:
    """Share targets (T, 3) out among nodes at places (N, 3), by a Gaussian of a deviation, scan units.

    stray: of a share that belongs to no node. weights: (N,) gets what each has in all; wanted: (N, 3) the
    mean of that.
    """
    count = len(places)
    weights[:], wanted[:] = 0.0, 0.0
    shares, rows = np.empty(count), np.empty(count, np.int64)
    for t in range(len(targets)):
        x, y, z = targets[t, 0], targets[t, 1], targets[t, 2]
        found, total = 0, stray
        for n in range(count):
            squared = (places[n, 0] - x) ** 2 + (places[n, 1] - y) ** 2 + (places[n, 2] - z) ** 2
            if squared < (_FAR * deviation) ** 2:
                rows[found], shares[found] = n, np.exp(-0.5 * squared / deviation**2)
                total += shares[found]
                found += 1
        for i in range(found):
            n, share = rows[i], shares[i] / total
            weights[n] += share
            wanted[n, 0] += share * x
            wanted[n, 1] += share * y
            wanted[n, 2] += share * z
    for n in range(count):
        if weights[n] > 0.0:
            for k in range(3):
                wanted[n, k] /= weights[n]


@compiled
def settle_nodes(
    firsts: NDArray[np.int64],
    others: NDArray[np.int64],
    edges: Float,
    turns: Float,
    stiffness: float,
    weights: Float,
    wanted: Float,
    places: Float,
    products: Float,
) -> None:
    """Move nodes, as they are turned, to where they are held best by those beside them and by what is wanted.

    firsts: (N + 1,), others: (E,), edges: (E, 3): beside node n at rest, in the rows firsts[n] to firsts[n +
    1], are others, at edges from it. turns: (N, 3, 3). stiffness: of the body; weights: (N,) of places that
    are wanted, (N, 3). places: (N, 3), near them, get the solution (conjugate gradients, Hestenes and Stiefel
    1952); products: (N, 3, 3), the sums of the edges' products now and at rest.
    """
    count = len(places)
    left, ahead, image = np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 3))
    before, wished = 0.0, 1e-300
    for n in range(count):
        for k in range(3):
            right = weights[n] * wanted[n, k]
            held = weights[n] * places[n, k]
            for e in range(firsts[n], firsts[n + 1]):
                m = others[e]
                held += stiffness * (places[n, k] - places[m, k])
                for q in range(3):
                    right -= 0.5 * stiffness * (turns[n, k, q] + turns[m, k, q]) * edges[e, q]
            left[n, k] = ahead[n, k] = right - held
            before += left[n, k] ** 2
            wished += right**2
    for _ in range(_MOST):
        if before <= _ENOUGH * wished:
            break
        power = 0.0
        for n in range(count):
            for k in range(3):
                held = weights[n] * ahead[n, k]
                for e in range(firsts[n], firsts[n + 1]):
                    held += stiffness * (ahead[n, k] - ahead[others[e], k])
                image[n, k] = held
                power += held * ahead[n, k]
        if not power > 0.0:
            break
        step, after = before / power, 0.0
        for n in range(count):
            for k in range(3):
                places[n, k] += step * ahead[n, k]
                left[n, k] -= step * image[n, k]
                after += left[n, k] ** 2
        for n in range(count):
            for k in range(3):
                ahead[n, k] = left[n, k] + after / before * ahead[n, k]
        before = after
    products[:] = 0.0
    for n in range(count):
        for e in range(firsts[n], firsts[n + 1]):
            for k in range(3):
                for q in range(3):
                    products[n, k, q] += (places[others[e], k] - places[n, k]) * edges[e, q]
