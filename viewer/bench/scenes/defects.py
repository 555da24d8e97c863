"""Clouds as scanners and users leave them: bare, uneven, noisy, with strays, with wrong normals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...scan.points import PointCloud
from ...scan.spacing import typical_spacing
from .subjects import Moment, Subject, with_rows

Change = Callable[[PointCloud, np.random.Generator], PointCloud]

SIGMAS = 4  # of noise that still belong to the surface: all but one point in 16 000
_THINNEST = 0.1  # of the points that are left at the thin end of a ramp
_STRAYS = (1e3, 1e6)  # times the size of the body that strays are away
_NO_DATA = -9999.0  # what scanners write for a coordinate that was not measured


def changed(
    subject: Subject, name: str, changes: Sequence[Change], seed: int = 0, tolerance: float | None = None
) -> Subject:
    """A subject whose points are changed, one change after the other; its truth stays.

    tolerance: how far its points may lie off the truth now, scan units; None: as far as before.
    """

    def load(index: int) -> Moment:
        moment = subject.moment(index)
        cloud = moment.pose.cloud
        for number, change in enumerate(changes):
            cloud = change(cloud, np.random.default_rng((seed, index, number)))
        return replace(moment, pose=replace(moment.pose, points=cloud))

    return replace(subject, name=name, load=load, tolerance=tolerance or subject.tolerance)


def without_normals(cloud: PointCloud, _: np.random.Generator) -> PointCloud:
    """Positions and colours alone."""
    return replace(cloud, normals=None, radii=None)


def density_ramp(thinnest: float) -> Change:
    """A change that removes points by chance: none at one end of the longest axis, and all but a share
    `thinnest` at the other.

    The share of points that stay falls as an exponential from end to end, so that the slope of its logarithm
    is the same everywhere.
    """

    def change(cloud: PointCloud, random: np.random.Generator) -> PointCloud:
        low, high = cloud.positions.min(axis=0), cloud.positions.max(axis=0)
        axis = int((high - low).argmax())
        along = (cloud.positions[:, axis] - low[axis]) / (high[axis] - low[axis])
        stays = random.random(len(cloud)) < thinnest**along
        return with_rows(replace(cloud, radii=None), np.flatnonzero(stays))

    return change


thinned = density_ramp(_THINNEST)


def fewer(share: float) -> Change:
    """A change that keeps a share of the points, by chance."""

    def change(cloud: PointCloud, random: np.random.Generator) -> PointCloud:
        rows = random.choice(len(cloud), round(share * len(cloud)), replace=False)
        return with_rows(replace(cloud, radii=None), np.sort(rows))

    return change


def noisy(spacings: float) -> Change:
    """A change that moves points along normals by chance, so many of their spacings (standard deviation)."""

    def change(cloud: PointCloud, random: np.random.Generator) -> PointCloud:
        assert cloud.normals is not None
        offset = random.normal(scale=spacings * typical_spacing(cloud), size=len(cloud))
        moved = cloud.displaced((offset[:, None] * cloud.normals).astype(np.float32))
        return with_rows(moved, np.arange(len(cloud)))

    return change


def with_strays(cloud: PointCloud, _: np.random.Generator) -> PointCloud:
    """A cloud and three points far off: at 10^3 and 10^6 times its size, and at -9999 on each axis."""
    world = cloud.world()
    size = float(np.ptp(world, axis=0).max())
    ahead = np.array([1.0, 0.3, -0.6]) / np.linalg.norm([1.0, 0.3, -0.6])
    strays = [world.mean(axis=0) + times * size * ahead for times in _STRAYS]
    strays.append(np.full(3, _NO_DATA))

    def added(array: NDArray | None) -> NDArray | None:
        return None if array is None else np.concatenate([array, array[: len(strays)]])

    return PointCloud.from_arrays(
        np.concatenate([world, strays]),
        normals=added(cloud.normals),
        colors=added(cloud.colors),
        radii=added(cloud.radii),
        origin=cloud.origin,
    )


def by_turns(scans: Sequence[NDArray[np.float32]]) -> NDArray[np.float32]:
    """Normals of merged scans, (N, 3) each, as they come from several programs: the first scan's as they are,
    the second's turned around, the third's missing (zero), and so on."""
    signs = (1.0, -1.0, 0.0)
    return np.concatenate([np.float32(signs[number % 3]) * normals for number, normals in enumerate(scans)])
