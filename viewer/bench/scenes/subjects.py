"""What is scanned and measured against: at each moment the points of a scan, and what was truly there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from hashlib import sha256

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...mesh.reference import Reference
from ...mesh.scene import Rays, Scene
from ...mesh.triangles import Mesh, vertex_normals
from ...scan.points import PointCloud
from ...scan.pose import Pose

_KEPT = 2  # moments in memory: flicker compares one with the next


@dataclass(frozen=True, eq=False)
class Moment:
    """One moment of a subject.

    pose: what was scanned. truth: what was there. mesh: the truth as triangles; where it is a mesh, itself.
    """

    pose: Pose
    truth: Scene
    mesh: Mesh


@dataclass(frozen=True, eq=False, kw_only=True)
class Subject:
    """A subject of the benchmark, at one or more moments, which are loaded when asked for.

    moments: how many. load: makes one. noise: the standard deviation of depth that a virtual scanner
    added, in footprints of its pixels. up: the axis that is up in pictures, such as '+y'. tolerance: how
    far measured points may lie off the truth, scan units; None: they are exact. credit: whose data it is.
    """

    name: str
    load: Callable[[int], Moment]
    moments: int = 1
    noise: float = 0.0
    up: str = "+y"
    tolerance: float | None = None
    credit: str = ""

    def moment(self, index: int) -> Moment:
        """The moment of this index; the last two are cached. Raises InputError where there is none."""
        if not 0 <= index < self.moments:
            raise InputError(
                f"has no moment {index}", self.name, f"The sequence has the moments 0 to {self.moments - 1}"
            )
        return self._latest(index)

    @cached_property
    def hash(self) -> str:
        """16 hex digits of the points and the truths of the first and the last moment."""
        digest = sha256()
        for index in sorted({0, self.moments - 1}):
            moment = self.moment(index)
            for part in (moment.pose.cloud, moment.truth):
                _add(digest.update, part)
        return digest.hexdigest()[:16]

    def carry(self, source: int, target: int, reference: Reference) -> Rays | None:
        """Move the hits of a reference picture of one moment to where they are at another, (N, 3).

        Relative to the origin of the other's truth, in the order of the covered pixels. None where that
        is not known: where the faces of the two moments are not the same.
        """
        if source == target:
            return reference.positions()
        truth, moved = self.moment(source).truth, self.moment(target).truth
        if not (isinstance(truth, Mesh) and isinstance(moved, Mesh)):
            return None
        if not np.array_equal(truth.faces, moved.faces):
            return None
        return truth.carry(reference.id[reference.covered], reference.positions(), moved)

    @cached_property
    def _latest(self) -> Callable[[int], Moment]:
        return lru_cache(maxsize=_KEPT)(self.load)


def smooth(mesh: Mesh) -> Mesh:
    """A mesh with normals at its vertices, less the vertices that are of no face."""
    used, faces = np.unique(mesh.faces, return_inverse=True)
    points = with_rows(replace(mesh.points, normals=vertex_normals(mesh)), used)
    return Mesh(points, faces.reshape(-1, 3).astype(np.uint32))


def with_rows(cloud: PointCloud, rows: NDArray[np.integer]) -> PointCloud:
    """Points of a cloud, in any order: without scalars, ids and what the scan says of itself."""
    chosen = cloud.of_rows(rows)
    return replace(chosen, scalars={}, ids=None, remainders=None, topology=None, viewpoint=None)


def _add(update: Callable[[bytes], object], part: PointCloud | Scene) -> None:
    """Feed what a cloud or a scene consists of to a digest."""
    if isinstance(part, Mesh):
        update(part.faces.tobytes())
        part = part.points
    if not isinstance(part, PointCloud):
        update(repr(part).encode())
        return
    arrays: tuple[NDArray | None, ...] = (
        part.origin, part.positions, part.normals, part.colors, part.radii
    )  # fmt: skip
    for array in arrays:
        update(b"none" if array is None else array.tobytes())
    if part.axes is not None:
        update(part.axes.tobytes())
