"""Triangle meshes as scenes: read from PLY and OBJ, hit by rays."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..bounds import Bounds
from ..errors import InputError
from ..scan.formats import read
from ..scan.points import PointCloud
from .scene import NOTHING, PLAIN, Hits, Rays, linear, to_linear

Faces = NDArray[np.uint32]  # (F, 3) rows of the vertices
_LISTS = ("vertex_indices", "vertex_index")  # what PLY files call the corners of a face
_HEADER_LIMIT = 1 << 20  # bytes looked at for a header


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh. points: its vertices, V of them; faces: (F, 3) uint32.

    Hits have the normals and colours of the vertices, interpolated, where the mesh has them; else the
    normals of the faces, towards the side that they run around counterclockwise, and a plain colour.
    Raises InputError where a face names a vertex that is not there.
    """

    points: PointCloud
    faces: Faces

    def __post_init__(self) -> None:
        if not len(self.faces):
            raise InputError("the mesh has no faces")
        if self.points.dropped:
            raise InputError(f"{self.points.dropped} vertices of the mesh are not finite")
        if int(self.faces.max()) >= len(self.points):
            raise InputError(f"a face names vertex {self.faces.max()} of {len(self.points)}")

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
        """See `Scene.cast`. float32 inside: distances are off by some 1e-7 of where the ray starts."""
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

    def carry(self, faces: NDArray[np.uint32], positions: Rays, moved: Mesh) -> Rays:
        """Where points of this mesh are on the same faces of a moved one, (N, 3).

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
        return _blend(to_linear(self.points.colors[self.faces[faces].T, :3]), weights)


def read_mesh(path: Path | str) -> Mesh:
    """The mesh of a PLY or OBJ file. Raises InputError where it is damaged or has no faces."""
    path = Path(path)
    faces, points = read_faces(path), read(path)
    assert isinstance(points, PointCloud), "the formats with faces hold points"
    try:
        return Mesh(points, faces)
    except InputError as error:
        raise InputError(error.what, path) from error


def read_faces(path: Path | str) -> Faces:
    """The faces of a PLY or OBJ file as triangles, (F, 3) uint32; polygons become fans. Raises InputError.

    A sequence that moves one mesh has the faces in a file of their own.
    """
    path = Path(path)
    readers = {".ply": _ply_faces, ".obj": _obj_faces}
    if path.suffix.lower() not in readers:
        raise InputError("is no mesh that can be read", path, f"Known: {', '.join(sorted(readers))}")
    try:
        return readers[path.suffix.lower()](path)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", path) from error
    except (ValueError, IndexError, OverflowError) as error:
        raise InputError(f"has damaged faces: {error}", path) from error


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


def _ply_faces(path: Path) -> Faces:
    from plyfile import PlyData, PlyParseError

    _check_counts(path)
    try:
        try:  # triangles alone are many times faster
            ply = PlyData.read(path, known_list_len={"face": dict.fromkeys(_LISTS, 3)})
        except PlyParseError:
            ply = PlyData.read(path)
    except PlyParseError as error:
        raise InputError(f"has damaged faces: {error}", path) from error
    if "face" not in ply:
        raise InputError("the mesh has no faces", path)
    face = ply["face"].data
    corners = next((face[name] for name in _LISTS if name in face.dtype.names), None)
    if corners is None or (corners.ndim == 1 and not corners.dtype.hasobject):
        raise InputError("its faces name no vertices", path)
    return _fans(list(corners)) if corners.ndim == 1 else _vertex_numbers(corners)


def _check_counts(path: Path) -> None:
    """Raise ValueError where a PLY header promises more than the file holds: memory follows the header."""
    with open(path, "rb") as file:
        header = file.read(_HEADER_LIMIT).partition(b"end_header")[0]
    size = path.stat().st_size
    for name, count in re.findall(rb"^element\s+(\S+)\s+(\d+)", header, re.MULTILINE):
        if int(count) > size:
            raise ValueError(f"{int(count):,} elements '{name.decode('latin-1')}' in {size:,} bytes")


def _obj_faces(path: Path) -> Faces:
    return _fans(list(_obj_polygons(path)))


def _obj_polygons(path: Path) -> Iterator[NDArray[np.int64]]:
    """The corners of each face; negative numbers count back from the vertices read so far."""
    vertices = 0
    with open(path, encoding="latin-1") as lines:
        for line in lines:
            if line.startswith(("v ", "v\t")):
                vertices += 1
            elif line.startswith(("f ", "f\t")):
                corners = np.array([int(corner.partition("/")[0]) for corner in line.split()[1:]])
                yield np.where(corners < 0, corners + vertices, corners - 1)


def _fans(polygons: list[NDArray]) -> Faces:
    """Polygons as triangles around their first corners. Raises ValueError as `_vertex_numbers` does."""
    triangles = [
        np.stack([np.full(len(p) - 2, p[0]), p[1:-1], p[2:]], axis=1) for p in polygons if len(p) > 2
    ]
    if not triangles:
        return np.empty((0, 3), np.uint32)
    return _vertex_numbers(np.concatenate(triangles))


def _vertex_numbers(corners: NDArray) -> Faces:
    """Corners as uint32. Raises ValueError for what cannot be the number of a vertex."""
    if corners.dtype.kind not in "iu" or (len(corners) and not 0 <= corners.min() <= corners.max() < NOTHING):
        raise ValueError("a corner is no vertex")
    return np.ascontiguousarray(corners, np.uint32)
