"""A patch: the part of a surface that something is measured on, as faces that can be walked over."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .manifold import Rows, across_edges, joined, manifold
from .smoothing import Points, rows_apart

_RADII = (1.0, 2.0, 4.0)  # of the balls that are rolled, in distances between points
_NEAREST = 0.6  # two of the points that make a patch, in the same
_GAP = 2.0  # distances between points: radius of a circle without a point that is no chance
_AROUND, _AROUND_SPACINGS = 6, 1.38  # points whose farthest lies so many distances away, pi d^2 = 6 s^2
SMALL_HOLE = 12  # edges around a hole that counts as a gap between points, and is closed, at most
_SAME = 1e-6  # weights below which a place in a face is on its edge


@dataclass(frozen=True)
class OnPatch:
    """A place on a patch. face: its number. weights: of its corners, (3,). position: (3,). away: how far the
    place that was asked for is from it, scan units."""

    face: int
    weights: NDArray[np.float64]
    position: NDArray[np.float64]
    away: float


@dataclass(frozen=True, eq=False)
class Patch:
    """Faces of which each edge has two at most, oriented alike, and each vertex one fan.

    vertices: (V, 3) float64, scan units. faces: (F, 3) int64. sources: (V,) the number of the point that each
    vertex was made of; -1: none.
    """

    vertices: Points
    faces: Rows
    sources: Rows

    @classmethod
    def of(cls, points: Points, faces: NDArray[np.integer]) -> Patch:
        """The patch of points (N, 3) and faces (F, 3) of any kind, see `manifold`."""
        clean, sources = manifold(faces)
        return cls(points[sources], clean, sources)

    @classmethod
    def of_points(cls, points: Points, normals: NDArray[np.floating], spacing: float) -> Patch:
        """Points (N, 3) joined by a ball that is rolled over them (ball pivoting, Bernardini 1999), with
        larger balls where they are sparse; those nearer to another than 0.6 of the spacing between them are
        left out.

        normals: (N, 3), all facing out or all facing in. Faces run around as these say. A face whose corners
        face to either side of it joins two surfaces that touch, such as lips, and is left out.
        """
        import open3d

        kept = rows_apart(points, _NEAREST * spacing)
        middle = points[kept].mean(axis=0) if len(kept) else np.zeros(3)
        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points[kept] - middle))
        cloud.normals = open3d.utility.Vector3dVector(normals[kept].astype(np.float64))
        radii = open3d.utility.DoubleVector([spacing * radius for radius in _RADII])
        rolled = open3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(cloud, radii)
        faces = kept[np.asarray(rolled.triangles, np.int64).reshape(-1, 3)]
        a, b, c = points[faces.T]
        facing = (normals[faces] * np.cross(b - a, c - a)[:, None]).sum(axis=2)
        faces = np.where(facing.sum(axis=1)[:, None] < 0, faces[:, ::-1], faces)
        is_one = (facing > 0).all(axis=1) | (facing < 0).all(axis=1)
        patch = cls.of(points, faces[is_one & ~_spans_gaps(points, kept, faces)])
        return patch.closed(np.flatnonzero(np.bincount(patch.holes) <= SMALL_HOLE))

    def closed(self, holes: NDArray[np.integer]) -> Patch:
        """The patch with some of its `holes` closed, by number, each by a vertex in its middle; what is added
        stands behind the vertices and faces that there are."""
        start, end = self.border
        chosen = np.isin(self.holes, holes)
        start, end = start[chosen], end[chosen]
        _, number = np.unique(self.holes[chosen], return_inverse=True)
        sums = np.stack([np.bincount(number, axis) for axis in self.vertices[start].T], axis=1)
        middles = sums / np.maximum(np.bincount(number), 1)[:, None]
        lids = np.stack([end, start, len(self.vertices) + number], axis=1)
        return Patch(
            np.concatenate([self.vertices, middles]),
            np.concatenate([self.faces, lids]),
            np.append(self.sources, np.full(len(middles), -1)),
        )

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """The corners of the faces, (3, F, 3)."""
        return self.vertices[self.faces.T]

    def corners_of(self, faces: Rows) -> NDArray[np.float64]:
        """The corners of some of the faces by number, (3, F', 3)."""
        return self.vertices[self.faces[faces].T]

    @cached_property
    def doubled(self) -> Points:
        """Normals of the faces as long as twice their areas, (F, 3)."""
        a, b, c = self.corners
        return np.cross(b - a, c - a)

    @cached_property
    def vertex_normals(self) -> Points:
        """Normals of the vertices, the sums of those of the faces around each, (V, 3); not of unit length."""
        count = len(self.vertices)
        sums = [sum(np.bincount(corner, axis, count) for corner in self.faces.T) for axis in self.doubled.T]
        return np.stack(sums, axis=1)

    @cached_property
    def pairs(self) -> tuple[Rows, Rows]:
        """Half-edges that share an edge, see `across_edges`."""
        return across_edges(self.faces)

    @cached_property
    def border(self) -> tuple[Rows, Rows]:
        """The edges with one face, from vertices (B,) to others (B,), as their faces run along them."""
        half = np.delete(np.arange(self.faces.size), np.concatenate(self.pairs))
        return self.faces.ravel()[half], np.roll(self.faces, -1, axis=1).ravel()[half]

    @cached_property
    def holes(self) -> Rows:
        """The number of the closed line that each edge of `border` is of, (B,)."""
        start, end = self.border
        part = joined(start, end, len(self.vertices))[1][start]
        return np.unique(part, return_inverse=True)[1]

    @cached_property
    def around(self) -> tuple[Rows, Rows]:
        """The faces at each vertex: those of v are others[firsts[v] : firsts[v + 1]], of firsts (V + 1,) and
        others (3 F,)."""
        corners = self.faces.ravel()
        order = np.argsort(corners, kind="stable")
        return np.searchsorted(corners[order], np.arange(len(self.vertices) + 1)), order // 3

    def of_faces(self, numbers: Rows) -> Patch:
        """The patch of some of the faces, by number."""
        part = Patch.of(self.vertices, self.faces[numbers])
        return Patch(part.vertices, part.faces, self.sources[part.sources])

    @cached_property
    def parts(self) -> NDArray[np.int32]:
        """The connected part that each vertex belongs to, (V,)."""
        ends = np.concatenate([self.faces, np.roll(self.faces, -1, axis=1)]).reshape(2, -1)
        return joined(ends[0], ends[1], len(self.vertices))[1]

    @cached_property
    def bends(self) -> NDArray[np.float64]:
        """How much the surface turns at the edges of each face, the sum of the squared angles, (F,)."""
        normals = self.doubled / np.maximum(
            np.linalg.norm(self.doubled, axis=1, keepdims=True), np.finfo(float).tiny
        )
        one, other = (half // 3 for half in self.pairs)
        squared = np.arccos(np.clip((normals[one] * normals[other]).sum(axis=1), -1, 1)) ** 2
        sums = np.bincount(np.concatenate([one, other]), np.tile(squared, 2), len(self.faces))
        return sums.astype(np.float64)

    def nearest(self, position: NDArray[np.float64]) -> OnPatch:
        """The place of the patch nearest to another, (3,); of the face of the lowest number where there are
        several. Raises ValueError where the patch has no faces."""
        offsets = self.vertices - position
        squared = np.einsum("vi,vi->v", offsets, offsets)
        is_near = squared <= ((np.sqrt(squared.min()) + self._longest) * (1 + _SAME)) ** 2
        near = np.flatnonzero(
            is_near[self.faces[:, 0]] | is_near[self.faces[:, 1]] | is_near[self.faces[:, 2]]
        )
        corners = self.corners_of(near)
        weights = nearest_weights(corners - position)
        offsets = np.einsum("fc,cfi->fi", weights, corners) - position
        squared = (offsets * offsets).sum(axis=1)
        best = int(squared.argmin())
        return OnPatch(
            int(near[best]), weights[best], position + offsets[best], float(np.sqrt(squared[best]))
        )

    @cached_property
    def _longest(self) -> float:
        """The longest edge: no place of a face, or of parts of it, is farther from a corner."""
        start, end = self.faces.ravel(), np.roll(self.faces, -1, axis=1).ravel()
        offsets = self.vertices[end] - self.vertices[start]
        return float(np.sqrt(np.einsum("ei,ei->e", offsets, offsets).max(initial=0)))

    def faces_at(self, one: int, other: int) -> Rows:
        """The numbers of the faces at the edge between two vertices."""
        a, b, c = self.faces.T
        return np.flatnonzero(
            ((a == one) | (b == one) | (c == one)) & ((a == other) | (b == other) | (c == other))
        )

    def with_point(self, place: OnPatch) -> tuple[Patch, int]:
        """The patch with a vertex at a place, and its number: a corner that is there, or else a new one that
        divides its face, or both faces of its edge."""
        corners, inner = self.faces[place.face], np.flatnonzero(place.weights > _SAME)
        if len(inner) == 1:
            return self, int(corners[inner[0]])
        number = len(self.vertices)
        split = [place.face] if len(inner) == 3 else self.faces_at(*corners[inner].tolist()).tolist()
        faces = [np.delete(self.faces, split, axis=0)]
        for face in split:
            for start in range(3):
                pair = self.faces[face, [start, (start + 1) % 3]]
                if len(inner) == 3 or set(pair.tolist()) != set(corners[inner].tolist()):
                    faces.append(np.array([[*pair, number]]))
        divided = Patch(
            np.vstack([self.vertices, place.position]), np.concatenate(faces), np.append(self.sources, -1)
        )
        divided.__dict__["_longest"] = self._longest  # its edges are no longer
        return divided, number


def _spans_gaps(points: Points, kept: Rows, faces: Rows) -> NDArray[np.bool_]:
    """Whether faces (F, 3) of points (N, 3) span gaps: the circle through their corners is wider than between
    those kept, by number, that lie around one of the corners."""
    from scipy.spatial import cKDTree

    away = cKDTree(points[kept]).query(points[kept], min(_AROUND + 1, len(kept)))[0][:, -1]
    spacing = np.zeros(len(points))
    spacing[kept] = away / _AROUND_SPACINGS
    a, b, c = points[faces.T]
    sides = [np.linalg.norm(one - other, axis=1) for one, other in ((b, c), (c, a), (a, b))]
    doubled = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    wide: NDArray[np.bool_] = np.prod(sides, axis=0) > 2 * _GAP * spacing[faces].min(axis=1) * doubled
    return wide


def nearest_weights(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights (F, 3) of the corners (3, F, 3) of faces at their places nearest to the origin."""
    a, b, c = corners
    normal = np.cross(b - a, c - a)
    area = np.maximum((normal * normal).sum(axis=1), np.finfo(float).tiny)
    inside = np.stack([(np.cross(p, q) * normal).sum(axis=1) for p, q in ((b, c), (c, a), (a, b))], axis=1)
    inside /= area[:, None]
    best = np.where((inside >= 0).all(axis=1), 0.0, np.inf)
    weights = inside
    for start in range(3):
        from_, to = corners[start], corners[(start + 1) % 3]
        edge = to - from_
        length = np.maximum((edge * edge).sum(axis=1), np.finfo(float).tiny)
        part = np.clip(-(from_ * edge).sum(axis=1) / length, 0, 1)
        place = from_ + part[:, None] * edge
        squared = (place * place).sum(axis=1)
        nearer = squared < best
        on_edge = np.zeros_like(weights)
        on_edge[:, start], on_edge[:, (start + 1) % 3] = 1 - part, part
        weights = np.where(nearer[:, None], on_edge, weights)
        best = np.where(nearer, squared, best)
    return weights
