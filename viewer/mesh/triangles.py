"""Triangle meshes as scenes, hit by rays."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..bounds import Bounds
from ..errors import InputError
from ..scan.faces import Triangles
from ..scan.formats import read, read_faces
from ..scan.points import PointCloud
from ..srgb import linear_from_bytes
from .scene import PLAIN, Hits, Rays, linear


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh. points: its vertices, V of them; faces: (F, 3) uint32.

    Hits have the normals and colours of the vertices, interpolated, where the mesh has them; else the
    normals of the faces, towards the side that they run around counterclockwise, and a plain colour.
    Raises InputError where a face names a vertex that is not there.
    """

    points: PointCloud
    faces: Triangles

    def __post_init__(self) -> None:
        if not len(self.faces):
            raise InputError("the mesh has no faces")
        if self.points.dropped:
            raise InputError(f"{self.points.dropped} vertices of the mesh are not finite")
        if int(self.faces.max()) >= len(self.points):
            raise InputError(
                f"a face refers to vertex {self.faces.max()}, but there are only {len(self.points)} vertices"
            )

    @property
    def origin(self) -> NDArray[np.float64]:
        """(3,), that of its points."""
        return self.points.origin

    @cached_property
    def bounds(self) -> Bounds:
        """The box around all vertices, absolute."""
        positions = self.points.positions
        return Bounds(positions.min(axis=0) + self.origin, positions.max(axis=0) + self.origin)

    @cached_property
    def _scene(self) -> Any:
        import open3d

        scene = open3d.t.geometry.RaycastingScene()
        vertices = open3d.core.Tensor.from_numpy(np.ascontiguousarray(self.points.positions))
        scene.add_triangles(vertices, open3d.core.Tensor.from_numpy(np.ascontiguousarray(self.faces)))
        return scene

    def cast(self, starts: Rays, steps: Rays) -> Hits:
        """Cast rays as `Scene.cast` does, in float32: distances are off by 1e-7 of where rays start."""
        import open3d

        rays = np.concatenate([starts, steps], axis=1, dtype=np.float32)
        cast = self._scene.cast_rays(open3d.core.Tensor.from_numpy(rays))
        distance, face = cast["t_hit"].numpy().astype(np.float64), cast["primitive_ids"].numpy()
        hits = Hits.none(len(starts))
        hit = np.isfinite(distance)
        u, v = cast["primitive_uvs"].numpy()[hit].astype(np.float64).T
        weights = np.stack([1 - u - v, u, v], axis=1)
        hits.distance[hit], hits.face[hit] = distance[hit], face[hit]
        hits.normal[hit] = self._normals(face[hit], weights)
        hits.color[hit] = self._colors(face[hit], weights)
        return hits

    def crossings(self, starts: Rays, steps: Rays) -> tuple[NDArray[np.intp], NDArray[np.uint32]]:
        """The faces that rays (N, 3) pass, found in float32: pairs of ray and face.

        A ray that passes an outline closely may have the face beside the one that it meets.
        """
        import open3d

        rays = np.concatenate([starts, steps], axis=1, dtype=np.float32)
        found = self._scene.list_intersections(open3d.core.Tensor.from_numpy(rays))
        return found["ray_ids"].numpy().astype(np.intp), found["primitive_ids"].numpy()

    def nearest_faces(self, positions: Rays) -> NDArray[np.uint32]:
        """The face nearest to each position (N, 3), relative to the origin, found in float32."""
        import open3d

        query = open3d.core.Tensor.from_numpy(np.ascontiguousarray(positions, np.float32))
        return self._scene.compute_closest_points(query)["primitive_ids"].numpy()

    @cached_property
    def neighbors(self) -> Triangles:
        """The face across each edge of each face, (F, 3); the face itself where there is none."""
        edges = np.sort(
            np.stack([self.faces, np.roll(self.faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1
        )
        order = np.lexsort(edges.T)
        after = np.roll(order, -1)
        shared = (edges[order] == edges[after]).all(axis=1)
        across = np.repeat(np.arange(len(self.faces), dtype=np.uint32), 3)
        face = across.copy()
        across[order[shared]], across[after[shared]] = face[after[shared]], face[order[shared]]
        return across.reshape(-1, 3)

    def meet(self, faces: NDArray[np.uint32], starts: Rays, steps: Rays) -> NDArray[np.float64]:
        """Distances in steps, found in float64, at which rays (N, 3) meet faces (N,); +inf: they do not."""
        a, b, c = self._corners(faces) - starts
        volumes = np.stack([(np.cross(p, q) * steps).sum(axis=1) for p, q in ((b, c), (c, a), (a, b))])
        whole = volumes.sum(axis=0)
        inside = (whole != 0) & ((volumes >= 0).all(axis=0) | (volumes <= 0).all(axis=0))
        weights = volumes / np.where(inside, whole, 1)
        place = a * weights[0][:, None] + b * weights[1][:, None] + c * weights[2][:, None]
        return np.where(inside, (place * steps).sum(axis=1) / (steps * steps).sum(axis=1), np.inf)

    def distances(self, faces: NDArray[np.uint32], positions: Rays) -> NDArray[np.float64]:
        """How far points (N, 3), relative to the origin, lie off their faces (N,), scan units."""
        corners = self._corners(faces) - positions
        normal = _unit(self.areas(faces))
        height = np.abs((corners[0] * normal).sum(axis=1))
        ends = np.roll(corners, -1, axis=0)
        edges = ends - corners
        squares = (edges * edges).sum(axis=2)
        part = np.clip(-(corners * edges).sum(axis=2) / np.where(squares > 0, squares, 1), 0, 1)
        to_edges = np.linalg.norm(corners + part[:, :, None] * edges, axis=2).min(axis=0)
        above = ((np.cross(corners, ends) * normal).sum(axis=2) >= 0).all(axis=0) & normal.any(axis=1)
        return np.where(above, height, to_edges)

    def carry(self, faces: NDArray[np.uint32], positions: Rays, moved: Mesh) -> Rays:
        """Move points of this mesh with their faces to a moved one, (N, 3).

        faces: (N,), the face that each is on. positions: (N, 3) and the result, relative to the origins.
        """
        a, b, c = self._corners(faces)
        normal = np.cross(b - a, c - a)
        square = (normal * normal).sum(axis=1, keepdims=True)
        u = (np.cross(positions - a, c - a) * normal).sum(axis=1, keepdims=True) / square
        v = (np.cross(b - a, positions - a) * normal).sum(axis=1, keepdims=True) / square
        return _blend(moved._corners(faces), np.hstack([1 - u - v, u, v]))

    def areas(self, faces: NDArray[np.integer] | slice = slice(None)) -> Rays:
        """The normals of faces, all or those of these rows, as long as twice their areas, (N, 3)."""
        a, b, c = self._corners(faces)
        return np.cross(b - a, c - a)

    def _corners(self, faces: NDArray[np.integer] | slice) -> Rays:
        """The positions of the corners of faces, (3, N, 3), relative to the origin."""
        return self.points.positions[self.faces[faces].T].astype(np.float64)

    def _normals(self, faces: NDArray, weights: Rays) -> Rays:
        flat = _unit(self.areas(faces))
        if self.points.normals is None:
            return flat
        smooth = _blend(self.points.normals[self.faces[faces].T], weights)
        length = np.linalg.norm(smooth, axis=1, keepdims=True)
        usable = np.isfinite(length) & (length > 0)
        return np.where(usable, smooth / np.where(usable, length, 1), flat)

    def _colors(self, faces: NDArray, weights: Rays) -> Rays:
        if self.points.colors is None:
            return np.broadcast_to(linear(PLAIN), (len(faces), 3))
        return _blend(linear_from_bytes(self.points.colors[self.faces[faces].T, :3]), weights)


def read_mesh(path: Path | str) -> Mesh:
    """The mesh of a file of points with faces. Raises InputError where it is damaged or has no faces."""
    faces, points = read_faces(path), read(path)
    assert isinstance(points, PointCloud), "a file with faces must also contain points"
    try:
        return Mesh(points, faces.triangles())
    except InputError as error:
        raise InputError(error.what, path) from error


def face_normals(mesh: Mesh) -> Rays:
    """Unit normals of the faces, (F, 3); zeros for faces without area."""
    return _unit(mesh.areas())


def vertex_normals(mesh: Mesh) -> NDArray[np.float32]:
    """Unit normals of the vertices, (V, 3): the faces around each, weighted by area.

    Zeros where no face with an area is.
    """
    sums, areas = np.zeros((len(mesh.points), 3)), mesh.areas()
    for corner in mesh.faces.T:
        np.add.at(sums, corner, areas)
    return _unit(sums).astype(np.float32)


def _unit(vectors: Rays) -> Rays:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


def _blend(corners: NDArray, weights: Rays) -> Rays:
    """Values (3, N, C) of the corners of faces at places of barycentric weights (N, 3): (N, C)."""
    return (corners * weights.T[:, :, None]).sum(axis=0)
