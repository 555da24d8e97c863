"""How finely a scan is drawn while it moves. Plain arithmetic, no clock."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from viewer.app.scene.detail import Detail, Quality, qualities

DEMO = 86_361
GOAL = 36.0
Cost = Callable[[Quality], float]


def machine(full_ms: float, fixed_ms: float, noise: float = 0.0) -> Cost:
    """What a picture takes: some always, the rest by points and, half of that, by width and height."""
    rng = np.random.default_rng(1)

    def ms(quality: Quality) -> float:
        exact = fixed_ms + (full_ms - fixed_ms) * quality.share * (1 + quality.scale) / 2
        return float(exact * (1 + noise * rng.standard_normal()))

    return ms


def play(detail: Detail, ms: Cost, pictures: int, points: int = DEMO) -> list[Quality]:
    """The levels of so many pictures in a row."""
    shown = []
    for _ in range(pictures):
        shown.append(detail.quality)
        detail.note(ms(detail.quality), detail.quality, GOAL, points)
    return shown


@pytest.mark.parametrize("points", [1, 5000, 20_000, DEMO, 10_000_000])
def test_levels_go_from_full_to_few_points_and_pixels(points: int) -> None:
    steps = qualities(points)
    assert steps[0] == Quality(1, 1)
    assert all(finer.cost > coarser.cost for finer, coarser in pairwise(steps))
    assert all(quality.share * points >= 10_000 for quality in steps if quality.share < 1)
    assert steps[-1].scale == 0.5
    at_full_size = [quality for quality in steps if quality.scale == 1]
    assert at_full_size == list(steps[: len(at_full_size)]), "first fewer points, then fewer pixels"


def test_nothing_is_left_out_where_there_is_time() -> None:
    assert set(play(Detail(), machine(full_ms=30, fixed_ms=5, noise=0.1), 500)) == {Quality()}


def test_a_slow_picture_now_and_then_changes_nothing() -> None:
    detail = Detail()
    for number in range(200):
        detail.note(60.0 if number % 4 == 0 else 30.0, detail.quality, GOAL, DEMO)
    assert detail.quality == Quality()


@pytest.mark.parametrize(("full_ms", "fixed_ms"), [(60, 10), (80, 20), (110, 12), (300, 8)])
def test_pictures_are_soon_in_time_and_not_much_sooner(full_ms: float, fixed_ms: float) -> None:
    ms = machine(full_ms, fixed_ms)
    quality = play(Detail(), ms, 200)[-1]
    assert GOAL / 2 < ms(quality) <= GOAL


def test_the_level_stays_where_times_vary() -> None:
    settled = play(Detail(), machine(full_ms=80, fixed_ms=15, noise=0.05), 600)[100:]
    assert sum(a != b for a, b in pairwise(settled)) <= 1


def test_one_very_slow_picture_is_enough() -> None:
    """A large scan is dragged: its picture at rest was slow, so the first one of the drag is a preview."""
    detail = Detail()
    detail.note(4000.0, Quality(), GOAL, 10_000_000)
    assert detail.quality.share < 0.02
    assert 4000 * detail.quality.cost <= GOAL


def test_it_becomes_finer_again_when_the_machine_has_time() -> None:
    detail = Detail()
    assert play(detail, machine(full_ms=300, fixed_ms=8), 100)[-1].cost < 0.2
    assert play(detail, machine(full_ms=30, fixed_ms=5), 100)[-1] == Quality()


def test_a_picture_in_full_that_was_in_time_ends_previews() -> None:
    detail = Detail()
    play(detail, machine(full_ms=300, fixed_ms=8), 100)
    detail.note(50.0, Quality(), GOAL, DEMO)
    assert detail.quality != Quality()
    detail.note(20.0, Quality(), GOAL, DEMO)
    assert detail.quality == Quality()


def test_there_is_a_floor() -> None:
    assert play(Detail(), lambda quality: 500.0, 300)[-1] == qualities(DEMO)[-1]
    assert play(Detail(), lambda quality: 500.0, 300, points=100)[-1] == Quality(1, 0.5)
