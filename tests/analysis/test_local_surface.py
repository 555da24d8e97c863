"""The surface in a pixel by the points around it, where their truth is known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import looking_down_z

from viewer.analysis.local_surface import local_surface
from viewer.analysis.words import SURE
from viewer.bounds import Bounds
from viewer.view import View

SPACING = 0.05
FRONT, BEHIND = 4.0, 5.0  # depths
VIEW = View.of(looking_down_z(), (400, 300), np.zeros(3), Bounds(np.full(3, -6.0), np.full(3, 6.0)))


def before_another(rng: np.random.Generator) -> NDArray[np.float64]:
    """Points by chance of a wall that ends at x = 0, and of another to the right behind it."""
    wide = 12 * SPACING
    count = round(2 * (wide / SPACING) ** 2)
    x, y = rng.uniform(-wide, 0, count), rng.uniform(-wide, wide, count)
    behind = BEHIND / FRONT * np.stack([-x, y], axis=1)
    front = np.column_stack([x, rng.uniform(-wide, wide, count), np.full(count, -FRONT)])
    return np.concatenate([front, np.column_stack([behind, np.full(count, -BEHIND)])])


def at(x: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A pixel to the right of the edge, by scan units on the wall, and the place of the wall there."""
    place = np.array([x, 0.0, -FRONT])
    return VIEW.project(place[None])[0][0], place


def nearest_of_front(points: NDArray[np.float64], place: NDArray[np.float64]) -> int:
    """What a splat that overhangs the edge shows."""
    away = np.where(points[:, 2] > -4.5, np.linalg.norm(points - place, axis=1), np.inf)
    return int(away.argmin())


def test_beyond_the_points_of_a_surface_the_likelier_is_taken_and_the_other_counts() -> None:
    rng = np.random.default_rng(4)
    right, held, doubted = [], [], []
    for x in rng.uniform(-1.5, 1.5, 300) * SPACING:
        points = before_another(rng)
        pixel, place = at(x)
        found = local_surface(VIEW, pixel, place, points, nearest_of_front(points, place))
        assert found is not None
        truth = FRONT if x < 0 else BEHIND
        right.append(abs(found.depth - truth) < 0.1)
        held.append(abs(found.depth - truth) <= max(SURE * found.deviation, 1e-6))
        doubted.append(found.doubt > 0)
    assert np.mean(right) > 0.8
    assert np.mean(held) > 0.93
    assert 0.3 < np.mean(doubted) < 0.9


@pytest.mark.parametrize("x", [-4.0, 4.0])
def test_away_from_an_edge_there_is_no_doubt(x: float) -> None:
    points = before_another(np.random.default_rng(1))
    pixel, place = at(x * SPACING)
    about = nearest_of_front(points, place)
    found = local_surface(VIEW, pixel, place if x < 0 else points[about], points, about)
    assert found is not None
    assert found.depth == pytest.approx(FRONT if x < 0 else BEHIND)
    assert found.doubt < 1e-6
    assert found.deviation < 1e-6
