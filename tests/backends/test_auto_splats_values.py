"""Numbers that auto splats find, as looks colour by them: those of `estimate_normals`, point by point."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import NOTHING, sphere
from scipy.spatial import cKDTree

import viewer
from viewer.backends import backend
from viewer.backends.auto_splats.values import VALUES
from viewer.bench.truth.shapes import AnalyticScene, Sphere
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.look import Look
from viewer.mesh.reference import trace
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

SIZE = (240, 180)
BALL = sphere(20_000)
FAR = np.array([[1.6, 0.3, 0.0], [-1.5, -0.4, 0.1]])  # from all others
CLOUD = PointCloud.from_arrays(np.concatenate([BALL.world(), FAR]))
CAMERA = Camera.orbit(CLOUD.bounds(), 30, 20, aspect=SIZE[0] / SIZE[1])
SCALE = 1.5


def expected(cloud: PointCloud) -> Mapping[str, NDArray]:
    """Each number by row, NaN where a point is not seen."""
    found = viewer.estimate_normals(cloud, CAMERA, size=SIZE)
    numbers = {
        "neighborhood": found.radii,
        "curvature": found.curvatures,
        "splat_radius": SCALE * found.splat_radii,
        "outlier": found.outliers,
    }
    by_row = {name: np.full(len(cloud), np.nan, np.float32) for name in VALUES}
    for name, values in by_row.items():
        values[found.rows] = numbers[name]
    return by_row


@pytest.mark.backend("auto_splats")
@pytest.mark.parametrize(("cloud", "cull"), [(CLOUD, False), (BALL, True)])
def test_each_pixel_has_the_number_of_its_point(
    draw: Callable[..., Surface], cloud: PointCloud, cull: bool
) -> None:
    numbers = expected(cloud)
    for name, kind in VALUES.items():
        params = {"radius_scale": SCALE, "cull": cull, "surface": "nearest"}  # splats at their points
        surface = draw(cloud, CAMERA, SIZE, "auto_splats", Look(color_by=name, light="flat"), params)
        seen = surface.row != NOTHING
        assert seen.sum() > 5000
        np.testing.assert_allclose(surface.value[seen], numbers[name][surface.row[seen]], rtol=1e-6)
        assert surface.value_kind is kind


@pytest.mark.backend("auto_splats")
@pytest.mark.parametrize("hidden_neighbors", [True, False])
def test_splats_close_the_surface_where_points_hide_each_other(
    draw: Callable[..., Surface], hidden_neighbors: bool
) -> None:
    """Some points to a pixel: neighborhoods have hidden ones, too, which have no splats."""
    dense = sphere(100_000)
    found = viewer.estimate_normals(
        dense,
        CAMERA,
        size=SIZE,
        search=viewer.NormalSearch(hidden_neighbors=hidden_neighbors, growth=100),
    )
    tree = cKDTree(dense.positions[found.neighbors].astype(np.float64))
    near = found.neighbors[tree.query(dense.positions[found.rows].astype(np.float64), k=10)[1]]
    shown = np.isin(near, found.rows).sum(axis=1)
    whole = found.counts == 10
    assert whole.mean() > 0.9
    shares = (found.splat_radii / (2 * found.radii / np.sqrt(shown)))[whole]
    assert np.mean((shares > 0.899) & (shares < 2.02)) > 0.99, "but where neighbors are equally far"
    assert (shown < 10).any() == hidden_neighbors
    surface = draw(dense, CAMERA, SIZE, "auto_splats", params={"hidden_neighbors": hidden_neighbors})
    truth = trace(AnalyticScene((Sphere(),)), CAMERA, SIZE)
    inside = truth.incidence() > 0.3  # steeper, points that are seen lie apart more one way than the other
    assert not (inside & (surface.row == NOTHING)).any(), "a hole"
    assert (surface.depth[inside] - truth.depth[inside]).max() < 0.1, (
        "the other side is seen through this one"
    )


@pytest.mark.backend("auto_splats")
def test_outliers_that_are_shown_are_marked(draw: Callable[..., Surface]) -> None:
    look = Look(color_by="outlier", light="flat")
    surface = draw(CLOUD, CAMERA, SIZE, "auto_splats", look, {"outliers": True})
    marked = surface.value == 1
    assert set(surface.row[marked]) == {len(BALL), len(BALL) + 1}
    assert (surface.value[~marked & (surface.row != NOTHING)] == 0).all()
    assert surface.color_range == (0, 1)


@pytest.mark.backend("auto_splats")
def test_another_number_takes_no_other_search(renderer: Renderer) -> None:
    surface, pose = Surface(renderer.gpu, SIZE), Pose(0, 0.0, "x", CLOUD)
    params = backend("auto_splats").params()
    for number, name in enumerate(VALUES):
        look = Look(color_by=name, light="flat")
        render_frame(renderer, Request(pose, CAMERA, "auto_splats", params, look), surface)
        assert ("neighborhoods" in surface.stats.skipped) == (number > 0)
        assert np.isfinite(surface.value[surface.row != NOTHING]).all()


@pytest.mark.backend("auto_splats")
@pytest.mark.parametrize("look", [Look(color_by="curvature"), Look(light="head"), Look(color_by="normal")])
def test_nothing_is_estimated_and_nothing_seen_is_drawn(renderer: Renderer, look: Look) -> None:
    own, pose = Renderer(renderer.gpu), Pose(0, 0.0, "x", CLOUD)
    surface = Surface(own.gpu, SIZE)
    for camera in (CAMERA, CAMERA.moved([100.0, 0, 0])):
        render_frame(own, Request(pose, camera, "auto_splats", look=look), surface)
    assert not np.isfinite(surface.depth).any()
    assert own.resident(pose).cloud.normals is None
    empty = Pose(0, 0.0, "x", PointCloud.from_arrays(np.zeros((0, 3))))
    render_frame(own, Request(empty, CAMERA, "auto_splats", look=look), surface)
    assert not np.isfinite(surface.depth).any()
    own.release()
