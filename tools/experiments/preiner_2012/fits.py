"""Normals and radii found in a picture, against the truth: inside and at silhouettes, and from view to view.

Points are vertices of models, whose true normals are those of the faces around them; with noise they lie off
the surface, and the true normals stay. Beside them, open3d's normals of as many neighbours among the same
points.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.suite import row_of
from experiments.tables import Row
from viewer.analysis.visible_normals import NormalSearch, VisibleNormals, estimate_normals
from viewer.bench.metrics import angles_between
from viewer.bench.plan import Group
from viewer.bench.run import Bench, BenchSettings
from viewer.camera import Camera
from viewer.mesh.reference import Reference, trace, visible
from viewer.mesh.triangles import Mesh
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.spacing import typical_spacing

SCENES = ("bunny", "armadillo", "igea", "dragon")
BAND = 3  # pixels to each side of a silhouette
ORBIT_STEP = 2.0  # degrees between two views that are compared
NOISES = (0.0, 0.25, 0.5, 1.0)  # standard deviations, in distances between neighbours
_ELEVATION = 10.0
_STEP = 4.0  # median distances between neighbours by which depth steps at a silhouette

Angles = NDArray[np.float64]
Finder = Callable[[Pose, Camera, tuple[int, int]], VisibleNormals]


@dataclass
class _Pooled:
    """Angles of all views, degrees, in lists of (P,): off the truth, and what changes from view to view."""

    found: list[Angles] = field(default_factory=list)
    reference: list[Angles] = field(default_factory=list)
    in_band: list[NDArray[np.bool_]] = field(default_factory=list)
    turned: list[Angles] = field(default_factory=list)
    grown: list[NDArray[np.float64]] = field(default_factory=list)

    def numbers(self) -> Row:
        """Medians and 95th percentiles, and how many points they are of."""
        band = np.concatenate(self.in_band)
        angles = {"found": np.concatenate(self.found), "open3d": np.concatenate(self.reference)}
        return {
            "points": int(np.count_nonzero(~band)),
            "band_points": int(np.count_nonzero(band)),
            **{
                f"{who}_{where}": _spread(values[mask])
                for who, values in angles.items()
                for where, mask in (("inside", ~band), ("band", band))
            },
            "turned": float(np.median(np.concatenate(self.turned))),
            "grown": float(np.median(np.concatenate(self.grown))),
        }


def measure_fits(bench: Bench) -> Iterator[Row]:
    """Yield a row for each model and setting: hidden neighbors or not, and numbers of them under noise."""
    for scene in SCENES:
        moment = bench.subject(Group(scene, ())).moment(0)
        for noise in NOISES if scene == SCENES[0] else NOISES[:1]:
            cloud = noisy(moment.pose.cloud, noise, bench.settings.seed)
            for params in fitted(noise):
                found = fit_errors(cloud, moment.mesh, bench.settings, params)
                yield row_of(bench, scene=scene, noise=noise, params=params, **found)


def fitted(noise: float) -> list[dict[str, Any]]:
    """Parameters whose fits are looked at: with hidden neighbours and without; under noise, of more.

    As many as stated, and as the noise asks for ("adaptive").
    """
    ks = (10, 20, 30) if noise else (10,)
    fixed = [{"k": k, "hidden_neighbors": True, "adaptive": False} for k in ks]
    alone = [] if noise else [{"k": 10, "hidden_neighbors": False, "adaptive": False}]
    return [*fixed, *alone, {"k": 10, "hidden_neighbors": True, "adaptive": True}]


def fit_errors(
    cloud: PointCloud, mesh: Mesh, settings: BenchSettings, params: dict[str, Any], find: Finder | None = None
) -> Row:
    """Angles between the normals found and the cloud's own, from evenly spread directions.

    cloud: points on the mesh with true normals, which are not looked at. A point counts where nothing of the
    mesh hides it. find: finds the normals; None: `estimate_normals` with these params. `found_inside`,
    `found_band`: {median, p95}, degrees; `open3d_...`: of as many neighbours among the same participants.
    `turned`, `grown`: the median change of a point's normal, degrees, and of its radius, as a share, from one
    view to another 2 degrees aside.
    """
    assert cloud.normals is not None
    pose, pooled = Pose(0, 0.0, "bare", bare(cloud)), _Pooled()
    tolerance = max(_STEP * typical_spacing(cloud), 1e-4 * mesh.bounds.radius)
    views, size = settings.views, settings.size
    find = find or partial(_estimated, NormalSearch(**params))
    for number in range(views):
        camera = Camera.orbit(mesh.bounds, 360 * number / views, _ELEVATION, aspect=size[0] / size[1])
        found = find(pose, camera, size)
        seen = visible(mesh, cloud.positions[found.rows], camera, 0.25 * tolerance)
        rows = found.rows[seen]
        reference = trace(mesh, camera, size)
        pooled.found.append(_off(found.normals[seen], cloud.normals[rows]))
        pooled.reference.append(_off(_open3d(cloud, found, params["k"])[seen], cloud.normals[rows]))
        pooled.in_band.append(at_silhouettes(reference, cloud, rows, tolerance))
        aside = find(pose, camera.orbited(ORBIT_STEP, 0), size)
        turned, grown = changes(found, aside)
        pooled.turned.append(turned)
        pooled.grown.append(grown)
    return pooled.numbers()


def _estimated(search: NormalSearch, pose: Pose, camera: Camera, size: tuple[int, int]) -> VisibleNormals:
    return estimate_normals(pose, camera, size=size, search=search)


def bare(cloud: PointCloud) -> PointCloud:
    """The positions alone."""
    return PointCloud(cloud.positions, cloud.origin, ids=cloud.ids)


def noisy(cloud: PointCloud, noise: float, seed: int) -> PointCloud:
    """Points moved along their normals by chance. noise: standard deviation, in distances of neighbours."""
    if not noise:
        return cloud
    assert cloud.normals is not None
    by = np.random.default_rng(seed).normal(0, noise * typical_spacing(cloud), (len(cloud), 1))
    return cloud.displaced(by * cloud.normals)


def at_silhouettes(
    reference: Reference, cloud: PointCloud, rows: NDArray[np.integer], step: float
) -> NDArray[np.bool_]:
    """Tell which of the points (P,) lie within three pixels of a silhouette: of a pixel whose neighbour sees
    nothing, or something farther by more than `step` and four times what a pixel covers."""
    from scipy.ndimage import distance_transform_edt

    depth, view = reference.depth, reference.view
    with np.errstate(invalid="ignore"):  # where both see nothing
        steps = [np.abs(np.diff(depth, axis=axis)) for axis in (0, 1)]
    nearest = float(depth[reference.covered].min()) if reference.covered.any() else 1.0
    limit = max(step, _STEP * (nearest if view.perspective else 1.0) / view.scale)
    edges = np.zeros(depth.shape, bool)
    edges[:-1] |= steps[0] > limit
    edges[1:] |= steps[0] > limit
    edges[:, :-1] |= steps[1] > limit
    edges[:, 1:] |= steps[1] > limit
    if not edges.any():
        return np.zeros(len(rows), bool)
    near = distance_transform_edt(~edges) <= BAND
    pixels, _ = view.project(cloud.positions[rows].astype(np.float64) + (cloud.origin - reference.origin))
    column, row = np.clip(np.floor(pixels).astype(np.intp), 0, np.array(view.size) - 1).T
    return near[row, column]


def changes(first: VisibleNormals, second: VisibleNormals) -> tuple[Angles, NDArray[np.float64]]:
    """The change of each point that both see: of its normal up to its sign, degrees (P,), and of its radius,
    a share of it (P,)."""
    _, at, there = np.intersect1d(first.rows, second.rows, assume_unique=True, return_indices=True)
    before, after = (
        found.radii[at_rows].astype(np.float64) for found, at_rows in ((first, at), (second, there))
    )
    grown = np.abs(after - before) / np.maximum(np.maximum(before, after), np.finfo(np.float32).tiny)
    return _off(first.normals[at], second.normals[there]), grown


def _open3d(cloud: PointCloud, found: VisibleNormals, k: int) -> NDArray[np.float64]:
    """open3d's normals of the visible points, of k neighbours among the participants, (M, 3)."""
    from open3d import geometry, utility

    participants = found.neighbors
    taking_part = geometry.PointCloud(
        utility.Vector3dVector(cloud.positions[participants].astype(np.float64))
    )
    taking_part.estimate_normals(geometry.KDTreeSearchParamKNN(k))
    return np.asarray(taking_part.normals)[np.searchsorted(participants, found.rows)]


def _off(first: NDArray[np.floating], second: NDArray[np.floating]) -> Angles:
    angle = angles_between(first, second)
    return np.minimum(angle, 180 - angle)


def _spread(angles: Angles) -> dict[str, float]:
    known = angles[np.isfinite(angles)]
    if not len(known):
        return {"median": float("nan"), "p95": float("nan")}
    median, p95 = np.quantile(known, [0.5, 0.95])
    return {"median": float(median), "p95": float(p95)}
