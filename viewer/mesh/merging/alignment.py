"""How far the calibration of pods has drifted: the rigid motions that bring what they measured together.

Pairs of views are registered by point-to-plane ICP (Chen and Medioni 1992) as open3d has it. A last step of
least squares, with the places where one surface meets the other along the pod's rays, tells how sure the
motion is: from the scatter of residuals between patches, since neighbours err alike. Directions in which
surfaces slide without coming apart (a plane has three) are left alone. Of all pairs, the motions of all
views are found by weighted least squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...bounds import Bounds
from ...rigid import STILL, Rigid, rigid_matrix, rotation_about
from ...scan.range_view import RangeView
from ...task import checkpoint
from ..scene import Rays
from .competition import SCATTER, agreement_of, comparable, normal_deviation, reach
from .surfaces import RangeSurface, meet

_ROUNDS = 3  # of registering all pairs and moving the views
_SAMPLES = 20_000  # points of a view that are registered, at most
_STEPS = 3  # of least squares, the last of which tells the errors
_FEWEST = 200  # points, that tell a motion
_SCALES = (1.0, 0.3, 0.1)  # of the reach: within which points correspond, one after another
_ITERATIONS = 30  # of each
_PATCHES = 12  # along an edge of the picture, whose residuals are taken as independent
_SMOOTHING = 2  # pixels over which normals are averaged
_SLIDING = 1e-4  # of a motion's mean square along the normals, below which surfaces only slide on each other
_OF_NOISE = 4.0  # times what noise of the normals makes of that: so much is uncertain
_SURE = 3.0  # standard errors
_NO_MATTER = 0.1  # of the spacing of samples: smaller shifts are none, however sure
_FLOOR = 0.02  # of the spacing of samples: no motion is known better

Twist = NDArray[np.float64]  # (6,), a turn in radians, times the scale of an alignment, and a shift


@dataclass(frozen=True, eq=False)
class Drift:
    """The motion of one view that registering it with another one finds.

    rotation: degrees, and translation: of the middle of what overlaps, scan units, each with its standard
    error. shift: root of the mean square distance that what overlaps moves by, scan units. is_significant:
    whether the shift is more than its error, and the sampling, account for. loose: of the six directions of a
    motion, in how many the surfaces only slide; these are not in it. depth_rmse: between the two without
    the motion, see `Agreement`.
    """

    rotation: float
    rotation_error: float
    translation: float
    translation_error: float
    shift: float
    shift_error: float
    is_significant: bool
    loose: int
    depth_rmse: float


@dataclass(frozen=True, eq=False)
class Refinement:
    """Views whose alignment was corrected, and the motion of each in the world."""

    views: tuple[RangeView, ...]
    motions: tuple[Rigid, ...]


@dataclass(frozen=True, eq=False)
class _Frame:
    """The frame of twists: a middle, (3,), and a length."""

    middle: Rays
    scale: float

    @classmethod
    def of(cls, surfaces: Sequence[RangeSurface]) -> _Frame:
        """Put one in the middle of surfaces."""
        bounds = Bounds.around([surface.bounds for surface in surfaces])
        return cls(bounds.center, bounds.radius)

    def slopes(self, points: Rays, directions: NDArray[np.floating]) -> NDArray[np.float64]:
        """How points (N, 3) move along directions (N, 3) with a twist, (N, 6)."""
        return np.hstack([np.cross(points - self.middle, directions) / self.scale, directions])

    def motion(self, twist: Twist) -> Rigid:
        """The motion of a twist."""
        turn = rotation_about(twist[:3] / self.scale)
        return Rigid(rigid_matrix(turn, self.middle + twist[3:] - turn @ self.middle))

    def twist(self, motion: Rigid) -> Twist:
        """The twist of a motion."""
        from scipy.spatial.transform import Rotation

        turn = Rotation.from_matrix(motion.rotation).as_rotvec()
        return np.concatenate([turn * self.scale, motion.points(self.middle) - self.middle])


@dataclass(frozen=True, eq=False)
class _Registration:
    """The twist that brings one view onto another, and its covariance (6, 6); what it does, as a `Drift`."""

    twist: Twist
    covariance: NDArray[np.float64]
    drift: Drift


def drifts(views: Sequence[RangeView]) -> dict[tuple[int, int], Drift]:
    """The drift of each pair (i, j), i < j, of views that overlap: of i, registered with j."""
    return {pair: found.drift for pair, found in _registered([RangeSurface.of(v) for v in views]).items()}


def refine(views: Sequence[RangeView]) -> Refinement:
    """Correct the alignment of views by where they overlap.

    Where no drift is significant, all stay as they are. Of views that hang together, the one stays
    by which the others move least; those that overlap with none stay where they are.
    """
    motions = [STILL for _ in views]
    for turn in range(_ROUNDS):
        checkpoint(turn / _ROUNDS)
        surfaces = [RangeSurface.of(_moved(v, motion)) for v, motion in zip(views, motions, strict=True)]
        frame, pairs = _Frame.of(surfaces), _registered(surfaces)
        if not turn and not any(found.drift.is_significant for found in pairs.values()):
            break
        twists = _settled(pairs, len(views))
        motions = [frame.motion(twist).after(motion) for twist, motion in zip(twists, motions, strict=True)]
    return Refinement(tuple(map(_moved, views, motions)), tuple(motions))


def _moved(view: RangeView, motion: Rigid) -> RangeView:
    """A view after a motion in the world."""
    if motion.is_identity:
        return view
    return replace(view, world_to_camera=view.world_to_camera @ motion.inverse.matrix)


def _registered(surfaces: Sequence[RangeSurface]) -> dict[tuple[int, int], _Registration]:
    """The registrations of all pairs that overlap."""
    frame, within = _Frame.of(surfaces), reach(surfaces)
    surfaces = [_with_smooth_normals(surface) for surface in surfaces]
    found = {}
    for i in range(len(surfaces)):
        for j in range(i + 1, len(surfaces)):
            checkpoint()
            one = _registration(surfaces[i], surfaces[j], frame, within)
            if one is not None:
                found[i, j] = one
    return found


def _with_smooth_normals(surface: RangeSurface) -> RangeSurface:
    """A surface with normals that noise does not turn, since such hold what really slides."""
    sums = np.stack([surface.smoothed(column, _SMOOTHING) for column in surface.normals.T], axis=1)
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    return replace(surface, normals=(sums / np.where(length > 0, length, 1)).astype(np.float32))


def _registration(
    moving: RangeSurface, fixed: RangeSurface, frame: _Frame, within: float
) -> _Registration | None:
    """The registration of a view with another, None where they do not overlap enough to tell."""
    met = meet(moving, moving.points, fixed)
    shared = np.flatnonzero(comparable(moving, met, within))
    if len(shared) < _FEWEST:
        return None
    rmse = agreement_of(moving, met, within).depth_rmse
    shared = shared[:: -(-len(shared) // _SAMPLES)]
    motion = _closest(moving.points[shared] - frame.middle, fixed, frame, within)
    registration = None
    for _ in range(_STEPS):
        fit = _fit(_motioned(moving, motion), fixed, frame, within)
        if fit is None:
            return None
        # What slides is taken back each time: else it comes in by the second order of how far it slid.
        twist = fit.held @ frame.twist(frame.motion(fit.step).after(motion))
        motion = frame.motion(twist)
        registration = _Registration(twist, fit.covariance, _drift(twist, fit, frame, rmse))
    return registration


@dataclass(frozen=True, eq=False)
class _Fit:
    """A step of least squares: the twist that is lacking, its covariance (6, 6), the projection (6, 6) onto
    the directions that are held; and the points (N, 3) that it is of, and how far apart they are measured."""

    step: Twist
    covariance: NDArray[np.float64]
    held: NDArray[np.float64]
    points: Rays
    spacing: float


def _fit(moved: RangeSurface, fixed: RangeSurface, frame: _Frame, within: float) -> _Fit | None:
    """Find what brings a surface still nearer to another; None where they overlap too little."""
    met = meet(moved, moved.points, fixed)
    near = comparable(moved, met, within)
    if np.count_nonzero(near) < _FEWEST:
        return None
    near &= met.distance <= SCATTER * normal_deviation(met.distance[near]) + met.spacing
    rows = np.flatnonzero(near)
    points, spacing = moved.points[rows], float(np.median(met.spacing[rows]))
    residuals = (moved.rays(points) * met.normal[rows]).sum(axis=1) * met.depth[rows]
    # Noise turns the normals, and squared that would hold what slides: of two views it is independent.
    own, other = (frame.slopes(points, normals) for normals in (moved.normals[rows], met.normal[rows]))
    slopes, normal = (own + other) / 2, (own.T @ other + other.T @ own) / 2
    noise = float(np.square(met.normal[rows] - moved.normals[rows]).mean()) / 2
    least = len(rows) * max(_SLIDING, _OF_NOISE * noise / np.sqrt(len(rows)))
    inverse, held = _held_inverse(normal, least)
    step = inverse @ (slopes.T @ residuals)
    patch = _patches(moved.view, rows)
    scores = slopes * (residuals - slopes @ step)[:, None]
    sums = np.stack([np.bincount(patch, column) for column in scores.T], axis=1)
    covariance = inverse @ (sums.T @ sums) @ inverse + (_FLOOR * spacing) ** 2 * held
    return _Fit(step, covariance, held, points, spacing)


def _motioned(surface: RangeSurface, motion: Rigid) -> RangeSurface:
    """A surface after a motion in the world."""
    return replace(
        surface,
        view=_moved(surface.view, motion),
        points=motion.points(surface.points),
        normals=motion.directions(surface.normals).astype(np.float32),
    )


def _closest(points: Rays, fixed: RangeSurface, frame: _Frame, within: float) -> Rigid:
    """The motion that brings points (N, 3), relative to the frame's middle, onto a surface, by ICP."""
    from open3d import geometry, pipelines, utility
    from scipy.spatial.transform import Rotation

    registration = pipelines.registration
    source, target = geometry.PointCloud(), geometry.PointCloud()
    source.points = utility.Vector3dVector(points)
    target.points = utility.Vector3dVector(fixed.points - frame.middle)
    target.normals = utility.Vector3dVector(fixed.normals.astype(np.float64))
    found = np.eye(4)
    for scale in _SCALES:
        checkpoint()
        result = registration.registration_icp(
            source,
            target,
            scale * within,
            found,
            registration.TransformationEstimationPointToPlane(registration.TukeyLoss(scale * within)),
            registration.ICPConvergenceCriteria(max_iteration=_ITERATIONS),
        )
        found = np.array(result.transformation)
    motion = Rigid(rigid_matrix(Rotation.from_matrix(found[:3, :3]).as_matrix(), found[:3, 3]))
    farthest = np.linalg.norm(motion.points(points) - points, axis=1).max()
    if not farthest <= 3 * within:  # it has slid away
        return STILL
    return motion.in_frame(-frame.middle)


def _held_inverse(
    normal: NDArray[np.float64], least: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The inverse of a normal matrix (6, 6) in the directions that it holds, whose eigenvalues are no less
    than `least`, and the projection onto them."""
    sizes, directions = np.linalg.eigh(normal)
    is_held = sizes > least
    held = directions[:, is_held]
    return (held / sizes[is_held]) @ held.T, held @ held.T


def _patches(view: RangeView, rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """The patch of the picture that points of a view in these rows are in, (N,)."""
    row, column = np.divmod(np.flatnonzero(view.valid())[rows], view.depth.shape[1])
    (top, tall), (left, wide) = ((place.min(), np.ptp(place) + 1) for place in (row, column))
    return (row - top) * _PATCHES // tall * _PATCHES + (column - left) * _PATCHES // wide


def _drift(twist: Twist, fit: _Fit, frame: _Frame, rmse: float) -> Drift:
    """Tell what a twist does to the points of a fit."""
    points, covariance = fit.points, fit.covariance
    of_middle = _point_slopes(frame, points.mean(axis=0)[None])[0]
    of_all = _point_slopes(frame, points)
    moments = np.einsum("nij,nik->jk", of_all, of_all) / len(points)
    shift, error = float(np.sqrt(twist @ moments @ twist)), float(np.sqrt(np.trace(moments @ covariance)))
    degrees = np.degrees(1 / frame.scale)
    return Drift(
        rotation=float(np.linalg.norm(twist[:3]) * degrees),
        rotation_error=float(np.sqrt(np.trace(covariance[:3, :3])) * degrees),
        translation=float(np.linalg.norm(of_middle @ twist)),
        translation_error=float(np.sqrt(np.trace(of_middle @ covariance @ of_middle.T))),
        shift=shift,
        shift_error=error,
        is_significant=shift > max(_SURE * error, _NO_MATTER * fit.spacing),
        depth_rmse=rmse,
        loose=6 - round(np.trace(fit.held)),
    )


def _point_slopes(frame: _Frame, points: Rays) -> NDArray[np.float64]:
    """How points (N, 3) move with a twist, (N, 3, 6)."""
    return np.stack([frame.slopes(points, np.broadcast_to(axis, points.shape)) for axis in np.eye(3)], axis=1)


def _settled(pairs: dict[tuple[int, int], _Registration], count: int) -> list[Twist]:
    """The twist of each of so many views, by which all pairs come together."""
    rows, values = [], []
    for (i, j), found in pairs.items():
        sizes, directions = np.linalg.eigh(found.covariance)
        sure = sizes > sizes[-1] * 1e-12
        weights = (directions[:, sure] / np.sqrt(sizes[sure])).T
        row = np.zeros((len(weights), 6 * count))
        row[:, 6 * i : 6 * i + 6], row[:, 6 * j : 6 * j + 6] = weights, -weights
        rows.append(row)
        values.append(weights @ found.twist)
    if not rows:
        return [np.zeros(6)] * count
    twists = np.linalg.lstsq(np.vstack(rows), np.concatenate(values))[0].reshape(count, 6)
    for together in _components(pairs, count):
        apart = np.linalg.norm(twists[together, None] - twists[None, together], axis=2).sum(axis=1)
        twists[together] -= twists[together[int(apart.argmin())]]
    return list(twists)


def _components(pairs: dict[tuple[int, int], _Registration], count: int) -> list[NDArray[np.intp]]:
    """Views that hang together by pairs, each group ascending."""
    group = np.arange(count)
    for _ in range(count):
        for i, j in pairs:
            group[[i, j]] = group[[i, j]].min()
    return [np.flatnonzero(group == one) for one in np.unique(group)]
