"""Where every point of a reference frame is in the other frames.

The nodes of a body (`tracking.body`) carry the points along (embedded deformation: Sumner, Schmid and Pauly
2007). The body first moves onto a frame as a whole, in the shape that it has in the frame beside. Then places
all over the reference frame draw its nodes: along the normals of the surface beside them (point to plane,
Chen and Medioni 1992), along it where colours change (Park, Zhou and Koltun 2017), and to the points
themselves where these recur (`tracking.pattern`). Where the subject opens, nodes let go of each other. These
places are always compared with the reference frame, never with the frame before: errors do not add up.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property, partial
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...scan.pose import Pose
from ...scan.spacing import typical_spacing
from ...scan.timeline import Timeline
from ...task import checkpoint
from ...threads import ranges, threads_for, together
from ..tracking.body import BodyPose, DeformableBody
from ..tracking.pattern import ExpectedPoints, RecurringPoints
from ..tracking.surface import MomentSurface
from .stabilise import outward

if TYPE_CHECKING:
    from .dense_kernels import CarriedPlaces, PlaceMatches, PullScales

Float = NDArray[np.float64]

_PLACES = 25_000  # of the reference frame that draw the body
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
_UNSUPPORTED = 0.04  # of the way from the nearest point that is seen, the deviation of a hidden one
_FLOOR = 0.03  # spacings: what a standard deviation is at least
_EXACT = 0.06  # spacings: noise up to which recurring points are taken as they are; bending makes up to 0.055
_AROUND = 13  # points, with the one in the middle, that tell its noise
_MEDIAN_SQUARE = 2.366  # of three Gaussian numbers: the median of the sum of their squares
_LOST = 2.5  # spacings: a larger standard deviation tells nothing


class PointState(IntEnum):
    """State of a point in a frame: seen there; hidden, so that others predict it; or not determined."""

    SEEN = 0
    HIDDEN = 1
    LOST = 2


@dataclass(frozen=True, eq=False)
class TrackedFrame:
    """The N points of the reference frame as they are in another frame.

    displacement: (N, 3) float32, scan units. sigma: (N,) float32, the standard deviation of the position in
    its most uncertain direction. state: (N,) uint8, see `PointState`. pose: of the body; None where
    it was not moved to the frame. rows: (N,) int32, of the points of the frame that are the same, -1 where
    none is known.
    """

    displacement: NDArray[np.float32]
    sigma: NDArray[np.float32]
    state: NDArray[np.uint8]
    pose: BodyPose | None
    rows: NDArray[np.int32]


class _Carried(NamedTuple):
    """A body, how it lies at rest, the places that it carries there, (N, 3), and those that draw it, by
    rows."""

    body: DeformableBody
    rest: BodyPose
    places: Float
    held: CarriedPlaces
    some: NDArray[np.int64]
    chosen: CarriedPlaces


class DensePoints:
    """The points of a reference frame, and the body that carries them through the others.

    points: (N, 3), relative to the origin of the surface.
    """

    def __init__(self, pose: Pose) -> None:
        self.pose = pose
        self.surface = _surface(pose, pose.cloud.origin)
        self.points = self.surface.held.points

    @property
    def reference(self) -> Float:
        """The positions of the points in the coordinates of the scan, (N, 3)."""
        return self.pose.cloud.world()

    @property
    def at_rest(self) -> TrackedFrame:
        """The reference frame itself."""
        count = len(self.points)
        return TrackedFrame(
            np.zeros((count, 3), np.float32),
            np.zeros(count, np.float32),
            np.full(count, PointState.SEEN, np.uint8),
            None,
            np.arange(count, dtype=np.int32),
        )

    @property
    def lost(self) -> TrackedFrame:
        """A frame that cannot be read."""
        count = len(self.points)
        return TrackedFrame(
            np.full((count, 3), np.nan, np.float32),
            np.full(count, np.nan, np.float32),
            np.full(count, PointState.LOST, np.uint8),
            None,
            np.full(count, -1, np.int32),
        )

    def is_same(self, pose: Pose) -> bool:
        """Whether the scan says which points of another pose are the same."""
        topology = self.pose.cloud.topology
        return topology is not None and pose.cloud.topology == topology

    def same(self, pose: Pose) -> TrackedFrame:
        """The points in a pose in which the scan says which they are; lost are those that it lacks."""
        ours, theirs = (
            np.arange(len(cloud)) if cloud.ids is None else cloud.ids
            for cloud in (self.pose.cloud, pose.cloud)
        )
        rows = np.minimum(np.searchsorted(theirs, ours), len(theirs) - 1)
        there = theirs[rows] == ours
        found = self.lost
        found.displacement[there] = pose.cloud.world()[rows[there]] - self.reference[there]
        found.sigma[there], found.state[there], found.rows[there] = 0.0, PointState.SEEN, rows[there]
        return found

    def surface_of(self, pose: Pose) -> MomentSurface:
        """The surface of another pose, relative to the origin of the reference frame."""
        return _surface(pose, self.pose.cloud.origin)

    def follow(
        self, now: MomentSurface, before: MomentSurface, beside: TrackedFrame, earlier: TrackedFrame
    ) -> TrackedFrame:
        """Find the points in a frame. before: the surface of the frame beside it.

        beside, earlier: the points there, and in the frame before that.
        """
        body, rest, places, held, *_ = self._carried
        recurring = RecurringPoints(before, now, np.empty((0, 3)), np.empty((0, 3)))
        last = beside.pose or rest
        step = body.reformed(last, earlier.pose or rest)
        step.go_to(now.held.points, recurring)
        start = BodyPose(step.pose.positions, step.pose.turns @ last.turns)
        rows = self._recurring(start, now, np.where(beside.rows >= 0, recurring.matches[beside.rows], -1))
        pose, spreads = self._refined(start, now, rows)
        found = self._matched(_torn(held, body, pose), pose, now, _REACH[1])
        known = rows >= 0
        moved = found.places - places
        is_seen = found.is_matched | known
        away = self._distances(is_seen)
        variance = (held.weights * spreads[held.nodes] ** 2).sum(axis=1) + (_UNSUPPORTED * away) ** 2
        ways = now.held.points[rows] - self.points
        noise = self._noise_of(ways, known)
        of_points = (_FLOOR * now.spacing) ** 2 + noise**2
        if noise <= _EXACT * now.spacing:
            moved[known], variance[known] = ways[known], of_points
        else:  # the body tells as well, without the noise of both frames
            share = (variance / (variance + of_points))[known]
            moved[known] += share[:, None] * (ways - moved)[known]
            variance[known] *= 1 - share
        sigma = np.sqrt(np.maximum(variance, (_FLOOR * now.spacing) ** 2))
        state = np.where(is_seen, PointState.SEEN, PointState.HIDDEN).astype(np.uint8)
        state[~(sigma <= _LOST * now.spacing)] = PointState.LOST
        return TrackedFrame(moved.astype(np.float32), sigma.astype(np.float32), state, pose, rows)

    def _recurring(self, start: BodyPose, now: MomentSurface, known: NDArray[np.int64]) -> NDArray[np.int32]:
        """The rows of the points in a frame, (N,), -1 where they do not recur. start: about where the body
        is. known: (N,), the rows that the frame beside tells, or -1."""
        from .dense_kernels import carry_places

        _, _, places, held, *_ = self._carried
        there = np.empty_like(places)
        carry_places(held, start.positions, start.turns, 0, len(places), there)
        expected = ExpectedPoints(known, there + (self.points - places), start.turns[held.nodes[:, 0]])
        nowhere = np.empty((0, 3))
        direct = RecurringPoints(self.surface, now, nowhere, nowhere, expected)
        return np.where(direct.matches >= 0, direct.matches, known).astype(np.int32)

    @cached_property
    def _carried(self) -> _Carried:
        """The body at rest, and the places of the points on the surface, without their noise."""
        from .dense_kernels import CarriedPlaces
        from .region_kernels import fit_rows

        body = DeformableBody(self.points, self.surface.spacing)
        count, held = len(self.points), self.surface.held
        places, normals, fitted = self.points.copy(), np.zeros((count, 3)), np.zeros(count, bool)
        fit_rows(held, np.arange(count), places, normals, fitted)
        colors = np.ascontiguousarray(held.parabolas[:, 1:, 0], np.float64)
        colors[~fitted] = 0.0
        nodes, weights, offsets = body.around(places)
        all_of_them = CarriedPlaces(nodes.astype(np.int32), weights, offsets, normals, colors)
        some = np.arange(0, count, max(1, count // _PLACES))
        chosen = CarriedPlaces(nodes[some].astype(np.int32), *(each[some] for each in all_of_them[1:]))
        return _Carried(body, body.pose, places, all_of_them, some, chosen)

    @cached_property
    def _predictions(self) -> tuple[NDArray[np.intp], Float]:
        """Some points and those around each, (n, 13) rows; and the shares (n, 12) of their ways that predict
        its own, if the surface is stretched alike there."""
        from scipy.spatial import cKDTree

        some = self.points[:: max(1, len(self.points) // _PLACES)]
        rows = cKDTree(self.points).query(some, [*range(1, min(_AROUND, len(self.points)) + 1)])[1]
        offsets = self.points[rows[:, 1:]] - self.points[rows[:, :1]]
        tangents = np.linalg.eigh(np.einsum("nki,nkj->nij", offsets, offsets))[1][:, :, 1:]
        flat = np.concatenate([np.ones((*offsets.shape[:2], 1)), offsets @ tangents], axis=2)
        return rows, np.linalg.pinv(flat)[:, 0]

    def _noise_of(self, ways: Float, known: NDArray[np.bool_]) -> float:
        """The standard deviation that noise of both frames gives the ways (N, 3) of points along an axis: so
        much are they off what those around predict. known: (N,). 0 where too few are."""
        rows, shares = self._predictions
        told = known[rows].all(axis=1)
        if rows.shape[1] < _AROUND or not told.any():
            return 0.0
        rows, shares = rows[told], shares[told]
        off = ways[rows[:, 0]] - np.einsum("nk,nki->ni", shares, ways[rows[:, 1:]])
        squares = np.square(off).sum(axis=1) / (1 + np.square(shares).sum(axis=1))
        return float(np.sqrt(np.median(squares) / _MEDIAN_SQUARE))

    def _distances(self, is_seen: NDArray[np.bool_]) -> Float:
        """How far each point is from those that a frame shows, at rest, (N,); inf where it shows none."""
        from scipy.spatial import cKDTree

        away = np.zeros(len(self.points))
        if not is_seen.all():
            some = self.points[is_seen][:: max(1, int(is_seen.sum()) // _PLACES)]
            away[~is_seen] = cKDTree(some).query(self.points[~is_seen])[0] if len(some) else np.inf
        return away

    def _refined(self, pose: BodyPose, now: MomentSurface, rows: NDArray[np.int32]) -> tuple[BodyPose, Float]:
        """A pose drawn by places to a frame, and the standard deviations of its nodes, (K,).

        rows: (N,), of the points of the frame that are known to be the same, or -1.
        """
        from .dense_kernels import gather_pulls

        body, _, places, _, some, held = self._carried
        known = np.full((len(some), 3), np.nan)
        matches = rows[some]
        is_known = matches >= 0
        known[is_known] = (now.held.points[matches] + (places - self.points)[some])[is_known]
        pulls, pushes = np.empty_like(pose.turns), np.empty_like(pose.positions)
        share = held.weights.sum() / len(pose.positions)  # of places, that draw a node
        stiffness, off = _STIFF[1], 0.0
        for part in np.linspace(0, 1, _ROUNDS):
            reach = now.spacing * _REACH[0] ** (1 - part) * _REACH[1] ** part
            torn = _torn(held, body, pose)
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
        return pose, np.hypot(deviations, _FLOOR * now.spacing)

    def _matched(self, held: CarriedPlaces, pose: BodyPose, now: MomentSurface, reach: float) -> PlaceMatches:
        """Places as a body in a pose carries them, beside the surface of a frame."""
        from .dense_kernels import PlaceMatches, carry_places, find_beside, fit_surface, match_places

        count, channels = held.colors.shape
        if now.held.colors.shape[1] != channels:  # one of the frames has no colours
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


def _torn(held: CarriedPlaces, body: DeformableBody, pose: BodyPose) -> CarriedPlaces:
    """Places that go along with the nearest of their nodes, and with the others as far as these do."""
    weights = held.weights * body.intact(pose)[held.nodes[:, 0]]
    return held._replace(weights=weights / weights.sum(axis=1, keepdims=True))


def _scales(found: PlaceMatches, now: MomentSurface) -> PullScales:
    """The standard deviations of the distances and colours of matched places.

    They are those of the frame's points from the parabolas around them: where the body is changes nothing.
    """
    from .dense_kernels import PullScales

    rows, channels = found.rows[found.is_matched], found.colors.shape[1]
    least = np.array([_LEAST_OFF * now.spacing, *[_LEAST_COLOR] * channels])
    shifts, scales = np.zeros(channels), least
    if len(rows):
        heights = now.held.parabolas[rows, : 1 + channels, 0]
        heights[:, 1:] -= now.held.colors[rows, :channels]
        shifts = np.median(found.colors[found.is_matched], axis=0)
        scales = np.maximum(_DEVIATION * np.median(np.abs(heights), axis=0), least)
    return PullScales(float(scales[0]), scales[1:], shifts)


def _surface(pose: Pose, origin: Float) -> MomentSurface:
    return MomentSurface.of(pose, origin, typical_spacing(pose.cloud))


class KeptFrames(Protocol):
    """A store of frames, by number."""

    def __contains__(self, frame: int) -> bool: ...

    def read(self, frame: int) -> TrackedFrame: ...

    def save(self, frame: int, found: TrackedFrame) -> None: ...


def follow_points(
    timeline: Timeline, points: DensePoints, reference: int | None, kept: KeptFrames
) -> Iterator[int]:
    """Follow the points through each frame that is not kept yet, outward from the reference; gives the frame.

    reference: its frame; None: it is none of the scan's. Raises Cancelled between frames, see `checkpoint`;
    another call goes on from there.
    """
    order = outward(range(len(timeline)), points.pose.index)
    read: dict[int | None, int | None] = {None: None}  # the last frame that could be read, up to each one
    earlier: dict[int | None, int | None] = {None: None}  # the one before it
    surfaces: dict[int, MomentSurface] = {}  # of the last frame in each direction

    def surface(frame: int | None) -> MomentSurface:
        if frame is None:
            return points.surface
        return surfaces.pop(frame, None) or points.surface_of(timeline.visit(frame))

    def tracked(frame: int | None) -> TrackedFrame:
        return points.at_rest if frame is None else kept.read(frame)

    for number, (frame, beside) in enumerate(order):
        checkpoint(number / len(order))
        last = read[beside]
        if frame in kept:
            is_read = not (kept.read(frame).state == PointState.LOST).all()
        else:
            try:
                pose = timeline.visit(frame)
            except InputError:
                found, is_read = points.lost, False
            else:
                is_read = True
                if frame == reference:
                    found = points.at_rest
                elif points.is_same(pose):
                    found = points.same(pose)
                else:
                    now, before = points.surface_of(pose), surface(last)
                    found = points.follow(now, before, tracked(last), tracked(earlier[last]))
                    surfaces[frame] = now
            kept.save(frame, found)
            yield frame
        if frame == reference:
            read[frame] = None
        else:
            read[frame] = frame if is_read else last
            earlier[frame] = last
