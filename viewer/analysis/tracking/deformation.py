"""How the surface of a reference frame deforms into the other frames.

The nodes of a body (`body`) carry places of the reference frame along (embedded deformation: Sumner, Schmid
and Pauly 2007). The body first moves onto a frame as a whole, in the shape that it has in the frame beside.
Then places all over the reference frame draw its nodes: along the normals of the surface beside them (point
to plane, Chen and Medioni 1992), along it where colours change (Park, Zhou and Koltun 2017), and to the
points themselves where these recur (`pattern`). Where the subject opens, nodes let go of each other. These
places are always compared with the reference frame, never with the frame before: errors do not add up.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...threads import ranges, shares, threads_for, together
from .body import BodyPose, DeformableBody
from .pattern import ExpectedPoints, RecurringPoints
from .surface import MomentSurface

if TYPE_CHECKING:
    from .deformation_kernels import CarriedPlaces, PlaceMatches, PullScales

Float = NDArray[np.float64]

FLOOR = 0.03  # spacings: what a standard deviation is at least
LOST = 2.5  # spacings: a larger standard deviation tells nothing
MOST_PLACES = 25_000  # of the reference frame that draw the body
_ROUNDS = 10
_REACH = 3.0, 2.0  # spacings that a place is drawn over, first and last
_LOOSE = 6.0, 4.0  # of the usual deviations, at which a residual counts as an outlier, first and last
_STIFF = 0.3, 0.1  # of the body, first and last
_LEAST_OFF = 0.02  # spacings: deviations of distances are taken to be this at least
_LEAST_COLOR = 0.002  # of a byte's range, as of colours
_DEVIATION = 1.4826  # standard deviation of Gaussian residuals, by their median absolute deviation
_RIDGE = 1e-9
_ALIKE = 14.0  # places whose errors are alike, as their parabolas share points
_BENDING = 1.5  # of the strains around a node, that they may be off


@dataclass(frozen=True, eq=False)
class Deformed:
    """The K nodes of the body in a frame.

    spreads: (K,), the standard deviations of their positions, scan units. rows: (N,) int32, of the points of
    the frame that are those of the reference frame, -1 where none is known.
    """

    pose: BodyPose
    spreads: Float
    rows: NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class PlacesFound:
    """P places of the reference frame in another one.

    positions: (P, 3). is_seen: (P,), whether the frame has a surface there that faces as the place does.
    variances: (P,), of the positions.
    """

    positions: Float
    is_seen: NDArray[np.bool_]
    variances: Float


class DeformingSurface:
    """The surface of a reference frame, and the body that carries it into the others.

    places: (N, 3), the points of the frame on its surface, without their noise. held: these, as the body at
    rest carries them.
    """

    def __init__(self, surface: MomentSurface) -> None:
        from .deformation_kernels import CarriedPlaces, fit_rows

        self.surface = surface
        held, count = surface.held, len(surface.held.points)
        self._body = DeformableBody(held.points, surface.spacing)
        self._rest = self._body.pose
        self.places, normals, fitted = held.points.copy(), np.zeros((count, 3)), np.zeros(count, bool)
        rows = np.arange(count)

        def fit(first: int, last: int) -> None:
            part = slice(first, last)
            fit_rows(held, rows[part], self.places[part], normals[part], fitted[part])

        together(count, [partial(fit, *share) for share in shares(count)])
        colors = np.ascontiguousarray(held.parabolas[:, 1:, 0], np.float64)
        colors[~fitted] = 0.0
        self.held = self.hold(self.places, normals, colors)
        self._some = np.arange(0, count, max(1, count // MOST_PLACES))
        nodes, *others = self.held
        self._chosen = CarriedPlaces(
            nodes[self._some].astype(np.int32), *(each[self._some] for each in others)
        )

    def hold(self, places: Float, normals: Float, colors: Float) -> CarriedPlaces:
        """Places (P, 3) of the reference frame, with normals (P, 3) and colours (P, C), as the body at rest
        carries them."""
        from .deformation_kernels import CarriedPlaces

        nodes, weights, offsets = self._body.around(places)
        return CarriedPlaces(nodes.astype(np.int32), weights, offsets, normals, colors)

    @property
    def at_rest(self) -> Deformed:
        """The body in the reference frame itself."""
        count = len(self.places)
        return Deformed(self._rest, np.zeros(len(self._rest.positions)), np.arange(count, dtype=np.int32))

    def follow(
        self,
        now: MomentSurface,
        before: MomentSurface,
        last: BodyPose | None,
        earlier: BodyPose | None,
        rows: NDArray[np.int32],
    ) -> Deformed:
        """Find the body in a frame. before: the surface of the frame beside it.

        last, earlier: its poses there, and in the frame before that; None: at rest. rows: (N,), of the points
        of the frame beside it, see `Deformed`.
        """
        recurring = RecurringPoints(before, now, np.empty((0, 3)), np.empty((0, 3)))
        last = last or self._rest
        step = self._body.reformed(last, earlier or self._rest)
        step.go_to(now.held.points, recurring)
        start = BodyPose(step.pose.positions, step.pose.turns @ last.turns)
        rows = self._recurring(start, now, np.where(rows >= 0, recurring.matches[rows], -1))
        return self._refined(start, now, rows)

    def find(self, held: CarriedPlaces, deformed: Deformed, now: MomentSurface) -> PlacesFound:
        """Find places in a frame in which the body is deformed."""
        found = self._matched(self._torn(held, deformed.pose), deformed.pose, now, _REACH[1])
        variances = (held.weights * deformed.spreads[held.nodes] ** 2).sum(axis=1)
        return PlacesFound(found.places, found.is_matched, variances)

    def _recurring(self, start: BodyPose, now: MomentSurface, known: NDArray[np.int64]) -> NDArray[np.int32]:
        """The rows of the points in a frame, see `Deformed`. start: about where the body is. known: (N,), the
        rows that the frame beside tells, or -1."""
        from .deformation_kernels import carry_places

        places, held = self.places, self.held
        there = np.empty_like(places)
        carry_places(held, start.positions, start.turns, 0, len(places), there)
        shifts = self.surface.held.points - places
        expected = ExpectedPoints(known, there + shifts, start.turns[held.nodes[:, 0]])
        nowhere = np.empty((0, 3))
        direct = RecurringPoints(self.surface, now, nowhere, nowhere, expected)
        return np.where(direct.matches >= 0, direct.matches, known).astype(np.int32)

    def _refined(self, pose: BodyPose, now: MomentSurface, rows: NDArray[np.int32]) -> Deformed:
        """A pose drawn by places to a frame. rows: (N,), see `Deformed`."""
        from .deformation_kernels import gather_pulls

        body, held, some = self._body, self._chosen, self._some
        known = np.full((len(some), 3), np.nan)
        matches = rows[some]
        is_known = matches >= 0
        points = self.surface.held.points
        known[is_known] = (now.held.points[matches] + (self.places - points)[some])[is_known]
        pulls, pushes = np.empty_like(pose.turns), np.empty_like(pose.positions)
        share = held.weights.sum() / len(pose.positions)  # of places, that draw a node
        stiffness, off = _STIFF[1], 0.0
        for part in np.linspace(0, 1, _ROUNDS):
            reach = now.spacing * _REACH[0] ** (1 - part) * _REACH[1] ** part
            torn = self._torn(held, pose)
            found = self._matched(torn, pose, now, reach)
            scales = _scales(found, now)
            loose = _LOOSE[0] ** (1 - part) * _LOOSE[1] ** part
            gather_pulls(torn, found, known, scales, loose, pulls, pushes)
            pulls /= share
            pushes /= share
            ways = np.linalg.solve(pulls + _RIDGE * np.eye(3), pushes[..., None])[..., 0]
            stiffness, off = _STIFF[0] ** (1 - part) * _STIFF[1] ** part, scales.off
            pose = body.strained(pose, stiffness, pulls, pose.positions + ways)
        noise = off * np.sqrt(_ALIKE / share)
        deviations = body.deviations(pose, stiffness, pulls, noise, _BENDING)
        return Deformed(pose, np.hypot(deviations, FLOOR * now.spacing), rows)

    def _matched(self, held: CarriedPlaces, pose: BodyPose, now: MomentSurface, reach: float) -> PlaceMatches:
        """Places as a body in a pose carries them, beside the surface of a frame."""
        from .deformation_kernels import PlaceMatches, carry_places, find_beside, fit_surface, match_places

        count, channels = held.colors.shape
        if now.held.colors.shape[1] != channels:  # one of them has no colours
            channels = 0
        found = PlaceMatches(
            np.empty((count, 3)),
            np.empty(count, np.int64),
            np.zeros(count, bool),
            np.empty(count),
            np.empty((count, 3)),
            np.empty((count, channels)),
            np.empty((count, channels, 3)),
        )
        points = len(now.held.points)

        def each(work: Callable[[int, int], object], count: int) -> None:
            borders = np.linspace(0, count, threads_for(points) + 1).astype(np.int64)
            together(points, [partial(work, first, last) for first, last in ranges(borders)])

        def find(first: int, last: int) -> None:
            carry_places(held, pose.positions, pose.turns, first, last, found.places)
            find_beside(now.held, reach, first, last, found)

        each(find, count)
        rows = found.rows[found.rows >= 0]
        rows = np.unique(rows[now.held.state[rows] == 0])
        each(lambda first, last: fit_surface(now.held, rows, first, last), len(rows))
        each(lambda first, last: match_places(now.held, held, pose.turns, first, last, found), count)
        return found

    def _torn(self, held: CarriedPlaces, pose: BodyPose) -> CarriedPlaces:
        """Places that go along with the nearest of their nodes, and with the others as far as these do."""
        weights = held.weights * self._body.intact(pose)[held.nodes[:, 0]]
        return held._replace(weights=weights / weights.sum(axis=1, keepdims=True))


def _scales(found: PlaceMatches, now: MomentSurface) -> PullScales:
    """The standard deviations of the distances and colours of matched places.

    They are those of the frame's points from the parabolas around them: where the body is changes nothing.
    """
    from .deformation_kernels import PullScales

    rows, channels = found.rows[found.is_matched], found.colors.shape[1]
    least = np.array([_LEAST_OFF * now.spacing, *[_LEAST_COLOR] * channels])
    shifts, scales = np.zeros(channels), least
    if len(rows):
        heights = now.held.parabolas[rows, : 1 + channels, 0]
        heights[:, 1:] -= now.held.colors[rows, :channels]
        shifts = np.median(found.colors[found.is_matched], axis=0)
        scales = np.maximum(_DEVIATION * np.median(np.abs(heights), axis=0), least)
    return PullScales(float(scales[0]), scales[1:], shifts)
