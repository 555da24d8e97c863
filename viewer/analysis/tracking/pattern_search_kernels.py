"""Search for a pattern of points on another surface. Compiled by numba; see `pattern`.

A pattern is tried at each point near where it is expected. A fit counts by its information: how unlikely
points at random lie as near along the surface.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled
from .pattern_fit_kernels import FREE, apply_map, fit_map, mapped_normal, stand_up, turn_to
from .surface_kernels import COPIES, Cells, fit_at, nearest_within, rows_within

Float = NDArray[np.float64]

_RINGS = 7, 13  # points, the nearest ones, that a map is fitted to before all are
_REFITS = 3  # of a map to all points of a pattern
_FIRST = 0.6  # local spacings that a point of the first ring may be off
_OFF = 0.45  # the same of later points
_ARM = 0.8  # local spacings from the first point to the one that tells the turn, at least
_STRETCH = 0.25  # of that distance, that it may be stretched by
_LEAST = 0.02  # local spacings: a smaller residual is taken for this one
_HOPELESS = 1.2  # mean of minus the logarithms of chances of the first rings, below which none follow
UNIQUE = 0.5  # of the distance of the second nearest point, that the nearest one may be off
_MOST = 256  # points that are looked at
_CANDIDATES = 1024  # positions that a pattern is looked for at, at most


class PatternArrays(NamedTuple):
    """A pattern of n points around a position of a surface."""

    offsets: Float  # (n, 3) from the position, the nearest first
    frame: Float  # (3, 3), tangents and normal there
    area: float  # of the surface for each point


class PatternFit(NamedTuple):
    """A pattern as it is fitted to another surface; fits fill the arrays."""

    linear: Float  # (3, 3), the map of offsets
    position: Float  # (3,), where the pattern's position goes
    targets: Float  # (n, 3), the points that its points are paired with
    weights: Float  # (n,), 0 where a point has no pair
    rows: NDArray[np.int64]  # (n,) of the targets, or -1
    off: Float  # (n,), how far each target is off along the surface, inf where there is none


class PatternSearch(NamedTuple):
    """How sure a pattern is found."""

    log_chance: float  # logarithm of the chance of unrelated points to fit as well anywhere near
    information: float  # of the best fit
    other: float  # of the best fit elsewhere


@compiled
def no_fit(count: int) -> PatternFit:
    """Room for the fit of so many points; position and map are the identity."""
    return PatternFit(
        np.eye(3),
        np.zeros(3),
        np.empty((count, 3)),
        np.zeros(count),
        np.full(count, -1),
        np.full(count, np.inf),
    )


@compiled
def nearest_of(surface: Cells, x: float, y: float, z: float, rows: NDArray[np.int32], squared: Float) -> int:
    """How many points nearest to a position are found, as many as `rows` has room for, the nearest first.

    squared gets their squared distances. Ties go to the lowest row.
    """
    found_rows, found_squared = np.empty(_MOST, np.int32), np.empty(_MOST)
    reach, found, kept = 0.6 * surface.spacing, 0, 0
    for _ in range(8):
        found = rows_within(surface, x, y, z, reach, found_rows, found_squared)
        if found >= len(rows):
            break
        reach *= 1.6
    while found == _MOST and reach > COPIES * surface.spacing:
        reach *= 0.7
        found = rows_within(surface, x, y, z, reach, found_rows, found_squared)
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
def log_chance(information: float, count: int) -> float:
    """The logarithm of the chance that unrelated points lie as near: minus the sum of logarithms of `count`
    chances is at least this (Fisher's method; Chernoff's bound on the Gamma distribution)."""
    if information <= count:
        return 0.0
    return -(information - count - count * np.log(information / count))


@compiled
def _pair(offsets: Float, surface: Cells, fit: PatternFit, reach: float, count: int) -> int:
    """Pair the first `count` points, mapped, each with the nearest point of a surface within reach, that no
    nearer one has; gives how many are."""
    linear, position, targets, weights, rows, _ = fit
    points = surface.points
    there, squared = np.empty(3), np.empty(count)
    paired = 0
    for i in range(count):
        apply_map(linear, offsets[i, 0], offsets[i, 1], offsets[i, 2], there)
        x, y, z = there[0] + position[0], there[1] + position[1], there[2] + position[2]
        row = nearest_within(surface, x, y, z, reach)
        rows[i], weights[i] = row, 0.0
        if row < 0:
            continue
        squared[i] = (points[row, 0] - x) ** 2 + (points[row, 1] - y) ** 2 + (points[row, 2] - z) ** 2
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
            targets[i, k] = points[row, k]
    return paired


@compiled
def _information(pattern: PatternArrays, fit: PatternFit, count: int) -> float:
    """Minus the sum of logarithms of the chances of points at random to lie as near along the surface."""
    offsets, frame, area = pattern
    linear, position, targets, weights, _, off = fit
    normal, there = np.empty(3), np.empty(3)
    mapped_normal(linear, frame, normal)
    total, least = 0.0, (_LEAST**2) * area
    for i in range(count):
        off[i] = np.inf
        if weights[i] == 0.0:
            continue
        apply_map(linear, offsets[i, 0], offsets[i, 1], offsets[i, 2], there)
        across, squared = 0.0, 0.0
        for k in range(3):
            away = targets[i, k] - there[k] - position[k]
            across += away * normal[k]
            squared += away * away
        along = max(squared - across * across, least)
        off[i] = np.sqrt(along)
        total -= min(np.log(np.pi * along / area), 0.0)
    return total


@compiled
def _fit_from(pattern: PatternArrays, surface: Cells, fit: PatternFit) -> float:
    """Fit the map of a pattern from a start, ring by ring; gives its information, 0 where it is hopeless."""
    offsets, frame, area = pattern
    linear, position, targets, weights, _, _ = fit
    count, spacing = len(offsets), np.sqrt(area)
    for ring in _RINGS:
        n = min(ring, count)
        reach = _FIRST if ring == _RINGS[0] else _OFF
        if _pair(offsets, surface, fit, reach * spacing, n) <= n // 2:
            return 0.0
        if not fit_map(offsets[:n], targets[:n], weights[:n], frame, spacing, linear, position):
            return 0.0
        if _information(pattern, fit, n) < _HOPELESS * n:
            return 0.0
    for _ in range(_REFITS):
        _pair(offsets, surface, fit, _OFF * spacing, count)
        if not fit_map(offsets, targets, weights, frame, spacing, linear, position):
            return 0.0
    return _information(pattern, fit, count)


@compiled
def fill_pattern(
    offsets: Float, surface: Cells, linear: Float, position: Float, reach: float, rows: NDArray[np.int64]
) -> None:
    """Find the points of a pattern that are not known yet in another moment, where one alone is near.

    rows: (n,), -1 for those, gets them. reach: how far one may be. The others are as of `find_pattern`.
    """
    there = np.empty(3)
    nearest, squared = np.empty(2, np.int32), np.empty(2)
    for i in range(len(offsets)):
        if rows[i] >= 0:
            continue
        apply_map(linear, offsets[i, 0], offsets[i, 1], offsets[i, 2], there)
        x, y, z = there[0] + position[0], there[1] + position[1], there[2] + position[2]
        if nearest_of(surface, x, y, z, nearest, squared) < 2:
            continue
        is_sure = squared[0] <= reach * reach and squared[0] <= UNIQUE**2 * squared[1]
        if is_sure and not (rows == nearest[0]).any():
            rows[i] = nearest[0]


@compiled
def _turning_arm(offsets: Float, spacing: float) -> Float:
    """The offset (3,) from the first point to the nearest one that is far enough to tell the turn."""
    second = 1
    while second < len(offsets) - 1:
        arm = offsets[second] - offsets[0]
        if not np.sqrt(arm[0] ** 2 + arm[1] ** 2 + arm[2] ** 2) < _ARM * spacing:
            break
        second += 1
    return offsets[second] - offsets[0]


@compiled
def find_pattern(pattern: PatternArrays, surface: Cells, best: PatternFit, reach: float) -> PatternSearch:
    """Find a pattern of points on another surface, near where it is looked for.

    best: its map and position are where the search begins; it gets the best fit. reach: how far the position
    may be off, scan units.
    """
    offsets, frame, area = pattern
    points, frames, count, spacing = surface.points, surface.frames, len(offsets), np.sqrt(area)
    near, squared = np.empty(_CANDIDATES, np.int32), np.empty(_CANDIDATES)
    beside, beside_squared = np.empty(_MOST, np.int32), np.empty(_MOST)
    start, there = best.linear.copy(), np.empty(3)
    apply_map(start, offsets[0, 0], offsets[0, 1], offsets[0, 2], there)
    first = there + best.position
    found = rows_within(surface, first[0], first[1], first[2], reach, near, squared)
    arm = _turning_arm(offsets, spacing)
    long = np.sqrt(arm[0] ** 2 + arm[1] ** 2 + arm[2] ** 2)
    upright, each = np.empty((3, 3)), no_fit(count)
    positions, informations = np.empty((found, 3)), np.zeros(found)
    best_number, tried = -1, 0
    for n in range(found):
        row = near[n]
        if not fit_at(surface, row) or not stand_up(start, frame, frames[row], upright):
            continue
        q = points[row]
        others = rows_within(surface, q[0], q[1], q[2], (1.0 + _STRETCH) * long, beside, beside_squared)
        for other in range(-1, others):
            each.linear[:] = upright
            if other >= 0 and (
                beside_squared[other] < ((1.0 - _STRETCH) * long) ** 2
                or not turn_to(each.linear, arm, points[beside[other]] - q, frames[row])
            ):
                continue
            apply_map(each.linear, offsets[0, 0], offsets[0, 1], offsets[0, 2], there)
            for k in range(3):
                each.position[k] = q[k] - there[k]
            tried += 1
            information = _fit_from(pattern, surface, each)
            if information <= informations[n]:
                continue
            positions[n], informations[n] = each.position, information
            if best_number < 0 or best_number == n or information > informations[best_number] or (
                information == informations[best_number] and row < near[best_number]
            ):  # fmt: skip
                best_number = n
                best.linear[:], best.position[:] = each.linear, each.position
                best.rows[:], best.off[:] = each.rows, each.off
    if best_number < 0:
        return PatternSearch(0.0, 0.0, 0.0)
    elsewhere = 0.0
    for n in range(found):
        away = 0.0
        for k in range(3):
            away += (positions[n, k] - best.position[k]) ** 2
        if away > (0.5 * spacing) * (0.5 * spacing):
            elsewhere = max(elsewhere, informations[n])
    information = informations[best_number]
    chance = log_chance(information * float(count - FREE) / count, count - FREE) + np.log(float(tried))
    return PatternSearch(chance, information, elsewhere)
