"""Whole steps of linear light: every level comes back, means are close, sums fit."""

from __future__ import annotations

import numpy as np

from viewer.srgb import (
    LIGHT_STEPS,
    bytes_from_light,
    bytes_from_linear,
    light_from_bytes,
    linear_from_bytes,
    roots_from_bytes,
)

LEVELS = np.arange(256, dtype=np.uint8)


def encoded(linear: np.ndarray) -> np.ndarray:
    """sRGB levels of linear colours, unrounded."""
    return 255 * np.where(linear > 0.0031308, 1.055 * linear ** (1 / 2.4) - 0.055, linear * 12.92)


def test_every_level_comes_back() -> None:
    light = light_from_bytes(LEVELS)
    np.testing.assert_array_equal(bytes_from_light(light), LEVELS)
    assert (np.diff(light.astype(int)) > 0).all()
    assert light[0] == 0
    assert light[-1] == LIGHT_STEPS
    assert np.abs(encoded(light / LIGHT_STEPS) - LEVELS).max() < 0.44, "levels"
    assert roots_from_bytes(LEVELS).max() < 1 << 10


def test_equal_neighbours_are_that_level() -> None:
    for count in (2, 3, 7, 1000):
        sums = count * light_from_bytes(LEVELS).astype(np.int64)
        np.testing.assert_array_equal(bytes_from_light(sums / count), LEVELS)


def test_means_are_within_a_level() -> None:
    pairs = np.stack(np.meshgrid(LEVELS, LEVELS)).reshape(2, -1)
    exact = bytes_from_linear(linear_from_bytes(pairs).mean(axis=0)).astype(int)
    stepped = bytes_from_light(light_from_bytes(pairs).mean(axis=0)).astype(int)
    assert bytes_from_light(light_from_bytes(np.array([0, 255], np.uint8)).mean()) == 188
    assert np.abs(stepped - exact).max() <= 1
    assert (stepped != exact).mean() < 0.1
