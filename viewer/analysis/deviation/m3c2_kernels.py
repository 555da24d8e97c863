"""Distances between the means of points in cylinders, compiled by numba; see `m3c2`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled
from ...scan.plane_kernels import fit_plane
from ..tracking.surface_kernels import Cells, nearest_within, rows_within

Float = NDArray[np.float64]

_SURE = 2.0  # standard deviations: the cylinder is long enough if it reaches that far beyond the mean
FEWEST = 5  # points that tell a mean and how sure it is


class Cylinder(NamedTuple):
    """A cylinder around a point, scan units: its radius, how far it goes both ways at first, and at most."""

    radius: float
    first: float
    reach: float


class Heights(NamedTuple):
    """Number, mean and variance of the heights of points; NaN where they are too few."""

    number: int
    mean: float
    variance: float


class CylinderDistances(NamedTuple):
    """Distances at each compared point, which the kernel fills in.

    values: (N,), distances. errors: (N,), their standard errors. directions: (N, 3). NaN where a mean is not
    known.
    """

    values: Float
    errors: Float
    directions: Float


@compiled
def normals_within(surface: Cells, radius: float, first: int, last: int, normals: Float) -> None:
    """Fill normals (N, 3), rows first to last - 1: those of the planes through the points within a radius.

    They lie on the side of the normals of the surface; zeros where a plane is not known.
    """
    most = len(surface.points)
    rows, squared = np.empty(most, np.int32), np.empty(most)
    sums, a, v = np.empty(9), np.empty((3, 3)), np.empty((3, 3))
    normal, widths = np.empty(3, np.float32), np.empty(3)
    for row in range(first, last):
        p = surface.points[row]
        count = rows_within(surface, p[0], p[1], p[2], radius, rows, squared)
        normals[row] = 0.0
        if count < FEWEST:
            continue
        sums[:] = 0.0
        for i in range(count):
            q = surface.points[rows[i]]
            x, y, z = q[0] - p[0], q[1] - p[1], q[2] - p[2]
            sums[0] += x
            sums[1] += y
            sums[2] += z
            sums[3] += x * x
            sums[4] += y * y
            sums[5] += z * z
            sums[6] += x * y
            sums[7] += y * z
            sums[8] += z * x
        fit_plane(sums, count, a, v, normal, widths)
        side = surface.normals[row]
        ahead = normal[0] * side[0] + normal[1] * side[1] + normal[2] * side[2]
        for k in range(3):
            normals[row, k] = -normal[k] if ahead < 0.0 else normal[k]


@compiled
def heights_in_cylinder(
    surface: Cells,
    position: Float,
    axis: Float,
    cylinder: Cylinder,
    rows: NDArray[np.int32],
    squared: Float,
) -> Heights:
    """The heights of points in a cylinder around a position, along its axis.

    The cylinder grows until it ends well beyond the mean, or at its reach.
    """
    radius, reach = cylinder.radius, cylinder.reach
    count, total, squares, length, step = 0, 0.0, 0.0, 0.0, cylinder.first
    while length < reach:
        longer = min(length + step, reach)
        for way in (-1.0, 1.0):
            if length == 0.0 and way > 0.0:
                continue  # the first part is whole
            low, high = (-longer, longer) if length == 0.0 else (length, longer)
            middle = 0.5 * way * (low + high)
            half = 0.5 * (high - low)
            x, y, z = (
                position[0] + middle * axis[0],
                position[1] + middle * axis[1],
                position[2] + middle * axis[2],
            )
            found = rows_within(surface, x, y, z, np.sqrt(half * half + radius * radius), rows, squared)
            for i in range(found):
                p = surface.points[rows[i]]
                dx, dy, dz = p[0] - position[0], p[1] - position[1], p[2] - position[2]
                along = dx * axis[0] + dy * axis[1] + dz * axis[2]
                if length == 0.0:
                    if abs(along) > longer:
                        continue
                elif along * way <= length or along * way > longer:
                    continue
                if dx * dx + dy * dy + dz * dz - along * along > radius * radius:
                    continue
                count += 1
                total += along
                squares += along * along
        length, step = longer, 2.0 * radius
        if count >= FEWEST:
            mean = total / count
            if abs(mean) + _SURE * np.sqrt(max(squares / count - mean * mean, 0.0)) < length:
                break
    if count < FEWEST:
        return Heights(count, np.nan, np.nan)
    mean = total / count
    return Heights(count, mean, max(squares - count * mean * mean, 0.0) / (count - 1))


@compiled
def m3c2(
    reference: Cells,
    normals: Float,
    compared: Cells,
    cylinder: Cylinder,
    first: int,
    last: int,
    found: CylinderDistances,
) -> None:
    """Find the distances of compared points first to last - 1. normals: of the reference, (N, 3)."""
    most = max(len(reference.points), len(compared.points))
    rows, squared = np.empty(most, np.int32), np.empty(most)
    for i in range(first, last):
        found.values[i] = found.errors[i] = np.nan
        found.directions[i] = np.nan
        p = compared.points[i]
        nearest = nearest_within(reference, p[0], p[1], p[2], cylinder.reach)
        if nearest < 0:
            continue
        axis = normals[nearest]
        if axis[0] == 0.0 and axis[1] == 0.0 and axis[2] == 0.0:
            continue
        own = heights_in_cylinder(compared, p, axis, cylinder, rows, squared)
        other = heights_in_cylinder(reference, p, axis, cylinder, rows, squared)
        if min(own.number, other.number) < FEWEST:
            continue
        found.values[i] = own.mean - other.mean
        found.errors[i] = np.sqrt(own.variance / own.number + other.variance / other.number)
        found.directions[i] = axis
