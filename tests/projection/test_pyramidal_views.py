"""Pyramidal projection of range views: polygons between samples, what is skipped, hidden, and blended."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from range_scenes import heights, looking_at, shape_view, straight_above
from scenes import NOTHING, rarely
from scipy.ndimage import binary_erosion, maximum_filter, minimum_filter

from viewer.bench.scenes.viewpoints import pod_camera, sample_near
from viewer.camera import Camera
from viewer.mesh.range_mesh import triangulated
from viewer.mesh.reference import trace
from viewer.picture.surface import Surface
from viewer.scan.range_view import RangeView

pytestmark = pytest.mark.backend("pyramidal")
Draw = Callable[..., Surface]
SIZE = (160, 120)
# Triangles of the finest level and samples of none, and nothing else.
QUADS: dict[str, Any] = {"primitive": "polygons", "lod": False, "fill": False}


def drawn(draw: Draw, views: tuple[RangeView, ...], camera: Camera, size=SIZE, **params: object) -> Surface:
    return draw(views, camera, size, "pyramidal", params=params)


def seen(surface: Surface) -> NDArray[np.bool_]:
    """(H, W), where something is."""
    return np.isfinite(surface.depth)


def middle(view: RangeView) -> NDArray[np.float64]:
    return sample_near(view, np.array([0.5, 0.5]))


# --- polygons -------------------------------------------------------------------------


@pytest.mark.parametrize("zoom", [0.5, *rarely(1.0), 2.3, *rarely(8.0), 30.0])
@pytest.mark.parametrize("name", ["plane", "sphere"])
@pytest.mark.parametrize("kind", ["z", "range", "height"])
def test_polygons_are_the_mesh_of_the_grid(draw: Draw, kind: str, name: str, zoom: float) -> None:
    """Ray by ray, to float32: no cracks, and beyond its outlines nothing but pixels that samples lie in."""
    view, _, _ = shape_view(name, kind)
    mesh, places = triangulated((view,)), view.positions()
    for aside in (0, 40):
        camera = pod_camera(view, middle(view), zoom, SIZE).orbited(aside, 5)
        exact = trace(mesh, camera, SIZE)
        surface = drawn(draw, (view,), camera, **QUADS)
        assert exact.covered.sum() > 500
        assert (exact.covered & ~seen(surface)).sum() <= 2, "edges through the middle of a pixel"
        pixels, depths = surface.view.project(places - surface.pose.origin)
        row, column = np.nonzero(seen(surface))
        depth, beneath = surface.depth[row, column], exact.depth[row, column]
        shown = rank(view, surface.id[row, column])
        away = np.abs(pixels[shown] - np.stack([column, row], axis=1) - 0.5).max(axis=1)
        assert away.max() < 5 * max(zoom, 1), "a corner of a triangle"
        is_sample = (away < 0.501) & np.isclose(depth, depths[shown], rtol=1e-6)
        is_mesh = np.isclose(depth, beneath, rtol=1e-6 if name == "plane" else 1e-5)  # more where edge on
        assert (is_sample | is_mesh).all()
        assert (depth[~is_mesh] < beneath[~is_mesh]).all()
        assert (~is_mesh).mean() < 0.05 * max(1, 1 / zoom)
        near = is_mesh & np.isfinite(beneath)
        assert np.quantile(np.abs(depth[near] / beneath[near] - 1), 0.98) < 5e-7


def rank(view: RangeView, numbers: NDArray[np.uint32]) -> NDArray[np.intp]:
    """Places of samples among the valid ones; all have to be."""
    valid = view.valid().ravel()
    assert valid[numbers].all()
    return (np.cumsum(valid) - 1)[numbers]


def test_surfaces_at_different_depths_are_not_joined(draw: Draw) -> None:
    depth = np.full((40, 60), -500.0)
    camera = Camera((300, 0, 900), (0, 0, 500), projection="orthographic", height=60)
    for step, joined in ((11.0, False), (9.0, True)):  # ten is the steepest step of a surface
        depth[:, 30:] = depth[0, 0] + step
        row = seen(drawn(draw, (heights(depth),), camera, (240, 160), **QUADS))[80]
        gap = np.diff(np.flatnonzero(row)).max() - 1
        wide = (0.8 + 0.6 * step) * 160 / 60
        assert gap == pytest.approx(0 if joined else wide, abs=1)


def test_samples_of_no_triangle_are_points(draw: Draw) -> None:
    """Alone, in a line, and before a surface: each has its own pixel, in which it lies."""
    depth, mask = np.full((24, 30), -500.0), np.zeros((24, 30), bool)
    mask[4:12, 4:12] = True
    mask[20, 4:20] = True
    mask[[2, 16, 8], [25, 25, 20]] = True
    depth[7, 7] = -600  # nearer to the eye than its surface
    camera, size = straight_above(mask.shape, 5.0)
    surface = drawn(draw, (heights(depth, mask),), camera, size, **QUADS)
    y, x = np.indices(surface.depth.shape)
    expected = (np.minimum(x, y) >= 5 * 4 + 2) & (np.maximum(x, y) <= 5 * 11 + 2)
    expected &= np.abs(x - (5 * 7 + 2)) + np.abs(y - (5 * 7 + 2)) >= 5
    alone = mask.copy()
    alone[4:12, 4:12] = False
    alone[7, 7] = True
    row, column = np.nonzero(alone)
    expected[5 * row + 2, 5 * column + 2] = True
    np.testing.assert_array_equal(seen(surface), expected)
    np.testing.assert_array_equal(surface.id[5 * row + 2, 5 * column + 2], 30 * row + column)
    np.testing.assert_array_equal(surface.depth[5 * row + 2, 5 * column + 2], 1000 + depth[alone])


def test_backs_are_left_out(draw: Draw) -> None:
    view, _, _ = shape_view("plane", "z")
    before = pod_camera(view, middle(view), 1.0, SIZE).orbited(20, 10)
    behind = before.orbited(180, 0)
    for primitive in ("points", "polygons"):
        params = {**QUADS, "primitive": primitive, "hide": False}
        whole, front = (drawn(draw, (view,), before, cull_back=cull, **params) for cull in (False, True))
        assert whole.depth.tobytes() == front.depth.tobytes()
        assert seen(drawn(draw, (view,), behind, **params)).mean() > 0.2
        assert seen(drawn(draw, (view,), behind, cull_back=True, **params)).sum() < 5


def test_levels_meet_without_holes(draw: Draw) -> None:
    """A plane of which some is near and some far, in samples of several levels: what does not fit between
    these is filled, and the surface is where it was."""
    y, x = np.mgrid[:300, :400]
    view = heights(-0.25 * x - 500.0 + 0.1 * y)
    mesh = triangulated((view,))
    for azimuth in (-40, -20, 30, 55):
        for near in (0.5, 1.5):
            camera = Camera.orbit(mesh.bounds, azimuth, 25, aspect=4 / 3, fov_y=60).zoomed(near)
            exact = trace(mesh, camera, SIZE)
            inside = binary_erosion(exact.covered, iterations=3, border_value=1)
            surface = drawn(draw, (view,), camera)
            assert seen(surface)[inside].all()
            filled = inside & (surface.id == NOTHING)
            assert filled.sum() < 0.01 * inside.sum()
            np.testing.assert_allclose(
                surface.depth[inside & ~filled], exact.depth[inside & ~filled], rtol=2e-6
            )
            assert (minimum_filter(exact.depth, 5)[filled] <= surface.depth[filled]).all()
            assert (
                maximum_filter(np.where(exact.covered, exact.depth, 0), 5)[filled] >= surface.depth[filled]
            ).all()


# --- what is skipped ------------------------------------------------------------------

QUICK = {("points", True, False), ("polygons", True, True)}  # together both values of what differs most


def assert_same(one: Surface, other: Surface) -> None:
    """Depths, numbers, levels and pictures are the same bits."""
    for name in ("depth", "id", "level"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    np.testing.assert_array_equal(one.image(), other.image())


@pytest.mark.parametrize(
    ("primitive", "lod", "cull_back"),
    [
        pytest.param(*ways, marks=() if ways in QUICK else pytest.mark.slow)
        for ways in product(("points", "polygons"), (True, False), (False, True))
    ],
)
def test_skipping_changes_no_picture(draw: Draw, primitive: str, lod: bool, cull_back: bool) -> None:
    """From before and behind, near and far, beside it, and with the pods' surfaces behind the eye."""
    rng = np.random.default_rng(8)
    shown = 0
    for kind in ("z", "range", "height"):
        first, second = (shape_view(name, kind)[0] for name in ("sphere", "plane"))
        rough = 0.02 * rng.standard_normal(first.depth.shape, np.float32)
        first = replace(first, depth=first.depth + rough)
        views = (first, replace(second, world_to_camera=looking_at((2.0, 1.5, 3.0), (0.5, 0.0, 0.0))))
        center = middle(first)
        for distance in (0.5, 2.0, 4.0, 15.0):
            away = rng.normal(size=3)
            eye = center + distance * away / np.linalg.norm(away)
            camera = Camera(
                tuple(eye), tuple(center + rng.normal(0, 0.3, 3)), fov_y=rng.choice([15, 50, 100])
            )
            for each in (camera, camera.orbited(100, 20, tuple(eye)), camera.projected("orthographic")):
                params = {"primitive": primitive, "lod": lod, "cull_back": cull_back}
                with_, without = (
                    drawn(draw, views, each, (96, 72), skip=skip, **params) for skip in (True, False)
                )
                assert_same(with_, without)
                shown += seen(with_).any()
    assert shown > 12
