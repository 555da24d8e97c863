"""Previews: a share of the points stands for all, and a picture in full comes after it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scenes import NOTHING, of_variant, rarely, sphere, sphere_hits

from viewer.backends import backend
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

SIZE = (320, 240)
Preview = Callable[..., Surface]


@pytest.fixture
def preview(renderer: Renderer) -> Preview:
    """preview(cloud, name, share): a picture of a share of the points, which says that it can be refined."""

    def preview(cloud: PointCloud, name: str, share: float, camera: Camera | None = None) -> Surface:
        surface = Surface(renderer.gpu, SIZE)
        camera = camera or Camera.orbit(cloud.bounds(), 20, 10, aspect=SIZE[0] / SIZE[1])
        name, setting = of_variant(name)
        request = Request(Pose(0, 0.0, "test", cloud), camera, name, backend(name).params(setting))
        assert render_frame(renderer, request, surface, share=share) == (surface.stats.left_out > 0)
        return surface

    return preview


@pytest.mark.parametrize("name", ["points", "surfels"])
def test_points_and_surfels_are_drawn_in_part(preview: Preview, name: str) -> None:
    assert preview(sphere(20_000), name, 0.25).stats.share == 0.25


@pytest.mark.parametrize("share", [*rarely(0.5, 0.1), 0.25])
@pytest.mark.parametrize("order", ["in rows", "shuffled"])
def test_the_surface_stays_closed_and_where_it_is(preview: Preview, share: float, order: str) -> None:
    cloud = sphere(20_000)
    if order == "shuffled":
        cloud = shuffled(cloud)
    camera = Camera.orbit(cloud.bounds(), 20, 10, aspect=SIZE[0] / SIZE[1])
    surface = preview(cloud, "surfels", share, camera)
    depth, _ = sphere_hits(camera, SIZE)
    hit = np.isfinite(depth)
    seen = surface.row != NOTHING
    assert seen[hit].mean() > 0.999
    # Splats reach over the silhouette, by their radius at most.
    assert (seen & ~hit).sum() / hit.sum() < 0.2 * np.sqrt(0.1 / share)
    wrong = np.abs(surface.depth[hit & seen] - depth[hit & seen]) > 0.2
    assert wrong.mean() < 0.01, "the far side is seen through no more than a few gaps"


def shuffled(cloud: PointCloud) -> PointCloud:
    order = np.random.default_rng(0).permutation(len(cloud))
    assert cloud.normals is not None
    assert cloud.radii is not None
    return replace(
        cloud,
        positions=cloud.positions[order],
        normals=cloud.normals[order],
        colors=None,
        radii=cloud.radii[order],
        scalars={},
    )
