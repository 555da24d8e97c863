"""Several bodies as one: subjects that cover themselves, of very different scales, and with thin parts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...mesh.scene import Rays
from ...mesh.triangles import Mesh
from ...scan.points import PointCloud
from ..truth.shapes import AnalyticScene, Cuboid, Sphere
from ..truth.tessellation import cube_mesh, sphere_mesh
from .subjects import with_rows

_GAP = 0.9  # from one to the next in a lattice, in edges of their box
_HEAD = 8  # times that the upper of two is smaller
_EAR, _FINGER = (0.25, 0.5, 0.015), (0.5, 0.03, 0.03)  # half of their edges
_APART = 0.12  # from finger to finger
_ON = 1e-3  # how far inside a shape its own points may be: those of its triangles
_SEAT = 0.03  # of its height, that it sinks in


def in_lattice(meshes: Sequence[Mesh], counts: tuple[int, int, int]) -> Mesh:
    """Copies of meshes, by turns, in a lattice of boxes side by side; most of them hide others.

    counts: how many along x, y and z.
    """
    step = _GAP * np.max([mesh.bounds.high - mesh.bounds.low for mesh in meshes], axis=0)
    positions = np.indices(counts).reshape(3, -1).T * step
    chosen = [meshes[number % len(meshes)] for number in range(len(positions))]
    return _joined(
        chosen,
        [1.0] * len(positions),
        [position - m.bounds.center for m, position in zip(chosen, positions, strict=True)],
    )


def on_its_head(mesh: Mesh) -> Mesh:
    """A mesh, up +y, and a copy an eighth of its size on its highest point (Preiner 2012, Fig. 7)."""
    points, scale = mesh.points.world(), 1 / _HEAD
    top = points[points[:, 1].argmax()]
    seat = mesh.bounds.center.copy()
    seat[1] = mesh.bounds.low[1] + _SEAT * (mesh.bounds.high - mesh.bounds.low)[1]
    return _joined([mesh, mesh], [1.0, scale], [np.zeros(3), top - scale * seat])


def with_sheets() -> tuple[AnalyticScene, Mesh]:
    """A unit sphere with two thin ears and five fingers; also as triangles, which go on inside."""
    sheets = [Cuboid(center=(side * 0.45, 1.25, 0.0), half=_EAR) for side in (-1, 1)]
    sheets += [Cuboid(center=(1.3, _APART * number, 0.2), half=_FINGER) for number in range(-2, 3)]
    meshes = [sphere_mesh(), *(_stretched(cube_mesh(), sheet.half) for sheet in sheets)]
    positions = [np.zeros(3), *(np.array(sheet.center) for sheet in sheets)]
    return AnalyticScene((Sphere(), *sheets)), _joined(meshes, [1.0] * len(meshes), positions)


def outside_sheets(scene: AnalyticScene, cloud: PointCloud) -> PointCloud:
    """The points of a cloud that lie inside no sphere or box of a scene."""
    world, outside = cloud.world(), np.ones(len(cloud), bool)
    for shape in scene.shapes:
        local = world - shape.center
        if isinstance(shape, Cuboid):
            outside &= (np.abs(local) > np.array(shape.half) - _ON).any(axis=1)
        elif isinstance(shape, Sphere):
            outside &= np.linalg.norm(local, axis=1) > shape.radius - _ON
    return with_rows(cloud, np.flatnonzero(outside))


def _stretched(cube: Mesh, half: tuple[float, float, float]) -> Mesh:
    """The cube -1..1 as a box, half: half its edges."""
    return Mesh(cube.points.displaced(cube.points.positions * (np.array(half) - 1)), cube.faces)


def _joined(meshes: Sequence[Mesh], scales: Sequence[float], shifts: Sequence[Rays]) -> Mesh:
    """One mesh of several with normals, each scaled and then moved (3,)."""
    firsts = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    cloud = PointCloud.from_arrays(
        np.concatenate([m.points.world() * s + by for m, s, by in zip(meshes, scales, shifts, strict=True)]),
        normals=np.concatenate([mesh.points.normals for mesh in meshes]),
    )
    faces = np.concatenate([m.faces + np.uint32(first) for m, first in zip(meshes, firsts[:-1], strict=True)])
    return Mesh(cloud, faces)
