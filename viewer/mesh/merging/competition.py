"""Confidence competition: each patch that several range views have measured stays with the one that sees it
best, and the others' pixels are masked (Ju et al. 2004; Farooq and Siebert 2009, section 4).

Pixels compete by S C V (`competition_weights`). What is masked are pixels, and what is seen are the triangles
between them: at a seam, the triangles between a pixel that has won and one that has not would be lost from
both views. So in the end a view keeps, one after another, the triangles that the others do not cover wholly.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...bounds import Bounds
from ...errors import InputError
from ...scan.faces import Triangles
from ...scan.range_view import RangeView
from ...task import checkpoint
from ..scene import Rays
from .surfaces import Meeting, RangeSurface, meet

SCATTER = 4.0  # deviations within which two measures are of one surface
_REACH = 0.1  # of the subject's radius: no farther apart are measures compared
_SAME_SIDE = 0.5  # least cosine between normals of one surface
_NORMAL_DEVIATION = 1.4826  # times the median of absolute values
_FACES_AT_ONCE = 1 << 17
_FINEST = 6  # parts of an edge in which what covers a triangle is looked at, at most
_INSET = 0.7  # of a triangle, in which that is: a sliver along its edge brings back none


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
    """The surfaces of all views, their weights, and how far any two may be apart."""

    def __init__(self, surfaces: Sequence[RangeSurface], rules: Rules) -> None:
        self.surfaces, self.rules = surfaces, rules
        self.reach = reach(surfaces)
        confident = all(surface.view.confidence is not None for surface in surfaces)
        self.weights = [
            surface.smoothed(competition_weights(surface, confident), rules.smoothing) for surface in surfaces
        ]
        count = len(surfaces)
        self.tolerances = np.zeros((count, count))
        self.agreements: list[list[Agreement | None]] = [[None] * count for _ in surfaces]

    def result(self) -> Competition:
        """Hold it."""
        best = [self._best_of_others(number) for number in range(len(self.surfaces))]
        checkpoint(0.5)
        faces = [surface.faces for surface in self.surfaces]
        before = self._areas([np.ones(len(of), bool) for of in faces])
        won = [other <= own + self.rules.ties for own, other in zip(self.weights, best, strict=True)]
        tied = [
            _corners_all(np.abs(own - other) <= self.rules.ties, of)
            for own, other, of in zip(self.weights, best, faces, strict=True)
        ]
        shown = [_corners_all(points, of) for points, of in zip(won, faces, strict=True)]
        for number, seen in enumerate(self.surfaces):
            checkpoint(0.6 + 0.3 * number / len(faces))
            needed = tied[number] | self._uncovered(number, shown)
            kept = np.zeros(len(seen.points), bool)
            kept[seen.faces[needed].ravel()] = True
            shown[number] = _corners_all(kept, seen.faces)
        after = self._areas(shown)
        ties = self._areas([some & of for some, of in zip(shown, tied, strict=True)])
        return Competition(
            views=tuple(map(self._masked, range(len(won)), won, shown)),
            agreements=tuple(map(tuple, self.agreements)),
            area=float(before[0]),
            overlap=(float(before[1] / before[0]), float(after[1] / before[0])),
            ties=float(ties[1] / before[0]),
        )

    def _others(self, number: int) -> Iterator[int]:
        return (other for other in range(len(self.surfaces)) if other != number)

    def _best_of_others(self, number: int) -> NDArray[np.float64]:
        """The highest weight that another view has at each point of a view, (N,); -inf: none sees it."""
        seen = self.surfaces[number]
        best = np.full(len(seen.points), -np.inf)
        for other in self._others(number):
            checkpoint()
            met = meet(seen, seen.points, self.surfaces[other], self.weights[other])
            self.agreements[number][other] = agreement = agreement_of(seen, met, self.reach)
            self.tolerances[number, other] = agreement.deviation
            same = self._is_same(met, number, other)
            best[same] = np.maximum(best[same], met.weight[same])
        return best

    def _is_same(self, met: Meeting, number: int, other: int) -> NDArray[np.bool_]:
        """Whether positions of a view are of the surface that they meet, (Q,)."""
        if self.rules.tolerance is not None:
            return met.distance <= self.rules.tolerance
        deviation = self.tolerances[number, other]
        with np.errstate(invalid="ignore"):
            return met.distance <= np.minimum(SCATTER * deviation + met.spacing, self.reach)

    def _uncovered(self, number: int, shown: Sequence[NDArray[np.bool_]]) -> NDArray[np.bool_]:
        """Tell which faces of a view have a part that no other view shows, (F,)."""
        seen, shares = self.surfaces[number], _shares(self._parts(number))
        uncovered = np.zeros(len(seen.faces), bool)
        for start in range(0, len(seen.faces), _FACES_AT_ONCE):
            positions = (shares @ seen.points[seen.faces[start : start + _FACES_AT_ONCE]]).reshape(-1, 3)
            lacking = np.arange(len(positions))
            for other in self._others(number):
                checkpoint()
                met = meet(seen, positions[lacking], self.surfaces[other], faces=shown[other])
                lacking = lacking[~self._is_same(met, number, other)]
            uncovered[start + lacking // len(shares)] = True
        return uncovered

    def _parts(self, number: int) -> int:
        """Number of parts in which edges of a view's triangles are looked at, by how fine the others are."""
        own, *others = (
            np.median(surface.spacing(surface.points, surface.normals))
            for surface in [self.surfaces[number], *(self.surfaces[other] for other in self._others(number))]
        )
        return int(np.clip(np.ceil(2 * own / min(others)), 2, _FINEST))

    def _areas(self, shown: Sequence[NDArray[np.bool_]]) -> tuple[float, float]:
        """The area of faces (F,) of each view, each patch once, and that of patches of several views."""
        whole = shared = 0.0
        for number, seen in enumerate(self.surfaces):
            rows = np.flatnonzero(shown[number])
            centers = seen.points[seen.faces[rows]].mean(axis=1)
            times = np.ones(len(rows))
            for other in self._others(number):
                checkpoint()
                met = meet(seen, centers, self.surfaces[other], faces=shown[other])
                times += self._is_same(met, number, other)
            areas = seen.face_areas()[rows] / times
            whole, shared = whole + float(areas.sum()), shared + float(areas[times > 1].sum())
        return whole, shared

    def _masked(self, number: int, won: NDArray[np.bool_], shown: NDArray[np.bool_]) -> RangeView:
        """A view whose mask keeps the corners of the faces that are shown, and points of no face that won."""
        surface = self.surfaces[number]
        alone = np.ones(len(won), bool)
        alone[surface.faces.ravel()] = False
        stays = won & alone
        stays[surface.faces[shown].ravel()] = True
        return replace(surface.view, mask=surface.on_grid(stays))


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


def _shares(parts: int) -> Rays:
    """The corners' shares in places spread over a triangle, (M, 3)."""
    grid = [(a, b, parts - a - b) for a in range(parts + 1) for b in range(parts + 1 - a)]
    return _INSET * np.array(grid) / parts + (1 - _INSET) / 3
