"""Signed distances of points from a triangle mesh.

Embree, through open3d, finds the nearest face in float32. The distance from that face is exact, in float64.
Its sign is that of the angle-weighted pseudonormal of the face, edge or vertex that is nearest (Baerentzen
and Aanaes 2005).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scan.points import PointCloud
from .triangles import Mesh

_BESIDE = 1e-3  # of its distance, and
_ROUNDED = 1e-6  # of the size of the mesh: a point that is farther beyond the border is not above the mesh

Float = NDArray[np.float64]


class NearestOnMesh:
    """The mesh that points are compared with. Vertices at one place count as one, so a seam is no border."""

    outside_by = "faces"  # that run around counterclockwise there

    def __init__(self, cloud: PointCloud, faces: NDArray[np.integer]) -> None:
        """faces: (F, 3) rows of the cloud. Raises InputError where none has an area."""
        places, of_place = np.unique(cloud.positions, axis=0, return_inverse=True)
        welded = of_place.reshape(-1)[faces].astype(np.uint32)
        a, b, c = places[welded.T].astype(np.float64)
        has_area = np.cross(b - a, c - a).any(axis=1)
        self.origin = cloud.origin
        self._mesh = Mesh(PointCloud.from_arrays(places, origin=np.zeros(3)), welded[has_area])
        self._corners = places[self._mesh.faces].astype(np.float64)
        areas = self._mesh.areas()
        normals = areas / np.linalg.norm(areas, axis=1, keepdims=True)
        self._rounded = _ROUNDED * self._mesh.bounds.radius
        neighbors = self._mesh.neighbors
        self._is_border = neighbors == np.arange(len(neighbors))[:, None]
        self._normals = np.concatenate(
            [normals[:, None], normals[:, None] + normals[neighbors], self._at_corners(normals)], axis=1
        )
        self._outward = self._border_directions(normals)

    def _at_corners(self, normals: Float) -> Float:
        """The pseudonormals of the vertices at corners of faces, (F, 3, 3): normals weighted by angles."""
        after = np.roll(self._corners, -1, axis=1) - self._corners
        before = np.roll(self._corners, 1, axis=1) - self._corners
        sines = np.linalg.norm(np.cross(after, before), axis=2)
        angles = np.arctan2(sines, np.einsum("fci,fci->fc", after, before))
        sums = np.zeros((len(self._mesh.points), 3))
        np.add.at(sums, self._mesh.faces, angles[:, :, None] * normals[:, None])
        return sums[self._mesh.faces]

    def _border_directions(self, normals: Float) -> Float:
        """Unit vectors that lead away from the mesh along its faces, (F, 7, 2, 3): of each face (none), edge
        (one) and corner (those of both border edges there); zeros elsewhere."""
        along = np.roll(self._corners, -1, axis=1) - self._corners
        out = np.cross(along, normals[:, None])
        out *= self._is_border[:, :, None] / np.linalg.norm(out, axis=2, keepdims=True)
        at_vertices = np.zeros((len(self._mesh.points), 2, 3))
        faces, edges = np.nonzero(self._is_border)
        for end in range(2):
            at_vertices[self._mesh.faces[faces, (edges + end) % 3], end] = out[faces, edges]
        directions = np.zeros((len(out), 7, 2, 3))
        directions[:, 1:4, 0] = out
        directions[:, 4:] = at_vertices[self._mesh.faces]
        return directions

    def signed(self, positions: Float, reach: float) -> Float:
        """The distances of positions (N, 3), absolute, (N,), scan units; positive on the side that faces run
        around counterclockwise. NaN where the mesh is farther than a reach, and beyond its border."""
        local = positions - self.origin
        faces = self._mesh.nearest_faces(local)
        foot, part = _feet(self._corners[faces], local)
        away = local - foot
        distances = np.linalg.norm(away, axis=1)
        sides = np.sign(np.einsum("ni,ni->n", away, self._normals[faces, part]))
        beyond = np.einsum("ni,nei->ne", away, self._outward[faces, part]).max(axis=1)
        is_above = (distances <= reach) & (beyond <= _BESIDE * distances + self._rounded)
        return np.where(is_above & ((sides != 0) | (distances == 0)), sides * distances, np.nan)


def _feet(corners: Float, positions: Float) -> tuple[Float, NDArray[np.intp]]:
    """The places (N, 3) of triangles that are nearest to positions (N, 3), and what each is on, (N,): 0 the
    face, 1 to 3 the edge after that corner, 4 to 6 the corner. corners: (N, 3, 3)."""
    rows = np.arange(len(corners))
    along = np.roll(corners, -1, axis=1) - corners
    normal = np.cross(along[:, 0], along[:, 1])
    apart = positions[:, None] - corners
    square = np.einsum("ni,ni->n", normal, normal)
    inside = np.einsum("nci,ni->nc", np.cross(along, apart), normal) >= 0
    above = np.einsum("ni,ni->n", apart[:, 0], normal) / square
    foot, part = positions - above[:, None] * normal, np.zeros(len(corners), np.intp)
    shares = np.einsum("nci,nci->nc", apart, along) / np.einsum("nci,nci->nc", along, along)
    shares = np.clip(shares, 0.0, 1.0)
    on_edges = corners + shares[:, :, None] * along
    nearest = np.linalg.norm(positions[:, None] - on_edges, axis=2).argmin(axis=1)
    share = shares[rows, nearest]
    off = np.flatnonzero(~inside.all(axis=1))
    foot[off] = on_edges[off, nearest[off]]
    at_corner = np.where(share == 0, 4 + nearest, 4 + (nearest + 1) % 3)
    part[off] = np.where((share > 0) & (share < 1), 1 + nearest, at_corner)[off]
    return foot, part
