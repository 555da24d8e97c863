"""Pyramidal projection: hidden samples, views blended, bare points, sizes and units that are odd."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from range_scenes import heights, shape_view, sphere_view, straight_above
from scenes import NOTHING, sphere, sphere_hits, sphere_mesh
from scipy.ndimage import binary_dilation, binary_erosion

from viewer.bench.scenes.viewpoints import pod_camera, sample_near
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.look import Look
from viewer.mesh.reference import trace
from viewer.mesh.triangles import Mesh
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.range_view import RangeView
from viewer.simulate.scanner import Faults, around, capture, rig

pytestmark = pytest.mark.backend("pyramidal")
Draw = Callable[..., Surface]


# --- hidden samples -------------------------------------------------------------------


def sheets(gap: float) -> tuple[RangeView, RangeView]:
    """A sheet with a sample for every 4 x 4 pixels, and one behind it with a sample for each."""
    front = heights(np.full((24, 24), -500.0), fx=0.25, fy=0.25, cx=12.0, cy=12.0)
    return front, heights(np.full((96, 96), -500.0 + gap))


@pytest.mark.parametrize("zoom", [1, 2, 3])
def test_nothing_behind_shows_through_a_sparse_surface(draw: Draw, zoom: int) -> None:
    camera, size = straight_above((96, 96), zoom)
    inside = slice(8 * zoom, -8 * zoom)
    for fill in (False, True):
        shown, hidden = (
            draw(
                sheets(100),
                camera,
                size,
                "pyramidal",
                params={"primitive": "points", "lod": False, "hide": hide, "fill": fill},
            ).depth[inside, inside]
            for hide in (False, True)
        )
        assert (shown[np.isfinite(shown)] > 599).mean() > 0.6
        np.testing.assert_allclose(hidden[np.isfinite(hidden)], 500, rtol=1e-6)
        assert np.isfinite(hidden).all() == fill


@pytest.mark.parametrize(("gap", "hides"), [(1, False), (7, False), (9, True), (13, True)])
def test_sheets_that_are_near_are_left_alone(draw: Draw, gap: float, hides: bool) -> None:
    """Two cells, of four pixels here, are tolerated."""
    camera, size = straight_above((96, 96))
    params = {"primitive": "points", "lod": False, "fill": False, "blend": "nearest"}
    surface = draw(sheets(gap), camera, size, "pyramidal", params=params)
    behind = (surface.depth == 500 + gap)[8:-8, 8:-8].mean()
    assert behind == pytest.approx(0 if hides else 15 / 16)


def random_sphere(count: int) -> PointCloud:
    """Points of the unit sphere that lie anywhere on it."""
    points = np.random.default_rng(0).normal(size=(count, 3))
    return PointCloud.from_arrays(points / np.linalg.norm(points, axis=1)[:, None])


@pytest.mark.parametrize("count", [62_500, 12_500, 3_000])
def test_random_points_hide_the_far_side(draw: Draw, count: int) -> None:
    """They are as far apart as 0.8, 2 and 4 pixels; gaps between them are wider here and there."""
    camera, size = Camera(eye=(0.0, 0.0, 4.0), target=(0.0, 0.0, 0.0), fov_y=32.0), (160, 120)
    depth = draw(random_sphere(count), camera, size, "pyramidal").depth
    exact = sphere_hits(camera, size)[0]
    covered = binary_erosion(np.isfinite(exact), iterations=3)
    assert np.isfinite(depth[covered]).mean() > 0.99
    seen = covered & np.isfinite(depth)
    assert (depth[seen] > exact[seen] + 0.2).mean() < 0.005


def test_a_hand_before_a_face_stays_before_it(draw: Draw) -> None:
    """At four pixels a sample, what is seen of the wrong layer becomes at least ten times less."""
    face, hand = sphere_mesh(48), sphere_mesh(24)
    points = np.concatenate([face.points.world(), 0.3 * hand.points.world() + [0.2, 0.1, 1.6]])
    mesh = Mesh(PointCloud.from_arrays(points), np.concatenate([face.faces, hand.faces + len(face.points)]))
    pods = rig(mesh.bounds, around(2), aspect=1.0)
    views = capture(mesh, pods, (90, 90), [Faults(), Faults()], unit="m")
    target = sample_near(views[0], np.array([0.5, 0.5]))
    wrong = {True: 0, False: 0}
    for aside in (0, 10, 20):
        camera = pod_camera(views[0], target, 4.0, (240, 240)).orbited(aside, 5)
        exact = trace(mesh, camera, (240, 240))
        is_hand = exact.covered & (exact.id >= len(face.faces))
        hand_inside = binary_erosion(
            is_hand, iterations=4
        )  # by a sample: its own outline is not known better
        for hide in wrong:
            params = {"primitive": "points", "hide": hide, "fill": False}
            depth = draw(tuple(views), camera, (240, 240), "pyramidal", params=params).depth
            behind = np.isfinite(depth) & exact.covered & (depth > exact.depth + 0.15)
            wrong[hide] += int((behind & hand_inside).sum())
    assert wrong[False] > 300
    assert wrong[True] <= wrong[False] / 10


# --- views blended --------------------------------------------------------------------


def flat(depth: float, gray: int, **fields: object) -> RangeView:
    """64 x 64 samples at a height, of one gray."""
    shape = (64, 64)
    return heights(np.full(shape, depth), color=np.full((*shape, 3), gray, np.uint8), **fields)


def blended(draw: Draw, one: RangeView, other: RangeView, blend: str, **params: object) -> Surface:
    camera, size = straight_above(one.depth.shape)
    return draw((one, other), camera, size, "pyramidal", params={"blend": blend, **params})


def test_views_of_one_surface_are_averaged(draw: Draw) -> None:
    """Depths, and colours in linear light."""
    for gap in (0.0, 1.0, 3.0):
        surface = blended(draw, flat(-500, 100), flat(-500 + gap, 200), "linear")
        np.testing.assert_allclose(surface.depth, 500 + gap / 2, rtol=1e-6)
        np.testing.assert_array_equal(surface.image()[..., :3], 160)
    apart = blended(draw, flat(-500, 100), flat(-490, 200), "linear")
    assert (apart.depth == 500).all()
    assert (apart.image()[..., :3] == 100).all()


def test_noise_of_two_views_is_less_by_the_root_of_two(draw: Draw) -> None:
    rng = np.random.default_rng(1)
    depths = -500 + 0.5 * rng.standard_normal((2, 64, 64))
    views = heights(depths[0]), heights(depths[1])
    alone, both = (blended(draw, *views, blend).depth[4:-4, 4:-4] for blend in ("nearest", "linear"))
    np.testing.assert_allclose(both, (1000 + depths.mean(axis=0))[4:-4, 4:-4], atol=0.02)
    assert np.std(both) == pytest.approx(0.5 / np.sqrt(2), rel=0.05)
    np.testing.assert_allclose(alone, (1000 + depths.min(axis=0))[4:-4, 4:-4], atol=1e-3)


def test_the_better_of_two_views_is_shown_as_it_is(draw: Draw) -> None:
    sure = np.full((64, 64), 0.2, np.float32)
    sure[:, :32] = 1
    one, other = flat(-500, 100, confidence=sure), flat(-499, 200, confidence=sure[:, ::-1].copy())
    surface = blended(draw, one, other, "best")
    left, right = surface.image()[8:-8, 8:24, :3], surface.image()[8:-8, 40:56, :3]
    assert (left == 100).all()
    assert (right == 200).all()
    np.testing.assert_allclose(surface.depth[8:-8, 40:56], 501, rtol=1e-6)
    nearest = blended(draw, one, other, "nearest")
    assert (nearest.image()[..., :3] == 100).all()
    assert (nearest.depth == 500).all()


def test_a_view_fades_towards_the_edge_of_its_mask(draw: Draw) -> None:
    mask = np.zeros((64, 64), bool)
    mask[:, :32] = True
    row = blended(draw, flat(-500, 100), flat(-500, 200, mask=mask), "linear").image()[32, :, 0].astype(int)
    assert (row[:24] == 160).all()
    assert (row[32:] == 100).all()
    assert (np.diff(row) <= 0).all()
    assert np.diff(row).min() >= -40, "without falling it would be 60"


# --- points without views -------------------------------------------------------------

CLOUD = sphere(3000)
CAMERA = Camera.orbit(CLOUD.bounds(), 30, 20, aspect=4 / 3)
SIZE = (160, 120)


def test_bare_points_are_shown_and_what_is_between_them_is_filled(draw: Draw) -> None:
    plain = draw(CLOUD, CAMERA, SIZE, "points", params={"point_size": 1})
    surface = draw(CLOUD, CAMERA, SIZE, "pyramidal")
    measured = surface.level == 0
    np.testing.assert_array_equal(surface.id != NOTHING, measured)
    np.testing.assert_array_equal(surface.id[measured], plain.id[measured])
    assert surface.depth[measured].tobytes() == plain.depth[measured].tobytes()
    behind = (plain.id != NOTHING) & ~measured
    assert (surface.depth[behind] < plain.depth[behind]).mean() > 0.95, "what was hidden is covered"
    exact = trace(sphere_mesh(64), CAMERA, SIZE)
    both = exact.covered & np.isfinite(surface.depth)
    assert both.sum() > 0.97 * exact.covered.sum()
    error = np.abs(surface.depth[both] - exact.depth[both])
    assert np.quantile(error, 0.98) < 0.1
    assert error[surface.level[both] > 0].max() < 0.2
    assert not (np.isfinite(surface.depth) & ~binary_dilation(exact.covered, iterations=4)).any(), (
        "two spacings"
    )


@pytest.mark.parametrize("gap", [10, 13, 15])
def test_no_bar_joins_two_legs(draw: Draw, gap: int) -> None:
    """Upright half cylinders of points 3 pixels apart, with a gap of some pixels between them."""
    rng, legs = np.random.default_rng(0), []
    for side in (-1, 1):
        turn, y = np.pi * rng.random(2500), 2 * rng.random(2500) - 1
        x = side * (0.25 + gap / 200) + 0.25 * np.cos(turn)
        legs.append(np.stack([x, y, 0.25 * np.sin(turn)], axis=1))
    camera = Camera(projection="orthographic", height=2.4)
    surface = draw(PointCloud.from_arrays(np.concatenate(legs)), camera, (240, 240), "pyramidal")
    there = np.isfinite(surface.depth)[30:-30]
    assert there[:, 70:105].mean() > 0.99
    assert there[:, 135:170].mean() > 0.99
    assert not there[:, 119:121].any()


def test_levels_are_shown_one_by_one(draw: Draw) -> None:
    def levels(**params: object) -> set[int]:
        return set(np.unique(draw(CLOUD, CAMERA, SIZE, "pyramidal", params=params).level)) - {255}

    assert levels(fill=False) == {0}
    assert levels(level_0=False) <= {1, 2, 3, 4}
    assert 0 not in levels(level_0=False)
    assert levels(level_1=False, level_2=False) <= {0, 3, 4}
    assert levels(level_0=False, fill=False) == set()
    none = {f"level_{level}": False for level in range(5)}
    assert levels(**none) == set()


def test_first_level_shows_the_samples_of_the_pyramid(draw: Draw) -> None:
    depth = np.arange(64.0).reshape(8, 8) / 8 - 500
    mask = np.ones((8, 8), bool)
    mask[:2, :2] = False
    camera, _ = straight_above((8, 8))
    params = {"primitive": "points", "lod": False, "fill": False, "hide": False, "first_level": 1}
    surface = draw((heights(depth, mask),), camera, (4, 4), "pyramidal", params=params)
    expected = 1000 + depth.reshape(4, 2, 4, 2).mean(axis=(1, 3))
    expected[0, 0] = np.inf
    np.testing.assert_allclose(surface.depth, expected, rtol=1e-6)


# --- the same bits, and what is odd ---------------------------------------------------


def picture(renderer: Renderer, surface: Surface, views: tuple[RangeView, ...], camera: Camera) -> bytes:
    request = Request(Pose.of(0, 0.0, "test", views), camera, "pyramidal", look=Look())
    while render_frame(renderer, request, surface):
        pass
    return b"".join(each.tobytes() for each in (surface.depth, surface.id, surface.level, surface.image()))


@pytest.mark.parametrize("size", [(1, 1), (1, 37), (53, 1), (97, 61)])
def test_the_same_bits_whatever_was_drawn_before(renderer: Renderer, size: tuple[int, int]) -> None:
    """On one surface, of poses with other numbers and sizes of views."""
    camera = Camera((2.0, 1.0, 4.0), (0, 0, 0), fov_y=30)
    left, right = sphere_view((0, 0, 4)), sphere_view((2, 0, 4), size=(33, 70), name="right")
    scans = [(left,), (left, right), (right,), (right, left, right)]
    surface = Surface(renderer.gpu, size)
    first = [picture(renderer, surface, views, camera) for views in scans]
    again = [picture(renderer, surface, views, camera) for views in reversed(scans)]
    assert first == again[::-1]
    assert first[0] == picture(renderer, Surface(renderer.gpu, size), scans[0], camera)


@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (40, 1), (2, 2)])
@pytest.mark.parametrize("primitive", ["points", "polygons"])
def test_small_views(draw: Draw, shape: tuple[int, int], primitive: str) -> None:
    camera, _ = straight_above((48, 48))
    surface = draw(
        (heights(np.full(shape, -500)),), camera, (48, 48), "pyramidal", params={"primitive": primitive}
    )
    assert len(np.unique(surface.id)) == shape[0] * shape[1] + 1
    assert (surface.depth[np.isfinite(surface.depth)] == 500).all()


@pytest.mark.parametrize("primitive", ["points", "polygons"])
def test_one_sample_among_none(draw: Draw, primitive: str) -> None:
    depth = np.full((40, 40), np.nan, np.float32)
    depth[20, 21] = -500
    camera, size = straight_above(depth.shape)
    full = np.full_like(depth, -500)
    for view in (heights(depth), heights(full, np.isfinite(depth))):
        surface = draw((view,), camera, size, "pyramidal", params={"primitive": primitive})
        assert np.argwhere(np.isfinite(surface.depth)).tolist() == [[20, 21]]
        assert surface.id[20, 21] == 20 * 40 + 21


@pytest.mark.parametrize("primitive", ["points", "polygons"])
def test_near_plane_and_eye_within_the_surface(draw: Draw, primitive: str) -> None:
    view, _, _ = shape_view("plane", "z")
    center = sample_near(view, np.array([0.5, 0.5]))
    for near in (None, 0.3):
        camera = Camera(tuple(center), tuple(center + np.array([0.3, -0.1, -1.0])), fov_y=90, near=near)
        surface = draw((view,), camera, SIZE, "pyramidal", params={"primitive": primitive})
        shown = surface.depth[np.isfinite(surface.depth)]
        assert (shown >= surface.view.near * (1 - 1e-6)).all()
        assert not np.isnan(surface.depth).any()


@pytest.mark.parametrize("primitive", ["points", "polygons"])
@pytest.mark.parametrize("factor", [2.0**-20, 2.0**20])
def test_units_make_no_difference(draw: Draw, primitive: str, factor: float) -> None:
    views = sphere_view((0, 0, 4)), sphere_view((2, 0, 4), name="right")
    camera = Camera((1.0, 0.5, 5.0), (0, 0, 0), fov_y=30)
    large = replace(camera, eye=tuple(factor * np.array(camera.eye)))
    params = {"primitive": primitive}
    one = draw(views, camera, SIZE, "pyramidal", params=params)
    other = draw(tuple(view.scaled(factor, "x") for view in views), large, SIZE, "pyramidal", params=params)
    same = (one.id == other.id) & (one.level == other.level)
    assert same.mean() > 0.999
    covered = same & np.isfinite(one.depth)
    np.testing.assert_allclose(other.depth[covered], factor * one.depth[covered], rtol=1e-5)
