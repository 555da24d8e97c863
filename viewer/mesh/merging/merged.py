"""Range views of one moment made into one surface, and what Scan4D reports of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ...scan.range_view import RangeView
from .alignment import Drift, Refinement, drifts, refine
from .competition import Competition, Rules, compete

Pairs = dict[tuple[int, int], Drift]


@dataclass(frozen=True, eq=False)
class MergedViews:
    """The range views of one moment after they have been merged.

    given: the views as they were. competition: of these, or of the views with refined alignment.
    drifts: of each pair of views that overlaps, as given; left: after the refinement, None without one.
    """

    given: tuple[RangeView, ...]
    competition: Competition
    drifts: Pairs
    refinement: Refinement | None = None
    left: Pairs | None = None

    @property
    def views(self) -> tuple[RangeView, ...]:
        """The views, whose masks keep each patch once."""
        return self.competition.views

    @property
    def drifted(self) -> Pairs:
        """The pairs whose drift is significant in what the views are now."""
        pairs = self.drifts if self.left is None else self.left
        return {pair: drift for pair, drift in pairs.items() if drift.is_significant}

    def facts(self) -> dict[str, Any]:
        """All of it as plain values: lengths in scan units, angles in degrees; None: unknown."""
        names, competition = [view.name for view in self.given], self.competition
        before, after = competition.overlap
        return {
            "area": competition.area,
            "overlap_before": before,
            "overlap_after": after,
            "ties": competition.ties,
            "views": [
                {
                    "name": view.name,
                    "pixels": int(np.count_nonzero(given.valid())),
                    "kept": int(np.count_nonzero(view.valid())),
                    **self._motion(number),
                }
                for number, (given, view) in enumerate(zip(self.given, self.views, strict=True))
            ],
            "pairs": [
                {
                    "views": [names[i], names[j]],
                    **_agreement(competition, i, j),
                    "drift": _drift_facts(self.drifts.get((i, j))),
                    **({} if self.left is None else {"drift_left": _drift_facts(self.left.get((i, j)))}),
                }
                for i in range(len(names))
                for j in range(i + 1, len(names))
            ],
        }

    def _motion(self, number: int) -> dict[str, Any]:
        """The matrix, for column vectors, that a view was moved by; nothing without a refinement."""
        if self.refinement is None:
            return {}
        return {"motion": self.refinement.motions[number].matrix.tolist()}


def merge_views(views: Sequence[RangeView], rules: Rules | None = None, refined: bool = False) -> MergedViews:
    """Have range views compete for each patch, see `compete`, and tell how well they are aligned.

    refined: whether their alignment is corrected first, see `refine`. Raises InputError for less than two.
    """
    found = drifts(views)
    if not refined:
        return MergedViews(tuple(views), compete(views, rules), found)
    refinement = refine(views)
    moved = any(not motion.is_identity for motion in refinement.motions)
    left = drifts(refinement.views) if moved else found
    return MergedViews(tuple(views), compete(refinement.views, rules), found, refinement, left)


def _agreement(competition: Competition, i: int, j: int) -> dict[str, Any]:
    one, other = competition.agreements[i][j], competition.agreements[j][i]
    assert one is not None and other is not None, "the two views differ"
    return {
        "overlap": [one.overlap, other.overlap],
        "depth_rmse": _number(one.depth_rmse),
        "deviation": _number(one.deviation),
    }


def _drift_facts(drift: Drift | None) -> dict[str, Any] | None:
    return None if drift is None else asdict(drift)


def _number(value: float) -> float | None:
    return None if math.isnan(value) else value
