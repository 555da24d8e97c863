"""Rigid registration of points to oriented points: small, and the same in every run."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...mesh.scene import Rays
from ...rigid import rigid_matrix, rotation_about

_STEPS = 60  # at each reach
_STILL = 1e-6  # a step that moves nothing any more: radians, and scan units


@dataclass(frozen=True, eq=False)
class OrientedPoints:
    """Points that others are registered to. positions, normals: (N, 3), normals of unit length."""

    positions: Rays
    normals: Rays

    @cached_property
    def tree(self) -> Any:
        """A tree that finds the nearest of its points."""
        from scipy.spatial import cKDTree

        return cKDTree(self.positions)


def register(
    points: Rays, target: OrientedPoints, start: NDArray[np.float64], reaches: tuple[float, ...]
) -> tuple[NDArray[np.float64], float, float]:
    """The rigid motion (4, 4) that brings points (N, 3) to the target, from a start near it.

    Point to plane (Chen and Medioni 1991), with the nearest points as partners. reaches: how far partners
    may be, in scan units, one after the other. Also gives the root mean square of the distances to the planes
    of the partners, and the share of points that have one.
    """
    motion = start
    for reach in reaches:
        for _ in range(_STEPS):
            step, rms, share = _step(points @ motion[:3, :3].T + motion[:3, 3], target, reach)
            motion = step @ motion
            if np.abs(step - np.eye(4)).max() < _STILL:
                break
    return motion, rms, share


def _step(points: Rays, target: OrientedPoints, reach: float) -> tuple[NDArray[np.float64], float, float]:
    """The small motion that brings points nearer to the planes of their partners, and how far they are."""
    distance, partner = target.tree.query(points, distance_upper_bound=reach)
    paired = np.isfinite(distance)
    if np.count_nonzero(paired) < 6:
        return np.eye(4), np.inf, 0.0
    normal, offset = target.normals[partner[paired]], points[paired] - target.positions[partner[paired]]
    off = (offset * normal).sum(axis=1)
    center = points[paired].mean(axis=0)  # turning about it keeps the system well conditioned
    rows = np.hstack([np.cross(points[paired] - center, normal), normal])
    # Not by matrix products: those may sum in another order on another number of threads.
    square, right = np.einsum("ni,nj->ij", rows, rows), -np.einsum("ni,n->i", rows, off)
    solution = np.linalg.lstsq(square, right, rcond=None)[0]
    turn = rotation_about(solution[:3])
    motion = rigid_matrix(turn, center - turn @ center + solution[3:])
    return motion, float(np.sqrt(np.mean(off**2))), float(paired.mean())
