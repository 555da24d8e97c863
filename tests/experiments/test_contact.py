"""Fast contact of a surface with itself is found where it is, and neighbours along the surface are none."""

from __future__ import annotations

import numpy as np
from experiments.landmarks.contact import near_contact

from viewer.mesh.triangles import Mesh
from viewer.scan.points import PointCloud

SPACING = 1.0
LENGTH, WIDTH = 60, 5


def strip(gap: float) -> Mesh:
    """A strip folded in the middle into two layers, so far apart."""
    along, across = np.meshgrid(np.arange(LENGTH), np.arange(WIDTH), indexing="ij")
    half = LENGTH // 2
    x = np.where(along < half, along, LENGTH - 1 - along).ravel()
    z = np.where(along < half, 0.0, gap).ravel()
    points = np.stack([x, across.ravel(), z], axis=1).astype(float)
    corner = (np.arange(LENGTH - 1)[:, None] * WIDTH + np.arange(WIDTH - 1)).ravel()
    quads = np.stack([corner, corner + WIDTH, corner + WIDTH + 1, corner + 1], axis=1)
    faces = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.uint32)
    return Mesh(PointCloud.from_arrays(points, origin=np.zeros(3)), faces)


def touching(gaps: list[float]) -> np.ndarray:
    """Of a place at the free end, and one at the fold, by frame."""
    meshes, vertices = [strip(gap) for gap in gaps], np.array([2, (LENGTH // 2 - 1) * WIDTH + 2])
    paths = np.array([mesh.points.world(vertices) for mesh in meshes])
    return near_contact(meshes, paths, vertices, SPACING)


def test_layers_that_near_each_other_fast_touch() -> None:
    found = touching([8.0, 8.0, 3.0, 3.0, 3.0, 9.0])
    assert found[:, 0].tolist() == [False, False, True, False, True, False]


def test_neighbours_along_the_surface_do_not_touch() -> None:
    assert not touching([8.0, 8.0, 3.0, 3.0, 3.0, 9.0])[:, 1].any()


def test_slow_layers_do_not_count() -> None:
    assert not touching([3.0, 2.5, 2.0, 2.5]).any()
