"""The surface on a ray by the points around it, where their truth is known."""

from __future__ import annotations

import numpy as np
import pytest
from columns import column_through
from numpy.typing import NDArray

from viewer.analysis.local_surface import LocalSurface, Unclear, local_surface
from viewer.analysis.words import SURE

SPACING, DEPTH = 0.02, 4.0
PLACE = np.array([0.0, 0.0, -DEPTH])


def cap(rng: np.random.Generator, radius: float, noise: float) -> NDArray[np.float64]:
    """Points by chance of the part of a sphere that faces the eye, its nearest point at `PLACE`. radius,
    noise along the normals: spacings."""
    wide, radius = 12 * SPACING, radius * SPACING
    x, y = rng.uniform(-wide, wide, (2, round((2 * wide / SPACING) ** 2)))
    inside = x**2 + y**2 < 0.9 * radius**2
    x, y = x[inside], y[inside]
    z = np.sqrt(radius**2 - x**2 - y**2)
    normals = np.stack([x, y, z], axis=1) / radius
    moved = normals * rng.normal(scale=noise * SPACING, size=len(x))[:, None]
    return normals * radius + moved + PLACE - np.array([0, 0, radius])


@pytest.mark.parametrize("radius", [15.0, 1000.0])
@pytest.mark.parametrize("noise", [0.0, 0.1, 0.3, 0.6])
def test_the_true_depth_is_within_what_is_said_and_noise_moves_it_neither_way(
    noise: float, radius: float
) -> None:
    rng = np.random.default_rng(3)
    errors, held = [], []
    for _ in range(120):
        column = column_through(PLACE, cap(rng, radius, noise), SPACING, 10 * SPACING)
        found = local_surface(column, DEPTH - noise * SPACING)  # where the nearest of the points are
        assert isinstance(found, LocalSurface)
        errors.append((found.depth - DEPTH) / SPACING)
        held.append(abs(found.depth - DEPTH) <= SURE * found.deviation + 1e-9)
        assert found.spacing == pytest.approx(SPACING, rel=0.5)
    assert np.mean(held) >= 0.9
    assert abs(np.mean(errors)) < 0.01 + 0.1 * noise
    assert np.std(errors) < 0.05 + 0.5 * noise


def test_points_that_fill_space_are_no_surface() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        points = PLACE + rng.uniform(-0.3, 0.3, (3000, 3))
        assert local_surface(column_through(PLACE, points, 0.05), DEPTH) is Unclear.THICK


def test_few_points_tell_no_surface_and_a_narrow_column_tells_that_it_is() -> None:
    points = cap(np.random.default_rng(0), 1000.0, 0.0)
    nearest = np.linalg.norm(points - PLACE, axis=1).argsort()
    assert local_surface(column_through(PLACE, points[nearest[:8]], SPACING), DEPTH) is Unclear.FEW
    narrow = column_through(PLACE, points, SPACING, 2 * SPACING)
    assert local_surface(narrow, DEPTH) is Unclear.NARROW
