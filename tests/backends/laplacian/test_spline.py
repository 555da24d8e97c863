"""Laplacian projection against the spline of whole pictures: flat views, whose samples are pixels."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from plain_splines import DARK, KERNELS, expanded, reduced, splined
from range_scenes import heights, straight_above
from scenes import rarely

from viewer.picture.surface import Surface
from viewer.scan.colors import linear_from_srgb8
from viewer.scan.range_view import RangeView

pytestmark = pytest.mark.backend("laplacian")
Draw = Callable[..., Surface]

SHAPE = (60, 75)
ROUNDING = 1.5 / 255  # sRGB: two times eight bits


def speckled(seed: int, gain: float) -> NDArray[np.uint8]:
    """Colours of all frequencies, sRGB."""
    rng = np.random.default_rng(seed)
    row, column = np.mgrid[: SHAPE[0], : SHAPE[1]]
    waves = sum(
        np.sin(row[..., None] / size + rng.uniform(0, 6, 3)) + np.sin(column[..., None] / size + seed)
        for size in (1.5, 4.0, 11.0)
    )
    return np.uint8(np.clip(gain * (110 + 18 * waves), 0, 255))


def halves(own: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Confidence that wins where it is the view's own."""
    return np.where(own, 1.0, 0.5).astype(np.float32)


def two_views(**fields: object) -> tuple[tuple[RangeView, RangeView], NDArray[np.bool_]]:
    """Two views of one plane that see other colours, and where the first of them is the better one."""
    row, column = np.mgrid[: SHAPE[0], : SHAPE[1]]
    first = column + 6 * np.sin(row / 5) < 37
    flat = np.full(SHAPE, -500.0)
    one = heights(flat, color=speckled(1, 1.0), confidence=halves(first), **fields)
    return (one, heights(flat, color=speckled(2, 0.8), confidence=halves(~first), **fields)), first


def drawn(draw: Draw, views: tuple[RangeView, ...], **params: object) -> Surface:
    camera, size = straight_above(SHAPE)
    return draw(views, camera, size, "laplacian", params=params)


def banded(light: NDArray, kind: str) -> NDArray[np.float64]:
    return np.log(light + DARK) if kind == "logarithm" else light


def unbanded(bands: NDArray, kind: str) -> NDArray[np.float64]:
    return np.exp(bands) - DARK if kind == "logarithm" else bands


@pytest.mark.parametrize("weights", ["mixed", *rarely("crisp"), "soft"])
@pytest.mark.parametrize("light", ["logarithm", *rarely("linear")])
@pytest.mark.parametrize(("levels", "kernel"), [(3, "3x3"), (6, "3x3"), (6, "5x5")])
def test_it_is_the_spline_of_the_views_pictures(
    draw: Draw, levels: int, kernel: str, light: str, weights: str
) -> None:
    views, first = two_views()
    crisp = [first.astype(float), (~first).astype(float)]
    soft = [np.where(first, 2, 1) / 3, np.where(first, 1, 2) / 3]
    shares, top = (soft if weights in soft_for else crisp for soft_for in (("soft",), ("mixed", "soft")))
    pictures = [banded(linear_from_srgb8(view.color).astype(float), light) for view in views]
    expected = np.clip(unbanded(splined(pictures, shares, top, levels, KERNELS[kernel]), light), 0, 1)
    found = drawn(draw, views, levels=levels, light=light, weights=weights, kernel=kernel).color[..., :3]
    off = np.abs(found - expected)
    assert off.max() < 0.01
    assert off.mean() < 0.003


@pytest.mark.parametrize("light", ["logarithm", "linear"])
@pytest.mark.parametrize(("gain", "kernel"), [(0.0, "3x3"), (0.5, "5x5"), (2.5, "5x5")])
def test_the_finest_band_has_a_gain(draw: Draw, gain: float, kernel: str, light: str) -> None:
    views, _ = two_views()
    whole = banded(linear_from_srgb8(views[0].color).astype(float), light)
    fine = whole - expanded(reduced(whole, KERNELS[kernel]), SHAPE, KERNELS[kernel])
    expected = np.clip(unbanded(whole + (gain - 1) * fine, light), 0, 1)
    found = drawn(draw, views[:1], detail=gain, light=light, kernel=kernel).color[..., :3]
    np.testing.assert_allclose(found, expected, atol=0.012)


@pytest.mark.parametrize("light", ["logarithm", "linear"])
def test_views_that_see_the_same_change_nothing(draw: Draw, light: str) -> None:
    """All bands sum to what each view shows."""
    flat, color = np.full(SHAPE, -500.0), speckled(1, 1.0)
    rng = np.random.default_rng(3)
    views = tuple(heights(flat, color=color, confidence=rng.random(SHAPE, np.float32)) for _ in range(3))
    shown = drawn(draw, views, light=light).image()[..., :3].astype(int)
    assert np.abs(shown - color).max() <= 1


def test_views_that_tie_are_shared(draw: Draw) -> None:
    flat = np.full(SHAPE, -500.0)
    gray = [np.full((*SHAPE, 3), value, np.uint8) for value in (100, 200)]
    views = tuple(heights(flat, color=color) for color in gray)
    for order in (views, views[::-1]):
        linear = drawn(draw, order, light="linear").image()[..., :3]
        np.testing.assert_array_equal(linear, 160)  # the mean of linear light
        logarithm = drawn(draw, order).color[..., :3]
        light = linear_from_srgb8(np.array([100, 200], np.uint8)) + DARK
        np.testing.assert_allclose(logarithm, np.sqrt(light.prod()) - DARK, atol=0.003)


def test_a_step_fades_over_the_coarsest_band(draw: Draw) -> None:
    """The fewer bands, the steeper."""
    steepest = {}
    flat, first = np.full(SHAPE, -500.0), np.broadcast_to(np.arange(SHAPE[1]) < 37, SHAPE)
    views = tuple(
        heights(flat, color=np.full((*SHAPE, 3), value, np.uint8), confidence=halves(own))
        for value, own in ((150, first), (136, ~first))
    )
    for levels in (3, 4, 5, 6):
        middle = drawn(draw, views, levels=levels, weights="crisp").color[30, :, 1]
        assert (np.diff(middle) <= 1e-6).all()
        steepest[levels] = np.abs(np.diff(middle)).max()
    best = np.ptp(middle)
    assert steepest[3] < best / 3
    assert steepest[4] < steepest[3]
    assert steepest[6] < best / 9
