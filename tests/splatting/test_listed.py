"""Few points list the pixels to clear and shade: pictures are as on a surface that was never drawn to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from viewer.backends import backend
from viewer.camera import Camera
from viewer.drawing.frame import render_frame, supersample
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.errors import InputError
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

SIZE = (200, 150)


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    return Renderer()


@pytest.fixture(scope="module")
def request_(renderer: Renderer) -> Request:
    rng = np.random.default_rng(4)
    points = rng.standard_normal((600, 3)).astype(np.float32)
    points = np.repeat(points, 2, axis=0)  # two in each place, the lower one is shown
    cloud = PointCloud.from_arrays(points, colors=rng.random((1200, 3)))
    return Request(Pose(0, 0.0, "cloud", cloud), Camera.orbit(cloud.bounds(), 0, 0, aspect=4 / 3), "points")


def turned(request: Request, degrees: float, size: int = 1, **look: object) -> Request:
    camera = Camera.orbit(request.pose.points.bounds(), degrees, 10, aspect=4 / 3)
    params = backend("points").params({"point_size": size})
    return replace(request, camera=camera, params=params, look=Look(**look))


def assert_as_if_new(renderer: Renderer, request: Request, surface: Surface) -> None:
    render_frame(renderer, request, surface)
    fresh = Surface(renderer.gpu, SIZE)
    render_frame(renderer, request, fresh)
    np.testing.assert_array_equal(surface.image(), fresh.image())
    np.testing.assert_array_equal(surface.depth, fresh.depth)
    np.testing.assert_array_equal(surface.id, fresh.id)


@pytest.mark.parametrize("size", [1, 2])
def test_pictures_one_after_another(renderer: Renderer, request_: Request, size: int) -> None:
    surface = Surface(renderer.gpu, SIZE)
    for degrees in (0, 40, 41, 200):
        wanted = turned(request_, degrees, size)
        assert_as_if_new(renderer, wanted, surface)
        assert "pixels" in surface.stats.skipped
    depths = surface.depth[np.isfinite(surface.depth)]
    assert 400 < len(depths) < SIZE[0] * SIZE[1] / 2


def test_what_lies_between_leaves_nothing(renderer: Renderer, request_: Request) -> None:
    """Other backgrounds, painted holes, smooth edges, another backend, many points, and what fails."""
    surface = Surface(renderer.gpu, SIZE)
    assert_as_if_new(renderer, turned(request_, 0, background="#123456"), surface)
    assert_as_if_new(renderer, turned(request_, 10, background="#654321"), surface)
    assert_as_if_new(renderer, turned(request_, 20, background="#654321", holes=True), surface)
    assert_as_if_new(renderer, turned(request_, 30, background="#654321"), surface)
    while supersample(renderer, turned(request_, 30, background="#654321", quality="balanced"), surface):
        pass
    assert surface.stats.samples == 5
    assert_as_if_new(renderer, turned(request_, 40, background="#654321"), surface)
    render_frame(renderer, replace(turned(request_, 50), backend="auto_splats", params=None), surface)
    assert_as_if_new(renderer, turned(request_, 60), surface)
    assert_as_if_new(renderer, turned(request_, 70, size=9), surface)
    assert "pixels" not in surface.stats.skipped
    assert_as_if_new(renderer, turned(request_, 80), surface)
    with pytest.raises(InputError, match="none of these"):
        render_frame(renderer, turned(request_, 90, color_by="none of these"), surface)
    assert_as_if_new(renderer, turned(request_, 100), surface)
