"""The patch of a surface that registration moves, and how it deforms.

Compiled by numba; see `registration`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, inlined
from .surface_kernels import Cells, fit_at

MODES = 12  # in which a patch deforms, see `deformation_modes`
_FAR_SIDE = -0.2  # cosine between normals, below which a point lies on the far side of something thin

Float = NDArray[np.float64]


class SurfacePatch(NamedTuple):
    """The surface around a position of one moment, n points of C channels of colour."""

    center: Float  # (3,) relative to the moment's origin
    axes: Float  # (3, 3), by row: two tangents and the normal at the centre
    local: Float  # (n, 3), the points along the axes
    normals: Float  # (n, 3), along the axes
    colors: Float  # (n, C)
    gradients: Float  # (n, C, 3) of colour, along the axes
    closeness: Float  # (n,), weights: 1 at the centre, 0 at the radius
    radius: float  # scan units
    noise: float  # root mean square of how far points are off their parabolas, scan units


@inlined
def _dot(a: Float, b: Float) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def cut_patch(
    surface: Cells, position: Float, axes: Float, radius: float, rows: NDArray[np.int32]
) -> SurfacePatch:
    """The patch of a surface at some rows, around a position, (3,). axes: (3, 3), at that position."""
    count = len(rows)
    channels, is_signed = surface.colors.shape[1], len(surface.normals) > 0
    local, normals = np.empty((count, 3)), np.empty((count, 3))
    colors, gradients = np.empty((count, channels)), np.empty((count, channels, 3))
    closeness = np.empty(count)
    kept, squares = 0, 0.0
    at, normal, slope = np.empty(3), np.empty(3), np.empty(3)
    for i in range(count):
        row = rows[i]
        if not fit_at(surface, row):
            continue
        f, p = surface.frames[row], surface.parabolas[row]
        squared, facing = 0.0, 0.0
        for k in range(3):
            at[k] = surface.points[row, k] + p[0, 0] * f[2, k] - position[k]
            normal[k] = f[2, k] - p[0, 1] * f[0, k] - p[0, 2] * f[1, k]
            squared += at[k] * at[k]
            facing += normal[k] * axes[2, k]
        length = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
        if squared >= radius * radius:
            continue
        if not is_signed and facing < 0.0:
            length, facing = -length, -facing
        if facing < _FAR_SIDE * abs(length):
            continue
        for k in range(3):
            local[kept, k] = _dot(axes[k], at)
            normals[kept, k] = _dot(axes[k], normal) / length
        for c in range(channels):
            colors[kept, c] = p[1 + c, 0]
            for k in range(3):
                slope[k] = p[1 + c, 1] * f[0, k] + p[1 + c, 2] * f[1, k]
            for k in range(3):
                gradients[kept, c, k] = _dot(axes[k], slope)
        closeness[kept] = (1.0 - squared / (radius * radius)) ** 2
        squares += p[0, 0] ** 2
        kept += 1
    return SurfacePatch(
        position.copy(), axes.copy(), local[:kept], normals[:kept], colors[:kept], gradients[:kept],
        closeness[:kept], radius, np.sqrt(squares / max(kept, 1)),
    )  # fmt: skip


@inlined
def deformation_modes(u: float, v: float, modes: Float) -> None:
    """Fill (12, 3): how each mode moves a point of a patch of radius 1. The modes are strains along the
    surface, bending across it, and strains that change over it."""
    modes[:] = 0.0
    modes[0, 0], modes[1, 1], modes[2, 0], modes[2, 1] = u, v, v, u
    modes[3, 2], modes[4, 2], modes[5, 2] = u * u, u * v, v * v
    modes[6, 0], modes[7, 0], modes[8, 0] = u * u, u * v, v * v
    modes[9, 1], modes[10, 1], modes[11, 1] = u * u, u * v, v * v


@compiled
def deformed_points(patch: SurfacePatch, deformation: Float) -> Float:
    """The points of a patch along its axes, deformed by (12,): (n, 3)."""
    points, modes = patch.local.copy(), np.empty((MODES, 3))
    for i in range(len(points)):
        deformation_modes(patch.local[i, 0] / patch.radius, patch.local[i, 1] / patch.radius, modes)
        for b in range(MODES):
            if deformation[b] != 0.0:
                for k in range(3):
                    points[i, k] += patch.radius * deformation[b] * modes[b, k]
    return points
