"""Loops over points that recur from frame to frame, compiled by numba; see `pattern`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled
from .surface_kernels import Cells, fit_at, nearest_within, rows_within

Float = NDArray[np.float64]

FREE = 3  # points that a map along the surface has as many unknowns as
_RINGS = 7, 13  # points, the nearest ones, that a map is fitted to before all are
_REFITS = 3  # of a map to all points of a pattern
_FIRST = 0.6  # local spacings that a point of the first ring may be off
_OFF = 0.45  # the same of later points
_HOLD = 0.3  # points that count as much as the map from which a fit begins
_ARM = 0.8  # local spacings from the first point to the one that tells the turn, at least
_STRETCH = 0.25  # of that way, that it may be stretched by
_TURN = 0.5  # cosine of the angle that a pattern may be turned by besides what is expected
_LEAST = 0.02  # local spacings: a smaller residual is taken for this one
_HOPELESS = 1.2  # mean of minus the logarithms of chances of the first rings, below which none follow
_OWN_SPACING = 0.396  # of the reach of 20 points in a circle
_GROWN = 0.3  # local spacings that a grown point may be off its prediction
_UNIQUE = 0.5  # of the way to the second nearest point
_TRIES = 3  # of each point, as more and more around it are matched
_FEWEST = 4  # of the points around a matched one, that have to be matched as well
_MOST = 256  # points that are looked at
_CANDIDATES = 1024  # places that a pattern is looked for at, at most


@compiled
def nearest_of(held: Cells, x: float, y: float, z: float, rows: NDArray[np.int32], squared: Float) -> int:
    """How many points nearest to a place are found, as many as `rows` has room for, the nearest first.

    squared gets their squared distances. Ties go to the lowest row.
    """
    found_rows, found_squared = np.empty(_MOST, np.int32), np.empty(_MOST)
    reach, found, kept = 0.6 * held.spacing, 0, 0
    for _ in range(8):
        found = rows_within(held, x, y, z, reach, found_rows, found_squared)
        if found >= len(rows):
            break
        reach *= 1.6
    while found == _MOST:
        reach *= 0.7
        found = rows_within(held, x, y, z, reach, found_rows, found_squared)
    for i in range(found):
        row, away = found_rows[i], found_squared[i]
        at = kept
        while at > 0 and (squared[at - 1] > away or (squared[at - 1] == away and rows[at - 1] > row)):
            at -= 1
        if at >= len(rows):
            continue
        kept = min(kept + 1, len(rows))
        for j in range(kept - 1, at, -1):
            rows[j], squared[j] = rows[j - 1], squared[j - 1]
        rows[at], squared[at] = row, away
    return kept


@compiled
def _apply(linear: Float, x: float, y: float, z: float, out: Float) -> None:
    for k in range(3):
        out[k] = linear[k, 0] * x + linear[k, 1] * y + linear[k, 2] * z


@compiled
def _normal_of(linear: Float, frame: Float, normal: Float) -> None:
    """Map the normal of a tangent frame (3, 3): the unit vector across the mapped tangents."""
    a, b = np.empty(3), np.empty(3)
    _apply(linear, frame[0, 0], frame[0, 1], frame[0, 2], a)
    _apply(linear, frame[1, 0], frame[1, 1], frame[1, 2], b)
    _across(a, b, normal)


@compiled
def _across(a: Float, b: Float, normal: Float) -> None:
    """The unit vector across two; 0 where they lie along each other."""
    normal[0] = a[1] * b[2] - a[2] * b[1]
    normal[1] = a[2] * b[0] - a[0] * b[2]
    normal[2] = a[0] * b[1] - a[1] * b[0]
    length = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    for k in range(3):
        normal[k] /= length if length > 0.0 else 1.0


@compiled
def _length(vector: Float) -> float:
    return np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)


@compiled
def _stand_up(linear: Float, frame: Float, there: NDArray[np.float32], upright: Float) -> bool:
    """Turn a map so that a patch's normal goes to that of another surface, of either side, by the shortest
    way; False where that is too far. frame, there: (3, 3), tangents and normal of both."""
    one, other, axis = np.empty(3), np.empty(3), np.empty(3)
    _normal_of(linear, frame, one)
    cosine = one[0] * there[2, 0] + one[1] * there[2, 1] + one[2] * there[2, 2]
    for k in range(3):
        other[k] = there[2, k] if cosine >= 0.0 else -there[2, k]
    if abs(cosine) < _TURN:
        return False
    axis[0] = one[1] * other[2] - one[2] * other[1]
    axis[1] = one[2] * other[0] - one[0] * other[2]
    axis[2] = one[0] * other[1] - one[1] * other[0]
    _turned(linear, axis, abs(cosine), upright)
    return True


@compiled
def _turn_to(linear: Float, arm: Float, wanted: Float, there: NDArray[np.float32]) -> bool:
    """Turn a map about a surface's normal, so that an arm points along one that is wanted; False where that
    is too far."""
    now, axis, out = np.empty(3), np.empty(3), np.empty((3, 3))
    _apply(linear, arm[0], arm[1], arm[2], now)
    u, v, p, q = 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        u += there[0, k] * now[k]
        v += there[1, k] * now[k]
        p += there[0, k] * wanted[k]
        q += there[1, k] * wanted[k]
    lengths = np.sqrt((u * u + v * v) * (p * p + q * q))
    if not lengths > 0.0:
        return False
    cosine, sine = (u * p + v * q) / lengths, (u * q - v * p) / lengths
    if cosine < _TURN:
        return False
    across = np.empty(3)
    across[0] = there[0, 1] * there[1, 2] - there[0, 2] * there[1, 1]
    across[1] = there[0, 2] * there[1, 0] - there[0, 0] * there[1, 2]
    across[2] = there[0, 0] * there[1, 1] - there[0, 1] * there[1, 0]
    for k in range(3):
        axis[k] = sine * across[k]
    _turned(linear, axis, cosine, out)
    linear[:] = out
    return True


@compiled
def _turned(linear: Float, axis: Float, cosine: float, out: Float) -> None:
    """A map turned further about an axis as long as the angle's sine (Rodrigues): out gets it."""
    for q in range(3):
        x, y, z = linear[0, q], linear[1, q], linear[2, q]
        along = (axis[0] * x + axis[1] * y + axis[2] * z) / (1.0 + cosine)
        out[0, q] = cosine * x + axis[1] * z - axis[2] * y + along * axis[0]
        out[1, q] = cosine * y + axis[2] * x - axis[0] * z + along * axis[1]
        out[2, q] = cosine * z + axis[0] * y - axis[1] * x + along * axis[2]


@compiled
def fit_map(
    offsets: Float, targets: Float, weights: Float, frame: Float, spacing: float, linear: Float, place: Float
) -> bool:
    """Fit the map of a surface's patch: affine along its tangents, with heights over them kept.

    offsets: (n, 3) from the patch's centre. targets: (n, 3). weights: (n,). frame: (3, 3), tangents and
    normal. linear: (3, 3), the map from which it begins, gets the one found; place: (3,) gets where the
    centre goes.
    """
    normal = np.empty(3)
    _normal_of(linear, frame, normal)
    s00, s01, s02, s11, s12, s22 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    sides = np.zeros((3, 3))
    for i in range(len(offsets)):
        weight = weights[i]
        if weight == 0.0:
            continue
        u, v, w = 0.0, 0.0, 0.0
        for k in range(3):
            u += frame[0, k] * offsets[i, k]
            v += frame[1, k] * offsets[i, k]
            w += frame[2, k] * offsets[i, k]
        s00 += weight
        s01 += weight * u
        s02 += weight * v
        s11 += weight * u * u
        s12 += weight * u * v
        s22 += weight * v * v
        for k in range(3):
            y = targets[i, k] - w * normal[k]
            sides[0, k] += weight * y
            sides[1, k] += weight * u * y
            sides[2, k] += weight * v * y
    hold = _HOLD * spacing * spacing * s00 / max(1.0, float(len(offsets)))
    s11 += hold
    s22 += hold
    for k in range(3):
        for axis in range(2):
            along = 0.0
            for q in range(3):
                along += linear[k, q] * frame[axis, q]
            sides[1 + axis, k] += hold * along
    det = s00 * (s11 * s22 - s12 * s12) - s01 * (s01 * s22 - s12 * s02) + s02 * (s01 * s12 - s11 * s02)
    if not det > 0.0:
        return False
    i00, i01, i02 = (
        (s11 * s22 - s12 * s12) / det,
        (s02 * s12 - s01 * s22) / det,
        (s01 * s12 - s02 * s11) / det,
    )
    i11, i12, i22 = (
        (s00 * s22 - s02 * s02) / det,
        (s01 * s02 - s00 * s12) / det,
        (s00 * s11 - s01 * s01) / det,
    )
    a, b = np.empty(3), np.empty(3)
    for k in range(3):
        place[k] = i00 * sides[0, k] + i01 * sides[1, k] + i02 * sides[2, k]
        a[k] = i01 * sides[0, k] + i11 * sides[1, k] + i12 * sides[2, k]
        b[k] = i02 * sides[0, k] + i12 * sides[1, k] + i22 * sides[2, k]
    _across(a, b, normal)
    for k in range(3):
        for q in range(3):
            linear[k, q] = a[k] * frame[0, q] + b[k] * frame[1, q] + normal[k] * frame[2, q]
    return True


@compiled
def log_chance(information: float, count: int) -> float:
    """The logarithm of the chance that unrelated points lie as near: minus the sum of logarithms of `count`
    chances is at least this (Fisher's method; Chernoff's bound on the Gamma distribution)."""
    if information <= count:
        return 0.0
    return -(information - count - count * np.log(information / count))


@compiled
def _pair(
    offsets: Float, held: Cells, linear: Float, place: Float, reach: float, count: int,
    targets: Float, weights: Float, rows: NDArray[np.int64],
) -> int:  # fmt: skip
    """Pair the first `count` points, mapped, each with the nearest point of a moment within reach, that no
    nearer one has; gives how many are."""
    there, squared = np.empty(3), np.empty(count)
    paired = 0
    for i in range(count):
        _apply(linear, offsets[i, 0], offsets[i, 1], offsets[i, 2], there)
        x, y, z = there[0] + place[0], there[1] + place[1], there[2] + place[2]
        row = nearest_within(held, x, y, z, reach)
        rows[i], weights[i] = row, 0.0
        if row < 0:
            continue
        squared[i] = (
            (held.points[row, 0] - x) ** 2 + (held.points[row, 1] - y) ** 2 + (held.points[row, 2] - z) ** 2
        )
        is_free = True
        for j in range(i):
            if rows[j] == row:
                if squared[j] <= squared[i]:
                    is_free = False
                else:
                    rows[j], weights[j] = -1, 0.0
                    paired -= 1
        if not is_free:
            rows[i] = -1
            continue
        paired += 1
        weights[i] = 1.0
        for k in range(3):
            targets[i, k] = held.points[row, k]
    return paired


@compiled
def _information(
    offsets: Float, frame: Float, area: float, linear: Float, place: Float, count: int,
    targets: Float, weights: Float, off: Float,
) -> float:  # fmt: skip
    """Minus the sum of logarithms of the chances of points at random to lie as near along the surface.

    area: of the surface, for each point. off: (n,) gets how far they are off along it, inf where unpaired.
    """
    normal, there = np.empty(3), np.empty(3)
    _normal_of(linear, frame, normal)
    total, least = 0.0, (_LEAST**2) * area
    for i in range(count):
        off[i] = np.inf
        if weights[i] == 0.0:
            continue
        _apply(linear, offsets[i, 0], offsets[i, 1], offsets[i, 2], there)
        across, squared = 0.0, 0.0
        for k in range(3):
            away = targets[i, k] - there[k] - place[k]
            across += away * normal[k]
            squared += away * away
        along = max(squared - across * across, least)
        off[i] = np.sqrt(along)
        total -= min(np.log(np.pi * along / area), 0.0)
    return total


@compiled
def _fit_from(
    offsets: Float, frame: Float, area: float, held: Cells, linear: Float, place: Float,
    targets: Float, weights: Float, rows: NDArray[np.int64], off: Float,
) -> float:  # fmt: skip
    """Fit the map of a pattern from a start, ring by ring; gives its information, 0 where it is hopeless."""
    count, spacing = len(offsets), np.sqrt(area)
    for ring in _RINGS:
        n = min(ring, count)
        reach = _FIRST if ring == _RINGS[0] else _OFF
        if _pair(offsets, held, linear, place, reach * spacing, n, targets, weights, rows) <= n // 2:
            return 0.0
        if not fit_map(offsets[:n], targets[:n], weights[:n], frame, spacing, linear, place):
            return 0.0
        if _information(offsets, frame, area, linear, place, n, targets, weights, off) < _HOPELESS * n:
            return 0.0
    for _ in range(_REFITS):
        _pair(offsets, held, linear, place, _OFF * spacing, count, targets, weights, rows)
        if not fit_map(offsets, targets, weights, frame, spacing, linear, place):
            return 0.0
    return _information(offsets, frame, area, linear, place, count, targets, weights, off)


@compiled
def fill_pattern(
    offsets: Float, held: Cells, linear: Float, place: Float, reach: float, rows: NDArray[np.int64]
) -> None:
    """Find the points of a pattern that are not known yet in another moment, where one alone is near.

    rows: (n,), -1 for those, gets them. reach: how far one may be. The others are as of `find_pattern`.
    """
    there = np.empty(3)
    nearest, squared = np.empty(2, np.int32), np.empty(2)
    for i in range(len(offsets)):
        if rows[i] >= 0:
            continue
        _apply(linear, offsets[i, 0], offsets[i, 1], offsets[i, 2], there)
        x, y, z = there[0] + place[0], there[1] + place[1], there[2] + place[2]
        if nearest_of(held, x, y, z, nearest, squared) < 2:
            continue
        is_sure = squared[0] <= reach * reach and squared[0] <= _UNIQUE**2 * squared[1]
        if is_sure and not (rows == nearest[0]).any():
            rows[i] = nearest[0]


@compiled
def find_pattern(
    offsets: Float, frame: Float, area: float, held: Cells, reach: float, linear: Float, place: Float,
    rows: NDArray[np.int64], off: Float, told: Float,
) -> int:  # fmt: skip
    """Find the place of a pattern of points in another moment, near where it is looked for.

    offsets: (n, 3) from the place, the nearest first. frame: (3, 3), tangents and normal. area: of the
    surface for each point. reach: how far the place may be from where it is looked for. linear: (3, 3) and
    place: (3,), the map from which it begins, get the best one. rows: (n,) gets the point that each is paired
    with, or -1; off: (n,), how far it is off along the surface. told: (3,) gets the logarithm of the
    chance of unrelated points to fit as well anywhere there, the information, and that of the best other
    place. Gives how many places were tried.
    """
    count, spacing = len(offsets), np.sqrt(area)
    near, squared = np.empty(_CANDIDATES, np.int32), np.empty(_CANDIDATES)
    beside, beside_squared = np.empty(_MOST, np.int32), np.empty(_MOST)
    start, there = linear.copy(), np.empty(3)
    _apply(start, offsets[0, 0], offsets[0, 1], offsets[0, 2], there)
    first = there + place
    found = rows_within(held, first[0], first[1], first[2], reach, near, squared)
    second, arm = 1, np.empty(3)  # the first point far enough to tell the turn
    while second < count - 1 and _length(offsets[second] - offsets[0]) < _ARM * spacing:
        second += 1
    arm[:] = offsets[second] - offsets[0]
    long = _length(arm)
    targets, weights = np.empty((count, 3)), np.empty(count)
    each_rows, each_off = np.empty(count, np.int64), np.empty(count)
    upright, each, at = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    places, informations = np.empty((found, 3)), np.zeros(found)
    best, tried = -1, 0
    for n in range(found):
        row = near[n]
        if not fit_at(held, row) or not _stand_up(start, frame, held.frames[row], upright):
            continue
        q = held.points[row]
        others = rows_within(held, q[0], q[1], q[2], (1.0 + _STRETCH) * long, beside, beside_squared)
        for other in range(-1, others):
            each[:] = upright
            if other >= 0 and (
                beside_squared[other] < ((1.0 - _STRETCH) * long) ** 2
                or not _turn_to(each, arm, held.points[beside[other]] - q, held.frames[row])
            ):
                continue
            _apply(each, offsets[0, 0], offsets[0, 1], offsets[0, 2], there)
            for k in range(3):
                at[k] = q[k] - there[k]
            tried += 1
            information = _fit_from(
                offsets, frame, area, held, each, at, targets, weights, each_rows, each_off
            )  # fmt: skip
            if information <= informations[n]:
                continue
            places[n], informations[n] = at, information
            if best < 0 or best == n or information > informations[best] or (
                information == informations[best] and row < near[best]
            ):  # fmt: skip
                best = n
                linear[:] = each
                place[:] = at
                rows[:] = each_rows
                off[:] = each_off
    told[:] = 0.0
    if best < 0:
        return tried
    bound = 0.5 * spacing
    for n in range(found):
        away = 0.0
        for k in range(3):
            away += (places[n, k] - place[k]) ** 2
        if away > bound * bound:
            told[2] = max(told[2], informations[n])
    told[1] = informations[best]
    free = float(count - FREE)
    told[0] = log_chance(informations[best] * free / count, count - FREE) + np.log(float(tried))
    return tried


@compiled
def _predicted(
    before: Cells, now: Cells, row: int, around: NDArray[np.int32], matches: NDArray[np.int64],
    linear: Float, place: Float,
) -> int:  # fmt: skip
    """Predict where a point goes, by those around it, (n,), that are matched; gives how many are, 0 where
    there is no surface.

    linear: (3, 3), the map from which it begins, gets the one found; place: (3,).
    """
    if not fit_at(before, row):
        return 0
    offsets, targets, weights = np.empty((len(around), 3)), np.empty((len(around), 3)), np.empty(len(around))
    paired, farthest = 0, 1e-300
    for other in around:
        match = matches[other]
        if other == row or match < 0:
            continue
        away = 0.0
        for k in range(3):
            offsets[paired, k] = before.points[other, k] - before.points[row, k]
            targets[paired, k] = now.points[match, k]
            away += offsets[paired, k] ** 2
        weights[paired] = away
        farthest = max(farthest, away)
        paired += 1
    for i in range(paired):
        weights[i] = (1.0 - 0.8 * weights[i] / farthest) ** 2
    frame, spacing = before.frames[row].astype(np.float64), before.reaches[row] * _OWN_SPACING
    if not paired or not fit_map(offsets[:paired], targets, weights, frame, spacing, linear, place):
        return 0
    return paired


@compiled
def grow_matches(
    before: Cells, now: Cells, around: NDArray[np.int32], matches: NDArray[np.int64],
    taken: NDArray[np.int64], maps: Float, queue: NDArray[np.int64], queued: int,
) -> int:  # fmt: skip
    """Grow matches of the points of a moment with those of the next over the surface, breadth first.

    around: (N, n), the rows nearest to each. matches: (N,) rows of the next moment, or -1. taken: (M,) the
    rows that they are of, or -1. maps: (N, 3, 3) of matched points. queue: (N,), of which the first `queued`
    rows are matched. Gives how many are then.
    """
    nearest, squared = np.empty(2, np.int32), np.empty(2)
    tries = np.zeros(len(matches), np.int8)
    linear, place = np.empty((3, 3)), np.empty(3)
    at = 0
    while at < queued:
        row = queue[at]
        at += 1
        for other in around[row]:
            if matches[other] >= 0 or tries[other] >= _TRIES:
                continue
            tries[other] += 1
            linear[:] = maps[row]
            if not _predicted(before, now, other, around[other], matches, linear, place):
                continue
            if nearest_of(now, place[0], place[1], place[2], nearest, squared) < 2:
                continue
            most = _GROWN * before.reaches[other] * _OWN_SPACING
            is_sure = squared[0] <= most * most and squared[0] <= _UNIQUE**2 * squared[1]
            if not is_sure or taken[nearest[0]] >= 0:
                continue
            matches[other], taken[nearest[0]] = nearest[0], other
            maps[other] = linear
            queue[queued] = other
            queued += 1
    return queued


@compiled
def prove_matches(
    before: Cells, now: Cells, around: NDArray[np.int32], matches: NDArray[np.int64], maps: Float,
    proven: NDArray[np.int64],
) -> None:  # fmt: skip
    """Keep the matches that those around them bear out: proven (N,) gets them, others are -1. The arrays are
    those of `grow_matches`."""
    linear, place = np.empty((3, 3)), np.empty(3)
    for row in range(len(matches)):
        proven[row] = -1
        if matches[row] < 0:
            continue
        linear[:] = maps[row]
        if _predicted(before, now, row, around[row], matches, linear, place) < _FEWEST:
            continue
        squared = 0.0
        for k in range(3):
            squared += (now.points[matches[row], k] - place[k]) ** 2
        if squared <= (_GROWN * before.reaches[row] * _OWN_SPACING) ** 2:
            proven[row] = matches[row]
