"""Growth of matches over a surface, from those of patterns. Compiled by numba; see `pattern`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled
from .pattern_fit_kernels import fit_map
from .pattern_search_kernels import UNIQUE, nearest_of
from .surface_kernels import OWN_SPACING, Cells, fit_at

Float = NDArray[np.float64]

_GROWN = 0.3  # local spacings that a grown point may be off its prediction
_TRIES = 3  # of each point, as more and more around it are matched
_FEWEST = 4  # of the points around a matched one, that have to be matched as well


@compiled
def _predicted(
    before: Cells, now: Cells, row: int, around: NDArray[np.int32], matches: NDArray[np.int64],
    linear: Float, position: Float,
) -> int:  # fmt: skip
    """Predict where a point goes, by those around it, (n,), that are matched; gives how many are, 0 where
    there is no surface.

    linear: (3, 3), the map from which it begins, gets the one found; position: (3,).
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
    frame, spacing = before.frames[row].astype(np.float64), before.reaches[row] * OWN_SPACING
    if not paired or not fit_map(offsets[:paired], targets, weights, frame, spacing, linear, position):
        return 0
    return paired


class MatchGrowth(NamedTuple):
    """Matches of the N points of a moment with the M points of the next one; growth fills the arrays."""

    matches: NDArray[np.int64]  # (N,) rows of the next moment, or -1
    taken: NDArray[np.int64]  # (M,), the rows that they are of, or -1
    maps: Float  # (N, 3, 3) of matched points
    queue: NDArray[np.int64]  # (N,), matched rows in the order of their match
    is_reached: NDArray[np.bool_]  # (N,), whether a point is matched, or lies around one that is


@compiled
def grow_matches(
    before: Cells, now: Cells, around: NDArray[np.int32], growth: MatchGrowth, at: int, queued: int
) -> int:
    """Grow matches of the points of a moment with those of the next over the surface, breadth first.

    around: (N, n), the rows nearest to each. at, queued: growth begins from these rows of the queue, the
    second not included. Gives how many rows it has then.
    """
    matches, taken, maps, queue, is_reached = growth
    nearest, squared = np.empty(2, np.int32), np.empty(2)
    tries = np.zeros(len(matches), np.int8)
    linear, position = np.empty((3, 3)), np.empty(3)
    while at < queued:
        row = queue[at]
        at += 1
        for other in around[row]:
            is_reached[other] = True
            if matches[other] >= 0 or tries[other] >= _TRIES:
                continue
            tries[other] += 1
            linear[:] = maps[row]
            if not _predicted(before, now, other, around[other], matches, linear, position):
                continue
            if nearest_of(now, position[0], position[1], position[2], nearest, squared) < 2:
                continue
            most = _GROWN * before.reaches[other] * OWN_SPACING
            is_sure = squared[0] <= most * most and squared[0] <= UNIQUE**2 * squared[1]
            if not is_sure or taken[nearest[0]] >= 0:
                continue
            matches[other], taken[nearest[0]] = nearest[0], other
            maps[other] = linear
            queue[queued] = other
            queued += 1
    return queued


@compiled
def prove_matches(
    before: Cells, now: Cells, around: NDArray[np.int32], growth: MatchGrowth, first: int, last: int,
    proven: NDArray[np.int64],
) -> None:  # fmt: skip
    """Keep those of the matches from first to last - 1 that the ones around them bear out: proven (N,) gets
    them, others are -1. around: as of `grow_matches`."""
    matches, maps = growth.matches, growth.maps
    linear, position = np.empty((3, 3)), np.empty(3)
    for row in range(first, last):
        proven[row] = -1
        if matches[row] < 0:
            continue
        linear[:] = maps[row]
        if _predicted(before, now, row, around[row], matches, linear, position) < _FEWEST:
            continue
        squared = 0.0
        for k in range(3):
            squared += (now.points[matches[row], k] - position[k]) ** 2
        if squared <= (_GROWN * before.reaches[row] * OWN_SPACING) ** 2:
            proven[row] = matches[row]
