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


@pytest.mark.parametrize("noise", [0.0, 0.3])
@pytest.mark.parametrize("inside", [0.5, 1.0, 3.0])
def test_a_surface_seen_edge_on_is_met_as_far_as_it_reaches(noise: float, inside: float) -> None:
    """At the outline of a ball, where the ray runs so many spacings below its surface, or above."""
    rng, radius, held, doubts = np.random.default_rng(5), 15.0, [], []
    turned = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])  # the cap faces right
    middle = PLACE - np.array([radius * SPACING, 0.0, 0.0])
    for _ in range(60):
        points = (cap(rng, radius, noise) - PLACE) @ turned.T + PLACE
        place = PLACE - np.array([inside * SPACING, 0.0, 0.0])
        ahead = place / np.linalg.norm(place)
        below = np.linalg.norm(np.cross(middle, ahead))
        true = -(ahead * (middle @ ahead - np.sqrt((radius * SPACING) ** 2 - below**2)))[2]
        found = local_surface(column_through(place, points, SPACING), true)
        assert isinstance(found, LocalSurface)
        doubts.append(found.doubt)
        held.append(abs(found.depth - true) <= SURE * found.deviation + 0.02 * SPACING)
        past = PLACE + np.array([(1 + 4 * noise) * SPACING, 0, 0])
        beyond = local_surface(column_through(past, points, SPACING), DEPTH)
        assert isinstance(beyond, Unclear) or beyond.doubt > 0.9
    assert np.mean(held) >= 0.9
    assert np.mean(doubts) < 0.2


@pytest.mark.parametrize("apart", [1.0, 1.5, 2.0])
def test_of_two_sides_of_a_thin_part_the_front_is_found(apart: float) -> None:
    """Sides whose points together would tell a surface between them."""
    rng, right = np.random.default_rng(6), []
    for _ in range(40):
        front, back = cap(rng, 1000.0, 0.0), cap(rng, 1000.0, 0.0) - np.array([0, 0, apart * SPACING])
        found = local_surface(column_through(PLACE, np.concatenate([front, back]), SPACING), DEPTH)
        right.append(isinstance(found, LocalSurface) and abs(found.depth - DEPTH) < 0.05 * SPACING)
    assert np.mean(right) > 0.85
