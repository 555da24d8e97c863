"""Loops of a body's motion, compiled by numba; see `body`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled
from .surface_kernels import Cells, fit_at, nearest_within, parabola_height

_FACING = 0.5  # cosine of the angle between the normals of a node and of the surface that it is drawn to
_ENOUGH = 1e-10  # of the squared residual of a solution, at which it is one

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
def normals_at(held: Cells, rows: NDArray[np.int64]) -> Float:
    """The unit normals of the surface at rows (N,), (N, 3), of either side; 0 where there is none."""
    normals = np.zeros((len(rows), 3))
    for n in range(len(rows)):
        if fit_at(held, rows[n]):
            normals[n] = held.frames[rows[n], 2]
    return normals


@compiled
def pull_across(
    held: Cells, positions: Float, turns: Float, normals: Float, reach: float, pulls: Float, wanted: Float
) -> None:
    """The targets (N, 3) that the surface gives to nodes at positions: across it, and not along it.

    turns: (N, 3, 3). normals: (N, 3) of the nodes at rest. reach: how far a node may be off, scan units.
    pulls: (N, 3, 3) gets the weights, 0 where no surface near a node faces as it does. wanted: (N, 3) gets
    the positions.
    """
    for n in range(len(positions)):
        pulls[n] = 0.0
        wanted[n] = positions[n]
        row = nearest_within(held, positions[n, 0], positions[n, 1], positions[n, 2], reach)
        if row < 0:
            continue
        if not fit_at(held, row):  # stray points: each is all that there is
            wanted[n] = held.points[row]
            for k in range(3):
                pulls[n, k, k] = 1.0
            continue
        f, p = held.frames[row], held.parabolas[row]
        u, v, w, cosine = 0.0, 0.0, 0.0, 0.0
        for k in range(3):
            away = positions[n, k] - held.points[row, k]
            u += f[0, k] * away
            v += f[1, k] * away
            w += f[2, k] * away
            for q in range(3):
                cosine += f[2, k] * turns[n, k, q] * normals[n, q]
        if u * u + v * v > held.reaches[row] ** 2 or abs(cosine) < _FACING:
            continue
        off = w - parabola_height(p[0], u, v)
        weight = max(0.0, 1.0 - (off / reach) ** 2) ** 2
        for k in range(3):
            wanted[n, k] -= off * f[2, k]
            for q in range(3):
                pulls[n, k, q] = weight * f[2, k] * f[2, q]


class BodyEdges(NamedTuple):
    """Edges between the N nodes of a body: those of node n are the rows firsts[n] to firsts[n + 1]."""

    firsts: NDArray[np.int64]  # (N + 1,)
    others: NDArray[np.int64]  # (E,), the nodes that they lead to
    edges: Float  # (E, 3), from node to node at rest
    holds: Float  # (E,), the share of the body's stiffness that each edge keeps


class NodeTargets(NamedTuple):
    """Positions that are wanted of the nodes of a body."""

    pulls: Float  # (N, 3, 3), weights
    wanted: Float  # (N, 3)


@compiled
def settle_nodes(
    body: BodyEdges, turns: Float, stiffness: float, targets: NodeTargets, most: int, positions: Float
) -> None:
    """Move nodes, as they are turned, to where their edges and targets hold them best.

    turns: (N, 3, 3). stiffness: of the body. positions: (N, 3), near them, get the solution after at most so
    many steps of conjugate gradients (Hestenes and Stiefel 1952).
    """
    firsts, others, edges, holds = body
    pulls, wanted = targets
    count = len(positions)
    left, ahead, image = np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 3))
    before, wished = 0.0, 1e-300
    for n in range(count):
        for k in range(3):
            right, held = 0.0, 0.0
            for q in range(3):
                right += pulls[n, k, q] * wanted[n, q]
                held += pulls[n, k, q] * positions[n, q]
            for e in range(firsts[n], firsts[n + 1]):
                m = others[e]
                held += stiffness * holds[e] * (positions[n, k] - positions[m, k])
                for q in range(3):
                    right -= 0.5 * stiffness * holds[e] * (turns[n, k, q] + turns[m, k, q]) * edges[e, q]
            left[n, k] = ahead[n, k] = right - held
            before += left[n, k] ** 2
            wished += right**2
    for _ in range(most):
        if before <= _ENOUGH * wished:
            break
        power = 0.0
        for n in range(count):
            for k in range(3):
                held = 0.0
                for q in range(3):
                    held += pulls[n, k, q] * ahead[n, q]
                for e in range(firsts[n], firsts[n + 1]):
                    held += stiffness * holds[e] * (ahead[n, k] - ahead[others[e], k])
                image[n, k] = held
                power += held * ahead[n, k]
        if not power > 0.0:
            break
        step, after = before / power, 0.0
        for n in range(count):
            for k in range(3):
                positions[n, k] += step * ahead[n, k]
                left[n, k] -= step * image[n, k]
                after += left[n, k] ** 2
        for n in range(count):
            for k in range(3):
                ahead[n, k] = left[n, k] + after / before * ahead[n, k]
        before = after


@compiled
def edge_holds(
    at: Float, turns: Float, rest: Float, ones: NDArray[np.int64], others: NDArray[np.int64], bound: float,
    holds: Float,
) -> None:  # fmt: skip
    """Fill how much of its stiffness each edge (E,) between nodes keeps (Geman and McClure 1985).

    at, rest: (N, 3), positions now and at rest. turns: (N, 3, 3). bound: of its length that an edge is off,
    at which it keeps half.
    """
    for e in range(len(ones)):
        n, m = ones[e], others[e]
        x, y, z = rest[m, 0] - rest[n, 0], rest[m, 1] - rest[n, 1], rest[m, 2] - rest[n, 2]
        off = 0.0
        for k in range(3):
            a, b = turns[n, k], turns[m, k]
            way = 0.5 * ((a[0] + b[0]) * x + (a[1] + b[1]) * y + (a[2] + b[2]) * z)
            off += (at[m, k] - at[n, k] - way) ** 2
        holds[e] = 1.0 / (1.0 + off / (bound * bound * (x * x + y * y + z * z) + 1e-300))


@compiled
def edge_products(body: BodyEdges, positions: Float, products: Float) -> None:
    """Fill the sums (N, 3, 3) of the products of each node's edges, now and at rest. positions: (N, 3)."""
    firsts, others, edges, holds = body
    products[:] = 0.0
    for n in range(len(positions)):
        for e in range(firsts[n], firsts[n + 1]):
            for k in range(3):
                for q in range(3):
                    products[n, k, q] += holds[e] * (positions[others[e], k] - positions[n, k]) * edges[e, q]
