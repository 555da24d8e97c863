"""Correspondences of registration: where each point of a patch meets the surface of another moment.

Compiled by numba; see `register_kernels`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, inlined
from .patch_kernels import SurfacePatch, deformed_points
from .surface_kernels import (
    OWN_SPACING,
    Cells,
    fit_at,
    nearest_within,
    parabola_height,
    parabola_slopes,
)

# Spacings to the nearest point beyond which there is a hole: 3 of 10,000 positions are, of random points.
_HOLE = 1.6
_FACING = 0.35  # cosine of the angle between normals that still may match

Float = NDArray[np.float64]


class MovedPatch(NamedTuple):
    """How a patch lies in another moment. Registration changes the arrays."""

    position: Float  # (3,), of its centre
    rotation: Float  # (3, 3), from the patch's moment to the other one
    deformation: Float  # (12,), see `deformation_modes`


class Correspondences(NamedTuple):
    """The counterparts of the n points of a patch on a surface.

    Of each there are 1 + C residuals: 0 is the distance above the surface; the others are the colours of C
    channels on the surface, less those of the patch. Values of points that are not matched have no meaning.
    """

    is_matched: NDArray[np.bool_]  # (n,)
    arms: Float  # (n, 3), from the patch's centre to each point, as it is moved
    residuals: Float  # (n, 1 + C)
    gradients: Float  # (n, 1 + C, 3) on the surface: its normal, and how colours grow
    own_gradients: Float  # (n, 1 + C, 3) of the patch, as it is moved
    scales: Float  # (1 + C,), standard deviations of residuals, see `robust_kernels`
    weights: Float  # (n, 1 + C), robust weights


@compiled
def no_correspondences(count: int, residuals: int) -> Correspondences:
    """Room for the correspondences of so many points."""
    return Correspondences(
        np.empty(count, np.bool_),
        np.empty((count, 3)),
        np.empty((count, residuals)),
        np.empty((count, residuals, 3)),
        np.empty((count, residuals, 3)),
        np.empty(residuals),
        np.empty((count, residuals)),
    )


@compiled
def moved_axes(patch: SurfacePatch, rotation: Float, axes: Float) -> None:
    """Fill the axes (3, 3), by row, of a patch that is rotated."""
    for p in range(3):
        for q in range(3):
            axes[q, p] = (
                rotation[p, 0] * patch.axes[q, 0]
                + rotation[p, 1] * patch.axes[q, 1]
                + rotation[p, 2] * patch.axes[q, 2]
            )


@inlined
def along_axis(vector: Float, axes: Float, k: int) -> float:
    """The coordinate k of a vector (3,) that is given along axes (3, 3)."""
    return vector[0] * axes[0, k] + vector[1] * axes[1, k] + vector[2] * axes[2, k]


@compiled
def find_correspondences(
    patch: SurfacePatch, surface: Cells, moved: MovedPatch, search: float, out: Correspondences
) -> tuple[int, float]:
    """Fill the correspondences of a patch with a surface: of each point, the parabola around the nearest one.

    search: how far that may be, scan units. Gives how many points are matched, and the sum of the reaches of
    their parabolas.
    """
    is_matched, arms, residuals, gradients, own_gradients, _, _ = out  # taken out once: it counts references
    points, frames, parabolas, reaches = surface.points, surface.frames, surface.parabolas, surface.reaches
    own_normals, colors, slopes, position = patch.normals, patch.colors, patch.gradients, moved.position
    axes = np.empty((3, 3))
    moved_axes(patch, moved.rotation, axes)
    local = deformed_points(patch, moved.deformation)
    is_signed = len(surface.normals) > 0
    found, reach = 0, 0.0
    for i in range(len(local)):
        is_matched[i] = False
        for k in range(3):
            arms[i, k] = along_axis(local[i], axes, k)
        x, y, z = position[0] + arms[i, 0], position[1] + arms[i, 1], position[2] + arms[i, 2]
        row = nearest_within(surface, x, y, z, search)
        if row < 0 or not fit_at(surface, row):
            continue
        f, p = frames[row], parabolas[row]
        x, y, z = x - points[row, 0], y - points[row, 1], z - points[row, 2]
        u = f[0, 0] * x + f[0, 1] * y + f[0, 2] * z
        v = f[1, 0] * x + f[1, 1] * y + f[1, 2] * z
        w = f[2, 0] * x + f[2, 1] * y + f[2, 2] * z
        if u * u + v * v > (_HOLE * (reaches[row] * OWN_SPACING)) ** 2:
            continue
        slope_u, slope_v = parabola_slopes(p[0], u, v)
        slant = np.sqrt(1.0 + slope_u * slope_u + slope_v * slope_v)
        facing = 0.0
        for k in range(3):
            own = along_axis(own_normals[i], axes, k)
            own_gradients[i, 0, k] = own
            gradients[i, 0, k] = (f[2, k] - slope_u * f[0, k] - slope_v * f[1, k]) / slant
            facing += own * gradients[i, 0, k]
        sign = 1.0
        if not is_signed and facing < 0.0:
            sign, facing = -1.0, -facing
        if facing < _FACING:
            continue
        for k in range(3):
            gradients[i, 0, k] *= sign
        residuals[i, 0] = sign * (w - parabola_height(p[0], u, v)) / slant
        for c in range(1, residuals.shape[1]):
            residuals[i, c] = parabola_height(p[c], u, v) - colors[i, c - 1]
            slope_u, slope_v = parabola_slopes(p[c], u, v)
            for k in range(3):
                gradients[i, c, k] = slope_u * f[0, k] + slope_v * f[1, k]
                own_gradients[i, c, k] = along_axis(slopes[i, c - 1], axes, k)
        is_matched[i] = True
        found += 1
        reach += reaches[row]
    return found, reach
