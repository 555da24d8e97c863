"""The inner loops of fitting planes to the neighbours of points, compiled by numba; see `planes`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled

_SWEEPS = 12  # of Jacobi's rotations, at most; four or five are enough as a rule
_SETTLED = 1e-30  # the square of what lies off the diagonal, of a matrix of trace 1
_FLATTEST = 0.1  # of a squared width, what noise leaves of it at least
# Few neighbours tell no surface where their normals disagree by so much more than those of more; nor where
# they lie in lines, their squared widths in a ratio below this, and residuals grow faster than a curved
# surface's.
_DISAGREEING, _MORE, _ROUND = 0.15, 3, 0.35
_LINE = 0.03  # ratio of squared widths, below which neighbours lie in a line, bent or not: it has no plane
_ROUNDS = 3  # in which a reference is found, as noise is better known from more neighbours


@compiled
def _rotate(a: NDArray[np.float64], v: NDArray[np.float64], p: int, q: int) -> None:
    """Make a[p, q] of a symmetric matrix (3, 3) zero, and turn the vectors (3, 3), by column, along."""
    if a[p, q] == 0.0:
        return
    theta = (a[q, q] - a[p, p]) / (2.0 * a[p, q])
    t = 1.0 / (abs(theta) + np.sqrt(theta * theta + 1.0))
    if theta < 0.0:
        t = -t
    c = 1.0 / np.sqrt(t * t + 1.0)
    s = t * c
    r = 3 - p - q
    rp, rq = a[r, p], a[r, q]
    a[p, p] -= t * a[p, q]
    a[q, q] += t * a[p, q]
    a[p, q] = a[q, p] = 0.0
    a[r, p] = a[p, r] = c * rp - s * rq
    a[r, q] = a[q, r] = s * rp + c * rq
    for i in range(3):
        ip, iq = v[i, p], v[i, q]
        v[i, p] = c * ip - s * iq
        v[i, q] = s * ip + c * iq


@compiled
def fit_plane(
    sums: NDArray[np.float64],
    count: float,
    a: NDArray[np.float64],
    v: NDArray[np.float64],
    normal: NDArray[np.float32],
    widths: NDArray[np.float64],
) -> None:
    """The normal (3,) and squared widths (3,), ascending, of `count` points; +z where all are in one place.

    sums: (9,), of x y z, xx yy zz, and xy yz zx.
    """
    x, y, z = sums[0] / count, sums[1] / count, sums[2] / count
    a[0, 0], a[1, 1], a[2, 2] = (
        sums[3] / count - x * x,
        sums[4] / count - y * y,
        sums[5] / count - z * z,
    )
    a[0, 1] = a[1, 0] = sums[6] / count - x * y
    a[1, 2] = a[2, 1] = sums[7] / count - y * z
    a[0, 2] = a[2, 0] = sums[8] / count - z * x
    trace = a[0, 0] + a[1, 1] + a[2, 2]
    for i in range(3):
        for j in range(3):
            v[i, j] = 1.0 if i == j else 0.0
    if not trace > 0.0:
        normal[0], normal[1], normal[2] = 0.0, 0.0, 1.0
        widths[:] = 0.0
        return
    for i in range(3):
        for j in range(3):
            a[i, j] /= trace
    for _ in range(_SWEEPS):
        if a[0, 1] * a[0, 1] + a[1, 2] * a[1, 2] + a[0, 2] * a[0, 2] < _SETTLED:
            break
        _rotate(a, v, 0, 1)
        _rotate(a, v, 1, 2)
        _rotate(a, v, 0, 2)
    least, most = 2, 0  # of equal ones, the last is the least: +z
    for i in (1, 0):
        if a[i, i] < a[least, least]:
            least = i
    for i in (1, 2):
        if a[i, i] > a[most, most]:
            most = i
    if most == least:
        most = (least + 1) % 3
    widths[0] = max(a[least, least], 0.0) * trace
    widths[1] = max(a[3 - least - most, 3 - least - most], 0.0) * trace
    widths[2] = a[most, most] * trace
    for i in range(3):
        normal[i] = v[i, least]


@compiled
def fit_nested(
    points: NDArray[np.float64],
    rows: NDArray[np.integer],
    near: NDArray[np.int32],
    counts: NDArray[np.int64],
    normals: NDArray[np.float32],
    widths: NDArray[np.float64],
) -> None:
    """Planes through the nearest counts[0], counts[1], ... neighbours of points.

    points: (N, 3). rows: (M,), which of them. near: (M, K), rows of their neighbours, nearest first. counts:
    (J,), ascending, up to K. Gets normals, (M, J, 3) unit length, and the squared widths of the neighbours
    along the principal axes, (M, J, 3), ascending.
    """
    sums, a, v = np.empty(9), np.empty((3, 3)), np.empty((3, 3))
    for m in range(len(rows)):
        sums[:] = 0.0
        px, py, pz = points[rows[m], 0], points[rows[m], 1], points[rows[m], 2]
        j = 0
        for i in range(counts[-1]):
            other = near[m, i]
            x, y, z = points[other, 0] - px, points[other, 1] - py, points[other, 2] - pz
            sums[0] += x
            sums[1] += y
            sums[2] += z
            sums[3] += x * x
            sums[4] += y * y
            sums[5] += z * z
            sums[6] += x * y
            sums[7] += y * z
            sums[8] += z * x
            if i + 1 == counts[j]:
                fit_plane(sums, i + 1, a, v, normals[m, j], widths[m, j])
                j += 1


@compiled
def _noise(widths: NDArray[np.float64], counts: NDArray[np.int64], fewer: int, more: int) -> float:
    """The variance of the distances to a surface, from those to two planes: those of a curved surface grow
    with the square of the number of neighbours, and noise stays."""
    low, high = float(counts[fewer]) ** 2, float(counts[more]) ** 2
    of_low = widths[fewer, 0] * counts[fewer] / (counts[fewer] - 3)
    of_high = widths[more, 0] * counts[more] / (counts[more] - 3)
    return (high * of_low - low * of_high) / (high - low)


@compiled
def _turned(noise: float, widths: NDArray[np.float64], count: int) -> float:
    """Mean square of the angle by which noise turns a normal, of small angles."""
    if noise <= 0.0:
        return 0.0
    total = 0.0
    for axis in (1, 2):
        left = max(widths[axis] - noise, _FLATTEST * widths[axis])
        if left == 0.0:
            return 1.0
        total += widths[axis] / (left * left)
    return min(noise * total / count, 1.0)


@compiled
def _median(values: NDArray[np.float64], count: int) -> float:
    """The median of the first values, which are put in order."""
    for i in range(1, count):
        value, j = values[i], i
        while j > 0 and values[j - 1] > value:
            values[j] = values[j - 1]
            j -= 1
        values[j] = value
    return 0.5 * (values[(count - 1) // 2] + values[count // 2])


@compiled
def _agreement(normals: NDArray[np.float32], around: NDArray[np.int64], total: int, j: int) -> float:
    """The mean square of the cosines between the normals of counts[j] of some places."""
    xx = yy = zz = xy = yz = zx = 0.0
    for i in range(total):
        x, y, z = normals[around[i], j]
        xx += x * x
        yy += y * y
        zz += z * z
        xy += x * y
        yz += y * z
        zx += z * x
    return (xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + zx * zx)) / (total * total)


class NestedFits(NamedTuple):
    """Planes through the nearest counts[0], counts[1], ... neighbours of P points, see `fit_nested`."""

    counts: NDArray[np.int64]  # (J,), ascending, J > 2
    normals: NDArray[np.float32]  # (P, J, 3)
    widths: NDArray[np.float64]  # (P, J, 3), squared, ascending


class TurnLimits(NamedTuple):
    """Mean squares of the angle by which noise may turn a normal."""

    quiet: float  # of the fewest neighbours that tell a surface: below it, these are taken
    settled: float  # of the reference that others are compared with


@compiled
def _ratio(widths: NDArray[np.float64]) -> float:
    """The ratio of the squared widths (3,) along a plane, 0 to 1: small where points lie in a line."""
    return widths[1] / widths[2] if widths[2] > 0.0 else 0.0


@compiled
def _fewest(fits: NestedFits, around: NDArray[np.int64], scratch: NDArray[np.float64]) -> tuple[int, bool]:
    """The first of the numbers of neighbours that tells a surface at some points, which are judged together;
    and whether these neighbours still lie in a line, so that more are needed.

    around: (K,), the point itself first. scratch: at least (K,).
    """
    counts, normals, widths = fits
    last, total = len(counts) - 1, len(around)
    for i in range(total):
        scratch[i] = _noise(widths[around[i]], counts, 0, 2)
    least_round = _ROUND if _median(scratch, total) < 0.0 else _LINE
    agreeing = _agreement(normals, around, total, min(last, _MORE)) - _DISAGREEING
    for first in range(last - 1):
        for i in range(total):
            scratch[i] = _ratio(widths[around[i], first])
        own = scratch[0]
        ratio = _median(scratch, total)
        in_line = ratio < _LINE or own < _LINE
        if not in_line and ratio >= least_round and _agreement(normals, around, total, first) >= agreeing:
            break
    return first, in_line


@compiled
def _settle_reference(
    fits: NestedFits, around: NDArray[np.int64], first: int, limits: TurnLimits,
    turned: NDArray[np.float64], scratch: NDArray[np.float64],
) -> int:  # fmt: skip
    """The least number of neighbours from `first` on that noise hardly turns, see `choose`.

    turned: (J,) gets by how much noise turns the normals of each number; only of the first where that is
    quiet.
    """
    counts, _, widths = fits
    last, total, reference = len(counts) - 1, len(around), first
    for _ in range(_ROUNDS):
        fewer = min(reference, last - 2)
        for i in range(total):
            scratch[i] = _noise(widths[around[i]], counts, fewer, fewer + 2)
        noise, before = _median(scratch, total), reference
        for j in range(first, last + 1):
            turned[j] = 0.0
            for i in range(total):
                turned[j] += _turned(noise, widths[around[i], j], counts[j]) / total
            if turned[first] < limits.quiet:
                break
        while turned[first] >= limits.quiet and reference < last and turned[reference] >= limits.settled:
            reference += 1
        if reference == before:
            break
    return reference


@compiled
def choose(
    rows: NDArray[np.integer], near: NDArray[np.int32], places: NDArray[np.int32], fits: NestedFits,
    limits: TurnLimits, chosen: NDArray[np.float32], further: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Fill the normals (M, 3) of as many neighbours as give the least error around each point, and whether
    more than counts[-1] may give less, (M,).

    The error of a number of neighbours is what noise leaves of it, and how far it turns normals from those of
    the least number that noise turns by less than `settled`; less what noise tells of that turn (Mallows'
    C_p). All are means over the points around.

    rows: (M,). near: (M, K), rows of the points around, of which those with a place count. places: (N,), by
    row, in the fits; or -1.
    """
    counts, normals, _ = fits
    last = len(counts) - 1
    around, scratch = np.empty(near.shape[1], np.int64), np.empty(near.shape[1])
    turned = np.empty(len(counts))
    for m in range(len(rows)):
        total = 0
        for i in range(near.shape[1]):
            place = places[near[m, i]]
            if place >= 0:
                around[total] = place
                total += 1
        together = around[:total]
        first, in_line = _fewest(fits, together, scratch)
        reference = _settle_reference(fits, together, first, limits, turned, scratch)
        is_quiet = turned[first] < limits.quiet
        best, least = reference, np.inf
        for j in range(reference, first + 1 if is_quiet else last + 1):
            away = 0.0
            for i in range(total):
                one, other = normals[around[i], j], normals[around[i], reference]
                cosine = one[0] * other[0] + one[1] * other[1] + one[2] * other[2]
                away += (1.0 - cosine * cosine) / total
            error = away + 2.0 * turned[j]
            if error < least:
                best, least = j, error
        chosen[m] = normals[places[rows[m]], best]
        further[m] = in_line or (not is_quiet and (reference > first or best >= last - 1))
