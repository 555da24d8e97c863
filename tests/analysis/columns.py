"""Columns of points round a ray, of clouds whose truth is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scenes import looking_down_z

from viewer.analysis.local_surface import Column
from viewer.bounds import Bounds
from viewer.scan.rays import Ray
from viewer.view import View

VIEW = View.of(looking_down_z(), (400, 300), np.zeros(3), Bounds(np.full(3, -6.0), np.full(3, 6.0)))


def column_through(
    place: NDArray[np.float64], points: NDArray[np.float64], spacing: float, reach: float = np.inf
) -> Column:
    """The points (n, 3) that are so near to the ray through a place, both relative to the view's origin."""
    pixel = VIEW.project(place[None])[0][0]
    step = VIEW.along(pixel)
    ray = Ray(VIEW.unproject(pixel[None], np.ones(1))[0] - step, step)
    away = ray.away(points)
    near = away <= reach
    pixels, depths = VIEW.project(points[near])
    return Column(
        VIEW, ray, np.flatnonzero(near), points[near], pixels - pixel, depths, away[near], reach, spacing
    )
