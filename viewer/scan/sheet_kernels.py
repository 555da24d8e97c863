"""The inner loops of telling the two sides of a thin sheet apart, compiled by numba; see `fine_sides`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from .plane_kernels import fit_plane

_TERMS = 6  # of a quadric
_LEAST = 4  # points of a sheet
_ROUNDS = 4  # in which points move from sheet to sheet
_NO_MORE = 1e-6  # of the length of a term, what earlier ones leave of it at least
_FLAT = 1e-9  # of the squared distance to the farthest neighbour, the mean square below which one sheet fits
_FEWEST, _PLANE_OF = 6, 12  # points on one side that a plane goes through
_BETTER = 0.1  # of the variance about the former plane, what a plane through one side leaves at most
_LINE = 0.02  # of the squared widths of points, the ratio below which they lie in a line


@compiled
def _tangents(normal: NDArray[np.float64], u: NDArray[np.float64], v: NDArray[np.float64]) -> None:
    """Two unit vectors, (3,), across a normal, (3,), and each other."""
    least = 0
    for axis in range(1, 3):
        if abs(normal[axis]) < abs(normal[least]):
            least = axis
    one, other = (least + 1) % 3, (least + 2) % 3
    length = np.sqrt(normal[one] ** 2 + normal[other] ** 2)
    u[least], u[one], u[other] = 0.0, -normal[other] / length, normal[one] / length
    for axis in range(3):
        after, last = (axis + 1) % 3, (axis + 2) % 3
        v[axis] = normal[after] * u[last] - normal[last] * u[after]


@compiled
def _split(off: NDArray[np.float64], side: NDArray[np.float64]) -> None:
    """Fill the sides, (K,), 1 and -1, of offsets (K,), so that their means lie as far apart as can be."""
    order, count = np.argsort(off), len(off)
    total, below, best, cut = off.sum(), 0.0, -1.0, _LEAST
    for n in range(1, count - _LEAST + 1):
        below += off[order[n - 1]]
        if n < _LEAST:
            continue
        apart = below / n - (total - below) / (count - n)
        if apart * apart * n * (count - n) > best:
            best, cut = apart * apart * n * (count - n), n
    for n in range(count):
        side[order[n]] = -1.0 if n < cut else 1.0


@compiled
def _orthogonal(terms: NDArray[np.float64], kept: NDArray[np.bool_]) -> None:
    """Make terms, (C, K), of K points orthogonal to each other, of length 1; kept, (C,), tells those that say
    more than the ones before."""
    for term in range(len(terms)):
        before = np.sqrt((terms[term] * terms[term]).sum())
        for _ in range(2):  # the second time for what rounding left
            _without(terms[:term], kept, terms[term])
        length = np.sqrt((terms[term] * terms[term]).sum())
        kept[term] = length > _NO_MORE * before
        if kept[term]:
            terms[term] /= length


@compiled
def _without(terms: NDArray[np.float64], kept: NDArray[np.bool_], values: NDArray[np.float64]) -> None:
    """Take away from values, (K,), what orthogonal terms, (C, K), fit of them."""
    for term in range(len(terms)):
        if kept[term]:
            share = 0.0
            for k in range(len(values)):
                share += terms[term, k] * values[k]
            for k in range(len(values)):
                values[k] -= share * terms[term, k]


@compiled
def split_in_sheets(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    near: NDArray[np.int32],
    rows: tuple[int, int],
    explained: NDArray[np.float64],
    sides: NDArray[np.int8],
) -> None:
    """Fit two parallel sheets to the neighbours of points: quadrics that differ by a distance.

    points, normals: (N, 3). near: (N, K), K above 8. rows: first and last + 1 of the points. Gets explained,
    (N,), the share of the variance around one quadric that two explain, and sides, (N, K), 1 or -1, the sheet
    of each neighbour.
    """
    count = near.shape[1]
    u, v, offset = np.empty(3), np.empty(3), np.empty(3)
    terms, kept = np.empty((_TERMS, count)), np.empty(_TERMS, np.bool_)
    one, off, side, across = np.empty(count), np.empty(count), np.empty(count), np.empty(count)
    for i in range(rows[0], rows[1]):
        _tangents(normals[i], u, v)
        farthest = points[near[i, count - 1]] - points[i]
        scale = 1.0 / np.sqrt((farthest * farthest).sum())
        for k in range(count):
            x, y, one[k] = 0.0, 0.0, 0.0
            for axis in range(3):
                offset[axis] = (points[near[i, k], axis] - points[i, axis]) * scale
                x += offset[axis] * u[axis]
                y += offset[axis] * v[axis]
                one[k] += offset[axis] * normals[i, axis]
            terms[0, k], terms[1, k], terms[2, k] = 1.0, x, y
            terms[3, k], terms[4, k], terms[5, k] = x * x, x * y, y * y
        _orthogonal(terms, kept)
        _without(terms, kept, one)
        off[:] = one
        for _ in range(_ROUNDS):
            _split(off, side)
            across[:] = side
            _without(terms, kept, across)
            squared = (across * across).sum()
            apart = (across * one).sum() / squared if squared > _FLAT else 0.0
            for k in range(count):
                off[k] = one[k] + apart * (side[k] - across[k])
            if apart <= 0.0:
                break
        around_one = (one * one).sum()
        around_two = around_one - apart * apart * squared
        of_each = (count - _TERMS) / (count - _TERMS - 1)
        explained[i] = 0.0 if around_one <= _FLAT * count else 1.0 - of_each * around_two / around_one
        for k in range(count):
            sides[i, k] = np.int8(side[k])


@compiled
def count_votes(
    near: NDArray[np.int32],
    trust: NDArray[np.float64],
    sides: NDArray[np.int8],
    links: NDArray[np.int32],
    votes: NDArray[np.float64],
    trusted: NDArray[np.float64],
) -> None:
    """Ask the fits of all points around two linked ones whether these lie on one sheet.

    near, sides: (N, K). trust: (N,), in the fit of each point, 0 to 1. links: (L, 2). Gets votes, (L,), from
    -1, on two sheets, to 1, on one, and trusted, (L,), the mean trust.
    """
    count = near.shape[1]
    for n in range(len(links)):
        one, other = links[n, 0], links[n, 1]
        both, total, weight = 0, 0.0, 0.0
        for k in range(count):
            fit, at_one, at_other = near[one, k], -1, -1
            for m in range(count):
                if near[fit, m] == one:
                    at_one = m
                if near[fit, m] == other:
                    at_other = m
            if at_one >= 0 and at_other >= 0:
                both += 1
                weight += trust[fit]
                total += trust[fit] * sides[fit, at_one] * sides[fit, at_other]
        votes[n] = total / weight if weight > 0.0 else 0.0
        trusted[n] = weight / both if both else 0.0


@compiled
def fit_one_side(
    points: NDArray[np.float64],
    normals: NDArray[np.float32],
    near: NDArray[np.int32],
    rows: tuple[int, int],
    fitted: NDArray[np.float32],
) -> None:
    """Fit planes anew where neighbours lie on both sides of something thin: through those of the same side.

    points, normals: (N, 3), normals that agree as far as possible. near: (N, K), each point and its nearest
    others. rows: first and last + 1 of the points. Gets fitted, (N, 3), the normals of planes that lie much
    nearer to these points.
    """
    sums, a, v = np.empty(9), np.empty((3, 3)), np.empty((3, 3))
    normal, widths = np.empty(3, np.float32), np.empty(3)
    for i in range(rows[0], rows[1]):
        sums[:] = 0.0
        total, height, squared, is_mixed = 0, 0.0, 0.0, False
        for k in range(near.shape[1]):
            other, cosine, off = near[i, k], 0.0, 0.0
            for axis in range(3):
                cosine += normals[i, axis] * normals[other, axis]
                off += normals[i, axis] * (points[other, axis] - points[i, axis])
            is_mixed |= cosine < 0.0
            if cosine < 0.0 or total == _PLANE_OF:
                continue
            total += 1
            height += off
            squared += off * off
            for axis in range(3):
                step = points[other, axis] - points[i, axis]
                sums[axis] += step
                sums[3 + axis] += step * step
                sums[6 + axis] += step * (points[other, (axis + 1) % 3] - points[i, (axis + 1) % 3])
        if not is_mixed or total < _FEWEST:
            continue
        fit_plane(sums, total, a, v, normal, widths)
        before = squared / total - (height / total) ** 2
        if widths[0] < _BETTER * before and widths[1] > _LINE * widths[2]:
            away = 0.0
            for axis in range(3):
                away += normal[axis] * normals[i, axis]
            for axis in range(3):
                fitted[i, axis] = -normal[axis] if away < 0.0 else normal[axis]
