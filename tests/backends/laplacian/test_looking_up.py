"""What a pixel looks up in a view, where it is larger or smaller than samples: plain interpolation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from range_scenes import heights, straight_above
from scenes import rarely_together
from test_spline import ROUNDING, SHAPE, speckled

from viewer.picture.surface import Surface
from viewer.scan.colors import linear_from_srgb8

pytestmark = pytest.mark.backend("laplacian")
Draw = Callable[..., Surface]
Weights = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def linear(away: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.maximum(1 - np.abs(away), 0)


def cubic(away: NDArray[np.float64]) -> NDArray[np.float64]:
    """Keys' kernel, a = -1/2."""
    x = np.abs(away)
    near, far = 1.5 * x**3 - 2.5 * x**2 + 1, -0.5 * x**3 + 2.5 * x**2 - 4 * x + 2
    return np.where(x < 1, near, np.where(x < 2, far, 0.0))


def looked_up(
    light: NDArray[np.float64], zoom: float, parts: int, kernel: Weights, stride: int = 1
) -> NDArray[np.float64]:
    """A picture of so many pixels a sample, of that many places along either edge of a pixel, (H, W, 3).
    stride: of the samples of a level."""
    along = []
    for size, count in zip(SHAPE, light.shape[:2], strict=True):
        pixels = round(zoom * size)
        places = (np.arange(pixels * parts) + 0.5) / parts - pixels / 2
        places = (places / zoom + size / 2) / stride - 0.5
        shares = kernel(places[:, None] - np.arange(count))
        along.append(shares.reshape(pixels, parts, count).mean(axis=1))
    return np.einsum("ay,yxc,bx->abc", along[0], light, along[1])


def between_levels(light: NDArray[np.float64], zoom: float) -> NDArray[np.float64]:
    """A picture of samples a half to 1 / sqrt(3) pixels apart: of two levels, so mixed that it is as smooth
    as pixels are."""
    height, width = (count // 2 for count in SHAPE)
    halved = light[: 2 * height, : 2 * width].reshape(height, 2, width, 2, 3).mean(axis=(1, 3))
    share = (1 / 12 - zoom**2 / 4) / (zoom**2 - zoom**2 / 4)
    finer, coarser = looked_up(light, zoom, 1, linear), looked_up(halved, zoom, 1, linear, 2)
    return (1 - share) * finer + share * coarser


def drawn(
    draw: Draw, zoom: float, quality: str, mask: NDArray[np.bool_] | None = None
) -> NDArray[np.float64]:
    view = heights(np.full(SHAPE, -500.0), mask, color=speckled(1, 1.0))
    camera, size = straight_above(SHAPE, zoom)
    surface = draw((view, view), camera, size, "laplacian", params={"quality": quality})
    return surface.color[..., :3].astype(float)


@pytest.mark.parametrize(
    ("quality", "zoom", "parts", "kernel"),
    [
        ("fast", 0.8, 1, linear),
        ("fine", 0.6, 2, linear),
        ("fast", 1.0, 1, linear),
        ("fast", 2.0, 1, cubic),
        *rarely_together(
            ("fine", 3.0, 1, cubic),
            ("fine", 0.8, 1, linear),
            ("fine", 0.5, 2, linear),
            ("fast", 0.6, 1, linear),
        ),
    ],
)
def test_pixels_look_up(draw: Draw, quality: str, zoom: float, parts: int, kernel: Weights) -> None:
    light = linear_from_srgb8(speckled(1, 1.0)).astype(float)
    expected = np.clip(looked_up(light, zoom, parts, kernel), 0, 1)
    inside = np.s_[8:-8, 8:-8]
    found = drawn(draw, zoom, quality)
    assert found.shape == expected.shape
    np.testing.assert_allclose(found[inside], expected[inside], atol=ROUNDING)


@pytest.mark.parametrize("zoom", [0.4, 0.5, 0.55])
def test_pixels_look_up_between_levels(draw: Draw, zoom: float) -> None:
    expected = between_levels(linear_from_srgb8(speckled(1, 1.0)).astype(float), zoom)
    inside = np.s_[8:-8, 8:-8]
    np.testing.assert_allclose(drawn(draw, zoom, "fast")[inside], expected[inside], atol=ROUNDING)


def test_where_any_of_sixteen_samples_is_missing_four_are_looked_up(draw: Draw) -> None:
    mask = np.ones(SHAPE, bool)
    mask[::3, ::3] = False
    light = linear_from_srgb8(speckled(1, 1.0)).astype(float)
    expected = looked_up(light, 2.0, 1, linear)
    apart = [np.arange(2 * count) % 6 for count in SHAPE]  # pixels from the middle of four that are there
    whole = np.ix_(*((each == 3) | (each == 4) for each in apart))
    found = drawn(draw, 2.0, "fast", mask)
    assert len(expected[whole]) > 30
    np.testing.assert_allclose(found[whole], expected[whole], atol=ROUNDING)


def test_one_view_is_looked_up_as_well(draw: Draw) -> None:
    view = heights(np.full(SHAPE, -500.0), color=speckled(1, 1.0))
    camera, size = straight_above(SHAPE, 2.0)
    one, both = (
        draw(views, camera, size, "laplacian", params={"quality": "fine"}).color
        for views in ((view,), (view, view))
    )
    inside = np.s_[8:-8, 8:-8]
    np.testing.assert_allclose(one[inside], both[inside], atol=ROUNDING)
