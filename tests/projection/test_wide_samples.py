"""More range samples than a driver has texels: a texel holds several, and pictures keep their bits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from range_scenes import looking_at, shape_view

from viewer.backends import backend
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.errors import InputError
from viewer.gpu.context import headless
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose
from viewer.scan.range_view import DepthKind, RangeView

SIZE = (112, 84)
MOST = 16_000  # texels, of 31 500 samples with the coarser levels
CAMERA = Camera((3.5, 1.2, 3.0), (0.5, 0.0, 0.0), fov_y=40)
LIT = Look(light="head")


@pytest.fixture(scope="module")
def both() -> Iterator[tuple[Renderer, Renderer]]:
    """A renderer that has a texel for each sample, and one that has fewer texels."""
    usual, few = Renderer(headless()), Renderer(headless())
    few.gpu.max_points = MOST
    yield usual, few
    usual.release()
    few.release()


def two_pods(kind: DepthKind, measured: bool = False) -> tuple[RangeView, RangeView]:
    """A sphere and a plane, with colours, and confidences of the first."""
    rng = np.random.default_rng(5)
    first, second = (
        replace(view, color=rng.integers(0, 256, (*view.depth.shape, 3), np.uint8))
        for view in (shape_view(name, kind, measured=measured)[0] for name in ("sphere", "plane"))
    )
    second = replace(second, world_to_camera=looking_at((2.0, 1.5, 3.0), (0.5, 0.0, 0.0)))
    return replace(first, confidence=rng.random(first.depth.shape).astype(np.float32)), second


def drawn(own: Renderer, views: tuple[RangeView, ...], name: str, params: dict[str, Any]) -> Surface:
    """The picture that a renderer draws."""
    surface = Surface(own.gpu, SIZE)
    pose = Pose.of(0, 0.0, "", views)
    while render_frame(own, Request(pose, CAMERA, name, backend(name).params(params), LIT), surface):
        pass
    assert bool(pose.count > MOST)
    return surface


@pytest.mark.parametrize(
    ("name", "params", "kind", "measured"),
    [
        ("pyramidal", {}, "z", False),
        ("pyramidal", {"primitive": "points"}, "range", False),
        ("pyramidal", {"first_level": 1, "filter": "gaussian", "blend": "best"}, "z", True),
        ("pyramidal", {"primitive": "points", "detail": 4.0, "fade": True}, "height", False),
        ("laplacian", {}, "z", False),
        ("laplacian", {"bands": "capture"}, "z", False),
    ],
)
def test_pictures_are_the_same_bits(
    both: tuple[Renderer, Renderer], name: str, params: dict[str, Any], kind: DepthKind, measured: bool
) -> None:
    usual, few = (drawn(own, two_pods(kind, measured), name, params) for own in both)
    assert (usual.coverage > 0).mean() > 0.1
    for channel in ("depth", "id", "level", "normal", "color"):
        np.testing.assert_array_equal(getattr(few, channel), getattr(usual, channel), err_msg=channel)
    np.testing.assert_array_equal(few.image(), usual.image())


def test_what_has_no_texels_is_told(both: tuple[Renderer, Renderer]) -> None:
    few = both[1]
    by_height = Request(Pose.of(0, 0.0, "", two_pods("z")), CAMERA, "pyramidal", look=Look(color_by="height"))
    with pytest.raises(InputError, match="cannot colour 23,474 pixels of range views by a number"):
        render_frame(few, by_height, Surface(few.gpu, SIZE))
    with pytest.raises(InputError, match="have 70,422 pixels, which is too many"):
        drawn(few, 3 * two_pods("z"), "pyramidal", {})
