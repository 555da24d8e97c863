"""Splats of about a pixel: sent to their pixels one by one, and averaged there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scenes import NOTHING, looking_down_z, rarely, sphere, sphere_hits
from splat_scenes import assert_agree, assert_covers_the_same

from viewer.bench.judge import Judge, Walk
from viewer.bench.truth.shapes import AnalyticScene, Sphere
from viewer.camera import Camera
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.splatting.amplify import FEEDS
from viewer.srgb import bytes_from_linear, linear_from_bytes

pytestmark = pytest.mark.backend("surfels")
Draw = Callable[..., Surface]
SIZE = (200, 150)
CLOUD = sphere(300_000)
PROJECTIONS = ("perspective", "orthographic")


def camera(projection: str = "perspective", azimuth: float = 30) -> Camera:
    return Camera.orbit(CLOUD.bounds(), azimuth, 20, aspect=4 / 3, projection=projection)


def surfels(draw: Draw, cloud: PointCloud, camera: Camera, **params: object) -> Surface:
    return draw(cloud, camera, SIZE, "surfels", Look(light="flat"), {"passes": "one", **params})


def in_one_pixel(depths: list[float], colors: list[list[int]], normals: list[list[float]]) -> PointCloud:
    """Discs of a hundredth of a pixel in the middle of a picture of 9 x 9, at the eye's z axis."""
    positions = [[0.0, 0.0, -depth] for depth in depths]
    return PointCloud.from_arrays(
        positions, normals=normals, colors=np.array(colors, np.uint8), radii=[1e-3] * len(depths)
    )


@pytest.mark.parametrize("cull_back", [False, *rarely(True)])
@pytest.mark.parametrize("projection", PROJECTIONS)
def test_scattered_splats_are_those_of_tiles_and_quads(draw: Draw, projection: str, cull_back: bool) -> None:
    ways = {
        way: surfels(draw, CLOUD, camera(projection), instancing=way, cull_back=cull_back)
        for way in ("auto", "tiles", "gs")
    }
    assert ways["auto"].stats.chosen["instancing"] == "scatter"
    assert "tiles" in ways["auto"].stats.skipped
    for way in ("tiles", "gs"):
        assert_covers_the_same(ways["auto"], ways[way])
        assert_agree(ways["auto"], ways[way], others=0.2)  # a pixel holds some twenty, many at one depth


@pytest.mark.parametrize("passes", ["one", "two"])
def test_those_of_a_pixel_are_averaged_within_epsilon_of_the_nearest(draw: Draw, passes: str) -> None:
    view, size = looking_down_z(), (9, 9)
    near, far = 1.0, 1.0 + 1e-3
    cloud = in_one_pixel(
        [near, near, near, far, 1.5],
        [[200, 0, 0], [0, 100, 0], [10, 20, 30], [50, 80, 30], [0, 0, 255]],
        [[0, 0, 1], [0, 0, -1], [0.6, 0, 0.8], [0, 0.6, 0.8], [0, 0, 1]],
    )
    surface = draw(cloud, view, size, "surfels", Look(light="flat"), {"passes": passes})
    ((y,), (x,)) = np.nonzero(surface.row != NOTHING)
    assert surface.row[y, x] == 0
    assert surface.depth[y, x] == pytest.approx(near, rel=1e-6)
    light = linear_from_bytes(cloud.colors[:4, :3]).mean(axis=0)
    np.testing.assert_allclose(surface.image()[y, x, :3], bytes_from_linear(light), atol=1)
    mean = np.array([0.6, 0.6, 3.6]) / np.linalg.norm([0.6, 0.6, 3.6])  # signs need not agree
    np.testing.assert_allclose(surface.normal[y, x], mean, atol=2e-3)


@pytest.mark.parametrize(("radii", "share"), [(0.9, 1.0), (1.25, 0.75), (1.5, 0.5), (2.5, 0.0)])
def test_larger_splats_are_averaged_less_and_less(draw: Draw, radii: float, share: float) -> None:
    view, size = looking_down_z(), (9, 9)
    pair = in_one_pixel([1.0, 1.0], [[200, 0, 0], [0, 100, 0]], [[0, 0, 1], [0, 0.6, 0.8]])
    scale = draw(pair, view, size, "surfels").view.scale
    cloud = replace(pair, radii=np.full(2, radii * 0.7072 / scale, np.float32))
    # Of two at one place and depth, the rasteriser's fewer bits may have the later one nearer.
    given = {"passes": "one", "instancing": "auto" if share else "tiles"}
    surface = draw(cloud, view, size, "surfels", Look(light="flat"), given)
    light = linear_from_bytes(cloud.colors[:, :3])
    shown = bytes_from_linear(share * light.mean(axis=0) + (1 - share) * light[0])
    np.testing.assert_allclose(surface.image()[4, 4, :3], shown, atol=1)
    mean = np.array([0, 0.6, 1.8]) / np.linalg.norm([0.6, 1.8])
    mixed = share * mean + (1 - share) * np.array([0, 0, 1])
    np.testing.assert_allclose(surface.normal[4, 4], mixed / np.linalg.norm(mixed), atol=3e-3)


def test_without_epsilon_the_nearest_is_alone(draw: Draw) -> None:
    nearest = surfels(draw, CLOUD, camera(), epsilon=0)
    assert nearest.stats.chosen["instancing"] == "scatter"
    assert not nearest.is_own("normal")
    assert_agree(nearest, surfels(draw, CLOUD, camera(), epsilon=0, instancing="gs"), others=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("count", [200_000, 4_300_000])
def test_very_many_in_one_pixel(draw: Draw, count: int) -> None:
    """Of the larger number, light and normals would add up to more than 2^31: the nearest is shown alone."""
    view, size = looking_down_z(), (9, 9)
    one = in_one_pixel([1.0], [[250, 120, 7]], [[0, 0, 1]])
    arrays = (one.world(), one.normals, one.colors, one.radii)
    positions, normals, colors, radii = (np.repeat(array, count, axis=0) for array in arrays)
    cloud = PointCloud.from_arrays(positions, normals=normals, colors=colors, radii=radii)
    surface = draw(cloud, view, size, "surfels", Look(light="flat"))
    ((y,), (x,)) = np.nonzero(surface.row != NOTHING)
    assert surface.row[y, x] == 0
    np.testing.assert_array_equal(surface.image()[y, x, :3], [250, 120, 7])
    np.testing.assert_allclose(surface.normal[y, x], [0, 0, 1], atol=2e-3)


@pytest.mark.parametrize("instancing", ["auto", "tiles", "gs"])
@pytest.mark.parametrize("mask", [{"mask_cutoff": 0.5}, {"mask_falloff": 100, "mask_cutoff": 0.9}])
def test_what_the_mask_leaves_reaches_a_pixel(draw: Draw, instancing: str, mask: dict[str, float]) -> None:
    """Points some pixels apart, each of which is seen, however little of a splat the mask leaves."""
    x, y = np.meshgrid(np.linspace(-0.8, 0.8, 20), np.linspace(-0.6, 0.6, 15))
    positions = np.stack([x.ravel(), y.ravel(), np.zeros(300)], axis=1)
    normals = np.tile([0.0, 0.0, 1.0], (300, 1))
    cloud = PointCloud.from_arrays(positions, normals=normals, radii=np.full(300, 1e-4))
    surface = surfels(draw, cloud, Camera((0, 0, 4), (0, 0, 0)), instancing=instancing, **mask)
    assert len(np.unique(surface.row[surface.row != NOTHING])) == 300


def test_the_same_picture_twice(draw: Draw) -> None:
    first, second = (surfels(draw, CLOUD, camera()).arrays() for _ in range(2))
    for channel, values in first.items():
        np.testing.assert_array_equal(values, second[channel], channel)


@pytest.mark.slow
def test_they_do_not_flicker(draw: Draw) -> None:
    look = Look(light="head", color_by="plain")
    cameras = [camera(azimuth=10 + 2 * step) for step in range(3)]
    gpu = surfels(draw, CLOUD, cameras[0]).gpu
    truth = AnalyticScene((Sphere(),))
    walk = Walk([Judge.of(gpu, truth, one, SIZE, look, CLOUD, None) for one in cameras], [None] * 2)
    nearest, mean = (
        walk.flicker(
            (
                draw(CLOUD, one, SIZE, "surfels", look, {"passes": "one", "epsilon": epsilon})
                for one in cameras
            ),
            "orbit",
        )
        for epsilon in (0.0, 1.0)
    )
    assert nearest["flicker_orbit_normal"] > 0.5, "degrees: nothing to improve"
    for name in ("flicker_orbit_color", "flicker_orbit_normal"):
        assert abs(mean[name]) < nearest[name] / 2


def test_larger_splats_are_neither_scattered_nor_averaged(draw: Draw) -> None:
    """A few large ones among them count, and those that come close to the eye."""
    close = surfels(draw, CLOUD, Camera((0, 0, 1.2), (0, 0, 0)))
    radii = CLOUD.radii.copy()  # type: ignore[union-attr]
    radii[7] = 2.0
    one_large = PointCloud.from_arrays(CLOUD.positions, normals=CLOUD.normals, radii=radii)
    for surface in (close, surfels(draw, one_large, camera())):
        assert surface.stats.chosen["instancing"] in (
            ("tiles",) if surface.gpu.software else ("tiles", *FEEDS)
        )
        assert not surface.is_own("normal")
    assert surface.row.min() >= 0


def test_an_outlier_before_the_eye_changes_nothing(draw: Draw) -> None:
    arrays = (CLOUD.positions, CLOUD.normals, CLOUD.radii)
    view = Camera.orbit(CLOUD.bounds(), 0, 0, aspect=4 / 3)
    outlier = np.array([[0.0, 0.0, 0.9 * view.eye[2]]])
    positions, normals, radii = (
        np.concatenate([array, extra])
        for array, extra in zip(arrays, (outlier, outlier, arrays[2][:1]), strict=True)
    )
    surface = surfels(draw, PointCloud.from_arrays(positions, normals=normals, radii=radii), view)
    assert surface.stats.chosen["instancing"] == "scatter"
    assert surface.is_own("normal")
    assert len(CLOUD) in surface.row


def test_no_colours_and_no_radii_of_their_own(draw: Draw) -> None:
    bare = PointCloud.from_arrays(CLOUD.positions, normals=CLOUD.normals)
    surface = surfels(draw, bare, camera())
    assert surface.stats.chosen["instancing"] == "scatter"
    assert surface.is_own("normal")
    assert not surface.is_own("color")
    covered = surface.row != NOTHING
    away = np.linalg.norm(surface.normal[covered], axis=1)
    np.testing.assert_allclose(away, 1, atol=1e-5)


@pytest.mark.parametrize("instancing", ["auto", "tiles", "gs"])
def test_a_lone_one_is_shown_in_its_plane_within_a_pixel_of_its_point(draw: Draw, instancing: str) -> None:
    """Splats far apart and far smaller than a pixel, tilted by all angles."""
    tilts = np.radians(np.linspace(0, 85, 18))
    positions = np.stack([np.linspace(-0.9, 0.9, 18), 0.3 * np.sin(np.arange(18.0)), 0 * tilts], axis=1)
    normals = np.stack([np.sin(tilts), 0 * tilts, np.cos(tilts)], axis=1)
    cloud = PointCloud.from_arrays(positions, normals=normals, radii=np.full(18, 1e-5))
    surface = surfels(draw, cloud, Camera((0, 0, 4), (0, 0, 0)), instancing=instancing, radius="own")
    y, x = np.nonzero(surface.row != NOTHING)
    rows, depth = surface.row[y, x], surface.depth[y, x].astype(np.float64)
    assert len(np.unique(rows)) >= 12
    shown = surface.view.unproject(np.stack([x, y], axis=1) + 0.5, depth) + surface.view.origin
    away, pixel = shown - positions[rows], depth / surface.view.scale
    assert (np.linalg.norm(away, axis=1) <= 0.7072 * pixel * 1.02).all()
    assert (np.abs(np.sum(away * normals[rows], axis=1)) <= 0.01 * pixel).all()


def test_far_ones_show_the_depth_of_the_surface_at_the_middle_of_pixels(draw: Draw) -> None:
    """By their planes; discs that face the eye would be off by up to a pixel's slope."""
    view = camera()
    surface, (depth, normal) = surfels(draw, CLOUD, view), sphere_hits(view, SIZE)
    slanted = np.isfinite(depth) & (normal @ view.rotation()[2] < 0.6) & (normal @ view.rotation()[2] > 0.2)
    error = np.abs(surface.depth[slanted] - depth[slanted]) * surface.view.scale / depth[slanted]
    assert np.count_nonzero(slanted) > 1000
    assert np.median(error) < 0.1
