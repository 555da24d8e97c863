"""How far the points of a subject lie from its mirror image."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...scan.noise import noise_of
from ...scan.pose import Pose
from ..deviation.reference import PointReference
from ..landmarks.mirroring import MirrorPlane, mirrored

_OF_NOISE = (
    0.53  # of the variance of points: that of two parabolas at their middle (0.50 in a grid, 0.55 if random)
)


class AsymmetryMap(NamedTuple):
    """The distances of the surface of a pose from its mirror image.

    values: (N,), at the points, scan units; positive outside, NaN where there is no mirror image. noise: the
    standard deviation that values of a symmetric subject have by the noise of its points, scan units.
    """

    values: NDArray[np.float64]
    noise: float

    @property
    def rms(self) -> float:
        """The root mean square of the values, less what noise adds to it; NaN if none is known."""
        known = self.values[np.isfinite(self.values)]
        return float(np.sqrt(max(np.square(known).mean() - self.noise**2, 0.0))) if len(known) else np.nan

    @property
    def share(self) -> float:
        """The share of the points that have a value."""
        return float(np.isfinite(self.values).mean())


def asymmetry_map(pose: Pose, plane: MirrorPlane, reach: float) -> AsymmetryMap:
    """The asymmetry of a pose. reach: scan units, beyond which a point has no value.

    Both surfaces average noise. Raises InputError where the pose has no points.
    """
    surface = PointReference(pose)
    # A place is as far from the mirrored surface as its mirror image from the surface.
    values = surface.signed(mirrored(surface.surface_points(), plane), reach)
    return AsymmetryMap(values, float(np.sqrt(_OF_NOISE)) * noise_of(pose.cloud).deviation)
