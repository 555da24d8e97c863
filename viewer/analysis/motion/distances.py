"""Points of a frame, moved to the reference: how far they lie from its surface, and which are of a region."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...rigid import Rigid
from ...scan.points import PointCloud
from ..tracking.surface import MomentSurface

NAME = "distance from reference"  # of the numbers, as looks colour by them
_REACH = 20.0  # spacings, beyond which a point is said to be off all surface

Float = NDArray[np.float64]


def unknown_distances(count: int) -> NDArray[np.float32]:
    """The distances of so many points of a frame whose motion is not known: (N,) NaN."""
    return np.full(count, np.nan, np.float32)


def distances_from(
    surface: MomentSurface, origin: Float, cloud: PointCloud, reference_from_frame: Rigid
) -> NDArray[np.float32]:
    """The distances of all points of a cloud from a surface, (N,) scan units, NaN over its holes and beyond.

    surface: of the reference, relative to an origin, (3,). It is the parabola around the nearest point.
    """
    from .region_kernels import heights_over

    moved = reference_from_frame.points(cloud.world()) - origin
    heights, _ = heights_over(surface.held, np.ascontiguousarray(moved), _REACH * surface.spacing)
    return np.abs(heights).astype(np.float32)


def in_region(
    surface: MomentSurface,
    origin: Float,
    cloud: PointCloud,
    reference_from_frame: Rigid,
    rows: NDArray[np.int64],
) -> NDArray[np.float32]:
    """Whether each point of a cloud is of a region of the reference, (N,): 1 where the nearest point of the
    reference is, 0 elsewhere, NaN where there is none near. rows: of the region in the reference."""
    from .region_kernels import rows_nearest

    moved = reference_from_frame.points(cloud.world()) - origin
    nearest = rows_nearest(surface.held, np.ascontiguousarray(moved), _REACH * surface.spacing)
    is_in = np.zeros(len(surface.held.points), np.float32)
    is_in[rows] = 1.0
    return np.where(nearest < 0, np.nan, is_in[nearest]).astype(np.float32)
