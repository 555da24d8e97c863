"""M3C2: distances between the means of two clouds, and the least that differs from their noise.

Lague, Brodu, Leroux 2013, "Accurate 3D comparison of complex topography with terrestrial laser scanner".
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...scan.noise import noise_of
from ...scan.pose import Pose
from ...scan.spacing import typical_spacing
from ...threads import shares, together
from ..motion.stabilise import moment_surface
from ..tracking.surface import MomentSurface
from .reference import sided

Float = NDArray[np.float64]

_CYLINDER = 2.5  # spacings, so that a cylinder holds about 20 points
_NORMAL_NOISE = 12.5  # standard deviations of noise: half of the scale that the paper asks for
_NORMAL = 3.0  # spacings, at least
_TOLD = 1.96  # standard deviations


class M3C2Distances(NamedTuple):
    """The distances of the points of a frame.

    values: (N,), scan units, positive outside; NaN where a point has none. errors: (N,), their standard
    errors by noise. directions: (N, 3), along which they are measured.
    """

    values: Float
    errors: Float
    directions: Float

    def detectable(self, registration: Float | float = 0.0) -> Float:
        """The least distances that differ from noise with 95 % (equation 1), (N,).

        registration: standard errors of the place of the frame along the directions, (N,) or one.
        """
        return _TOLD * (self.errors + registration)


class M3C2Reference:
    """The cloud that others are compared with.

    cylinder: the radius in which points are averaged. normal: the radius around a point, in which its normal
    is that of the plane through all points. Both in scan units; None: from the spacing and noise of the
    cloud. is_whole: each cylinder ends at the reach, as the paper has it. Else it grows until it holds the
    surface, so that it does not average a lip with the other one, or a thin part with its back.
    """

    def __init__(
        self,
        pose: Pose,
        cylinder: float | None = None,
        normal: float | None = None,
        is_whole: bool = False,
    ) -> None:
        """Raises InputError where the pose has no points."""
        if not pose.count:
            raise InputError("has no points to compare with", pose.label)
        cloud, self.outside_by = sided(pose)
        self.spacing = typical_spacing(cloud)
        self.cylinder = cylinder or _CYLINDER * self.spacing
        self.normal = normal or max(_NORMAL * self.spacing, _NORMAL_NOISE * noise_of(cloud).deviation)
        self._is_whole, self._origin = is_whole, cloud.origin
        self._surface = moment_surface(cloud, cloud.origin)

        from .m3c2_kernels import normals_within

        held = self._surface.held
        self._normals = np.empty((len(cloud), 3))
        works = [
            lambda a=a, b=b: normals_within(held, self.normal, a, b, self._normals)
            for a, b in shares(len(cloud))
        ]
        together(len(cloud), works)

    def signed(self, positions: Float, reach: float) -> Float:
        """Distances along the normals of the reference, see `DeviationReference.signed`."""
        return self.distances(positions, reach).values

    def distances(self, positions: Float, reach: float) -> M3C2Distances:
        """The distances of a frame, whose points are at positions (N, 3), absolute, up to a reach."""
        from .m3c2_kernels import Cylinder, CylinderDistances, m3c2

        count = len(positions)
        found = CylinderDistances(np.empty(count), np.empty(count), np.empty((count, 3)))
        if count:
            held, normals = self._surface.held, self._normals
            compared = MomentSurface(positions - self._origin, self.spacing).held
            cylinder = Cylinder(self.cylinder, reach if self._is_whole else self.cylinder, reach)
            works = [
                lambda a=a, b=b: m3c2(held, normals, compared, cylinder, a, b, found)
                for a, b in shares(count)
            ]
            together(count, works)
        return M3C2Distances(*found)
