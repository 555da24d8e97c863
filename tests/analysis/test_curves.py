"""Curves over time against ones whose speed, movement and repeats are known exactly, and against scipy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from viewer.analysis.curves import (
    Repeats,
    Smoothing,
    correlation,
    movement_of,
    peaks_of,
    repeats_of,
    runs,
    smoothed,
)

RATE = 30.0
TIMES = np.arange(120) / RATE
NONE = np.zeros(120)


def bump(times: NDArray[np.float64], middle: float = 2.0, wide: float = 0.3) -> NDArray[np.float64]:
    return np.exp(-0.5 * ((times - middle) / wide) ** 2)


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize(("seconds", "degree", "points"), [(0.3, 3, 9), (0.2, 2, 7), (0.5, 4, 15)])
def test_evenly_spaced_it_is_the_filter_of_scipy_up_to_both_ends(
    order: int, seconds: float, degree: int, points: int
) -> None:
    values = np.random.default_rng(1).normal(size=120).cumsum()
    smoothing = Smoothing(seconds, degree)
    assert smoothing.points(TIMES) == points
    wanted = savgol_filter(values, points, degree, deriv=order, delta=1 / RATE)
    found, _ = smoothed(TIMES, values, NONE, smoothing, order)
    np.testing.assert_allclose(found, wanted, atol=1e-9 * np.abs(wanted).max())


def test_polynomials_are_kept_exactly_at_uneven_times_and_each_run_by_itself() -> None:
    rng = np.random.default_rng(2)
    times = 5000.0 + np.sort(rng.choice(np.arange(200), 150, replace=False)) / 100
    x = times - 5002
    cubic, speed, acceleration = x**3 - 2 * x, 3 * x**2 - 2, 6 * x
    values = np.where(np.arange(150) < 80, cubic, cubic + 1000)  # a jump that a gap lies in
    values[77:83] = np.nan
    smoothing = Smoothing(0.4, 3)
    for order, wanted in enumerate((values, speed, acceleration)):
        found, _ = smoothed(times, values, np.zeros(150), smoothing, order)
        assert (np.isnan(found) == np.isnan(values)).all()
        known = np.isfinite(values)
        np.testing.assert_allclose(found[known], wanted[known], atol=1e-6)


def test_speed_and_acceleration_of_a_sine() -> None:
    slow = 2 * math.pi * 1.0
    values = np.sin(slow * TIMES)
    inside = slice(4, -4)
    expected = (1, slow * np.cos(slow * TIMES), 0.003), (2, -(slow**2) * np.sin(slow * TIMES), 0.06)
    for order, wanted, lost in expected:  # of what the window takes off at 1 Hz
        found, _ = smoothed(TIMES, values, NONE, Smoothing(), order)
        np.testing.assert_allclose(found[inside], wanted[inside], atol=lost * slow**order)


def test_what_is_told_of_errors_is_what_they_are() -> None:
    rng = np.random.default_rng(3)
    sigma = 0.1 + 0.1 * TIMES
    for order in range(3):
        runs_of_noise = [
            smoothed(TIMES, bump(TIMES) + sigma * rng.normal(size=120), sigma**2, Smoothing(), order)
            for _ in range(200)
        ]
        found = np.array([values for values, _ in runs_of_noise])
        told = np.sqrt(runs_of_noise[0][1])
        np.testing.assert_allclose(found.std(axis=0), told, rtol=0.2)


def test_vectors_have_covariances() -> None:
    rng = np.random.default_rng(4)
    values = rng.normal(size=(120, 3)).cumsum(axis=0)
    spread = np.tile(np.diag([1.0, 4.0, 9.0]), (120, 1, 1))
    found, covariances = smoothed(TIMES, values, spread, Smoothing(), 1)
    for axis, variance in enumerate((1.0, 4.0, 9.0)):
        alone = smoothed(TIMES, values[:, axis], np.full(120, variance), Smoothing(), 1)
        np.testing.assert_allclose(found[:, axis], alone[0])
        np.testing.assert_allclose(covariances[:, axis, axis], alone[1])
    assert (covariances[:, 0, 1] == 0).all()


def test_too_few_frames_give_nothing_and_a_window_is_widened_for_them() -> None:
    values = np.full(120, np.nan)
    values[[10, 20, 21, 22]] = 1.0
    values[30:34] = 2.0
    found, _ = smoothed(TIMES, values, NONE, Smoothing(), 1)
    assert np.flatnonzero(np.isfinite(found)).tolist() == [30, 31, 32, 33]
    assert np.isnan(smoothed(np.arange(9.0), np.arange(9.0), np.zeros(9), Smoothing())[0]).all()
    wide = Smoothing().wide_enough(np.arange(9.0))
    np.testing.assert_allclose(smoothed(np.arange(9.0), np.arange(9.0), np.zeros(9), wide, 1)[0], 1)
    one = smoothed(np.zeros(1), np.ones(1), np.zeros(1), Smoothing())[0]
    assert np.isnan(one).all()
    with pytest.raises(ValueError, match="no derivative of order 4"):
        smoothed(TIMES, NONE, NONE, Smoothing(), 4)
    assert runs(np.array([True, False, True, True])) == [(0, 1), (2, 4)]


@pytest.mark.parametrize("sign", [1, -1])
def test_amplitude_onset_peak_and_duration_of_a_bump(sign: int) -> None:
    middle, wide, height = 2.013, 0.3, 12.0
    reach = wide * math.sqrt(2 * math.log(10))
    movement = movement_of(TIMES, 40 + sign * height * bump(TIMES, middle, wide), NONE, Smoothing())
    assert movement is not None
    assert movement.rest == pytest.approx(40, abs=1e-6)
    assert movement.amplitude == pytest.approx(sign * height, rel=2e-3)
    assert movement.peak == pytest.approx(middle, abs=1e-3)
    assert movement.onset == pytest.approx(middle - reach, abs=2e-3)
    assert movement.end == pytest.approx(middle + reach, abs=2e-3)
    assert movement.duration == pytest.approx(2 * reach, abs=4e-3)


def test_errors_of_a_movement_are_what_is_told() -> None:
    rng, sigma = np.random.default_rng(5), np.full(120, 0.3)
    clean = 40 + 12 * bump(TIMES)
    found = [movement_of(TIMES, clean + sigma * rng.normal(size=120), sigma, Smoothing()) for _ in range(150)]
    for name, told in (("amplitude", "amplitude_sigma"), ("onset", "onset_sigma"), ("end", "end_sigma")):
        values = np.array([getattr(one, name) for one in found])
        assert np.median([getattr(one, told) for one in found]) == pytest.approx(values.std(), rel=0.4)


def test_what_lies_beyond_a_gap_or_the_end_is_not_known() -> None:
    values = bump(TIMES)
    values[45:48] = np.nan
    movement = movement_of(TIMES, values, NONE, Smoothing())
    assert movement is not None
    assert math.isnan(movement.onset)
    assert math.isnan(movement.duration)
    assert movement.end == pytest.approx(2 + 0.3 * math.sqrt(2 * math.log(10)), abs=2e-3)
    rising = movement_of(TIMES[:60], bump(TIMES[:60]), NONE[:60], Smoothing())
    assert rising is not None
    assert math.isnan(rising.end)
    unsure = movement_of(TIMES, bump(TIMES), np.full(120, 2.0), Smoothing())
    assert unsure is not None
    assert math.isnan(unsure.onset)
    assert unsure.amplitude == pytest.approx(1, abs=0.01)
    assert movement_of(TIMES, np.full(120, np.nan), NONE, Smoothing()) is None
    assert movement_of(TIMES, np.full(120, 3.0), NONE, Smoothing()) is None


def test_repeats_lie_over_one_another_with_their_mean_and_deviation() -> None:
    times, middles = np.arange(400) / RATE, np.array([2.0, 5.01, 8.02, 11.03])
    heights = np.array([9.0, 10.0, 11.0, 10.0])
    values = sum(height * bump(times, middle) for height, middle in zip(heights, middles, strict=True))
    values = values + 0.05 * np.random.default_rng(6).normal(size=400)
    values[140] = np.nan  # on the second one's way up
    events = peaks_of(times, values, Smoothing())
    np.testing.assert_allclose(events, middles, atol=0.02)
    repeats = repeats_of(times, values, events)
    assert repeats.curves.shape == (4, len(repeats.times))
    assert abs(repeats.times[0] + 1.5) < 0.1
    middle = int(np.argmin(np.abs(repeats.times)))
    assert repeats.mean[middle] == pytest.approx(10, abs=0.2)
    assert repeats.deviation[middle] == pytest.approx(heights.std(ddof=1), abs=0.15)
    assert np.isnan(repeats.curves).any(axis=1).tolist() == [False, True, False, False]
    downwards = peaks_of(times, -values, Smoothing())
    np.testing.assert_allclose(downwards, events)
    with pytest.raises(ValueError, match="no peak"):
        repeats_of(times, values, np.zeros(0))


def test_repeats_at_frames_are_the_values_themselves() -> None:
    values = np.arange(120.0) ** 2
    values[50] = np.nan
    repeats = repeats_of(TIMES, values, TIMES[[40, 70]], before=0.5, after=0.4)
    for row, frame in zip(repeats.curves, (40, 70), strict=True):
        np.testing.assert_allclose(row, values[frame - 15 : frame + 13])


def test_what_stands_out_little_on_one_side_is_no_peak() -> None:
    """On the shoulder of a higher one, with a deep valley behind; far from zero, which changes nothing."""
    times = np.arange(360) / RATE
    values = 100 + np.interp(times, [0, 2, 4, 6, 7, 8, 10, 12], [0, 0, 10, 5, 5, 6, 0, 0])
    np.testing.assert_allclose(peaks_of(times, values, Smoothing()), [4.0], atol=0.05)
    np.testing.assert_allclose(peaks_of(times, values, Smoothing(), least=0.05), [4.0, 8.0], atol=0.05)


def test_repeats_reach_to_the_last_frame() -> None:
    values = np.arange(120.0) ** 2
    repeats = repeats_of(TIMES, values, TIMES[[107]], before=0.5, after=0.4)
    np.testing.assert_allclose(repeats.curves[0], values[92:120])


def test_the_deviation_of_repeats_is_by_one_less_than_are_known() -> None:
    """Two repeats deviate by their difference over the root of 2; one alone has no deviation."""
    curves = np.array([[1.0, 5.0, 2.0], [4.0, 5.0, np.nan], [np.nan, 8.0, np.nan]])
    repeats = Repeats(np.arange(3.0), np.arange(3.0), curves)
    np.testing.assert_allclose(repeats.mean, [2.5, 6.0, 2.0])
    np.testing.assert_allclose(repeats.deviation, [3 / np.sqrt(2), np.sqrt(3), np.nan])


def test_correlation_is_of_what_both_know() -> None:
    one = np.sin(TIMES)
    other = -2 * one + 5
    other[10:20] = np.nan
    assert correlation(one, other) == pytest.approx(-1)
    assert math.isnan(correlation(one, np.full(120, 2.0)))
    assert math.isnan(correlation(one[:2], one[:2]))
