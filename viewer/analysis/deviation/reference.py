"""The surface that deviations are measured from: the faces of a mesh, or what points show."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...mesh.nearest import NearestOnMesh
from ...scan.estimate import with_estimates
from ...scan.faces import Triangles, rows_of_faces
from ...scan.noise import noise_of
from ...scan.points import PointCloud
from ...scan.pose import Pose
from ...threads import shares, together
from ..motion.stabilise import moment_surface

Float = NDArray[np.float64]


STORED, ESTIMATED = "normals of the scan", "estimated normals"


class DeviationReference(Protocol):
    """A surface with two sides."""

    @property
    def outside_by(self) -> str:
        """The source of the sides, such as STORED or ESTIMATED."""

    def signed(self, positions: Float, reach: float) -> Float:
        """The distances of positions (N, 3), absolute, from the surface, (N,) scan units; positive outside.
        NaN where the surface is farther than a reach, over its holes, and beyond its border."""


class Sided(NamedTuple):
    """A cloud with normals, and where they come from: STORED or ESTIMATED."""

    cloud: PointCloud
    by: str


def sided(pose: Pose) -> Sided:
    """The cloud of a pose with the normals of the scan. Where it has none, Scan4D estimates them."""
    if pose.cloud.normals is not None:
        return Sided(pose.cloud, STORED)
    return Sided(with_estimates(pose, ("normals",)).cloud, ESTIMATED)


class PointReference:
    """The surface that the points of a pose show: parabolas around them, see `tracking.surface_kernels`, and
    planes where these do not fit.

    Normals tell the side, see `sided`.
    """

    def __init__(self, pose: Pose) -> None:
        if not pose.count:
            raise InputError("has no points to compare with", pose.label)
        cloud, self.outside_by = sided(pose)
        self._origin = cloud.origin
        self._surface = moment_surface(cloud, cloud.origin)

        from .height_kernels import fit_range

        held, noise = self._surface.held, noise_of(cloud).deviation
        works = [lambda a=a, b=b: fit_range(held, noise, a, b) for a, b in shares(len(cloud))]
        together(len(cloud), works)

    def signed(self, positions: Float, reach: float) -> Float:
        """Signed distances, see `DeviationReference.signed`."""
        from .height_kernels import signed_distances

        held, found = self._surface.held, np.empty(len(positions))
        local = np.ascontiguousarray(positions - self._origin)
        works = [
            lambda a=a, b=b: signed_distances(held, local[a:b], reach, found[a:b])
            for a, b in shares(len(local))
        ]
        together(len(local), works)
        return found

    def surface_points(self) -> Float:
        """The points of the pose, moved onto their surface, which averages noise: (N, 3), absolute.

        A point without neighbours stays.
        """
        from ..tracking.deformation_kernels import fit_rows

        points = self._surface.held.points
        found, normals = np.empty((2, len(points), 3))
        fitted = np.empty(len(points), np.bool_)
        fit_rows(self._surface.held, np.arange(len(points)), found, normals, fitted)
        return np.where(fitted[:, None], found, points) + self._origin


def deviation_reference(pose: Pose, faces: Triangles) -> DeviationReference:
    """The surface of a pose. faces: (F, 3) of ids of its points, perhaps none. Raises InputError."""
    rows = rows_of_faces(faces, pose.cloud.ids)
    return NearestOnMesh(pose.cloud, rows) if len(rows) else PointReference(pose)
