"""Which places of a true surface range views cover: what merging them must keep, and keep once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from viewer.camera import Camera
from viewer.mesh.range_mesh import triangulated
from viewer.mesh.triangles import Mesh, vertex_normals
from viewer.scan.points import PointCloud
from viewer.scan.range_view import RangeView
from viewer.simulate.scanner import Faults, around, capture, rig

Places = tuple[NDArray[np.float64], NDArray[np.float64]]  # positions, normals


def bumpy_ball(rings: int = 160) -> Mesh:
    """A ball of radius 1 or so with bumps of several sizes, so that it slides in no direction on itself."""
    polar, turn = np.meshgrid(
        np.linspace(0.01, np.pi - 0.01, rings), np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False)
    )
    ray = np.stack([np.sin(polar) * np.sin(turn), np.cos(polar), np.sin(polar) * np.cos(turn)], axis=-1)
    x, y, z = np.moveaxis(ray, -1, 0)
    radius = (
        1 + 0.05 * np.sin(5 * x + 1) * np.cos(4 * y) + 0.03 * np.sin(9 * y + 7 * z) + 0.02 * np.cos(11 * x)
    )
    number = np.arange(polar.size, dtype=np.uint32).reshape(polar.shape)
    across, down, both = (np.roll(number, -1, 0)[:, :-1], number[:, 1:], np.roll(number, -1, 0)[:, 1:])
    own = number[:, :-1]
    faces = np.concatenate(
        [np.stack(each, -1).reshape(-1, 3) for each in ((own, down, across), (across, down, both))]
    )
    points = PointCloud.from_arrays((ray * radius[..., None]).reshape(-1, 3))
    mesh = Mesh(points, faces)
    return Mesh(replace(points, normals=vertex_normals(mesh)), faces)


def pods_of(mesh: Mesh, size: tuple[int, int], count: int = 2) -> list[Camera]:
    return rig(mesh.bounds, around(count), aspect=size[0] / size[1])


def scanned(mesh: Mesh, size: tuple[int, int], *faults: Faults) -> tuple[RangeView, ...]:
    """The mesh as a pod for each of these faults sees it."""
    return capture(mesh, pods_of(mesh, size, len(faults)), size, list(faults))


def places_on(mesh: Mesh, count: int = 60_000) -> Places:
    """Places spread evenly by area."""
    rng = np.random.default_rng(1)
    normals = mesh.areas()
    areas = np.linalg.norm(normals, axis=1)
    face = rng.choice(len(areas), count, p=areas / areas.sum())
    shares = rng.dirichlet((1, 1, 1), count)
    corners = mesh.points.positions.astype(np.float64)[mesh.faces[face]]
    places = (corners * shares[:, :, None]).sum(axis=1) + mesh.origin
    return places, normals[face] / areas[face, None]


def covered(view: RangeView, places: Places, within: float) -> NDArray[np.bool_]:
    """Whether triangles of a view lie over places, so far off along the surface's normal at most, (N,)."""
    positions, normals = places
    if not view.valid().any():
        return np.zeros(len(positions), bool)
    mesh = triangulated([view])
    hits = mesh.cast(positions - mesh.origin + within * normals, -normals)
    return hits.distance <= 2 * within


def times_covered(views: Sequence[RangeView], places: Places, within: float) -> NDArray[np.int_]:
    """By how many views each place is covered, (N,)."""
    return np.sum([covered(view, places, within) for view in views], axis=0)
