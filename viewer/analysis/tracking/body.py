"""The whole of a subject as up to two thousand nodes that are moved from frame to frame together.

A patch cannot tell which of two limbs it lies on, but the limb's root can. Nodes are spread over the points
of one frame. The nodes beside each other along the surface hold each other about as a rigid body
(as-rigid-as-possible, Sorkine and Alexa 2007). In the next frame each node is drawn onto the tangent plane of
the nearest surface that faces as it does (non-rigid point-to-plane registration, Li et al. 2008), first over
long ways and stiffly, then closely and softly.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .registration import rotations
from .surface import MomentSurface

if TYPE_CHECKING:
    from .pattern import RecurringPoints

Float = NDArray[np.float64]

_NODES = 2000  # at most
_SHARE = 4  # points to a node, at least
_TARGETS = 900  # points of a frame by which poses are compared
_LOOKED_AT = 10_000  # points at most that nodes are chosen from and drawn to
_BESIDE = 8  # nodes that hold a node
_WAY = 6.0  # node distances along the surface, within which nodes hold each other
_STARTS = 100  # nodes at a time, of which the ways to the others are found
_JOINED = 2.5  # local spacings between points that lie beside each other on the surface
_STRAY = 8.0  # spacings to the fourth neighbour, from which on a point belongs to nothing
_PIECE = 0.01  # of the points: a smaller connected piece is no part of the body
_ROUNDS = 16
_REACH = 12.0, 2.5  # spacings that a node is drawn over, first and last
_STIFF = 2.0, 0.05  # of the body against the surface, first and last
_YIELD = 0.2  # of its length that an edge is stretched by, at which it keeps half of its stiffness
_YIELDS = 0.7  # of the rounds, after which stretched edges yield
_PREDICTED = 0.01  # weight of positions that the speed predicts, against the body's stiffness
_STEPS = 60  # of conjugate gradients at most
_CAPPED = 3.0  # node distances: a longer way counts as this one where poses are compared
_UNSTRAINED = 0.1  # of a node's edges, that hold its map to a rotation
_EASE = 0.02  # strain of the map at which it is held by a quarter of this
_LEAST_HELD = 1e-6  # the same at least: a node whose edges all let go keeps a map
_PROBES = 8  # random changes that say how exactly nodes are held
_PROBING = 2  # threads
_USUAL = 0.75  # of the nodes, that are strained less: strains are off by a share of this at least
_SMOOTH = 3  # times that random strains are averaged with those beside them
_HELD = 1e-6  # a smaller weight of a target holds nothing
_STRETCH = 3.0  # spacings that count as much as a stretch by the whole length


class Grip(NamedTuple):
    """Places that go along with a body.

    nodes: (n, k), those around each position. weights: (n, k), their sum 1. offsets: (n, k, 3), the position
    from each node, as at rest. turns: (n, 3, 3), of the body there when it was gripped.
    """

    nodes: NDArray[np.intp]
    weights: Float
    offsets: Float
    turns: Float


class NodesAround(NamedTuple):
    """The nodes (..., k) around positions, their weights, and the way from each, (..., k, 3)."""

    nodes: NDArray[np.intp]
    weights: Float
    arms: Float


@dataclass(frozen=True, eq=False)
class BodyPose:
    """The positions of the N nodes of a body, (N, 3), and how each is turned, (N, 3, 3)."""

    positions: Float
    turns: Float


class DeformableBody:
    """A deformable model of all that one frame shows, and where it is.

    distance: how far apart its nodes are, scan units. slips: (N,), how far each node has been from where it
    was, at most, after a step to the next frame and back, scan units.
    """

    def __init__(self, points: Float, spacing: float) -> None:
        """points: (P, 3) of the frame, all at rest. spacing: between neighbours."""
        from scipy.sparse import csr_matrix
        from scipy.sparse.csgraph import connected_components, dijkstra
        from scipy.spatial import cKDTree

        from .body_kernels import normals_at

        self._spacing = spacing
        some = _some(points)
        reach = self._spacing_of(points, some)
        distances, others = cKDTree(some).query(some, min(_BESIDE + 1, len(some)))
        distances, others = distances.reshape(len(some), -1), others.reshape(len(some), -1)
        local = distances[:, min(_BESIDE // 2, distances.shape[1] - 1)]
        is_inner = local <= _STRAY * reach
        joined = distances <= _JOINED * np.maximum(local[:, None], local[others])
        joined &= is_inner[:, None] & is_inner[others]
        starts = np.broadcast_to(np.arange(len(some))[:, None], others.shape)[joined]
        graph = csr_matrix((distances[joined], (starts, others[joined])), shape=(len(some),) * 2)
        piece = connected_components(graph, directed=False)[1]
        is_inner = np.bincount(piece)[piece] >= _PIECE * len(some)  # the others would drift away
        inner = np.flatnonzero(is_inner) if is_inner.any() else np.arange(len(some))
        chosen, farthest = _spread(some[inner], min(_NODES, -(-len(inner) // _SHARE)))
        self.distance = max(farthest, spacing)
        rows = inner[chosen]
        rest = some[rows]
        count = len(rows)
        own = np.arange(count)[:, None]
        self._around = np.repeat(own, min(_BESIDE + 1, count), axis=1)
        for first in range(0, count, _STARTS):  # the ways from all nodes at once would fill the memory
            part = slice(first, first + _STARTS)
            along = dijkstra(graph, directed=False, indices=rows[part], limit=_WAY * self.distance)[:, rows]
            nearest = np.argsort(along, axis=1)[:, 1 : _BESIDE + 1]
            is_near = np.isfinite(np.take_along_axis(along, nearest, axis=1))
            self._around[part, 1:] = np.where(is_near, nearest, own[part])
        is_beside = np.zeros((count, count), bool)
        is_beside[own, self._around] = True
        is_beside |= is_beside.T
        np.fill_diagonal(is_beside, False)
        self._ones, self._others = np.nonzero(is_beside)
        self._firsts = np.searchsorted(self._ones, np.arange(count + 1))
        self._edges = rest[self._others] - rest[self._ones]
        self._rest = rest
        self._strengths = np.ones(len(self._edges))
        self._moments = self._products(rest, np.ones(len(self._edges)))
        self._surface = MomentSurface(some, reach)
        self._normals = normals_at(self._surface.held, rows)
        self.slips = np.zeros(count)
        self.pose = self._before = BodyPose(rest, np.tile(np.eye(3), (count, 1, 1)))

    def move_to(self, points: Float, recurring: RecurringPoints | None = None) -> None:
        """Move it onto the points (P, 3) of the next frame; where there are none it stays.

        recurring: points that the frame it is in and the next one have in common; nodes beside them go along.
        """
        before, surface = self.pose, self._surface
        self.go_to(points, recurring)
        if len(points):
            returned = self._drawn(self.pose, surface).positions - before.positions
            self.slips = np.maximum(self.slips, np.linalg.norm(returned, axis=1))

    def go_to(self, points: Float, recurring: RecurringPoints | None = None) -> None:
        """Move it as `move_to` does, without the way back that tells slips.

        It begins both from where it is and from where its speed takes it: the better fit counts.
        """
        before, self._before = self._before, self.pose
        if not len(points):
            return
        some = _some(points)
        surface = MomentSurface(some, self._spacing_of(points, some))
        targets = some[_spread(some, _TARGETS)[0]]
        known = None if recurring is None else recurring.moved(self.pose.positions, self._spacing)
        starts = self._predicted(before), self.pose
        others = surface.unfitted()  # each thread fits parabolas of its own
        with ThreadPoolExecutor(1, "scan4d-body") as pool:
            second = pool.submit(self._drawn, starts[1], others, known)
            found = [self._drawn(starts[0], surface, known), second.result()]
        self.pose = min(found, key=lambda pose: self._misfit(pose, targets))
        self._surface = surface

    def reformed(self, pose: BodyPose, before: BodyPose) -> DeformableBody:
        """The body with a pose as its shape at rest, which `go_to` then keeps; its turns count from there.

        before: its pose a frame earlier. What the pose tears apart holds little.
        """
        other, back = copy(self), np.linalg.inv(pose.turns)
        other._rest = pose.positions
        other._edges = pose.positions[self._others] - pose.positions[self._ones]
        other._moments = other._products(pose.positions, np.ones(len(self._edges)))
        other._strengths = self._holds(pose) ** 2
        other._normals = np.einsum("nij,nj->ni", rotations(pose.turns), self._normals)
        other.pose = BodyPose(pose.positions, np.tile(np.eye(3), (len(back), 1, 1)))
        other._before = BodyPose(before.positions, rotations(before.turns @ back))
        return other

    def gripped(self, positions: Float) -> Grip:
        """The grip of positions (..., 3) of the body as it is now."""
        nodes, weights, arms = self.around(positions)
        turns = self.pose.turns[nodes]
        return Grip(nodes, weights, np.einsum("...ji,...j->...i", turns, arms), _mean(weights, turns))

    def around(self, positions: Float) -> NodesAround:
        """The nodes around positions (..., 3) of the body as it is now."""
        from scipy.spatial import cKDTree

        nodes = self._around[cKDTree(self.pose.positions).query(positions)[1]]
        arms = positions[..., None, :] - self.pose.positions[nodes]
        away = np.linalg.norm(arms, axis=-1)
        reach = 1.01 * np.maximum(away.max(axis=-1, keepdims=True), self.distance)
        weights = (1 - away / reach) ** 2
        weights /= weights.sum(axis=-1, keepdims=True)
        return NodesAround(nodes, weights, arms)

    def deviations(
        self, pose: BodyPose, stiffness: float, pulls: Float, noise: float, bending: float
    ) -> Float:
        """How far off nodes may be, (N,), root mean square (perturbation sampling: Papandreou and Yuille
        2010): chance changes what holds them, and they are solved for anew.

        pulls: (N, 3, 3), weights of targets, whose deviation is the noise, scan units. bending: strains are
        off by this share of what they are around a node, and those of nodes near each other alike.
        """
        from .body_kernels import BodyEdges, NodeTargets, settle_nodes

        count = len(pose.positions)
        sizes, ways = np.linalg.eigh(pulls)
        loosely = np.where(sizes > _HELD, noise / np.sqrt(np.maximum(sizes, _HELD)), 0.0)
        rigid, holds = BodyPose(pose.positions, rotations(pose.turns)), self._holds(pose) ** 2
        strained = self._strained(rigid, self._ones, self._others)
        squares = np.zeros(count)
        np.add.at(squares, self._ones, holds * (strained**2).sum(axis=1))
        squares /= np.trace(self._moments, axis1=1, axis2=2) + 1e-300
        usual = bending * np.sqrt(self._mean_around(np.maximum(squares, np.quantile(squares, _USUAL))))
        edges = BodyEdges(self._firsts, self._others, self._edges, holds)

        def moved(probe: int) -> Float:
            chance = np.random.default_rng(probe)
            wanted = np.einsum("nij,nj->ni", ways, loosely * chance.standard_normal((count, 3)))
            strains = chance.standard_normal((count, 3, 3))
            for _ in range(_SMOOTH):
                strains = self._mean_around(strains)
            strains *= usual[:, None, None] / max(float(strains.std()), 1e-300)
            away = np.zeros((count, 3))
            settle_nodes(edges, strains, stiffness, NodeTargets(pulls, wanted), _STEPS, away)
            return away

        with ThreadPoolExecutor(_PROBING, "scan4d-body") as pool:
            squares = np.mean([(away**2).sum(axis=1) for away in pool.map(moved, range(_PROBES))], axis=0)
        return np.sqrt(self._mean_around(squares))

    def intact(self, pose: BodyPose) -> Float:
        """How far each node holds together with those that `around` gives with it, (N, k), 0..1: less where
        the subject opens, as a mouth does whose lips touch at rest."""
        return self._kept(pose, np.arange(len(pose.positions))[:, None], self._around) ** 2

    def _mean_around(self, values: Float) -> Float:
        """The means of values of nodes, (N, ...), over each and those beside it."""
        return values[self._around].mean(axis=1)

    def carried(self, grip: Grip, pose: BodyPose | None = None) -> tuple[Float, Float]:
        """The positions that are held, (..., 3), and how each has been turned from when it was gripped, (...,
        3, 3). pose: in which; None: the body's now."""
        pose = pose or self.pose
        turns = pose.turns[grip.nodes]
        positions = np.einsum("...ij,...j->...i", turns, grip.offsets) + pose.positions[grip.nodes]
        return (
            np.einsum("...k,...ki->...i", grip.weights, positions),
            _mean(grip.weights, turns) @ np.swapaxes(grip.turns, -1, -2),
        )

    def _predicted(self, before: BodyPose) -> BodyPose:
        """The pose that follows if all parts move and turn on as from the pose before to the one now."""
        now = self.pose
        wanted = 2 * now.positions - before.positions
        pose = BodyPose(wanted, now.turns @ before.turns.transpose(0, 2, 1) @ now.turns)
        pulls = np.broadcast_to(_PREDICTED * np.eye(3), (len(wanted), 3, 3))
        for _ in range(4):
            pose = self.settled(pose, 1.0, pulls, wanted)
        return pose

    def _drawn(
        self, pose: BodyPose, surface: MomentSurface, known: tuple[Float, NDArray[np.bool_]] | None = None
    ) -> BodyPose:
        """A pose drawn onto a surface. known: positions (N, 3) of nodes, and of which they are known,
        (N,)."""
        from .body_kernels import pull_across

        pulls, wanted = np.empty_like(pose.turns), np.empty_like(pose.positions)
        for share in np.linspace(0, 1, _ROUNDS):
            reach = surface.spacing * _REACH[0] ** (1 - share) * _REACH[1] ** share
            pull_across(surface.held, pose.positions, pose.turns, self._normals, reach, pulls, wanted)
            if known is not None:
                pulls[known[1]], wanted[known[1]] = np.eye(3), known[0][known[1]]
            stiffness = _STIFF[0] ** (1 - share) * _STIFF[1] ** share
            pose = self.settled(pose, stiffness, pulls, wanted, yields=share > _YIELDS)
        return pose

    def _misfit(self, pose: BodyPose, targets: Float) -> float:
        """How badly a pose fits targets (T, 3) of a frame: ways to and fro, and stretching, spacings."""
        from scipy.spatial import cKDTree

        def mean(ways: Float) -> float:
            return float(np.sqrt((np.minimum(ways, _CAPPED * self.distance) ** 2).mean())) / self._spacing

        to = cKDTree(pose.positions).query(targets)[0]
        fro = cKDTree(targets).query(pose.positions)[0]
        edges = pose.positions[self._others] - pose.positions[self._ones]
        if not len(edges):
            return mean(to) + mean(fro)
        stretch = np.linalg.norm(edges, axis=1) / np.linalg.norm(self._edges, axis=1) - 1
        return mean(to) + mean(fro) + _STRETCH * float(np.sqrt(np.minimum(stretch**2, 1).mean()))

    def settled(
        self, pose: BodyPose, stiffness: float, pulls: Float, wanted: Float, *, yields: bool = False
    ) -> BodyPose:
        """The pose after a step towards positions (N, 3) that are wanted of nodes, with weights (N, 3, 3).

        yields: whether stretched edges, as at joints, hold less.
        """
        holds = self._holds(pose) if yields else np.ones(len(self._edges))
        positions, products = self._moved(pose, stiffness, pulls, wanted, holds)
        return BodyPose(positions, rotations(products))

    def strained(self, pose: BodyPose, stiffness: float, pulls: Float, wanted: Float) -> BodyPose:
        """The pose after a step as of `settled`, where strains that are alike around a node cost little.

        Its turns are affine maps (as in embedded deformation: Sumner, Schmid and Pauly 2007): each the one
        that fits the edges of the node best, drawn to a rotation.
        """
        holds = self._holds(pose) ** 2
        positions, products = self._moved(pose, stiffness, pulls, wanted, holds)
        moments = self._products(self._rest, holds)
        strains = ((pose.turns - rotations(pose.turns)) ** 2).sum(axis=(1, 2))
        eased = np.maximum(_UNSTRAINED / (1 + strains / _EASE**2) ** 2, _LEAST_HELD)
        hold = (eased * np.trace(self._moments, axis1=1, axis2=2) + 1e-300)[:, None, None]
        turns = products + hold * rotations(products)
        return BodyPose(positions, turns @ np.linalg.inv(moments + hold * np.eye(3)))

    def _moved(
        self, pose: BodyPose, stiffness: float, pulls: Float, wanted: Float, holds: Float
    ) -> tuple[Float, Float]:
        """The positions of nodes after a step, and the products of their edges, now and at rest, (N, 3, 3).

        holds: (E,), the share of its stiffness that each edge keeps.
        """
        from .body_kernels import BodyEdges, NodeTargets, settle_nodes

        positions = pose.positions.copy()
        edges = BodyEdges(self._firsts, self._others, self._edges, holds * self._strengths)
        settle_nodes(edges, pose.turns, stiffness, NodeTargets(pulls, wanted), _STEPS, positions)
        return positions, self._products(positions, holds)

    def _holds(self, pose: BodyPose) -> Float:
        """How much of its stiffness each edge keeps, (E,): those that are stretched, as at joints, less. The
        square is the weight of a kernel to which far residuals are outliers (Geman and McClure 1985)."""
        return self._kept(pose, self._ones, self._others)

    def _kept(self, pose: BodyPose, ones: NDArray[np.intp], others: NDArray[np.intp]) -> Float:
        """`_holds` of edges between nodes (...)."""
        from .body_kernels import edge_holds

        ones, others = np.broadcast_arrays(ones, others)
        holds = np.empty(ones.size)
        edge_holds(pose.positions, pose.turns, self._rest, ones.ravel(), others.ravel(), _YIELD, holds)
        return holds.reshape(ones.shape)

    def _products(self, positions: Float, holds: Float) -> Float:
        """The sums of the products of each node's edges, at positions (N, 3) and at rest, (N, 3, 3)."""
        from .body_kernels import BodyEdges, edge_products

        products = np.empty((len(positions), 3, 3))
        edges = BodyEdges(self._firsts, self._others, self._edges, holds)
        edge_products(edges, positions, products)
        return products

    def _strained(self, pose: BodyPose, ones: NDArray[np.intp], others: NDArray[np.intp]) -> Float:
        """How far edges between nodes (...) are from where the turns of these would have them, (..., 3)."""
        turns = 0.5 * (pose.turns[ones] + pose.turns[others])
        ways = pose.positions[others] - pose.positions[ones]
        return ways - np.einsum("...ij,...j->...i", turns, self._rest[others] - self._rest[ones])

    def _spacing_of(self, points: Float, some: Float) -> float:
        """The spacing of some of the points, evenly chosen."""
        return float(self._spacing * np.sqrt(len(points) / len(some)))


def _some(points: Float) -> Float:
    """So many of the points (P, 3) as are looked at, evenly."""
    return np.ascontiguousarray(points[:: max(1, len(points) // _LOOKED_AT)])


def _spread(points: Float, count: int) -> tuple[NDArray[np.int64], float]:
    """The rows of so many points, each the farthest from those before, and how far the next one would be."""
    from .body_kernels import spread_out

    chosen = np.empty(min(count, len(points)), np.int64)
    return chosen, spread_out(points, chosen)


def _mean(weights: Float, turns: Float) -> Float:
    """The means of rotations (..., k, 3, 3) with weights (..., k)."""
    return rotations(np.einsum("...k,...kij->...ij", weights, turns))
