"""Points that recur: material points that several frames hold, each in an order of its own.

Where frames hold the same points, such as the vertices of one mesh, their irregular pattern tells the
position along the surface exactly. A pattern of points counts as found where points at random would not lie
so near to it (a contrario, Moisan and Stival 2004), and where it fits no other position nearly as well, in
the other frame or in its own: so the grid of a range camera, which recurs at each step of a pixel, is never
taken for matter. From patterns that are found, matches grow over the surface, each point's position predicted
by those beside it (match propagation, Lhuillier and Quan 2002): thus they reach limbs that are too fast to be
looked for.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...threads import shares, together
from .surface import MomentSurface

if TYPE_CHECKING:
    from .pattern_growth_kernels import MatchGrowth
    from .pattern_search_kernels import PatternFit, PatternSearch

Float = NDArray[np.float64]
Rows = NDArray[np.int64]

_POINTS = 24  # of a pattern
_CERTAIN = 1e-6  # chance of points at random to fit as well anywhere where a pattern is looked for
_DISTINCT = np.log(4.0)  # a point, in information: residuals of other positions are twice as large at least
_SEARCH = 5.0  # spacings that a pattern may be from where it is looked for
_SEED_SEARCH = 12.0  # the same for patterns that matches grow from
_NEAR_SEARCH = 3.0  # the same where the way is known about
_SWING = 1.0  # of the way from the nearest matched point, that a point may go besides
_SEEDS = 24  # patterns that are tried in a round
_LEAPS = 3  # rounds at most, each over what growth has not reached yet
_FARTHEST = 15.0  # the same in spacings of the pattern
_MATCHED = 0.3  # local spacings that matched points of a pattern are off at most
_STRAY = 3.0  # times the median, that they may be off where the surface is deformed
_NEXT = 8  # points next to the position, of which half have to be matched
_LEAST_FREEDOM = 0.25  # of residuals besides what the map takes of them
_FLOOR = 0.02  # spacings: what bending leaves at least, standard deviation


@dataclass(frozen=True, eq=False)
class FoundPattern:
    """A pattern in another frame.

    position: (3,), of its centre. linear: (3, 3), how it is turned and stretched. rows: (n,), the points
    that are its own, -1 where one has none. covariance: (3, 3), of the position.
    """

    position: Float
    linear: Float
    rows: Rows
    covariance: Float

    @classmethod
    def itself(cls, pattern: PointPattern) -> FoundPattern:
        """A pattern in its own frame."""
        return cls(pattern.position, np.eye(3), pattern.rows, np.zeros((3, 3)))


class PointPattern:
    """The points nearest to a position of a surface."""

    def __init__(self, surface: MomentSurface, position: Float, frame: Float, rows: Rows) -> None:
        """frame: (3, 3), tangents and normal. rows: (n,), of its points, the nearest first."""
        self.rows, self.position, self._frame = rows, position, frame
        self._offsets = surface.held.points[rows] - position
        self._area = float(np.pi * (self._offsets[-1] ** 2).sum() / len(rows))
        self._closeness = 1 / (1 + (self._offsets**2).sum(axis=1) / self._area) ** 2
        self._spacing = surface.spacing
        self._own = surface
        self._alike: float | None = None

    @classmethod
    def around(cls, surface: MomentSurface, position: Float) -> PointPattern | None:
        """The pattern around a position; None where there are too few points, or no surface."""
        from .pattern_search_kernels import nearest_of

        rows = np.empty(_POINTS, np.int32)
        found = nearest_of(surface.held, position[0], position[1], position[2], rows, np.empty(_POINTS))
        if found < _POINTS:
            return None
        frame = surface.axes_at(position, float(np.linalg.norm(surface.held.points[rows[-1]] - position)))
        pattern = None if frame is None else cls(surface, position, frame, rows.astype(np.int64))
        return pattern if pattern is not None and pattern._area > 0 else None

    def found(
        self, surface: MomentSurface, position: Float, linear: Float, search: float = _SEARCH
    ) -> FoundPattern | None:
        """The pattern in another frame, near a position, (3,), and turned about as it is, (3, 3); None where
        it is not found, or fits several positions. search: how far it may be, spacings."""
        best, sure = self._fitted(surface, position, linear, search)
        if sure.log_chance > np.log(_CERTAIN) or not self._is_distinct(sure.information, sure.other):
            return None
        if self._alike is None:  # elsewhere in its own frame
            self._alike = self._fitted(self._own, self.position, np.eye(3), 2 * search)[1].other
        if not self._is_distinct(sure.information, self._alike):
            return None
        rows = np.where(best.off <= _MATCHED * np.sqrt(self._area), best.rows, -1)
        return self._judged(surface, rows, best.linear)

    def followed(self, surface: MomentSurface, rows: Rows, linear: Float) -> FoundPattern | None:
        """The pattern in another frame, where some of its points are known, (n,), others are -1; None where
        too few next to the position are. linear: (3, 3), about how it is turned."""
        from .pattern_search_kernels import fill_pattern

        if (rows[:_NEXT] >= 0).sum() < _NEXT // 2:
            return None
        reach = _MATCHED * np.sqrt(self._area)
        position, linear = self._weighted(surface, rows, linear)
        rows = rows.copy()
        fill_pattern(self._offsets, surface.held, linear, position, reach, rows)
        return self._judged(surface, rows, linear)

    def _fitted(
        self, surface: MomentSurface, position: Float, linear: Float, search: float
    ) -> tuple[PatternFit, PatternSearch]:
        """Fit the pattern near a position: the best fit, and how sure it is."""
        from .pattern_search_kernels import PatternArrays, find_pattern, no_fit

        best = no_fit(len(self._offsets))
        best.linear[:], best.position[:] = linear, position
        reach = min(search * self._spacing, _FARTHEST * np.sqrt(self._area))
        pattern = PatternArrays(self._offsets, self._frame, self._area)
        return best, find_pattern(pattern, surface.held, best, reach)

    def _is_distinct(self, information: float, other: float) -> bool:
        return information - other >= _DISTINCT * len(self._offsets)

    def _weighted(self, surface: MomentSurface, rows: Rows, linear: Float) -> tuple[Float, Float]:
        """Fit the position and map of the pattern to the points that are known, the nearest above all."""
        from .pattern_fit_kernels import fit_map

        linear, position = linear.copy(), np.full(3, np.nan)
        weights = (rows >= 0) * self._closeness
        fit_map(
            self._offsets,
            surface.held.points[rows],
            weights,
            self._frame,
            np.sqrt(self._area),
            linear,
            position,
        )
        return position, linear

    def _judged(self, surface: MomentSurface, rows: Rows, linear: Float) -> FoundPattern | None:
        """Drop points that are far off, and compute the covariance of the position from the others."""
        from .pattern_fit_kernels import FREE

        position, linear = self._weighted(surface, rows, linear)
        targets = surface.held.points[rows]
        off = np.linalg.norm(position + self._offsets @ linear.T - targets, axis=1)
        usual = np.median(off[rows >= 0]) if (rows >= 0).any() else 0.0
        rows = np.where(off <= max(_MATCHED * np.sqrt(self._area), _STRAY * usual), rows, -1)
        if (rows[:_NEXT] >= 0).sum() < _NEXT // 2:
            return None
        position, linear = self._weighted(surface, rows, linear)
        weights = (rows >= 0) * self._closeness
        left = ((position + self._offsets @ linear.T - targets) ** 2).sum(axis=1)
        share = (weights**2).sum() / weights.sum() ** 2  # one over as many points as count
        freedom = max(1 - FREE * share, _LEAST_FREEDOM)
        variance = weights @ left / weights.sum() / 2 / freedom  # along two axes of the surface
        covariance = (variance * share + (_FLOOR * self._spacing) ** 2) * np.eye(3)
        return FoundPattern(position, linear, rows, covariance)


class ExpectedPoints(NamedTuple):
    """How the N points of a frame are expected in the next one, to a few spacings.

    matches: (N,), rows of the next frame, which hold where those around bear them out; -1 where none is
    known. places: (N, 3). maps: (N, 3, 3), how the surface is turned and stretched.
    """

    matches: Rows
    places: Float
    maps: Float


class RecurringPoints:
    """The points of a frame that recur in the next one.

    matches: (N,), the row of each in the next frame, -1 for those that do not. maps: (N, 3, 3), how the
    surface there is turned and stretched.
    """

    def __init__(
        self,
        before: MomentSurface,
        now: MomentSurface,
        starts: Float,
        motions: Float,
        expected: ExpectedPoints | None = None,
    ) -> None:
        """starts: (n, 3), positions near which patterns are tried first; motions: (n, 3), where these are
        expected to go. expected: matches grow from those that are known, and patterns are looked for near."""
        count = len(before.held.points)
        self._before, self._now, self._expected = before, now, expected
        self.matches, self.maps = np.full(count, -1), np.zeros((count, 3, 3))
        self._grown, self._taken = self.matches.copy(), np.full(len(now.held.points), -1)
        self._queue, self._queued = np.empty(count, np.int64), 0
        self._is_reached = np.zeros(count, bool)
        if expected is not None:
            known = np.flatnonzero(expected.matches >= 0)
            self._grow(known, expected.matches[known], expected.maps[known])
        for position, motion in zip(starts, motions, strict=True):
            self._grow_from(position, position + motion, np.eye(3), _SEED_SEARCH)
        for _ in range(_LEAPS if expected is None else 1):
            left = np.flatnonzero(~self._is_reached)
            if not len(left):
                break
            queued = self._queued
            for row in left[_spread(before.held.points[left])]:
                self._grow_from(before.held.points[row], *self._expected_at(row))
            if self._queued == queued:
                break
        if self._queued:
            from .pattern_growth_kernels import prove_matches

            def prove(first: int, last: int) -> None:
                prove_matches(before.held, now.held, before.around, self._growth, first, last, self.matches)

            together(count, [partial(prove, *share) for share in shares(count)])

    def carried(self, rows: Rows, linear: Float) -> tuple[Rows, Float]:
        """Rows (n,) of the frame, or -1, in the next one, and a map to the frame, (3, 3), as one to the next,
        by that of the first of the rows."""
        there = np.where(rows >= 0, self.matches[rows], -1)
        known = np.flatnonzero(there >= 0)
        return there, self.maps[rows[known[0]]] @ linear if len(known) else linear

    def moved(self, positions: Float, reach: float) -> tuple[Float, NDArray[np.bool_]]:
        """Predict where positions (n, 3) go; known, (n,), are those within reach of a recurring point."""
        from scipy.spatial import cKDTree

        known = np.flatnonzero(self.matches >= 0)
        if not len(known):
            return positions, np.zeros(len(positions), bool)
        points = self._before.held.points[known]
        away, nearest = cKDTree(points).query(positions)
        rows = known[nearest]
        arms = np.einsum("nij,nj->ni", self.maps[rows], positions - points[nearest])
        return self._now.held.points[self.matches[rows]] + arms, away <= reach

    @property
    def _growth(self) -> MatchGrowth:
        from .pattern_growth_kernels import MatchGrowth

        return MatchGrowth(self._grown, self._taken, self.maps, self._queue, self._is_reached)

    def _expected_at(self, row: int) -> tuple[Float, Float, float]:
        """Predict where a point goes, (3,), how it turns, (3, 3), and to how many spacings: as the nearest
        matched point does, unless it is known."""
        if self._expected is not None:
            return self._expected.places[row], self._expected.maps[row], _NEAR_SEARCH
        position, known = self._before.held.points[row], self._queue[: self._queued]
        if not len(known):
            return position, np.eye(3), _SEED_SEARCH
        away = position - self._before.held.points[known]
        squares = (away**2).sum(axis=1)
        nearest = np.argmin(squares)
        one, distance = known[nearest], np.sqrt(squares[nearest]) / self._before.spacing
        place = self._now.held.points[self._grown[one]] + self.maps[one] @ away[nearest]
        return place, self.maps[one], min(_NEAR_SEARCH + _SWING * distance, _SEED_SEARCH)

    def _grow_from(self, position: Float, expected: Float, linear: Float, search: float) -> None:
        """Grow matches from the pattern around a position, where it is found near another one."""
        pattern = PointPattern.around(self._before, position)
        if pattern is None or self._is_reached[pattern.rows[0]]:
            return
        found = pattern.found(self._now, expected, linear, search)
        if found is not None:
            is_known = found.rows >= 0
            maps = np.broadcast_to(found.linear, (int(is_known.sum()), 3, 3))
            self._grow(pattern.rows[is_known], found.rows[is_known], maps)

    def _grow(self, rows: Rows, matches: Rows, maps: Float) -> None:
        """Grow from matches (n,) of rows (n,), of those that have none yet. maps: (n, 3, 3)."""
        from .pattern_growth_kernels import grow_matches

        is_free = (self._grown[rows] < 0) & (self._taken[matches] < 0)
        is_first = np.zeros(len(rows), bool)
        is_first[np.unique(matches, return_index=True)[1]] = True
        is_new = is_free & is_first
        rows, matches, maps = rows[is_new], matches[is_new], maps[is_new]
        self._grown[rows], self._taken[matches], self.maps[rows] = matches, rows, maps
        self._is_reached[rows] = True
        first, last = self._queued, self._queued + len(rows)
        self._queue[first:last] = rows
        self._queued = grow_matches(
            self._before.held,
            self._now.held,
            self._before.around,
            self._growth,
            first,
            last,
        )


def _spread(points: Float) -> Rows:
    """The rows of some of the points, spread over them, (n,)."""
    from .body_kernels import spread_out

    step = max(1, len(points) // 10_000)
    some = np.ascontiguousarray(points[::step])
    chosen = np.empty(min(_SEEDS, len(some)), np.int64)
    spread_out(some, chosen)
    return chosen * step
