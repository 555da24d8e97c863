"""Confidence competition: each patch that several range views have measured stays with the one that sees it
best, and the others' pixels are masked (Ju et al. 2004; Farooq and Siebert 2009, section 4).

Pixels compete by S C V (`competition_weights`). What is masked are pixels, and what is seen are the triangles
between them: at a seam, the triangles between a pixel that has won and one that has not would be lost from
both views. So pixels are masked, the worst first, if what stays covers all that their triangles do
(`TriangleCover`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...bounds import Bounds
from ...errors import InputError
from ...scan.faces import Triangles
from ...scan.range_view import RangeView
from ...task import checkpoint
from .covering import TriangleCover
from .surfaces import Meeting, RangeSurface, meet

SCATTER = 4.0  # deviations within which two measures are of one surface
_REACH = 0.1  # of the subject's radius: no farther apart are measures compared
_GOOD = 0.75  # of the best weight: pixels that may be kept in place of better ones, for a shorter seam
_SAME_SIDE = 0.5  # least cosine between normals of one surface
_NORMAL_DEVIATION = 1.4826  # times the median of absolute values


@dataclass(frozen=True)
class Rules:
    """How views compete.

    ties: by how much less than the best a weight (0 to 1, where confidences are) may be for its pixel to be
    kept all the same. smoothing: pixels over which weights are averaged, so that noise does not fray
    the seams. tolerance: how far two views may be apart, scan units, and measure the same surface; None: four
    times the deviation that is found between them, and the spacing of their samples. Raises InputError.
    """

    ties: float = 0.0
    smoothing: int = 5
    tolerance: float | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.ties) and self.ties >= 0):
            raise InputError(f"the largest difference of tied weights must be 0 or more, not {self.ties}")
        if not 0 <= self.smoothing <= 100:
            raise InputError(f"the radius that smooths weights must be 0 to 100 pixels, not {self.smoothing}")
        if self.tolerance is not None and not (np.isfinite(self.tolerance) and self.tolerance > 0):
            raise InputError(
                "the largest distance between two measurements of one surface must be above 0, not "
                f"{self.tolerance}"
            )


@dataclass(frozen=True, eq=False)
class Agreement:
    """How well one view agrees with another where both measure.

    overlap: the part of its pixels where the other has the same surface. depth_rmse: of the depths that both
    give in its picture, and deviation: of the distance along the normal, from the median, both in scan units
    and NaN where nothing overlaps.
    """

    overlap: float
    depth_rmse: float
    deviation: float


@dataclass(frozen=True, eq=False)
class Competition:
    """A competition's result.

    views: the views, with masks that are True where a pixel is kept. agreements: [i][j], of view i with view
    j; None for itself. area: of all surface, scan units squared, each patch once. overlap: the part of it
    that several views show, (before, after). ties: the part that several keep as they tie.
    """

    views: tuple[RangeView, ...]
    agreements: tuple[tuple[Agreement | None, ...], ...]
    area: float
    overlap: tuple[float, float]
    ties: float


def compete(views: Sequence[RangeView], rules: Rules | None = None) -> Competition:
    """Mask the pixels whose patch another view sees better, so that each patch is kept once; ties by `rules`.

    Confidence counts where all views have one. What any view has measured stays covered. Raises InputError
    for less than two views.
    """
    if len(views) < 2:
        raise InputError(f"merging needs two or more range views, not {len(views)}")
    return _Contest([RangeSurface.of(view) for view in views], rules or Rules()).result()


class _Contest:
    """The surfaces of all views, their weights, and how far each scatters about the others."""

    def __init__(self, surfaces: Sequence[RangeSurface], rules: Rules) -> None:
        self.surfaces, self.rules = surfaces, rules
        self.reach = reach(surfaces)
        confident = all(surface.view.confidence is not None for surface in surfaces)
        self.weights = [
            surface.smoothed(competition_weights(surface, confident), rules.smoothing) for surface in surfaces
        ]
        self.scatter = np.zeros(len(surfaces))
        self.agreements: list[tuple[Agreement | None, ...]] = []

    def result(self) -> Competition:
        """Hold it."""
        best = np.concatenate([self._best_of_others(number) for number in range(len(self.surfaces))])
        own = np.concatenate(self.weights)
        if self.rules.tolerance is None:
            covering = TriangleCover(self.surfaces, self.scatter, self.reach)
        else:
            stated = np.full(len(self.surfaces), self.rules.tolerance)
            covering = TriangleCover(self.surfaces, stated, self.rules.tolerance, spaced=False)
        checkpoint(0.8)
        before = covering.shared_area(covering.shown)
        tied = _corners_all(np.abs(own - best) <= self.rules.ties, covering.faces)
        of_tied, alone = np.zeros(len(own), bool), np.ones(len(own), bool)
        of_tied[covering.faces[covering.shown & tied].ravel()] = True
        alone[covering.faces[covering.shown].ravel()] = False
        covering.mask(own, of_tied | alone, own >= _GOOD * best)
        checkpoint(0.95)
        kept = covering.kept & ~(alone & (best > own + self.rules.ties))
        return Competition(
            views=tuple(
                replace(surface.view, mask=surface.on_grid(kept[rows]))
                for surface, rows in zip(self.surfaces, covering.own, strict=True)
            ),
            agreements=tuple(self.agreements),
            area=covering.area,
            overlap=(before / covering.area, covering.shared_area(covering.shown) / covering.area),
            ties=covering.shared_area(covering.shown & tied) / covering.area,
        )

    def _best_of_others(self, number: int) -> NDArray[np.float64]:
        """The highest weight that another view has at each point of a view, (N,); -inf: none sees it."""
        seen, weights = self.surfaces[number], self.weights
        meetings = {}
        for other, surface in enumerate(self.surfaces):
            checkpoint()
            if other != number:
                meetings[other] = meet(seen, seen.points, surface, weights[other])
        found = {other: agreement_of(seen, met, self.reach) for other, met in meetings.items()}
        self.agreements.append(tuple(found.get(other) for other in range(len(weights))))
        self.scatter[number] = SCATTER * _typical_deviation(list(found.values()))
        within = self.rules.tolerance
        if within is None:
            spacing = seen.spacing(seen.points, seen.normals)
            within = np.minimum(self.scatter[number] + spacing, self.reach)
        best = np.full(len(seen.points), -np.inf)
        for met in meetings.values():
            with np.errstate(invalid="ignore"):
                same = met.distance <= within
            best[same] = np.maximum(best[same], met.weight[same])
        return best


def reach(surfaces: Sequence[RangeSurface]) -> float:
    """How far apart measures of several views may be, and still be compared: a tenth of the subject's radius,
    scan units."""
    return _REACH * Bounds.around([surface.bounds for surface in surfaces]).radius


def comparable(seen: RangeSurface, met: Meeting, within: float) -> NDArray[np.bool_]:
    """Whether the points of a view, (N,), meet what is likely the same surface, badly aligned maybe: near,
    and with a normal like theirs."""
    with np.errstate(invalid="ignore"):
        return (met.distance <= within) & ((met.normal * seen.normals).sum(axis=1) >= _SAME_SIDE)


def agreement_of(seen: RangeSurface, met: Meeting, within: float) -> Agreement:
    """How well a view agrees with the one that its points meet. within: see `comparable`."""
    near = comparable(seen, met, within)
    if not near.any():
        return Agreement(0.0, np.nan, np.nan)
    depths, distances = met.depth[near], met.distance[near]
    deviation = normal_deviation(distances)
    one = distances <= SCATTER * deviation + met.spacing[near]
    rmse = float(np.sqrt(np.square(depths[one]).mean()))
    return Agreement(float(np.count_nonzero(one) / len(seen.points)), rmse, deviation)


def normal_deviation(distances: NDArray[np.float64]) -> float:
    """The standard deviation that distances (N,), of a normal distribution, have by their median."""
    return _NORMAL_DEVIATION * float(np.median(distances))


def _typical_deviation(agreements: Sequence[Agreement]) -> float:
    """The median of a view's deviations from others, by overlap: where two views hardly overlap, most of what
    meets is of different surfaces. 0 where none overlaps."""
    deviation, overlap = np.array([(each.deviation, each.overlap) for each in agreements]).T
    order = np.argsort(deviation)  # NaN comes last, and has no overlap
    shares = np.cumsum(overlap[order])
    return float(deviation[order][np.searchsorted(shares, shares[-1] / 2)]) if shares[-1] > 0 else 0.0


def competition_weights(surface: RangeSurface, confident: bool) -> NDArray[np.float64]:
    """The weights S C V of the points of a surface, (N,), 0 or more: S whether it is valid, C its
    confidence where the view has one, V the cosine between the normal and the direction to the pod, at least
    0.

    confident: False leaves C out.
    """
    facing = np.maximum(surface.cosines(surface.points, surface.normals), 0)
    confidence = surface.view.confidence
    if not confident or confidence is None:
        return facing
    stated = np.nan_to_num(confidence[surface.view.valid()].astype(np.float64), posinf=0)
    return facing * np.maximum(stated, 0)


def _corners_all(points: NDArray[np.bool_], faces: Triangles) -> NDArray[np.bool_]:
    """Tell which faces (F, 3) have all their corners among these points (N,), (F,)."""
    return np.asarray(points[faces].all(axis=1))
