"""The whole of a subject as a few hundred nodes that are moved from frame to frame together.

Which of two limbs a patch lies on, the patch cannot tell, but what the limbs hang on does. Nodes are spread
over the points of one frame and held by those beside them along the surface, each about as a rigid body
(as-rigid-as-possible, Sorkine and Alexa 2007); the points of the next frame are shared out softly among them,
ever closer (coherent point drift, Myronenko and Song 2010), so that each part of the frame is taken by one
part of the body.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

_NODES = 300
_TARGETS = 900  # points of a frame that they are moved onto
_LOOKED_AT = 10_000  # points at most that either are chosen from
_BESIDE = 8  # nodes that hold a node
_JOINED = 3.0  # spacings between points that are taken to be beside each other on the surface
_ROUNDS = 30
_WIDEST = 0.4, 1.5  # node distances: standard deviation of the first round, least and most
_CLOSEST = 0.3  # that of the last one
_STIFF = 3.0, 0.1  # of the body against the points, first and last
_STRAY = 0.1  # of a point's share that belongs to no node
_PREDICTED = 0.01  # weight of places that the speed tells, against the body's stiffness


class Grip(NamedTuple):
    """A place that goes along with a body.

    nodes: (k,), those around it. weights: (k,), their sum 1. offsets: (k, 3), the place from each node, as at
    rest. turn: (3, 3), of the body there when it was gripped.
    """

    nodes: NDArray[np.intp]
    weights: Float
    offsets: Float
    turn: Float


@dataclass(frozen=True, eq=False)
class BodyPose:
    """The places of the N nodes of a body, (N, 3), and how each is turned, (N, 3, 3)."""

    places: Float
    turns: Float


class DeformableBody:
    """A deformable model of all that one frame shows, and where it is.

    distance: how far apart its nodes are, scan units.
    """

    def __init__(self, points: Float, spacing: float) -> None:
        """points: (P, 3) of the frame, all at rest. spacing: between neighbours."""
        from scipy.sparse import csr_matrix
        from scipy.sparse.csgraph import dijkstra
        from scipy.spatial import cKDTree

        some = _some(points)
        reach = _JOINED * spacing * np.sqrt(len(points) / len(some))
        distances, others = cKDTree(some).query(some, _BESIDE + 1, distance_upper_bound=reach)
        is_there = np.isfinite(distances)
        is_inner = is_there.sum(axis=1) > _BESIDE // 2  # stray points would each be a node
        is_there &= is_inner[:, None]
        starts = np.broadcast_to(np.arange(len(some))[:, None], others.shape)[is_there]
        graph = csr_matrix((distances[is_there], (starts, others[is_there])), shape=(len(some),) * 2)
        inner = np.flatnonzero(is_inner) if is_inner.any() else np.arange(len(some))
        chosen, farthest = _spread(some[inner], _NODES)
        self.distance = max(farthest, spacing)
        rows = inner[chosen]
        rest = some[rows]
        count = len(rows)
        along = dijkstra(graph, directed=False, indices=rows, limit=6 * self.distance)[:, rows]
        nearest = np.argsort(along, axis=1)[:, 1 : _BESIDE + 1]
        is_beside = np.zeros((count, count), bool)
        is_beside[np.arange(count)[:, None], nearest] = np.isfinite(
            np.take_along_axis(along, nearest, axis=1)
        )
        is_beside |= is_beside.T
        one, self._others = np.nonzero(is_beside)
        self._firsts = np.searchsorted(one, np.arange(count + 1))
        self._edges = rest[self._others] - rest[one]
        self.pose = self._before = BodyPose(rest, np.tile(np.eye(3), (count, 1, 1)))

    def move_to(self, points: Float) -> None:
        """Move it onto the points (P, 3) of the next frame; where there are none it stays."""
        from scipy.spatial import cKDTree

        from .body_kernels import share_out

        before, self._before = self._before, self.pose
        if not len(points):
            return
        some = _some(points)
        targets = some[_spread(some, _TARGETS)[0]]
        pose = self._predicted(before)
        off = np.quantile(cKDTree(pose.places).query(targets)[0], 0.98) / self.distance
        first = np.clip(off / 2, *_WIDEST)
        many = len(targets) / len(pose.places)
        weights, wanted = np.empty(len(pose.places)), np.empty_like(pose.places)
        for share in np.linspace(0, 1, _ROUNDS):
            deviation = self.distance * first ** (1 - share) * _CLOSEST**share
            share_out(pose.places, targets, deviation, _STRAY, weights, wanted)
            pose = self._settled(pose, many * _STIFF[0] ** (1 - share) * _STIFF[1] ** share, weights, wanted)
        self.pose = pose

    def gripped(self, place: Float) -> Grip:
        """The grip of a place (3,) of the body as it is now."""
        from_all = np.linalg.norm(self.pose.places - place, axis=1)
        nearest = int(from_all.argmin())
        around = np.append(self._others[self._firsts[nearest] : self._firsts[nearest + 1]], nearest)
        reach = 1.01 * max(from_all[around].max(), self.distance)
        weights = (1 - from_all[around] / reach) ** 2
        weights /= weights.sum()
        arms = place - self.pose.places[around]
        offsets = np.einsum("nji,nj->ni", self.pose.turns[around], arms)
        return Grip(around, weights, offsets, _rotation(weights, self.pose.turns[around]))

    def carried(self, grip: Grip) -> tuple[Float, Float]:
        """The place that is held now, (3,), and how it has been turned since it was gripped, (3, 3)."""
        turns = self.pose.turns[grip.nodes]
        places = np.einsum("nij,nj->ni", turns, grip.offsets) + self.pose.places[grip.nodes]
        return grip.weights @ places, _rotation(grip.weights, turns) @ grip.turn.T

    def _predicted(self, before: BodyPose) -> BodyPose:
        """The pose that follows if all parts move and turn on as from the pose before to the one now."""
        now = self.pose
        wanted = 2 * now.places - before.places
        pose = BodyPose(wanted, now.turns @ before.turns.transpose(0, 2, 1) @ now.turns)
        weights = np.full(len(wanted), _PREDICTED)
        for _ in range(4):
            pose = self._settled(pose, 1.0, weights, wanted)
        return pose

    def _settled(self, pose: BodyPose, stiffness: float, weights: Float, wanted: Float) -> BodyPose:
        """The pose after a step towards places (N, 3) that are wanted of nodes, with weights (N,)."""
        from .body_kernels import settle_nodes

        places, products = pose.places.copy(), np.empty_like(pose.turns)
        settle_nodes(
            self._firsts, self._others, self._edges, pose.turns, stiffness, weights, wanted, places, products
        )  # fmt: skip
        return BodyPose(places, _rotations(products))


def _some(points: Float) -> Float:
    """So many of the points (P, 3) as are looked at, evenly."""
    return np.ascontiguousarray(points[:: max(1, -(-len(points) // _LOOKED_AT))])


def _spread(points: Float, count: int) -> tuple[NDArray[np.int64], float]:
    """The rows of so many points, each the farthest from those before, and how far the next one would be."""
    from .body_kernels import spread_out

    chosen = np.empty(min(count, len(points)), np.int64)
    return chosen, spread_out(points, chosen)


def _rotations(matrices: Float) -> Float:
    """The rotations nearest to matrices (N, 3, 3) (Kabsch 1976)."""
    left, _, right = np.linalg.svd(matrices)
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
    return left @ right


def _rotation(weights: Float, turns: Float) -> Float:
    """The mean of rotations (k, 3, 3) with weights (k,)."""
    return _rotations(np.tensordot(weights, turns, axes=1)[None])[0]
