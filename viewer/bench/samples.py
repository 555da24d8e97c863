"""Points on surfaces, with what is known of them in closed form.

They come as the arguments of `PointCloud.from_arrays` by name, all float64, so that they can be
moved, scaled and spoilt before they become a cloud.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Arrays = dict[str, NDArray]

_RADIUS_PER_SPACING = 1.5  # discs of this radius close the surface
# The generalised golden ratio in two dimensions (Roberts 2018): evenly spread points in a square.
_R2 = np.array([0.7548776662466927, 0.5698402909980532])


def torus(count: int, ring: float = 1.0, tube: float = 0.4) -> Arrays:
    """A torus about the y axis, evenly covered, with exact normals; colours tell the normals apart."""
    turn, place = (np.arange(count)[:, None] * _R2 % 1).T
    # The area of a slice of the tube grows with its distance from the axis: invert its integral.
    table = np.linspace(0, 2 * np.pi, 4097)
    angle = np.interp(place, (ring * table + tube * np.sin(table)) / (2 * np.pi * ring), table)
    outward = np.stack([np.cos(2 * np.pi * turn), np.zeros(count), np.sin(2 * np.pi * turn)], axis=1)
    normals = outward * np.cos(angle)[:, None] + np.array([0, 1, 0]) * np.sin(angle)[:, None]
    return _points(outward * ring + normals * tube, normals, np.sqrt(4 * np.pi**2 * ring * tube / count))


def wall(columns: int, rows: int, spacing: float, wave: float = 0.0) -> Arrays:
    """A grid of points on z = 0 around the origin, facing +z.

    wave: how fast colours change along x and y, radians a point; 0: one colour for all.
    """
    x, y = np.meshgrid(np.arange(columns) - (columns - 1) / 2, np.arange(rows) - (rows - 1) / 2)
    positions = spacing * np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    arrays = _points(positions, np.tile([0.0, 0.0, 1.0], (x.size, 1)), spacing)
    return {**arrays, "colors": 0.5 + 0.5 * np.sin(positions / spacing * wave + np.arange(3))}


def line(count: int, end: tuple[float, float, float]) -> Arrays:
    """Points on the line from -end to end, facing +z."""
    positions = np.linspace(-1, 1, count)[:, None] * np.array(end)
    spacing = 2 * np.linalg.norm(end) / max(count - 1, 1)
    return _points(positions, np.tile([0.0, 0.0, 1.0], (count, 1)), spacing)


def _points(positions: NDArray, normals: NDArray, spacing: float | np.floating) -> Arrays:
    radii = np.full(len(positions), _RADIUS_PER_SPACING * spacing)
    return {"positions": positions, "normals": normals, "colors": normals * 0.5 + 0.5, "radii": radii}
