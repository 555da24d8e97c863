"""Previews: a share of the points stands for all, and a picture in full comes after it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scenes import NOTHING, every_backend, every_backend_of_points, of_variant, rarely, sphere, sphere_hits

from viewer.backends import backend
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.picture.sample import is_sampled
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


@every_backend_of_points
@pytest.mark.parametrize("share", [*rarely(0.5, 0.1), 0.25])
def test_a_preview_shows_rows_of_the_sample_and_counts_the_others(
    preview: Preview, name: str, share: float
) -> None:
    cloud = sphere(20_000)
    surface = preview(cloud, name, share)
    assert surface.stats.share in (share, 1.0), "one that is fast enough may draw all"
    rows = np.unique(surface.row[surface.row != NOTHING])
    sampled = is_sampled(np.arange(len(cloud), dtype=np.uint32), surface.stats.share)
    assert sampled[rows].all()
    assert surface.stats.left_out == np.count_nonzero(~sampled)
    counts = surface.point_counts()
    assert counts.get("preview", 0) == surface.stats.left_out
    assert counts.pop("in") == len(cloud) == sum(counts.values())


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


@every_backend
def test_the_same_preview_again_and_in_full_as_if_nothing_had_been(
    renderer: Renderer, preview: Preview, name: str
) -> None:
    cloud = sphere(8_000)
    first = preview(cloud, name, 0.3)
    full = preview(cloud, name, 1.0)
    for share, count in product((0.5, 1.0), (12_000, 500)):
        preview(sphere(count), name, share)
    for before, share in ((first, 0.3), (full, 1.0)):
        again = preview(cloud, name, share)
        for channel, values in before.arrays().items():
            np.testing.assert_array_equal(again.arrays()[channel], values, err_msg=channel)
        np.testing.assert_array_equal(again.image(), before.image())
    assert full.stats.left_out == 0
    assert "preview" not in full.point_counts()


@every_backend
def test_of_few_points_none_is_left_out(preview: Preview, name: str) -> None:
    for cloud in (sphere(500), PointCloud.from_arrays(np.zeros((0, 3)), normals=np.zeros((0, 3)))):
        surface = preview(cloud, name, 0.1, Camera(eye=(0, 0, 4)))
        assert surface.stats.left_out == 0
        assert surface.stats.share == 1


@every_backend_of_points
def test_ties_go_to_the_lowest_row_of_the_sample(preview: Preview, name: str) -> None:
    count = 2000
    cloud = PointCloud.from_arrays(
        np.zeros((count, 3)), normals=np.tile([0.0, 0, 1], (count, 1)), radii=np.ones(count)
    )
    surface = preview(cloud, name, 0.2, Camera(eye=(0, 0, 4)))
    lowest = np.flatnonzero(is_sampled(np.arange(count, dtype=np.uint32), surface.stats.share))[0]
    assert set(np.unique(surface.row)) <= {lowest, NOTHING}
    assert (surface.row == lowest).any()
