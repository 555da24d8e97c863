"""Bands of captured images: samples as Gaussians, what they sum to, what is hidden, and what is left to
coarser bands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from experiments.farooq_2013.seams import pods_facing, seam_visibility, seams
from numpy.typing import NDArray
from plain_splines import KERNELS, blended, expanded, pyramid
from range_scenes import heights, straight_above
from test_merged_views import DIFFERENT, front, painted_ball, pods
from test_spline import ROUNDING, SHAPE, banded, speckled, two_views, unbanded

from viewer.backends import backend
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.mesh.reference import trace
from viewer.picture.surface import Surface
from viewer.scan.colors import linear_from_srgb8
from viewer.scan.pose import Pose
from viewer.scan.range_view import RangeView

pytestmark = pytest.mark.backend("laplacian")
Draw = Callable[..., Surface]


def drawn(draw: Draw, views: tuple[RangeView, ...], **params: object) -> NDArray[np.float64]:
    camera, size = straight_above(SHAPE)
    surface = draw(views, camera, size, "laplacian", params={"bands": "capture", **params})
    return surface.color[..., :3].astype(float)


def splats(picture: NDArray[np.float64], right: float = 0.0, down: float = 0.0) -> NDArray[np.float64]:
    """Samples (H, W, C) that lie so much beside the middles of pixels, as Gaussians over 3 x 3 of these."""
    sums, weights = np.zeros_like(picture), np.zeros((*picture.shape[:2], 1))
    height, width = picture.shape[:2]
    for row, column in np.ndindex(3, 3):
        y, x = row - 1, column - 1
        weight = np.exp(-2 * ((x - right) ** 2 + (y - down) ** 2))
        to = np.s_[max(y, 0) : height + min(y, 0), max(x, 0) : width + min(x, 0)]
        of = np.s_[max(-y, 0) : height + min(-y, 0), max(-x, 0) : width + min(-x, 0)]
        sums[to] += weight * picture[of]
        weights[to] += weight
    return sums / weights


@pytest.mark.parametrize("light", ["logarithm", "linear"])
@pytest.mark.parametrize(("levels", "kernel"), [(3, "3x3"), (6, "5x5")])
def test_bands_of_one_view_sum_to_its_finest_level(draw: Draw, levels: int, kernel: str, light: str) -> None:
    """All bands together are the samples themselves, up to the kernel that each is."""
    color = speckled(1, 1.0)
    whole = banded(linear_from_srgb8(color).astype(float), light)
    views = (heights(np.full(SHAPE, -500.0), color=color),)
    found = drawn(draw, views, levels=levels, kernel=kernel, light=light)
    np.testing.assert_allclose(found, unbanded(splats(whole), light), atol=ROUNDING)


def test_samples_lie_at_parts_of_pixels(draw: Draw) -> None:
    color = speckled(1, 1.0)
    camera, size = straight_above(SHAPE)
    right, down = 0.3, -0.2
    beside = np.array([-right, down, 0.0])
    moved = replace(camera, eye=tuple(camera.eye + beside), target=tuple(camera.target + beside))
    views = (heights(np.full(SHAPE, -500.0), color=color),)
    surface = draw(views, moved, size, "laplacian", params={"bands": "capture"})
    expected = unbanded(
        splats(banded(linear_from_srgb8(color).astype(float), "logarithm"), right, down), "logarithm"
    )
    inside = np.s_[2:-2, 2:-2]
    np.testing.assert_allclose(surface.color[..., :3][inside], expected[inside], atol=ROUNDING)


@pytest.mark.parametrize("light", ["logarithm", "linear"])
@pytest.mark.parametrize(("levels", "kernel"), [(3, "3x3"), (5, "5x5")])
def test_levels_are_those_of_the_capture(draw: Draw, levels: int, kernel: str, light: str) -> None:
    """Scattered one by one, and blended band by band."""
    views, first = two_views()
    taps = KERNELS[kernel]
    colors = [linear_from_srgb8(view.color).astype(float) for view in views]
    pyramids = [[splats(banded(level, light)) for level in pyramid(color, levels, taps)] for color in colors]
    shares = [first.astype(float), (~first).astype(float)]
    expected = np.clip(unbanded(blended(pyramids, shares, shares, taps), light), 0, 1)
    found = drawn(draw, views, levels=levels, light=light, kernel=kernel, weights="crisp")
    off = np.abs(found - expected)
    assert off.max() < 0.015
    assert off.mean() < 0.003


@pytest.mark.parametrize("gain", [0.0, 2.0])
def test_the_finest_band_has_a_gain(draw: Draw, gain: float) -> None:
    color = speckled(1, 1.0)
    levels = pyramid(linear_from_srgb8(color).astype(float), 2, KERNELS["5x5"])
    fine, coarse = (splats(level) for level in levels)
    smooth = expanded(coarse, SHAPE, KERNELS["5x5"])
    views = (heights(np.full(SHAPE, -500.0), color=color),)
    found = drawn(draw, views, detail=gain, light="linear")
    np.testing.assert_allclose(found, np.clip(smooth + gain * (fine - smooth), 0, 1), atol=0.012)


def test_what_a_level_lacks_is_of_coarser_ones(draw: Draw) -> None:
    """A picture of twice as many pixels as samples: no holes, and no band of single pixels."""
    color = np.full((*SHAPE, 3), 90, np.uint8)
    camera, (width, height) = straight_above(SHAPE)
    size = (4 * width, 4 * height)
    surface = draw(
        (heights(np.full(SHAPE, -500.0), color=color),),
        camera,
        size,
        "laplacian",
        params={"bands": "capture"},
    )
    shown = np.isfinite(surface.depth)
    assert shown.mean() > 0.95
    assert np.abs(surface.image()[shown][:, :3].astype(int) - 90).max() <= 1


def test_hidden_points_never_enter(draw: Draw) -> None:
    """Whatever colour they have, however coarse the level."""
    rng = np.random.default_rng(4)
    sheet = np.full((64, 64), -500.0)
    card = np.zeros((64, 64), bool)
    card[8:56, 8:56] = True
    near = heights(sheet, card, color=rng.integers(0, 256, (64, 64, 3), np.uint8))
    camera, size = straight_above((64, 64))
    hidden = np.zeros((64, 64), bool)
    hidden[10:54, 10:54] = True
    pictures = []
    for gray in (0, 255):
        behind = heights(sheet + 30, hidden, color=np.full((64, 64, 3), gray, np.uint8))
        surface = draw((behind, near), camera, size, "laplacian", params={"bands": "capture"})
        pictures.append(surface.image())
    np.testing.assert_array_equal(pictures[0], pictures[1])


def test_backs_are_seen_from_behind(draw: Draw) -> None:
    """Where nothing is before them."""
    _, views = pods(2)
    behind = Camera.orbit(painted_ball().bounds, 183, 5)
    captured, picture = (
        draw(views, behind, (160, 120), "laplacian", params={"bands": bands})
        for bands in ("capture", "picture")
    )
    shown = np.isfinite(picture.depth) & np.isfinite(captured.depth)
    assert shown.sum() > 2000
    assert np.abs(captured.color - picture.color)[shown].mean() < 0.02


@pytest.mark.slow
def test_seams_are_less_seen(draw: Draw) -> None:
    cameras, unlike = pods(size=(320, 320), gains=DIFFERENT)
    _, alike = pods(size=(320, 320))
    size, camera, ball = (320, 320), front((320, 320)), painted_ball()
    truth = trace(ball, camera, size)
    weights = pods_facing(ball, truth, cameras)
    seen = []
    for name, params in (("laplacian", {"bands": "capture"}), ("pyramidal", {"blend": "best"})):
        one, other = (draw(views, camera, size, name, params=params) for views in (unlike, alike))
        shown = np.isfinite(one.depth) & np.isfinite(other.depth) & truth.covered
        seen.append(seam_visibility(one.color[..., :3], other.color[..., :3], shown, seams(weights))["seam"])
    assert seen[0] < seen[1] / 20


@pytest.mark.slow
def test_the_same_bits_come_again_in_any_order(draw: Draw) -> None:
    _, views = pods(3, gains=(*DIFFERENT, (0.95, 1.0, 0.9)))
    one, same, turned = (
        draw(some, front(), (320, 240), "laplacian", params={"bands": "capture"}).image().astype(int)
        for some in (views, views, views[::-1])
    )
    np.testing.assert_array_equal(one, same)
    assert np.abs(one - turned).max() <= 1


def test_memory_is_as_it_says(renderer: Renderer) -> None:
    """21.3 bytes a pixel for sums, 16 for the finest band."""
    _, views = pods(2)
    held = []
    for bands in ("picture", "capture"):
        surface = Surface(renderer.gpu, (320, 240))
        params = backend("laplacian").params({"bands": bands})
        request = Request(Pose.of(0, 0.0, "x", views), front(), "laplacian", params)
        render_frame(renderer, request, surface)
        held.append(surface.nbytes)
    assert (held[1] - held[0]) / (320 * 240) == pytest.approx(64 / 3 + 16, abs=0.5)
