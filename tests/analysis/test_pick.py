"""Picking gives what the pixel shows, in scan units, on scenes with exactly known answers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import filling
import numpy as np
import pytest
from scenes import looking_down_z, plane, rarely, sphere, sphere_hits

from viewer.analysis.pick import are_seen, before_gap, is_seen, pick
from viewer.camera import Camera
from viewer.picture.surface import EMPTY, NOTHING, Surface
from viewer.scan.points import PointCloud
from viewer.view import View

Draw = Callable[..., Surface]
SIZE = (60, 40)
# Half the height of the picture is one unit, at depth 4 in perspective.
CAMERAS = {
    "perspective": looking_down_z(fov_y=2 * np.degrees(np.arctan(1 / 4))),
    "orthographic": looking_down_z(projection="orthographic", height=2.0),
}


@pytest.mark.parametrize("projection", CAMERAS)
@pytest.mark.parametrize("pixel", [(0, 0), (30, 20), (59, 39), (7, 31)])
def test_a_plane_is_picked_at_the_pixels_centre(draw: Draw, projection: str, pixel: tuple[int, int]) -> None:
    surface = draw(plane(100, depth=4.0), CAMERAS[projection], SIZE, "surfels")
    picked = pick(surface, *pixel)
    assert picked is not None
    expected = [(pixel[0] + 0.5 - 30) / 20, (20 - pixel[1] - 0.5) / 20, -4.0]
    np.testing.assert_allclose(picked.position, expected, rtol=0, atol=4 * 2**-22)
    assert picked.measured
    assert picked.spacing == pytest.approx(0.05, rel=0.2)


@pytest.mark.parametrize("projection", CAMERAS)
def test_a_sphere_is_picked_where_rays_meet_it(draw: Draw, projection: str) -> None:
    cloud = sphere(5_000)
    camera = Camera.orbit(cloud.bounds(), 25, 40, projection=projection)
    surface = draw(cloud, camera, SIZE, "surfels")
    depths, normals = sphere_hits(camera, SIZE)
    for pixel in [(30, 20), (22, 14), (36, 25)]:
        picked = pick(surface, *pixel)
        assert picked is not None
        spacing = np.sqrt(4 * np.pi / 5_000)
        assert np.linalg.norm(picked.position) == pytest.approx(1, abs=0.5 * spacing)
        depth = -(camera.rotation() @ (picked.position - camera.eye))[2]
        assert depth == pytest.approx(depths[pixel[::-1]], abs=spacing)
        assert picked.normal @ normals[pixel[::-1]] > 0.99, "never the far side"
        np.testing.assert_array_equal(picked.point, cloud.world(picked.row))
        np.testing.assert_array_equal(picked.normal, cloud.normals[picked.row])
        np.testing.assert_array_equal(picked.color, cloud.colors[picked.row])
        assert picked.scalars == {"height": cloud.scalars["height"][picked.row]}
        assert np.linalg.norm(picked.position - picked.point) < 2 * spacing
        assert picked.spacing == pytest.approx(spacing, rel=0.2)


RENDERERS = {
    "points of a pixel": ("points", {"point_size": 1}),
    "points of three": ("points", {"point_size": 3}),
    "points that touch": ("points", {"point_size": 0}),
    "surfels": ("surfels", {}),
    "voxels": ("voxels", {}),
    "auto splats": ("auto_splats", {}),
}


@pytest.mark.parametrize(
    "which",
    [
        "points that touch",
        "surfels",
        *rarely("voxels", "points of a pixel", "points of three", "auto splats"),
    ],
)
def test_picks_are_on_the_surface_though_the_nearest_wins_a_pixel(draw: Draw, which: str) -> None:
    """Squares of three pixels write depths that are 0.07 spacings before it in the median, those that touch
    0.2."""
    name, params = RENDERERS[which]
    cloud, size = sphere(100_000), (320, 240)
    spacing = np.sqrt(4 * np.pi / len(cloud))
    camera = Camera.orbit(cloud.bounds(), 25, 40)
    camera = replace(camera, fov_y=camera.fov_y / 3)
    surface = draw(cloud, camera, size, name, params=params)
    truth, levels = sphere_hits(camera, size)[0], surface.level
    nearer, held = [], []
    for y, x in np.random.default_rng(2).integers([10, 10], [230, 310], (200, 2)).tolist():
        meant = before_gap(surface, x, y)
        if levels[meant[1], meant[0]] != 0:
            continue
        picked = pick(surface, x, y, shown=meant)
        assert picked is not None
        assert picked.uncertainty is not None
        off = -(camera.rotation() @ (picked.position - camera.eye))[2] - truth[y, x]
        nearer.append(-off)
        held.append(abs(off) <= picked.uncertainty)
    assert len(held) > 50
    assert abs(np.median(nearer)) < 1e-3 * spacing
    assert np.percentile(np.abs(nearer), 90) < 1e-2 * spacing
    assert np.mean(held) > 0.93


NOISE = 0.3  # spacings


@pytest.mark.parametrize("which", ["surfels", "points of a pixel", *rarely("voxels", "auto splats")])
def test_under_noise_picks_are_on_the_surface_within_what_is_said(draw: Draw, which: str) -> None:
    """The nearest of noisy points win the pixels, but all points of the cloud around tell of the surface."""
    name, params = RENDERERS[which]
    exact, size = sphere(20_000), (160, 120)
    spacing = np.sqrt(4 * np.pi / len(exact))
    away = 1 + np.random.default_rng(5).normal(scale=NOISE * spacing, size=(len(exact), 1))
    cloud = PointCloud.from_arrays(exact.world() * away, normals=exact.normals)
    camera = Camera.orbit(cloud.bounds(), 25, 40)
    surface = draw(cloud, camera, size, name, params=params)
    truth, shown = sphere_hits(camera, size)[0], surface.level == 0
    off, held = [], []
    facing = np.isfinite(truth) & (truth < np.nanmin(truth) + 0.5) & shown
    for y, x in np.argwhere(facing)[:: max(1, int(facing.sum()) // 150)].tolist():
        picked = pick(surface, x, y, shown=before_gap(surface, x, y))
        assert picked is not None
        assert picked.uncertainty is not None
        off.append(-(camera.rotation() @ (picked.position - camera.eye))[2] - truth[y, x])
        held.append(abs(off[-1]) <= picked.uncertainty)
    assert len(held) > 100
    assert abs(np.mean(off)) < 0.1 * spacing
    assert np.mean(held) > 0.93


def test_small_points_show_the_far_side_and_picks_the_near_one(draw: Draw) -> None:
    cloud, size = sphere(4_000), (240, 180)
    camera = Camera.orbit(cloud.bounds(), 25, 40)
    surface = draw(cloud, camera, size, "points", params={"point_size": 1})
    truth = sphere_hits(camera, size)[0]
    far = np.isfinite(truth) & (truth < np.nanmin(truth) + 0.4) & (surface.depth > truth + 1)
    assert far.sum() > 300
    for y, x in np.argwhere(far & (surface.level == 0))[::40].tolist():
        picked = pick(surface, x, y, shown=before_gap(surface, x, y))
        assert picked is not None
        assert np.linalg.norm(picked.position) == pytest.approx(1, abs=0.01)
        assert (camera.eye - picked.position) @ picked.position > 0, "on the near side"
        assert not picked.at_outline


@pytest.mark.parametrize("projection", CAMERAS)
def test_every_point_is_picked_at_its_own_pixel(draw: Draw, projection: str) -> None:
    rng = np.random.default_rng(3)
    points = rng.uniform([-1, -1, -5], [1, 1, -3], (40, 3))
    points[[4, 5, 17]] = np.nan, np.inf, np.nan
    cloud = PointCloud.from_arrays(points)
    surface = draw(cloud, CAMERAS[projection], SIZE)
    found = {}
    for y in range(SIZE[1]):
        for x in range(SIZE[0]):
            if picked := pick(surface, x, y, spacing=False):
                found[picked.id] = picked
                assert surface.id[y, x] == picked.id
                if not picked.neighbors:
                    assert surface.depth[y, x] == pytest.approx(-picked.position[2])
    assert len(found) > 25
    assert {4, 5, 17}.isdisjoint(found)
    alone = {id_: picked for id_, picked in found.items() if not picked.neighbors}
    assert len(alone) > 0.8 * len(found), "points that fill space are no surface"
    for id_, picked in alone.items():
        np.testing.assert_allclose(picked.point, points[id_], atol=1e-6)
        assert np.abs(picked.position - points[id_]).max() < 0.05, "within the pixel"
        assert (picked.color, picked.normal, picked.scalars, picked.spacing) == (None, None, {}, None)


@pytest.mark.parametrize("projection", CAMERAS)
def test_far_from_the_origin_nothing_is_lost(draw: Draw, projection: str) -> None:
    far = np.array([1e7, -2e7, 1e7])
    near = plane(100, depth=4.0)
    positions = near.positions.astype(np.float64) + far
    cloud = PointCloud.from_arrays(positions, normals=near.normals, radii=near.radii)
    camera = CAMERAS[projection]
    moved = Camera(**{**camera.to_json(), "eye": far, "target": far - np.array([0, 0, 1])})
    picked = pick(draw(cloud, moved, SIZE, "surfels"), 7, 31)
    assert picked is not None
    # Half a step of float32 at depth 4, and of float64 at 2e7.
    np.testing.assert_allclose(picked.position - far, [-1.125, -0.575, -4.0], rtol=0, atol=1e-6)
    assert np.linalg.norm(picked.point - picked.position) < 0.075
    assert picked.spacing == pytest.approx(0.05, rel=0.2)


def test_a_pixel_that_shows_nothing_gives_none(draw: Draw) -> None:
    surface = draw(PointCloud.from_arrays([[0.0, 0, -4]]), CAMERAS["perspective"], SIZE)
    assert pick(surface, 0, 0) is None
    for outside in [(-1, 20), (60, 20), (30, -1), (30, 40)]:
        assert pick(surface, *outside) is None
    picked = pick(surface, 30, 20)
    assert picked is not None
    assert picked.spacing is None, "one point has no neighbours"


def test_a_texel_is_what_the_whole_pictures_hold(draw: Draw) -> None:
    surface = draw(sphere(3000), Camera.orbit(sphere(3000).bounds()), SIZE)
    depth, row, level = surface.depth, surface.row, surface.level
    assert 0 < np.count_nonzero(level == EMPTY) < level.size
    for y, x in np.ndindex(*depth.shape):
        assert surface.texel(x, y) == (depth[y, x], row[y, x], level[y, x])


@pytest.mark.parametrize("projection", CAMERAS)
def test_what_a_gap_between_points_shows_is_not_meant_but_what_is_round_it(
    draw: Draw, projection: str
) -> None:
    front = plane(6, depth=3.0, spacing=0.15)  # 3 pixels or more between points of one pixel
    behind = plane(160, depth=4.0, spacing=0.02)
    cloud = PointCloud.from_arrays(np.concatenate([front.world(), behind.world()]))
    surface = draw(cloud, CAMERAS[projection], SIZE)
    for y, x in np.ndindex(5, 5):
        meant = before_gap(surface, 28 + x, 18 + y)
        assert surface.depth[meant[1], meant[0]] == pytest.approx(3.0)
        assert np.hypot(meant[0] - 28 - x, meant[1] - 18 - y) < 4, "the nearest point of the front"
    across, down = np.flatnonzero((surface.depth < 3.5).any(axis=0)), 20
    for x in (*range(across[0]), *range(across[-1] + 1, SIZE[0])):
        assert before_gap(surface, int(x), down) == (x, down), "beside an edge nothing is seen through"
    for place in [(0, 0), (SIZE[0] - 1, SIZE[1] - 1), (-1, 3), (SIZE[0], 3)]:
        assert before_gap(surface, *place) == place


@pytest.mark.parametrize("projection", CAMERAS)
@pytest.mark.parametrize("spacing", [0.15, 0.6], ids=["close", "sparse"])
def test_an_empty_pixel_between_points_means_the_surface_of_these(
    draw: Draw, projection: str, spacing: float
) -> None:
    surface = draw(plane(6, depth=4.0, spacing=spacing), CAMERAS[projection], SIZE, "points")
    across, down = (np.flatnonzero((surface.level != EMPTY).any(axis=axis)) for axis in (0, 1))
    middle = np.s_[down[1] : down[-2], across[1] : across[-2]]
    empty = np.argwhere(surface.level[middle] == EMPTY) + np.array([down[1], across[1]])
    assert len(empty) > 20
    for y, x in empty.tolist():
        meant = before_gap(surface, x, y)
        assert surface.level[meant[1], meant[0]] == 0
        picked = pick(surface, x, y, shown=meant)
        assert picked is not None
        np.testing.assert_allclose(picked.position[2], -4.0, atol=1e-5)
    for x in (across[0] - 1, across[-1] + 1):
        assert pick(surface, int(x), 20, shown=before_gap(surface, int(x), 20)) is None, "beside the points"


def test_on_a_slope_every_pixel_is_meant(draw: Draw) -> None:
    cloud = sphere(20_000)
    surface = draw(cloud, Camera.orbit(cloud.bounds()), SIZE, "surfels")
    for y, x in np.argwhere(surface.level == 0):
        assert before_gap(surface, int(x), int(y)) == (x, y)


@pytest.mark.parametrize("place", [(0, 0), (5, 39), (59, 20), (30, 20)])
def test_depths_round_a_pixel_are_those_of_the_picture(draw: Draw, place: tuple[int, int]) -> None:
    surface = draw(sphere(3000), Camera.orbit(sphere(3000).bounds()), SIZE)
    around = np.pad(surface.depth, 3, constant_values=np.inf)[place[1] :, place[0] :][:7, :7]
    np.testing.assert_array_equal(surface.depth_around(*place, 3), around)


@pytest.mark.parametrize("projection", CAMERAS)
def test_a_filled_pixel_has_a_place_and_no_point(draw: Draw, projection: str) -> None:
    surface = draw(plane(10, depth=4.0, spacing=0.25), CAMERAS[projection], SIZE, filling.BACKEND)
    levels = surface.level
    assert {*np.unique(levels)} == {0, 1, 2, 3, EMPTY}, "points are 5 pixels apart"
    for y, x in np.argwhere((levels > 0) & (levels != EMPTY))[::37].tolist():
        picked = pick(surface, x, y)
        assert picked is not None
        assert (picked.level, picked.measured) == (levels[y, x], False)
        assert picked.row is picked.id is picked.point is picked.spacing is None
        np.testing.assert_allclose(picked.position, [(x - 29.5) / 20, (19.5 - y) / 20, -4.0], atol=1e-6)
        assert surface.texel(x, y) == (surface.depth[y, x], NOTHING, levels[y, x])


def test_what_was_picked_does_not_hold_the_scan(draw: Draw) -> None:
    cloud = sphere(3000)
    picked = pick(draw(cloud, Camera.orbit(cloud.bounds()), SIZE), 30, 20)
    assert picked is not None
    assert picked.color.base is None
    assert picked.normal.base is None
    assert not np.shares_memory(picked.point, cloud.positions)


@pytest.mark.parametrize("projection", CAMERAS)
def test_unprojecting_undoes_projecting(projection: str) -> None:
    cloud = sphere(100, center=(3, -2, 1))
    camera = Camera.orbit(cloud.bounds(), 200, -30, projection=projection)
    view = View.of(camera, SIZE, np.array([1.0, 2, 3]), cloud.bounds())
    points = cloud.positions - np.array([1.0, 2, 3])
    np.testing.assert_allclose(view.unproject(*view.project(points)), points, atol=1e-12)


@pytest.mark.parametrize("projection", CAMERAS)
def test_a_place_is_seen_unless_something_is_before_it(draw: Draw, projection: str) -> None:
    surface = draw(plane(30, depth=4.0), CAMERAS[projection], SIZE, "surfels")  # 1.5 wide, of 3 in view
    assert is_seen(surface, (0.2, 0.1, -4.0), 0.01)
    assert is_seen(surface, (0.2, 0.1, -3.0), 0.01), "before the plane"
    assert not is_seen(surface, (0.2, 0.1, -5.0), 0.01)
    assert is_seen(surface, (0.2, 0.1, -5.0), 1.1)
    assert is_seen(surface, (1.3, 0, -4.0), 0.0), "beside the plane, where nothing is"
    assert not is_seen(surface, (1.9, 0, -4.0), 0.0), "outside the picture"
    assert not is_seen(surface, (0, 0, 2.0), 10.0), "behind the eye"
    places = np.random.default_rng(0).uniform((-2, -2, -6), (2, 2, 2), (200, 3))
    slacks = np.tile((0.01, 1.1), 100)
    seen = [is_seen(surface, place, slack) for place, slack in zip(places, slacks, strict=True)]
    assert are_seen(surface, places, slacks).tolist() == seen
    assert not are_seen(surface, np.array([[np.nan, 0, -4]]), np.ones(1)).any(), "nowhere"
