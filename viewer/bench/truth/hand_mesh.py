"""A hand before the demo scan's subject: a sheet with gaps, and another one close behind it."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ...mesh.scene import Rays
from ...mesh.triangles import Mesh, vertex_normals
from ...scan.points import PointCloud
from .head_mesh import head_mesh
from .isosurface import isosurface

_Bone = tuple[tuple[float, float, float], tuple[float, float, float], float]  # ends and radius, mm

_PLACE = np.array([-5.0, -45.0, 165.0])  # of the wrist, mm: the tip of the nose is at z = 116
# Palm, fingers, thumb; the fingers are spread so that the face is seen between them.
_BONES: list[_Bone] = [
    *(((x / 2, 5, 0), (x, 62, 0), 11.0) for x in (-27, -9, 9, 27)),
    *(
        ((x, 62, 0), (1.75 * x, 62 + length, 4), 7.5)
        for x, length in ((-27, 58), (-9, 72), (9, 66), (27, 50))
    ),
    ((-18, 10, 2), (-62, 52, 14), 9.0),
]
_BLEND = 4.0  # mm, over which bones run into each other
_CELL = 1.0  # mm
_MARGIN = 14.0  # mm around the ends of bones
_COLOR = (214, 158, 132)  # sRGB


@cache
def hand_before_face() -> Mesh:
    """The mesh of both, mm, with normals and colours; it does not move."""
    hand, hand_faces = _hand()
    positions = hand + _PLACE
    head = head_mesh(0.0)
    assert head.points.normals is not None and head.points.colors is not None
    bare = Mesh(PointCloud.from_arrays(positions, origin=np.zeros(3)), hand_faces)
    colors = np.tile(np.array([_COLOR], np.uint8), (len(positions), 1))
    points = PointCloud.from_arrays(
        np.concatenate([head.points.world(), positions]),
        normals=np.concatenate([head.points.normals, vertex_normals(bare)]),
        colors=np.concatenate([head.points.colors[:, :3], colors]),
        origin=np.zeros(3),
    )
    return Mesh(points, np.concatenate([head.faces, hand_faces + np.uint32(len(head.points))]))


def _hand() -> tuple[Rays, NDArray[np.uint32]]:
    """Vertices (V, 3), mm from the wrist, and faces."""
    ends = np.array([end for *both, _ in _BONES for end in both])
    lines = [
        np.arange(low - _MARGIN, high + _MARGIN + _CELL, _CELL)
        for low, high in zip(ends.min(axis=0), ends.max(axis=0), strict=True)
    ]
    x, y, z = lines
    grid = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1)
    # A smooth least of the distances to all bones (Quilez's exponential).
    total = sum(np.exp2(-_distance(grid, bone) / _BLEND) for bone in _BONES)
    values = -_BLEND * np.log2(np.maximum(total, 1e-30))
    return isosurface(values.astype(np.float32), (x, y, z))


def _distance(points: NDArray[np.float64], bone: _Bone) -> NDArray[np.float64]:
    """The signed distance of points (..., 3) to a capsule."""
    start, end, radius = np.array(bone[0], float), np.array(bone[1], float), bone[2]
    axis, arm = end - start, points - start
    along = np.clip(arm @ axis / (axis @ axis), 0, 1)
    return np.linalg.norm(arm - along[..., None] * axis, axis=-1) - radius
