"""How views compete, against the same weights on the scan itself (viewer/mesh/merging/competition.py)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from range_scenes import heights, straight_above
from scipy import ndimage

from viewer.backends import backend
from viewer.backends.laplacian.spline import Pictures
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.mesh.merging.competition import competition_weights
from viewer.mesh.merging.surfaces import RangeSurface
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose
from viewer.scan.range_view import RangeView

pytestmark = pytest.mark.backend("laplacian")

SHAPE = (60, 75)
AWAY = 5  # samples from an edge of the mask, where it falls; on the scan it is cut


def hills(seed: int) -> NDArray[np.float64]:
    row, column = np.mgrid[: SHAPE[0], : SHAPE[1]]
    return -500 + 9 * np.sin(column / 7 + seed) * np.cos(row / 9)


def scan_weights(view: RangeView) -> NDArray[np.float64]:
    """The weight of each pixel on the scan itself, (H, W)."""
    surface = RangeSurface.of(view)
    return surface.on_grid(competition_weights(surface, confident=True))


def best_weights(renderer: Renderer, views: tuple[RangeView, ...]) -> NDArray[np.float64]:
    """The largest weight of any view in each pixel, (H, W), as the spline has it."""
    camera, size = straight_above(SHAPE)
    surface = Surface(renderer.gpu, size)
    params = backend("laplacian").params({"detail": 0.5})  # also of one view alone
    render_frame(renderer, Request(Pose.of(0, 0.0, "x", views), camera, "laplacian", params), surface)
    words = np.frombuffer(surface.cached(Pictures).winners.buffer.read(), np.uint32).reshape(-1, 4)
    return (words[:, 0] & 0xFFFF).astype(np.uint16).view(np.float16).astype(float).reshape(SHAPE)


def masked() -> NDArray[np.bool_]:
    mask = np.ones(SHAPE, bool)
    mask[20:30, 40:60] = False
    return mask


@pytest.mark.parametrize("holed", [False, True])
@pytest.mark.parametrize("told", [False, True])
def test_weights_of_a_view_are_those_of_the_scan(renderer: Renderer, told: bool, holed: bool) -> None:
    rng = np.random.default_rng(3)
    mask = masked() if holed else np.ones(SHAPE, bool)
    confidence = rng.uniform(0.2, 1.0, SHAPE).astype(np.float32) if told else None
    if confidence is not None:
        confidence[5, 5] = 1.0  # the largest, by which others are told
    color = rng.integers(0, 256, (*SHAPE, 3), np.uint8)
    view = heights(hills(0), mask, color=color, confidence=confidence)
    found, expected = best_weights(renderer, (view,)), scan_weights(view)
    inside = ndimage.binary_erosion(mask, np.ones((3, 3)), AWAY)
    assert np.ptp(expected[inside]) > 0.2
    np.testing.assert_allclose(found[inside], expected[inside], atol=0.01)


def test_the_better_of_two_views_is_that_of_the_scan(renderer: Renderer) -> None:
    """Of views of one surface that are sure of different parts."""
    rng = np.random.default_rng(3)
    color = rng.integers(0, 256, (*SHAPE, 3), np.uint8)
    sure = rng.uniform(0.2, 1.0, (2, *SHAPE)).astype(np.float32)
    sure[:, 5, 5] = 1.0
    one, other = (heights(hills(0), color=color, confidence=each) for each in sure)
    found = best_weights(renderer, (one, replace(other, name="other")))
    expected = np.maximum(scan_weights(one), scan_weights(other))
    inside = np.s_[AWAY:-AWAY, AWAY:-AWAY]
    np.testing.assert_allclose(found[inside], expected[inside], atol=0.01)
