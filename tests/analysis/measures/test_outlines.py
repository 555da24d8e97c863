"""Closed outlines: what lies within, their area, and whether they cross themselves."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.analysis.measures.outlines import area_of, crosses_itself, is_within

STAR = np.array([(np.cos(turn), np.sin(turn)) for turn in np.arange(10) * np.pi / 5])
STAR *= np.resize([3.0, 1.2], 10)[:, None]  # five points, no side level or upright
AWAY = np.array([40.0, -7.0])
BOW = np.array([[-3.0, -3], [3, 3], [3, -3], [-3, 3]])


def turns(place: np.ndarray, outline: np.ndarray) -> float:
    """How often an outline goes round a place: the sum of the angles that its sides are seen at."""
    offsets = outline - place
    angles = np.arctan2(offsets[:, 1], offsets[:, 0])
    steps = np.diff(np.append(angles, angles[0]))
    return float(((steps + np.pi) % (2 * np.pi) - np.pi).sum() / (2 * np.pi))


@pytest.mark.parametrize("outline", [STAR + AWAY, STAR[::-1] + AWAY, BOW + AWAY])
def test_places_are_within_where_the_outline_goes_round_them(outline: np.ndarray) -> None:
    places = AWAY + np.random.default_rng(3).uniform(-3.5, 3.5, (400, 2))
    expected = np.array([round(turns(place, outline)) % 2 == 1 for place in places])
    assert 20 < expected.sum() < 380
    np.testing.assert_array_equal(is_within(places, outline), expected)


def test_the_area_is_that_of_triangles_about_the_middle() -> None:
    triangle = 0.5 * 3.0 * 1.2 * np.sin(np.pi / 5)
    for outline in (STAR, STAR[::-1] + AWAY, np.roll(STAR, 3, axis=0)):
        assert area_of(outline) == pytest.approx(10 * triangle)


def test_a_bow_crosses_itself_and_a_star_does_not() -> None:
    assert crosses_itself(BOW)
    assert crosses_itself(STAR[[0, 4, 8, 2, 6]] + AWAY)
    assert not crosses_itself(STAR + AWAY)
    assert not crosses_itself(BOW[[0, 2, 1, 3]])
