"""Which of several surfaces on a ray is meant, where their truth is known."""

from __future__ import annotations

import numpy as np
import pytest
from columns import column_through
from numpy.typing import NDArray

from viewer.analysis.front_layer import front_layer
from viewer.analysis.local_surface import LocalSurface, Unclear
from viewer.analysis.words import SURE

SPACING = 0.05
FRONT, BEHIND = 4.0, 5.0  # depths


def before_another(rng: np.random.Generator) -> NDArray[np.float64]:
    """Points by chance of a wall that ends at x = 0, and of another to the right behind it."""
    wide = 12 * SPACING
    count = round(2 * (wide / SPACING) ** 2)
    x, y = rng.uniform(-wide, 0, count), rng.uniform(-wide, wide, count)
    behind = BEHIND / FRONT * np.stack([-x, y], axis=1)
    front = np.column_stack([x, rng.uniform(-wide, wide, count), np.full(count, -FRONT)])
    return np.concatenate([front, np.column_stack([behind, np.full(count, -BEHIND)])])


def seen_at(points: NDArray[np.float64], x: float, shown: float) -> LocalSurface | Unclear:
    """What is meant to the right of the edge by so much, where the picture shows a depth."""
    return front_layer(column_through(np.array([x, 0.0, -FRONT]), points, SPACING), shown)


@pytest.mark.parametrize("shown", [FRONT, BEHIND])
def test_beyond_the_points_of_a_surface_the_likelier_is_taken_and_the_other_counts(shown: float) -> None:
    rng = np.random.default_rng(4)
    right, held, doubted = [], [], []
    for x in rng.uniform(-1.5, 1.5, 300) * SPACING:
        found = seen_at(before_another(rng), x, shown)
        assert isinstance(found, LocalSurface)
        truth = FRONT if x < 0 else BEHIND
        right.append(abs(found.depth - truth) < 0.1)
        held.append(abs(found.depth - truth) <= max(SURE * found.deviation, 1e-6))
        doubted.append(found.doubt > 0)
    assert np.mean(right) > 0.8
    assert np.mean(held) > 0.93
    assert 0.3 < np.mean(doubted) < 0.9


@pytest.mark.parametrize("shown", [FRONT, BEHIND])
@pytest.mark.parametrize("x", [-6.0, 6.0])
def test_away_from_an_edge_there_is_no_doubt_whatever_the_picture_shows(x: float, shown: float) -> None:
    found = seen_at(before_another(np.random.default_rng(1)), x * SPACING, shown)
    assert isinstance(found, LocalSurface)
    assert found.depth == pytest.approx(FRONT if x < 0 else BEHIND)
    assert found.doubt < 0.01
    assert found.deviation < 1e-6


def test_points_that_tell_no_surface_hide_the_one_behind() -> None:
    rng = np.random.default_rng(2)
    wide = 12 * SPACING
    bush = rng.uniform([-wide, -wide, -FRONT - wide], [wide, wide, -FRONT + wide], (15_000, 3))
    flat = rng.uniform(-wide, wide, (2 * 24**2, 2))
    wall = np.column_stack([flat, np.full(len(flat), -BEHIND - wide)])
    assert isinstance(seen_at(wall, 0.0, BEHIND + wide), LocalSurface)
    assert seen_at(np.concatenate([bush, wall]), 0.0, BEHIND + wide) is Unclear.THICK
