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
    """The counterparts of the n points of a patch on a surface, of C channels of colour that are compared.

    Values of points that are not matched have no meaning.
    """

    is_matched: NDArray[np.bool_]  # (n,)
    arms: Float  # (n, 3), from the patch's centre to each point, as it is moved
    distances: Float  # (n,), of the points above the surface
    normals: Float  # (n, 3) of the surface
    own_normals: Float  # (n, 3) of the patch, as it is moved
    color_steps: Float  # (n, C): colours of the surface less those of the patch
    gradients: Float  # (n, C, 3) of colours on the surface
    own_gradients: Float  # (n, C, 3) of the patch, as it is moved
    scales: Float  # (1 + C,), standard deviations of distances and steps, see `robust_kernels`
    weights: Float  # (n, 1 + C), robust weights of distances and steps


@compiled
def no_correspondences(count: int, channels: int) -> Correspondences:
    """Room for the correspondences of so many points."""
    return Correspondences(
        np.empty(count, np.bool_), np.empty((count, 3)), np.empty(count), np.empty((count, 3)),
        np.empty((count, 3)), np.empty((count, channels)), np.empty((count, channels, 3)),
        np.empty((count, channels, 3)), np.empty(1 + channels), np.empty((count, 1 + channels)),
    )  # fmt: skip


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
    axes = np.empty((3, 3))
    moved_axes(patch, moved.rotation, axes)
    local = deformed_points(patch, moved.deformation)
    is_signed = len(surface.normals) > 0
    found, reach = 0, 0.0
    for i in range(len(local)):
        out.is_matched[i] = False
        for k in range(3):
            out.arms[i, k] = along_axis(local[i], axes, k)
        x, y, z = out.arms[i, 0], out.arms[i, 1], out.arms[i, 2]
        x, y, z = moved.position[0] + x, moved.position[1] + y, moved.position[2] + z
        row = nearest_within(surface, x, y, z, search)
        if row < 0 or not fit_at(surface, row):
            continue
        f, p = surface.frames[row], surface.parabolas[row]
        x, y, z = x - surface.points[row, 0], y - surface.points[row, 1], z - surface.points[row, 2]
        u = f[0, 0] * x + f[0, 1] * y + f[0, 2] * z
        v = f[1, 0] * x + f[1, 1] * y + f[1, 2] * z
        w = f[2, 0] * x + f[2, 1] * y + f[2, 2] * z
        if u * u + v * v > (_HOLE * (surface.reaches[row] * OWN_SPACING)) ** 2:
            continue
        slope_u, slope_v = parabola_slopes(p[0], u, v)
        slant = np.sqrt(1.0 + slope_u * slope_u + slope_v * slope_v)
        facing = 0.0
        for k in range(3):
            own = along_axis(patch.normals[i], axes, k)
            out.own_normals[i, k] = own
            out.normals[i, k] = (f[2, k] - slope_u * f[0, k] - slope_v * f[1, k]) / slant
            facing += own * out.normals[i, k]
        sign = 1.0
        if not is_signed and facing < 0.0:
            sign, facing = -1.0, -facing
        if facing < _FACING:
            continue
        for k in range(3):
            out.normals[i, k] *= sign
        out.distances[i] = sign * (w - parabola_height(p[0], u, v)) / slant
        for c in range(out.color_steps.shape[1]):
            out.color_steps[i, c] = parabola_height(p[1 + c], u, v) - patch.colors[i, c]
            slope_u, slope_v = parabola_slopes(p[1 + c], u, v)
            for k in range(3):
                out.gradients[i, c, k] = slope_u * f[0, k] + slope_v * f[1, k]
                out.own_gradients[i, c, k] = along_axis(patch.gradients[i, c], axes, k)
        out.is_matched[i] = True
        found += 1
        reach += surface.reaches[row]
    return found, reach
