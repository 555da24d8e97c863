"""The subject of the demo scan as a mesh that moves: what its points are measured against.

The exact implicit surface takes a millisecond a ray; this mesh of it takes a microsecond.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...mesh.triangles import Mesh
from ...scan.demo import colors, head
from ...scan.demo.motion import TALK, HeadMotion, move, turn
from ...scan.demo.solids import Solid, projected
from ...scan.faces import Triangles
from ...scan.points import PointCloud
from .isosurface import grid_values, isosurface

_Runs = tuple[tuple[tuple[float, float], ...], ...]

# Grid lines along x, y and z as runs of (first, step), mm; they end at the last. The slit between the closed
# lips is 0.6 mm high and steep behind them: cells finer than that keep it open from end to end. Of the
# eyeballs, what the skull hides is left out.
_SKIN_LINES = (
    ((-95, 1.0), (-29, 0.75), (29, 1.0), (96, 0)),
    ((-143, 1.0), (-68, 0.25), (-54, 1.0), (134, 0)),
    ((-112, 1.0), (66, 0.3), (96, 1.0), (118, 0)),
)
_EYE_LINES = (((-47, 0.75), (47, 0)), ((-4, 0.75), (24, 0)), ((60, 0.75), (75, 0)))
_REACH = 8.0  # mm
_NEWTON_STEPS = 2
_LONGEST_STEP = 0.2  # mm
_BATCH = 1 << 15  # points evaluated at a time, so that intermediate results stay in the cache


@dataclass(frozen=True, eq=False)
class _Rest:
    """The head at rest. positions, normals: (3, V); the first `skin` move. colors: (V, 3) uint8."""

    positions: NDArray[np.float64]
    normals: NDArray[np.float64]
    colors: NDArray[np.uint8]
    faces: Triangles
    skin: int


def head_mesh(time: float, motion: HeadMotion = TALK) -> Mesh:
    """The demo scan's subject at a time in seconds, mm; its faces are the same always.

    Its vertices are exact, with exact normals. The first call makes the mesh at rest.
    """
    rest = _rest()
    positions, normals = rest.positions.copy(), rest.normals.copy()
    skin, eyes = slice(0, rest.skin), slice(rest.skin, None)
    positions[:, skin], normals[:, skin], _ = move(
        rest.positions[:, skin], rest.normals[:, skin], time, motion
    )
    positions[:, eyes], normals[:, eyes] = turn(rest.positions[:, eyes], rest.normals[:, eyes], time, motion)
    points = PointCloud.from_arrays(positions.T, normals=normals.T, colors=rest.colors, origin=np.zeros(3))
    return Mesh(points, rest.faces)


@cache
def _rest() -> _Rest:
    """The head at rest: skin and eyeballs by marching cubes, their vertices brought to the surface."""
    skin, skin_faces = _surface(head.skin, _SKIN_LINES)
    eyes, eye_faces = _surface(head.eyes, _EYE_LINES)
    parts = [
        projected(solid, positions.T, _NEWTON_STEPS, _LONGEST_STEP)
        for solid, positions in ((head.skin, skin), (head.eyes, eyes))
    ]
    positions, normals = (np.concatenate(rows, axis=1) for rows in zip(*parts, strict=True))
    return _Rest(
        positions=positions,
        normals=normals,
        colors=np.rint(255 * colors.albedo(positions, normals, len(skin))).astype(np.uint8),
        faces=np.concatenate([skin_faces, eye_faces + np.uint32(len(skin))]),
        skin=len(skin),
    )


def _surface(solid: Solid, runs: _Runs) -> tuple[NDArray[np.float64], Triangles]:
    """The mesh of a solid: vertices (V, 3) and faces."""

    def values(points: NDArray[np.float64]) -> NDArray[np.float32]:
        single = points.astype(np.float32).T
        batches = range(0, len(points), _BATCH)
        return np.concatenate([solid(*single[:, start : start + _BATCH]) for start in batches])

    x, y, z = (
        np.concatenate([np.arange(a, b, step) for (a, step), (b, _) in pairwise(axis)]) for axis in runs
    )
    lines = (x, y, z)
    return isosurface(grid_values(values, lines, _REACH), lines)
