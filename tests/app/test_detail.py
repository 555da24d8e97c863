"""How finely a scan is drawn while it moves. Plain arithmetic, no clock."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from viewer.app.scene.detail import Budget, Detail, details

DEMO, CRANE, MANY = 86_361, 10_002, 10_000_000  # points
PIXELS = 944 * 587
GOAL = 36.0
Cost = Callable[[Detail], float]


def machine(base: float, of_pixels: float, of_points: float, noise: float = 0.0) -> Cost:
    """What a picture takes, ms: some always, the rest by its pixels and by its points."""
    rng = np.random.default_rng(1)

    def ms(detail: Detail) -> float:
        exact = base + of_pixels * detail.scale**2 + of_points * detail.share
        return float(exact * (1 + noise * rng.standard_normal()))

    return ms


def play(budget: Budget, ms: Cost, pictures: int, points: int = DEMO) -> list[Detail]:
    """The details of so many pictures in a row."""
    shown = []
    for _ in range(pictures):
        shown.append(budget.detail)
        budget.note(ms(budget.detail), budget.detail, GOAL, points, PIXELS)
    return shown


@pytest.mark.parametrize("points", [1, CRANE, DEMO, MANY])
def test_where_points_are_kept_few_of_them_go_before_coarse_pixels(points: int) -> None:
    steps = details(points, PIXELS, keeps=True)
    assert steps[0] == Detail(1, 1)
    assert all(finer.size > coarser.size for finer, coarser in pairwise(steps))
    assert {steps[0], steps[-1]} <= set(details(points, PIXELS)), "from and to the same"
    if points == MANY:
        for scale, each in ((0.7, 0.2), (0.5, 0.1)):
            finer = [step.share * points / PIXELS for step in steps if step.scale >= scale]
            coarser = [step.share * points / PIXELS for step in steps if step.scale < scale]
            assert max(coarser) == min(finer)
            assert each <= min(finer) < 1.2 * each


def finest_in_time(ms: Cost, points: int) -> Detail:
    """The finest detail that is in time with a margin."""
    return next(one for one in details(points, PIXELS) if ms(one) <= 0.9 * GOAL)


@pytest.mark.parametrize("points", [1, 5000, CRANE, DEMO, MANY])
def test_details_go_from_full_to_few_pixels_and_points(points: int) -> None:
    steps = details(points, PIXELS)
    assert steps[0] == Detail(1, 1)
    assert all(finer.size > coarser.size for finer, coarser in pairwise(steps))
    assert all(step.share * points >= 10_000 for step in steps if step.share < 1)
    coarsest = min(step.scale for step in steps)
    assert 0.35 <= coarsest < 0.4
    for step in steps:
        drawn = step.scale**2 * PIXELS
        assert step.share == 1 or step.share * points >= drawn / 2, "fewer would leave holes"
        if step.scale == 1:
            assert step.share == 1 or step.share * points >= PIXELS / 2, (
                "where points are dense, they go first"
            )
        elif step.scale > coarsest:
            assert step.share == 1 or step.share * points < PIXELS, "pixels go before points that are seen"


def test_nothing_is_left_out_where_there_is_time() -> None:
    assert set(play(Budget(), machine(5, 12, 12, noise=0.1), 500)) == {Detail()}


def test_a_slow_picture_now_and_then_changes_nothing() -> None:
    budget = Budget()
    for number in range(200):
        budget.note(100.0 if number % 4 == 0 else 30.0, budget.detail, GOAL, DEMO, PIXELS)
    assert budget.detail == Detail()


MACHINES = [
    (10, 25, 25, DEMO), (5, 30, 40, DEMO), (15, 80, 10, DEMO), (5, 4, 40, DEMO), (5, 45, 3, CRANE),
    (5, 30, 15, CRANE), (5, 12, 800, MANY), (12, 80, 2000, MANY),
]  # fmt: skip


@pytest.mark.parametrize(("base", "of_pixels", "of_points", "points"), MACHINES)
def test_pictures_are_soon_in_time_and_the_time_is_used(
    base: float, of_pixels: float, of_points: float, points: int
) -> None:
    ms = machine(base, of_pixels, of_points)
    found = play(Budget(), ms, 200, points)
    best = finest_in_time(ms, points)
    assert ms(found[40]) <= GOAL
    assert ms(found[-1]) <= GOAL
    assert found[-1].size >= 0.5 * best.size


@pytest.mark.parametrize(("base", "of_pixels", "of_points", "points"), MACHINES)
def test_the_detail_stays_where_times_vary(
    base: float, of_pixels: float, of_points: float, points: int
) -> None:
    ms = machine(base, of_pixels, of_points, noise=0.08)
    settled = play(Budget(), ms, 900, points)[150:]
    steps = details(points, PIXELS)
    changes = [steps.index(a) - steps.index(b) for a, b in pairwise(settled) if a != b]
    assert len(changes) <= 4
    assert all(abs(change) <= 2 for change in changes), "neighbours, which look alike"


def test_one_very_slow_picture_is_enough() -> None:
    """A large scan is dragged: its picture at rest was slow, so the first one of the drag is a preview."""
    budget = Budget()
    budget.note(4000.0, Detail(), GOAL, MANY, PIXELS)
    assert budget.detail.share < 0.05


def test_it_becomes_finer_again_when_the_machine_has_time() -> None:
    budget = Budget()
    assert play(budget, machine(8, 150, 150), 100)[-1].size < 0.2
    assert play(budget, machine(5, 10, 12), 150)[-1] == Detail()


def test_a_picture_at_rest_that_was_surely_in_time_ends_previews() -> None:
    budget = Budget()
    play(budget, machine(8, 150, 150), 100)
    budget.note(30.0, Detail(), GOAL, DEMO, PIXELS)
    assert budget.detail != Detail()
    budget.note(15.0, Detail(), GOAL, DEMO, PIXELS)
    assert budget.detail == Detail()


@pytest.mark.parametrize("points", [100, DEMO])
def test_there_is_a_floor(points: int) -> None:
    assert play(Budget(), machine(5, 2000, 2000), 300, points)[-1] in details(points, PIXELS)[-2:]


def test_what_gains_no_time_is_not_left_out() -> None:
    """Where all is slow, for another program has the machine."""
    assert play(Budget(), machine(80, 4, 4), 300)[-1].size > 1.5 * details(DEMO, PIXELS)[-1].size


def test_another_scan_begins_where_the_one_before_was() -> None:
    budget = Budget()
    play(budget, machine(5, 12, 800), 200, MANY)
    assert budget.detail not in details(DEMO, PIXELS)
    assert play(budget, machine(5, 10, 12), 60, DEMO)[-1] == Detail()
