"""Registrations of other programs, which find the motion of a region, of points (N, 3), as Scan4D does.

Distances are in mm, for points 1.3 mm apart.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewer.rigid import Rigid, best_rotation, rigid_matrix

Float = NDArray[np.float64]
# Gives the motion of a region to the points (M, 3) of a frame, from a start on
Method = Callable[[Float, Rigid], Rigid]

_NEIGHBORS = 20  # that normals are of
_ROUNDS = 50
_REACHES = 8.0, 3.0, 1.5  # mm, of one ICP after the other
_REACH = 4.0  # mm, of small_gicp
_DRIFTS = 60  # rounds of coherent point drift
_STRAY = 0.1  # share of points that it takes for strays
_LEAST_VARIANCE = 1e-7  # of its residuals, in units of its own
_TUKEY = 0.5  # mm, from which on Tukey's weights are 0


def open3d_icp(region: Float, *, is_robust: bool) -> Method:
    """ICP, point to plane, of open3d; with Tukey's weights, if robust. Raises ImportError."""
    open3d: Any = import_module("open3d")
    registration = open3d.pipelines.registration
    losses = [registration.TukeyLoss(_TUKEY)] if is_robust else []
    estimation = registration.TransformationEstimationPointToPlane(*losses)
    criteria = registration.ICPConvergenceCriteria(max_iteration=_ROUNDS)

    def points_of(points: Float) -> Any:
        return open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))

    moved = points_of(region)

    def method(frame: Float, start: Rigid) -> Rigid:
        still = points_of(frame)
        still.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(_NEIGHBORS))
        matrix = start.matrix
        for reach in _REACHES:
            found = registration.registration_icp(moved, still, reach, matrix, estimation, criteria)
            matrix = found.transformation
        return _rigid(matrix)

    return method


def small_gicp(region: Float, *, kind: str) -> Method:
    """GICP or PLANE_ICP of small_gicp (Koide 2024). Raises ImportError."""
    gicp: Any = import_module("small_gicp")

    def prepared(points: Float) -> Any:
        return gicp.preprocess_points(
            points, downsampling_resolution=0.01, num_neighbors=_NEIGHBORS, num_threads=1
        )

    moved, _ = prepared(region)

    def method(frame: Float, start: Rigid) -> Rigid:
        still, tree = prepared(frame)
        found = gicp.align(
            still, moved, tree, start.matrix, registration_type=kind, max_correspondence_distance=_REACH,
            num_threads=1, max_iterations=_ROUNDS,
        )  # fmt: skip
        return _rigid(found.T_target_source)

    return method


def _rigid(matrix: Float) -> Rigid:
    """A motion whose rotation is exact again."""
    rotation = best_rotation(np.eye(3), np.asarray(matrix)[:3, :3].T)
    return Rigid(rigid_matrix(rotation, np.asarray(matrix)[:3, 3]))


def coherent_point_drift(points: Float, targets: Float, *, wide: float = 2.0, smooth: float = 3.0) -> Float:
    """Coherent point drift, non-rigid (Myronenko and Song 2010), plainly: gives the moved points, (N, 3).

    targets: (M, 3). wide: width of the motion's kernel, and smooth: its weight, after both clouds were scaled
    to unit variance, as the paper has them.
    """
    middle, scale = targets.mean(axis=0), targets.std()
    y, x = (points - middle) / scale, (targets - middle) / scale
    kernel = np.exp(-_squares(y, y) / (2 * wide**2))
    ways = np.zeros_like(y)
    variance = _squares(y, x).mean() / 3
    for _ in range(_DRIFTS):
        moved = y + kernel @ ways
        chances = np.exp(-_squares(moved, x) / (2 * variance))
        stray = (2 * np.pi * variance) ** 1.5 * _STRAY / (1 - _STRAY) * len(y) / len(x)
        chances /= chances.sum(axis=0) + stray
        weights, wanted = chances.sum(axis=1), chances @ x
        system = weights[:, None] * kernel + smooth * variance * np.eye(len(y))
        ways = np.linalg.solve(system, wanted - weights[:, None] * y)
        moved = y + kernel @ ways
        variance = max(float((chances * _squares(moved, x)).sum() / weights.sum() / 3), _LEAST_VARIANCE)
    return moved * scale + middle


def _squares(one: Float, other: Float) -> Float:
    """The squared distances of points, (N, M)."""
    return ((one[:, None] - other[None]) ** 2).sum(axis=2)
