"""Several meshes as one: subjects that cover themselves, and of very different scales."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...mesh.scene import Rays
from ...mesh.triangles import Mesh
from ...scan.points import PointCloud

_GAP = 0.9  # from one to the next in a lattice, in edges of their box
_HEAD = 8  # times that the upper of two is smaller
_SEAT = 0.03  # of its height, that it sinks in


def in_lattice(meshes: Sequence[Mesh], counts: tuple[int, int, int]) -> Mesh:
    """Copies of meshes, by turns, in a lattice of boxes side by side; most of them hide others.

    counts: how many along x, y and z.
    """
    step = _GAP * np.max([mesh.bounds.high - mesh.bounds.low for mesh in meshes], axis=0)
    places = np.indices(counts).reshape(3, -1).T * step
    chosen = [meshes[number % len(meshes)] for number in range(len(places))]
    return _joined(
        chosen,
        [1.0] * len(places),
        [place - m.bounds.center for m, place in zip(chosen, places, strict=True)],
    )


def on_its_head(mesh: Mesh) -> Mesh:
    """A mesh, up +y, and a copy an eighth of its size on its highest point (Preiner 2012, Fig. 7)."""
    points, scale = mesh.points.world(), 1 / _HEAD
    top = points[points[:, 1].argmax()]
    seat = mesh.bounds.center.copy()
    seat[1] = mesh.bounds.low[1] + _SEAT * (mesh.bounds.high - mesh.bounds.low)[1]
    return _joined([mesh, mesh], [1.0, scale], [np.zeros(3), top - scale * seat])


def _joined(meshes: Sequence[Mesh], scales: Sequence[float], shifts: Sequence[Rays]) -> Mesh:
    """One mesh of several with normals, each scaled and then moved (3,)."""
    firsts = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    cloud = PointCloud.from_arrays(
        np.concatenate([m.points.world() * s + by for m, s, by in zip(meshes, scales, shifts, strict=True)]),
        normals=np.concatenate([mesh.points.normals for mesh in meshes]),
    )
    faces = np.concatenate([m.faces + np.uint32(first) for m, first in zip(meshes, firsts[:-1], strict=True)])
    return Mesh(cloud, faces)
