"""Laws of time and error: fitted to numbers that are known, and monotone whatever they were fitted to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from viewer.choice.model import CAP, ERROR_TERMS, TIME_TERMS, Law, Measured, error_terms, fit, time_terms
from viewer.choice.seen import ScanInView


def seen(rng: np.random.Generator) -> ScanInView:
    """A view by chance."""
    count, pixels = 10 ** rng.uniform(4, 7), 10 ** rng.uniform(5, 6.5)
    share, spacing = rng.uniform(0.1, 1.0), 10 ** rng.uniform(-0.5, 1.5)
    return ScanInView(
        points=count,
        listed=count,
        in_view=share * count,
        pixels=pixels,
        covered=rng.uniform(0.1, 0.9) * pixels,
        spacing=spacing,
        sparse=spacing * rng.uniform(1, 2),
        rough=spacing * rng.uniform(0, 0.2),
        scattered=rng.random(),
        footprint=1.0,
    )


def measured(law: Law, count: int, noise: float, seed: int = 0) -> list[Measured]:
    """Pictures that keep a law but for noise, a share of each number."""
    rng = np.random.default_rng(seed)
    rows = []
    for number in range(count):
        view, scale = seen(rng), (1.0, 0.71, 0.5)[number % 3]
        expected = law.expect(view, scale)
        ms, error = (value * np.exp(noise * rng.normal()) for value in (expected.ms, expected.error))
        rows.append(Measured(view, scale, float(ms), float(error)))
    return rows


def true_law() -> Law:
    """A law with a few of the terms."""
    time, error = np.zeros(TIME_TERMS), np.zeros(ERROR_TERMS)
    time[[0, 2, 4, 7]] = 3.0, 8.0, 20.0, 2.0
    error[[1, 5, 19]] = 0.3, 4.0, 1.0
    return Law(tuple(time), tuple(error), 1.0, 1.0)


def test_terms_are_as_many_as_is_said() -> None:
    view = seen(np.random.default_rng(0))
    assert len(time_terms(view, 0.5)) == TIME_TERMS
    assert len(error_terms(view, 0.5)) == ERROR_TERMS


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_a_law_that_is_kept_is_found(noise: float) -> None:
    law = true_law()
    found = fit(measured(law, 300, noise))
    rng = np.random.default_rng(7)
    for _ in range(200):
        view = seen(rng)
        for scale in (1.0, 0.6):
            expected, got = law.expect(view, scale), found.expect(view, scale)
            assert got.ms == pytest.approx(expected.ms, rel=1e-3 + noise)
            assert got.error == pytest.approx(max(expected.error, 0.1), rel=1e-3 + 1.5 * noise, abs=noise)


def test_the_slack_holds_nine_of_ten_pictures() -> None:
    noise = 0.2
    law, rows = true_law(), measured(true_law(), 600, 0.2)
    found = fit(rows)
    assert found.late == pytest.approx(np.exp(1.28 * noise), rel=0.1)  # of a normal distribution
    others = measured(law, 600, noise, seed=1)
    late = [row.ms > found.late * found.expect(row.seen, row.scale).ms for row in others]
    assert np.mean(late) < 0.15


@pytest.mark.parametrize("seed", range(5))
def test_more_work_never_takes_less_and_sparser_points_are_never_better(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = [Measured(seen(rng), 1.0, rng.uniform(1, 100), rng.uniform(0, CAP)) for _ in range(50)]
    law = fit(rows)
    for _ in range(50):
        view, growth = seen(rng), rng.uniform(1, 3)
        now = law.expect(view, 0.7)
        more = replace(view, listed=view.listed * growth, in_view=view.in_view * growth)
        sparser = replace(
            view, spacing=view.spacing * growth, sparse=view.sparse * growth, rough=view.rough * growth
        )
        assert law.expect(more, 0.7).ms >= now.ms
        assert law.expect(sparser, 0.7).error >= now.error
        assert 0 <= now.error <= CAP
