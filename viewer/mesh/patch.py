"""A patch: the part of a surface that something is measured on, as faces that can be walked over."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .manifold import Rows, across_edges, joined, manifold
from .smoothing import Points, rows_apart

_RADII = (1.0, 1.5, 2.5, 4.0)  # of the balls that are rolled, in distances between points
_NEAREST = 0.6  # two of the points that make a patch, in the same
_HOLE = 12  # edges around what the balls have left open, at most
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

        normals: (N, 3), all facing out or all facing in.
        """
        import open3d

        kept = rows_apart(points, _NEAREST * spacing)
        middle = points[kept].mean(axis=0) if len(kept) else np.zeros(3)
        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points[kept] - middle))
        cloud.normals = open3d.utility.Vector3dVector(normals[kept].astype(np.float64))
        radii = open3d.utility.DoubleVector([spacing * radius for radius in _RADII])
        rolled = open3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(cloud, radii)
        return cls.of(points, kept[np.asarray(rolled.triangles, np.int64).reshape(-1, 3)])._closed()

    def _closed(self) -> Patch:
        """The patch with its small holes closed, each by a vertex in its middle."""
        half = np.delete(np.arange(self.faces.size), np.concatenate(self.pairs))
        start, end = self.faces.ravel()[half], np.roll(self.faces, -1, axis=1).ravel()[half]
        _, loop = joined(start, end, len(self.vertices))
        loop = loop[start]
        edges = np.bincount(loop)
        small = (edges > 0) & (edges <= _HOLE)
        sums = np.stack([np.bincount(loop, axis) for axis in self.vertices[start].T], axis=1)
        number = len(self.vertices) - 1 + np.cumsum(small)
        of_small = small[loop]
        lids = np.stack([end, start, number[loop]], axis=1)[of_small]
        middles = sums[small] / edges[small, None]
        return Patch(
            np.concatenate([self.vertices, middles]),
            np.concatenate([self.faces, lids]),
            np.append(self.sources, np.full(len(middles), -1)),
        )

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """The corners of the faces, (3, F, 3)."""
        return self.vertices[self.faces.T]

    @cached_property
    def doubled(self) -> Points:
        """Normals of the faces as long as twice their areas, (F, 3)."""
        a, b, c = self.corners
        return np.cross(b - a, c - a)

    @cached_property
    def vertex_normals(self) -> Points:
        """Normals of the vertices, the sums of those of the faces around each, (V, 3); not of unit length."""
        normals = np.zeros_like(self.vertices)
        for corner in self.faces.T:
            np.add.at(normals, corner, self.doubled)
        return normals

    @cached_property
    def pairs(self) -> tuple[Rows, Rows]:
        """Half-edges that share an edge, see `across_edges`."""
        return across_edges(self.faces)

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
        weights = nearest_weights(self.corners - position)
        offsets = np.einsum("fc,cfi->fi", weights, self.corners) - position
        squared = (offsets * offsets).sum(axis=1)
        face = int(squared.argmin())
        return OnPatch(face, weights[face], position + offsets[face], float(np.sqrt(squared[face])))

    def with_point(self, place: OnPatch) -> tuple[Patch, int]:
        """The patch with a vertex at a place, and its number: a corner that is there, or else a new one that
        divides its face, or both faces of its edge."""
        corners, inner = self.faces[place.face], np.flatnonzero(place.weights > _SAME)
        if len(inner) == 1:
            return self, int(corners[inner[0]])
        number = len(self.vertices)
        if len(inner) == 3:
            divided = [place.face]
        else:
            ends = corners[inner]
            divided = np.flatnonzero(np.isin(self.faces, ends).sum(axis=1) == 2).tolist()
        faces = [np.delete(self.faces, divided, axis=0)]
        for face in divided:
            for start in range(3):
                pair = self.faces[face, [start, (start + 1) % 3]]
                if len(inner) == 3 or set(pair.tolist()) != set(corners[inner].tolist()):
                    faces.append(np.array([[*pair, number]]))
        return (
            Patch(
                np.vstack([self.vertices, place.position]),
                np.concatenate(faces),
                np.append(self.sources, -1),
            ),
            number,
        )


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
