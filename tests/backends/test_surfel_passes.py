"""Surfels in one pass and in two: what is blended, what stays exact, what enlarging closes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hardware import at_borders
from scenes import NOTHING, looking_down_z, plane, rarely, sphere
from splat_scenes import assert_covers_the_same
from test_instancing import assert_blends_alike

from viewer.analysis.pick import pick
from viewer.backends import backend
from viewer.bench import metrics
from viewer.bench.judge import Judge, Walk
from viewer.bench.truth import tessellation
from viewer.bench.truth.shapes import AnalyticScene, Sphere
from viewer.bench.truth.surface import reference_surface
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.look import Look
from viewer.mesh.reference import trace, visible_pixels
from viewer.picture.surface import Surface
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.simulate.scanner import Faults, around, capture, rig
from viewer.splatting.amplify import FEEDS
from viewer.srgb import bytes_from_linear, linear_from_bytes

pytestmark = pytest.mark.backend("surfels")
Draw = Callable[..., Surface]
SIZE = (240, 180)
INSTANCING = ("tiles", "gs", "tbo")
RED, GREEN = (255, 0, 0), (0, 255, 0)
every_feed = pytest.mark.parametrize("instancing", INSTANCING)


def surfels(draw: Draw, cloud: PointCloud, camera: Camera, size=SIZE, look=None, **params: object) -> Surface:
    return draw(cloud, camera, size, "surfels", look, params)


def discs(depths: list[float], colors: list[tuple[int, int, int]], radius: float = 1.0) -> PointCloud:
    """Discs before the eye of `looking_down_z`, one behind another."""
    return PointCloud.from_arrays(
        [[0.0, 0.0, -depth] for depth in depths],
        normals=[[0, 0, 1]] * len(depths),
        colors=np.array(colors, np.uint8),
        radii=[radius] * len(depths),
    )


def _bytes_of(colors: np.ndarray) -> np.ndarray:
    """sRGB from 0 to 1, (n, 3), as a cloud stores it."""
    return np.column_stack([np.rint(255 * colors), np.full(len(colors), 255)]).astype(np.uint8)


def shown(surface: Surface, x: int, y: int) -> list[int]:
    return [int(channel) for channel in surface.image()[y, x, :3]]


@every_feed
@pytest.mark.parametrize("passes", ["two", "two_large"])
@pytest.mark.parametrize("enlarge", [1.0, 2.0])
def test_a_sphere_of_one_colour_is_one_colour(
    draw: Draw, instancing: str, passes: str, enlarge: float
) -> None:
    exact = sphere(8000)
    cloud = PointCloud.from_arrays(
        exact.positions, normals=exact.normals, radii=exact.radii, colors=np.full((8000, 3), 0.6)
    )
    camera = Camera.orbit(cloud.bounds(), 30, 20, aspect=4 / 3)
    surface = surfels(draw, cloud, camera, instancing=instancing, passes=passes, enlarge=enlarge)
    inside = surface.image()[surface.row != NOTHING][:, :3]
    assert len(inside) > 5000
    assert inside.std(axis=0).max() < 1, "of 255"


@every_feed
@pytest.mark.parametrize("projection", ["perspective", *rarely("orthographic")])
def test_a_sphere_is_exact(draw: Draw, instancing: str, projection: str) -> None:
    """Zero holes; depth within 5 % of a pixel and the discs' sagitta; shading within 40 dB."""
    cloud, look = sphere(20_000), Look(light="head", color_by="plain")
    camera = Camera.orbit(cloud.bounds(), 40, 25, aspect=4 / 3, projection=projection)
    truth = trace(AnalyticScene((Sphere(),)), camera, SIZE)
    inside = truth.covered
    for passes, enlarge in (("one", 1.0), ("two", 1.0), ("two", 2.0)):
        surface = surfels(
            draw, cloud, camera, look=look, instancing=instancing, passes=passes, enlarge=enlarge
        )
        drawn = surface.row != NOTHING
        assert not (inside & ~drawn).any(), "a hole"
        # Along the normal, in which discs are off by their sagitta.
        error = (surface.depth[inside] - truth.depth[inside]) * truth.incidence()[inside]
        pixel = float(np.median(truth.view.footprint(truth.depth[inside])))
        sagitta = 1 - np.sqrt(1 - float(cloud.radii[0]) ** 2)
        assert np.sqrt((error**2).mean()) < 0.05 * pixel + sagitta
        reference = reference_surface(truth, surface.gpu, look).image()
        assert metrics.color(surface.image(), reference, inside)["psnr"] >= 40


def test_discs_that_are_seen_edge_on_weigh_no_more_than_others(draw: Draw) -> None:
    """Of the demo from this eye one does at the outline, whose form is below zero by rounding."""
    cloud = open_scan("demo").pose(0).cloud
    camera = Camera(
        eye=(296.65148770755775, 181.91379588975124, 640.5755395931167),
        target=(-0.002124786376953125, -6.171062469482422, 4.399814605712891),
    )
    params = {"passes": "two", "radius_scale": 2.5}
    tiles, quads = (
        surfels(draw, cloud, camera, (480, 320), instancing=way, **params) for way in ("tiles", "vbo")
    )
    assert np.count_nonzero(np.abs(tiles.color - quads.color).max(axis=-1) >= 0.02) <= at_borders(tiles)


@pytest.mark.slow
def test_enlarging_closes_gaps_and_keeps_the_outline(draw: Draw) -> None:
    """Of what two pods with noise saw: at most half as many holes; outline and spill within a pixel."""
    mesh, size = tessellation.torus_mesh(), (240, 160)
    pods = rig(mesh.bounds, around(2), aspect=4 / 3, up="+y")
    noise = Faults(noise=0.5 / 190 * mesh.bounds.radius)  # 0.5 mm of a head
    pose = Pose.of(0, 0.0, "", capture(mesh, pods, (320, 240), [noise] * 2, seed=0, frame=0))
    camera = Camera.orbit(mesh.bounds, 20, 30, aspect=1.5)
    truth = trace(mesh, camera, size)
    scanned = visible_pixels(mesh, truth, pods)
    outline = np.count_nonzero(metrics._outline(truth.covered))
    holes, spill, boundary = [], [], []
    for enlarge in (1.0, 2.0):
        surface = surfels(draw, pose.cloud, camera, size, passes="two", enlarge=enlarge, radius="uniform")
        drawn = np.isfinite(surface.depth)
        holes.append(np.count_nonzero(scanned & ~drawn))
        spill.append(np.count_nonzero(drawn & ~truth.covered) / outline)
        boundary.append(metrics.coverage(drawn, truth.covered)["boundary_mean"])
    assert holes[0] > 100, "no gaps to close"
    assert holes[1] <= holes[0] / 2
    assert spill[1] < spill[0] + 1
    assert boundary[1] < boundary[0] + 1


@every_feed
def test_a_slit_is_closed_but_the_outline_stays(draw: Draw, instancing: str) -> None:
    whole = plane(40, 3.0)
    x = whole.positions[:, 0] + whole.origin[0]
    kept = np.abs(x) > 0.1  # four columns of points are gone
    cloud = PointCloud.from_arrays(
        (whole.positions + whole.origin)[kept], normals=whole.normals[kept], radii=whole.radii[kept]
    )
    camera, size = looking_down_z(fov_y=50), (200, 200)
    plain, large = (
        np.isfinite(surfels(draw, cloud, camera, size, instancing=instancing, passes="two", enlarge=e).depth)
        for e in (1.0, 2.0)
    )
    assert not plain[60:140, 97:103].any()
    assert large[60:140, 90:110].all()
    grown = large & ~plain
    grown[60:140, 90:110] = False
    across = np.count_nonzero(metrics._outline(plain))
    assert np.count_nonzero(grown) < across, "less than a pixel"


@every_feed
@pytest.mark.parametrize("color_by", ["auto", "height", "q"])
def test_what_is_filled_has_a_level_and_no_point(draw: Draw, instancing: str, color_by: str) -> None:
    whole = plane(40, 3.0)
    kept = np.abs(whole.world()[:, 0]) > 0.1
    cloud = PointCloud.from_arrays(
        whole.world()[kept],
        normals=whole.normals[kept],
        radii=whole.radii[kept],
        colors=np.full((int(kept.sum()), 3), [200, 90, 40], np.uint8),
        scalars={"q": 5 + whole.world()[kept, 1]},
    )
    camera, size, look = looking_down_z(fov_y=50), (200, 200), Look(light="flat", color_by=color_by)
    plain, large = (
        surfels(draw, cloud, camera, size, look, instancing=instancing, passes="two", enlarge=e)
        for e in (1.0, 2.0)
    )
    filled = np.isfinite(large.depth) & ~np.isfinite(plain.depth)
    assert filled[60:140, 97:103].all()
    assert (large.level[filled] == 1).all()
    assert (large.row[filled] == NOTHING).all()
    assert (large.id[filled] == NOTHING).all()
    np.testing.assert_array_equal(large.row[~filled], plain.row[~filled])
    assert (large.level[~filled] == plain.level[~filled]).all()
    np.testing.assert_allclose(large.depth[filled], 3.0, rtol=1e-6)
    picked = pick(large, 100, 100)
    assert picked is not None
    assert not picked.measured
    if color_by == "auto":
        assert (large.image()[filled][:, :3] == [200, 90, 40]).all()
    else:
        y = large.view.unproject(np.argwhere(filled)[:, ::-1] + 0.5, large.depth[filled])[:, 1]
        expected = y + cloud.origin[1] + (5 if color_by == "q" else 0)
        np.testing.assert_allclose(large.value[filled], expected, atol=0.15, err_msg="two radii")


@every_feed
def test_what_is_filled_goes_by_what_the_mask_leaves(draw: Draw, instancing: str) -> None:
    """A slit in small splats, and in splats of twice their radius of which the mask leaves a half."""
    whole = plane(40, 3.0)
    kept = np.abs(whole.world()[:, 0]) > 0.1
    positions, normals, radii = whole.world()[kept], whole.normals[kept], whole.radii[kept]
    camera, size = looking_down_z(fov_y=50), (200, 200)
    small, masked = (
        np.isfinite(
            surfels(
                draw,
                PointCloud.from_arrays(positions, normals=normals, radii=factor * radii),
                camera,
                size,
                instancing=instancing,
                passes="two",
                mask_cutoff=np.exp(-4 / factor**2) + 1e-6,
            ).depth
        )
        for factor in (1, 2)
    )
    assert small[60:140, 90:110].all()
    assert (small != masked).mean() < 1e-3


@every_feed
@pytest.mark.parametrize("passes", ["two", "two_large", "sorted", "one_blended", "one_no_depth"])
def test_every_level_comes_back(draw: Draw, instancing: str, passes: str) -> None:
    """One splat alone, and many of one colour that overlap, show that very colour: all 256 levels."""
    levels = np.arange(256)
    colors = np.stack([levels, levels[::-1], (levels * 77) % 256], axis=1).astype(np.uint8)
    x, y = levels % 16 - 7.5, levels // 16 - 7.5
    positions = np.stack([x, y, np.full(256, -5.0)], axis=1)
    camera, size = looking_down_z(fov_y=60, projection="orthographic", height=16.0), (96, 96)
    for overlapping in (1, 20):
        places = np.repeat(positions, overlapping, axis=0)
        places[:, 2] -= np.tile(0.01 * np.arange(overlapping), 256)
        cloud = PointCloud.from_arrays(
            places,
            normals=np.tile([0, 0, 1.0], (len(places), 1)),
            colors=np.repeat(colors, overlapping, axis=0),
            radii=np.full(len(places), 0.45),
        )
        surface = surfels(
            draw,
            cloud,
            camera,
            size,
            Look(light="flat"),
            instancing=instancing,
            passes=passes,
            enlarge=1,
            radius="own",
        )  # fmt: skip
        owns = surface._read_texels("color", np.uint8)[..., :3]
        for level in range(256):
            pixel = int(6 * (x[level] + 8)), int(6 * (8 - y[level]))
            assert (owns[pixel[1], pixel[0]] == colors[level]).all(), (overlapping, level)


@pytest.mark.parametrize("instancing", INSTANCING)
def test_means_are_those_of_linear_light(draw: Draw, instancing: str) -> None:
    """At most a level off what numbers of any length would give, for pairs of all levels."""
    levels = np.arange(256)
    pairs = np.stack([levels, (levels * 97 + 31) % 256]).astype(np.uint8)
    x, y = levels % 16 - 7.5, levels // 16 - 7.5
    places = np.concatenate([np.stack([x, y, np.full(256, depth)], axis=1) for depth in (-5.0, -5.1)])
    camera, size = looking_down_z(fov_y=60, projection="orthographic", height=16.0), (80, 80)
    cloud = PointCloud.from_arrays(
        places,
        normals=np.tile([0, 0, 1.0], (512, 1)),
        colors=np.repeat(pairs.reshape(-1, 1), 3, axis=1),
        radii=np.full(512, 0.45),
    )
    surface = surfels(draw, cloud, camera, size, instancing=instancing, passes="two", enlarge=1, radius="own")
    mean = bytes_from_linear(linear_from_bytes(pairs).mean(axis=0)).astype(int)
    middles = surface._read_texels("color", np.uint8)[
        (5 * (8 - y)).astype(int), (5 * (x + 8)).astype(int), 0
    ].astype(int)
    assert np.abs(middles - mean).max() <= 1
    assert (middles != mean).mean() < 0.15


@every_feed
@pytest.mark.parametrize("epsilon", [0.5, 1.0, 2.0])
def test_splats_are_blended_within_epsilon_of_the_nearest(
    draw: Draw, instancing: str, epsilon: float
) -> None:
    camera, size = looking_down_z(fov_y=60, projection="orthographic", height=4.0), (41, 41)
    for behind, blended in ((0.95, True), (1.05, False)):
        cloud = discs([5.0 + 0.5 * epsilon * behind, 5.0], [RED, GREEN], radius=0.5)
        surface = surfels(
            draw, cloud, camera, size, instancing=instancing, passes="two", enlarge=1, epsilon=epsilon
        )
        assert shown(surface, 20, 20) == ([188, 188, 0] if blended else [0, 255, 0])
        assert surface.row[20, 20] == 1
        assert surface.depth[20, 20] == pytest.approx(5.0, rel=1e-6)


@every_feed
def test_visibility_alone_is_pushed_away_by_epsilon(draw: Draw, instancing: str) -> None:
    cloud = sphere(3000)
    camera = Camera.orbit(cloud.bounds(), 30, 20, aspect=4 / 3)
    one = surfels(draw, cloud, camera, instancing=instancing)
    pushed = surfels(draw, cloud, camera, instancing=instancing, passes="visibility", epsilon=0.5)
    np.testing.assert_array_equal(one.row, pushed.row)
    covered = one.row != NOTHING
    moved = pushed.depth[covered] - one.depth[covered]
    np.testing.assert_allclose(moved, 0.5 * cloud.radii[0], rtol=1e-3)
    assert np.ptp(pushed.image()[covered][:, :3], axis=1).max() == 0, "grey"


@every_feed
def test_what_is_seen_where_splats_are_drawn_over_one_another(draw: Draw, instancing: str) -> None:
    camera, size = looking_down_z(fov_y=60, projection="orthographic", height=4.0), (41, 41)
    near_first = discs([4.0, 6.0], [RED, GREEN])
    near_last = discs([6.0, 4.0], [GREEN, RED])

    def middle(cloud: PointCloud, passes: str) -> list[int]:
        return shown(surfels(draw, cloud, camera, size, instancing=instancing, passes=passes), 20, 20)

    for passes in ("one", "two", "one_blended", "sorted"):
        assert middle(near_first, passes) == middle(near_last, passes) == [255, 0, 0]
    assert middle(near_last, "one_no_depth") == [255, 0, 0]
    assert middle(near_first, "one_no_depth") == [0, 255, 0], "what is behind shines through"


@every_feed
def test_sorted_blending_is_that_of_the_masks(draw: Draw, instancing: str) -> None:
    camera, size = looking_down_z(fov_y=60, projection="orthographic", height=4.0), (41, 41)
    cloud = discs([5.0, 4.0], [GREEN, RED])
    look = Look(light="flat", background="#000000")
    surface = surfels(draw, cloud, camera, size, look, instancing=instancing, passes="sorted")
    x = 25  # 5 pixels of 4 / 41 off the middle
    mask = np.exp(-4 * (5 * 4 / 41) ** 2)
    covered = 1 - (1 - mask) ** 2
    light = np.array([mask, mask * (1 - mask), 0]) / covered
    np.testing.assert_allclose(surface.color[20, x], light, atol=0.01)
    assert surface.coverage[20, x] == pytest.approx(covered, abs=0.01)
    np.testing.assert_allclose(shown(surface, x, 20), bytes_from_linear(light) * covered, atol=2)


@every_feed
def test_as_printed_blends_enlarged_masks_in_the_order_of_the_file(draw: Draw, instancing: str) -> None:
    camera, size = looking_down_z(fov_y=60, projection="orthographic", height=4.0), (41, 41)
    look = Look(light="flat", background="#000000")
    near, far = (
        surfels(
            draw,
            discs(depths, [GREEN, RED], radius=0.5),
            camera,
            size,
            look,
            instancing=instancing,
            passes="as_printed",
            radius="own",
        )
        for depths in ([5.0, 5.4], [5.0, 5.6])
    )
    x = 25  # 5 pixels of 4 / 41 off the middle; splats of the second pass are twice as large
    mask = np.exp(-4 * (5 * 4 / 41) ** 2)
    covered = 1 - (1 - mask) ** 2
    bytes_of = 255 * np.array([mask, mask * (1 - mask), 0]) / covered
    np.testing.assert_allclose(near._read_texels("color", np.uint8)[20, x, :3], bytes_of, atol=3)
    assert near.coverage[20, x] == pytest.approx(covered, abs=0.01)
    assert near.depth[20, x] == pytest.approx(5.0, rel=1e-6)
    assert far.coverage[20, x] == pytest.approx(mask, abs=0.01), "more than epsilon behind"
    assert (near.row == NOTHING).all()
    assert (near.level[np.isfinite(near.depth)] == 1).all()


@every_feed
def test_as_printed_transparent_corners_hide_what_is_behind(draw: Draw, instancing: str) -> None:
    """The first pass writes depths of whole quads: their corners leave a hole in what lies behind."""
    camera, size = looking_down_z(fov_y=60, projection="orthographic", height=4.0), (41, 41)
    cloud = discs([5.0, 8.0], [GREEN, RED])
    cloud = replace(cloud, radii=np.array([0.5, 2.0], np.float32))

    def covers(passes: str, x: int, y: int) -> bool:
        params = {"passes": passes, "radius": "own", "enlarge": 1, "instancing": instancing}
        return bool(np.isfinite(surfels(draw, cloud, camera, size, **params).depth[y, x]))

    corner = 20 + 4, 20 - 4  # 0.39 off the middle in both directions, 0.55 in all
    assert covers("two", *corner)
    assert not covers("as_printed", *corner)
    assert covers("as_printed", 20 + 8, 20)


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_as_printed_shows_about_the_colours_of_two_passes(draw: Draw, projection: str) -> None:
    cloud = sphere(3000)
    camera = Camera.orbit(cloud.bounds(), 30, 20, aspect=4 / 3, projection=projection)
    look = Look(light="flat")
    two = surfels(draw, cloud, camera, look=look, passes="two", cull_back=True, instancing="tbo")
    printed = surfels(draw, cloud, camera, look=look, passes="as_printed", instancing="tbo")
    both = np.isfinite(two.depth) & np.isfinite(printed.depth)
    assert both.sum() > 0.98 * np.isfinite(two.depth).sum()
    assert np.quantile(np.abs(two.image().astype(int) - printed.image())[both], 0.9) < 16, "levels"
    assert (np.abs(printed.depth[both] / two.depth[both] - 1) < 0.02).mean() > 0.99


@pytest.mark.parametrize("instancing", FEEDS)
def test_as_printed_colours_points_without_colours_by_their_normals(draw: Draw, instancing: str) -> None:
    colored = sphere(3000)
    assert colored.normals is not None
    colored = replace(colored, colors=_bytes_of(0.5 + 0.5 * colored.normals))
    camera = Camera.orbit(colored.bounds(), 30, 20, aspect=4 / 3)
    pictures = [
        surfels(draw, cloud, camera, instancing=instancing, passes="as_printed", radius="own").image()
        for cloud in (colored, replace(colored, colors=None))
    ]
    np.testing.assert_allclose(*pictures, atol=4)


@pytest.mark.parametrize("passes", ["two", "one_blended", "one_no_depth", "sorted"])
def test_feeds_blend_alike(draw: Draw, passes: str) -> None:
    cloud = sphere(8000)
    camera = Camera.orbit(cloud.bounds(), 30, 20, aspect=4 / 3)
    pictures = {
        feed: surfels(draw, cloud, camera, look=Look(light="head"), instancing=feed, passes=passes)
        for feed in ("gs", "tbo", "vbo", "ubo", "pull", "tiles")
    }
    buffers = [pictures[feed].arrays() for feed in ("tbo", "vbo", "ubo", "pull")]
    for other in buffers[1:]:
        for channel in ("color", "normal", "depth", "id"):
            np.testing.assert_array_equal(buffers[0][channel], other[channel], channel)
    for feed in ("tbo", "tiles"):
        assert_blends_alike(pictures[feed], pictures["gs"])


@every_feed
def test_normals_need_not_agree_in_sign(draw: Draw, instancing: str) -> None:
    exact = sphere(8000)
    flip = np.random.default_rng(0).choice([-1, 1], (8000, 1))
    mixed = PointCloud.from_arrays(
        exact.positions, normals=exact.normals * flip, radii=exact.radii, colors=exact.colors
    )
    camera = Camera.orbit(exact.bounds(), 30, 20, aspect=4 / 3)
    one, other = (
        surfels(draw, cloud, camera, look=Look(light="head"), instancing=instancing, passes="two")
        for cloud in (exact, mixed)
    )
    away = np.abs(one.image().astype(int) - other.image()).max(axis=-1)
    assert np.count_nonzero(away > 1) <= at_borders(one)


@every_feed
def test_the_same_picture_twice(draw: Draw, instancing: str) -> None:
    cloud = sphere(30_000)
    camera = Camera.orbit(cloud.bounds(), 10, 10, aspect=4 / 3)
    first, second = (
        surfels(draw, cloud, camera, look=Look(light="head"), instancing=instancing, passes="two").arrays()
        for _ in range(2)
    )
    for channel, values in first.items():
        np.testing.assert_array_equal(values, second[channel], channel)


def test_very_many_splats_in_one_pixel_stay_in_range(draw: Draw) -> None:
    count = 100_000  # more than a tile's list takes
    cloud = PointCloud.from_arrays(
        np.tile([[0.0, 0.0, -5.0]], (count, 1)), normals=np.tile([[0, 0, 1.0]], (count, 1)),
        radii=np.full(count, 0.5), colors=np.tile(np.array([[200, 100, 50]], np.uint8), (count, 1)),
    )  # fmt: skip
    surface = surfels(draw, cloud, looking_down_z(fov_y=60), (33, 33), instancing="tiles", passes="two")
    covered = surface.row != NOTHING
    assert covered.any()
    assert np.abs(surface.image()[covered][:, :3] - [200.0, 100.0, 50.0]).max() <= 1
    np.testing.assert_allclose(surface.normal[covered], [[0, 0, 1]] * covered.sum(), atol=0.01)


@pytest.mark.usefixtures("short_spans")
def test_large_splats_are_blended_by_the_rasteriser(draw: Draw) -> None:
    cloud = sphere(100)
    camera, size = Camera(eye=(0.3, 0.5, 1.5), fov_y=60), (480, 360)
    tiles, quads = (
        surfels(draw, cloud, camera, size, instancing=name, passes="two") for name in ("tiles", "gs")
    )
    assert "rasterised" in tiles.stats.skipped["tiles"]
    for channel, values in tiles.arrays().items():
        np.testing.assert_array_equal(values, quads.arrays()[channel], channel)


@pytest.mark.usefixtures("short_spans")
@pytest.mark.parametrize(("enlarge", "cull_back"), [(1.0, True), (1.0, False), (2.0, True)])
def test_large_splats_among_many_are_blended_with_them(draw: Draw, enlarge: float, cull_back: bool) -> None:
    """A ball full of gaps before a few discs as large as the picture, and one of its own before the eye."""
    ball = sphere(8000)
    walls, facing = [[0, 0, -3.0], [0.2, 0, -3.1], [0, 0.1, -3.2], [-0.4, -0.3, 2.7]], [[0.1, 0, 1.0]] * 4
    cloud = PointCloud.from_arrays(
        np.concatenate([ball.positions, walls]),
        normals=np.concatenate([ball.normals, facing]),  # type: ignore[list-item]
        colors=np.concatenate([ball.colors, np.full((4, 4), [90, 200, 40, 255])]),  # type: ignore[list-item]
        radii=np.concatenate([0.6 * ball.radii, [4.0, 4.0, 4.0, 0.4]]),  # type: ignore[operator]
    )
    camera = Camera((0.0, 0.0, 3.0), (0, 0, 0), fov_y=50)
    tiles, quads = (
        surfels(
            draw, cloud, camera, (480, 360), Look(light="head"),
            instancing=name, passes="two", enlarge=enlarge, cull_back=cull_back,
        )
        for name in ("tiles", "tbo")
    )  # fmt: skip
    assert "tiles" not in tiles.stats.skipped
    assert "rasterised" in tiles.stats.skipped["large splats in tiles"]
    assert_covers_the_same(tiles, quads)
    assert_blends_alike(tiles, quads)
    assert {8000, 8003} <= set(tiles.row.ravel())


def test_a_scan_without_colours_keeps_the_looks_colour(draw: Draw) -> None:
    exact = sphere(3000)
    cloud = PointCloud.from_arrays(exact.positions, normals=exact.normals)
    camera = Camera.orbit(cloud.bounds())
    surface = surfels(draw, cloud, camera, look=Look(light="flat", plain="#204060"), passes="two")
    assert (surface.image()[surface.row != NOTHING][:, :3] == [0x20, 0x40, 0x60]).all()
    assert surface.is_own("normal")
    assert not surface.is_own("color")


@every_feed
@pytest.mark.parametrize("projection", ["perspective", *rarely("orthographic")])
def test_nothing_is_shown_before_the_near_plane(draw: Draw, instancing: str, projection: str) -> None:
    """The plane cuts a sphere's front, and splats with it: rounding took some pixels before it."""
    cloud, before = sphere(3000), 0
    for step in range(6):
        near = 0.6 + 0.002 * step
        camera = Camera(
            (0.0, 0.0, 1.6),
            (0.02 * step, 0, 0),
            fov_y=60,
            near=near,
            far=10,
            projection=projection,
            height=2.0 if projection == "orthographic" else None,
        )
        for passes, enlarge in (("one", 1.0), ("two", 1.0), ("two", 2.0)):
            surface = surfels(draw, cloud, camera, instancing=instancing, passes=passes, enlarge=enlarge)
            assert np.isfinite(surface.depth).sum() > 10_000
            before += np.count_nonzero(surface.depth < np.float32(near))
    assert before == 0


@pytest.mark.parametrize("passes", ["two", "sorted", "one_blended", "visibility", "as_printed"])
@every_feed
def test_empty_poses_and_previews(renderer: Renderer, draw: Draw, instancing: str, passes: str) -> None:
    empty = PointCloud.from_arrays(np.zeros((0, 3)), normals=np.zeros((0, 3)))
    nothing = surfels(draw, empty, Camera(eye=(0, 0, 5)), instancing=instancing, passes=passes)
    assert (nothing.row == NOTHING).all()
    cloud = sphere(8000)
    surface = Surface(renderer.gpu, SIZE)
    params = backend("surfels").params({"instancing": instancing, "passes": passes})
    camera = Camera.orbit(cloud.bounds(), aspect=4 / 3)
    request = Request(Pose(0, 0.0, "", cloud), camera, "surfels", params, Look(light="flat"))
    assert render_frame(renderer, request, surface, share=0.25), "a preview would be refined"
    preview = np.isfinite(surface.depth).sum()
    assert not render_frame(renderer, request, surface)
    assert preview == pytest.approx(np.isfinite(surface.depth).sum(), rel=0.05)
    assert render_frame(renderer, request, surface, share=1e-12)
    assert (surface.row == NOTHING).all(), "a share that no point falls into"


def test_splats_under_a_pixel_do_not_flicker_where_they_are_blended(draw: Draw) -> None:
    cloud, truth, size = sphere(20_000), AnalyticScene((Sphere(),)), (100, 75)
    look = Look(light="head", color_by="plain")
    cameras = [Camera.orbit(cloud.bounds(), 10 + 2 * step, 10, aspect=4 / 3) for step in range(3)]
    gpu = surfels(draw, cloud, cameras[0]).gpu
    walk = Walk([Judge.of(gpu, truth, camera, size, look, cloud, None) for camera in cameras], [None] * 2)
    flicker = [
        walk.flicker((surfels(draw, cloud, camera, size, look, passes=passes) for camera in cameras), "orbit")
        for passes in ("one", "two")
    ]
    assert flicker[0]["flicker_orbit_normal"] > 0.5, "degrees: nothing to improve"
    for name in ("flicker_orbit_color", "flicker_orbit_normal"):
        assert abs(flicker[1][name]) < flicker[0][name] / 4


@pytest.mark.parametrize("cull_back", [False, True])
def test_splats_left_out_of_the_second_pass_would_not_have_shown(draw: Draw, cull_back: bool) -> None:
    """Balls in one another: most discs are hidden, and the rasteriser draws them all."""
    balls = [sphere(4000, radius=radius) for radius in (1.0, 0.9, 0.5)]
    cloud = PointCloud.from_arrays(
        np.concatenate([ball.positions for ball in balls]),
        normals=np.concatenate([ball.normals for ball in balls]),
        colors=np.concatenate([ball.colors for ball in balls]),
        radii=np.concatenate([ball.radii for ball in balls]),
    )
    camera = Camera.orbit(cloud.bounds(), 30, 20, aspect=4 / 3)
    tiles, quads = (
        surfels(
            draw, cloud, camera, look=Look(light="head"), instancing=name, passes="two", cull_back=cull_back
        )
        for name in ("tiles", "gs")
    )
    assert_blends_alike(tiles, quads)


@every_feed
def test_a_second_pass_that_would_change_nothing_is_not_drawn(draw: Draw, instancing: str) -> None:
    cloud = sphere(3000)
    camera = Camera.orbit(cloud.bounds())
    one = surfels(draw, cloud, camera, instancing=instancing, passes="one")
    two = surfels(draw, cloud, camera, instancing=instancing, passes="two", enlarge=1, epsilon=0)
    assert "second pass" in two.stats.skipped
    assert not two.is_own("normal")
    np.testing.assert_array_equal(one.image(), two.image())
