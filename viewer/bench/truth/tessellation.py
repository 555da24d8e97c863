"""Analytic shapes as triangles with exact normals: what a rasteriser can draw of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...mesh.scene import Rays
from ...mesh.triangles import Mesh
from ...scan.points import PointCloud

# Around and across a curved shape: the middles of its triangles are within 3e-5 of its size of the surface.
_FINE = (512, 256)
_NONE = 1e-12  # of area
_SIDES = [(axis, sign) for axis in range(3) for sign in (1.0, -1.0)]


def sphere_mesh() -> Mesh:
    """The unit sphere."""
    return _grid(lambda turn, tilt: (_around(turn, np.pi * tilt),) * 2)


def torus_mesh(ring: float = 1.0, tube: float = 0.4) -> Mesh:
    """A torus about the y axis."""

    def at(turn: NDArray, angle: NDArray) -> tuple[Rays, Rays]:
        normals = _around(turn, 2 * np.pi * angle)
        return ring * _around(turn, np.full_like(angle, np.pi / 2)) + tube * normals, normals

    return _grid(at)


def square_mesh() -> Mesh:
    """The square -1..1 on z = 0, facing +z."""
    return _sides([(2, 1.0)], offset=0.0)


def cube_mesh() -> Mesh:
    """The cube -1..1."""
    return _sides(_SIDES, offset=1.0)


def _around(turn: NDArray, tilt: NDArray) -> Rays:
    """Unit vectors (N, 3): a share of a turn about y, and the angle from +y."""
    out = np.sin(tilt)
    return np.stack([out * np.cos(2 * np.pi * turn), np.cos(tilt), out * np.sin(2 * np.pi * turn)], axis=1)


def _grid(at: Callable[[NDArray, NDArray], tuple[Rays, Rays]]) -> Mesh:
    """The image of the unit square. at: gives positions and normals, (N, 3) each."""
    around, across = _FINE
    u, v = np.meshgrid(np.linspace(0, 1, around + 1), np.linspace(0, 1, across + 1))
    corner = np.arange(across)[:, None] * (around + 1) + np.arange(around)
    corner = corner.ravel()
    up = around + 1
    quads = np.stack([corner, corner + 1, corner + 1 + up, corner + up], axis=1)
    return _mesh(*at(u.ravel(), v.ravel()), quads)


def _sides(sides: list[tuple[int, float]], offset: float) -> Mesh:
    """Squares of edge 2 at right angles to axes, facing along the signs, so far from zero."""
    positions, normals = np.zeros((2, 4 * len(sides), 3))
    for number, (axis, sign) in enumerate(sides):
        rows = slice(4 * number, 4 * number + 4)
        normals[rows, axis], positions[rows, axis] = sign, sign * offset
        positions[rows, (axis + 1) % 3] = sign * np.array([-1, 1, 1, -1])
        positions[rows, (axis + 2) % 3] = [-1, -1, 1, 1]
    return _mesh(positions, normals, np.arange(4 * len(sides)).reshape(-1, 4))


def _mesh(positions: Rays, normals: Rays, quads: NDArray[np.integer]) -> Mesh:
    """Quads as two triangles each; at a pole, where two corners meet, as one."""
    faces = np.ascontiguousarray(quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3), np.uint32)
    points = PointCloud.from_arrays(positions, normals=normals, origin=np.zeros(3))
    areas = Mesh(points, faces).areas()
    return Mesh(points, faces[np.linalg.norm(areas, axis=1) > _NONE])
