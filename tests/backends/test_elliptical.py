"""Elliptical splats: against rays in float64, by all ways alike, and round where they are none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hardware import at_borders, displaced, moved
from numpy.typing import NDArray
from scenes import BUFFERS, NOTHING, rarely, sphere
from splat_scenes import (
    CAMERAS,
    CLOUD,
    ELLIPSES,
    SIZE,
    assert_agree,
    assert_covers_the_same,
    assert_equal,
    elliptical,
    every_camera,
    with_axes,
)

from viewer.camera import Camera
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.splatting.amplify import FEEDS
from viewer.view import View

pytestmark = pytest.mark.backend("surfels")
Draw = Callable[..., Surface]
WAYS = ("tiles", *FEEDS)


@pytest.fixture
def surfels(draw: Draw) -> Draw:
    """surfels(cloud, camera, size, instancing=..., ...): one finished Surface."""

    def surfels(cloud: PointCloud, camera: Camera, size: tuple[int, int] = SIZE, **params: object) -> Surface:
        return draw(cloud, camera, size, "surfels", params={"passes": "one", **params})

    return surfels


def rays(
    view: View, off: tuple[float, float] = (0.0, 0.0)
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where the rays through pixels start and what they go a unit of depth, (H, W, 3), view space.

    off: pixels from their centres.
    """
    x, y = np.meshgrid(np.arange(view.size[0]) + 0.5 + off[0], np.arange(view.size[1]) + 0.5 + off[1])
    flat = np.stack([x - view.size[0] / 2, view.size[1] / 2 - y, 0 * x], axis=-1) / view.scale
    forward = np.array([0.0, 0.0, -1.0])
    if view.perspective:
        return np.zeros_like(flat), flat + forward
    return flat, np.broadcast_to(forward, flat.shape)


def brute_force(
    cloud: PointCloud, view: View, cutoff: float = 1.0, off: tuple[float, float] = (0.0, 0.0)
) -> tuple[NDArray[np.float64], NDArray[np.uint32], NDArray[np.bool_]]:
    """Depth and row of the nearest disc at each pixel, disc by disc in float64; what lies on no border.

    cutoff: squared distance from the centre, 1 at the half-axes, where discs end. off: as `rays` has it.
    """
    assert cloud.axes is not None
    assert cloud.normals is not None
    start, step = rays(view, off)
    depth, row = np.full(start.shape[:2], np.inf), np.full(start.shape[:2], NOTHING, np.uint32)
    clear = np.ones(depth.shape, bool)
    for i in range(len(cloud)):
        center = view.rotation @ cloud.positions[i].astype(np.float64) + view.translation
        n = view.rotation @ (cloud.normals[i] / np.linalg.norm(cloud.normals[i].astype(np.float64)))
        u = view.rotation @ cloud.axes[i, :3].astype(np.float64)
        lengths = np.array([np.linalg.norm(u), cloud.axes[i, 3]])
        u -= (u @ n) * n
        u /= np.linalg.norm(u)
        pixel = (-center[2] if view.perspective else 1) / view.scale
        lengths = np.maximum(lengths, 0.7072 / np.sqrt(cutoff) * pixel)
        t = ((center - start) @ n) / (step @ n)
        across = start + t[..., None] * step - center
        form = (across @ u / lengths[0]) ** 2 + (across @ np.cross(n, u) / lengths[1]) ** 2
        in_front = t > view.near
        clear &= ~(in_front & (np.abs(form / cutoff - 1) < 2e-3))
        nearer = in_front & (form <= cutoff) & (t < depth)
        depth[nearer], row[nearer] = t[nearer], i
    return depth, row, clear


@every_camera
@pytest.mark.parametrize("way", ["tiles", "gs", *rarely("tbo")])
def test_they_are_what_rays_meet(surfels: Draw, camera: Camera, way: str) -> None:
    cloud, size = elliptical(sphere(400), stretch=8.0), (160, 120)
    surface = surfels(cloud, camera, size, instancing=way)
    assert_exact(surface, cloud, 3000)


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("way", ["tiles", "gs", "tbo"])
def test_far_from_the_axis_and_cut_off_early(surfels: Draw, way: str, projection: str) -> None:
    """Discs that lean in all directions, at the corners of a wide view."""
    rng = np.random.default_rng(5)
    count, size = 120, (160, 120)
    positions = np.column_stack(
        [rng.uniform(-4, 4, count), rng.uniform(-3, 3, count), rng.uniform(-4, -1, count)]
    )
    normals, tangents = rng.normal(size=(2, count, 3))
    axes = np.column_stack([tangents * 0.4, rng.uniform(0.05, 0.5, count)])
    cloud = PointCloud.from_arrays(positions, normals=normals, axes=axes)
    camera = Camera((0, 0, 0), (0, 0, -1), fov_y=110, projection=projection, height=6.0, near=0.05)
    masks = {"mask_falloff": 4.0, "mask_cutoff": 0.3}
    surface = surfels(cloud, camera, size, instancing=way, surface="nearest", **masks)
    assert_exact(surface, cloud, 3000, cutoff=-np.log(0.3) / 4)


def assert_exact(surface: Surface, cloud: PointCloud, least: int, cutoff: float = 1.0) -> None:
    """What `brute_force` finds, but for borders and ties, at pixel centres or where a rasteriser moves these.
    least: pixels that it covers."""
    found = [brute_force(cloud, surface.view, cutoff, off) for off in displaced(surface.gpu)]
    depth, rows, clear = (np.stack(each) for each in zip(*found, strict=True))
    row, clear = rows[0], clear.all(axis=0) & (rows == rows[0]).all(axis=0)
    covered = row != NOTHING
    assert np.count_nonzero(covered) > least
    assert (~clear).mean() < 0.1
    np.testing.assert_array_equal((surface.row != NOTHING)[clear], covered[clear])
    inside, shown = clear & covered, surface.depth
    exact = np.clip(shown, depth.min(axis=0), depth.max(axis=0))
    np.testing.assert_allclose(shown[inside], exact[inside], rtol=5e-5)
    others = np.count_nonzero(surface.row[inside] != row[inside])
    assert others < max(1e-3 * np.count_nonzero(inside), at_borders(surface))


@every_camera
def test_feeds_from_buffers_give_the_same_bits(surfels: Draw, camera: Camera) -> None:
    first = surfels(ELLIPSES, camera, instancing="tbo")
    assert (first.row != NOTHING).any()
    for feed in BUFFERS:
        assert_equal(surfels(ELLIPSES, camera, instancing=feed), first)


@every_camera
@pytest.mark.parametrize("way", ["gs", "tiles"])
def test_other_ways_agree_with_them(surfels: Draw, camera: Camera, way: str) -> None:
    assert_agree(
        surfels(ELLIPSES, camera, instancing=way), surfels(ELLIPSES, camera, instancing="tbo"), 0.006
    )


@pytest.mark.parametrize("projection", ["perspective", *rarely("orthographic")])
@pytest.mark.parametrize("enlarge", [1.0, 2.0])
def test_two_passes_blend_them_alike(surfels: Draw, projection: str, enlarge: float) -> None:
    tiles, gs, tbo = (
        surfels(ELLIPSES, CAMERAS[projection], instancing=way, passes="two", enlarge=enlarge)
        for way in ("tiles", "gs", "tbo")
    )
    for other in (gs, tiles):
        assert_covers_the_same(other, tbo)
        away = np.abs(other.image().astype(int) - tbo.image()).max(axis=-1)[tbo.row != NOTHING]
        assert np.count_nonzero(away > 1) < max(1e-3 * len(away), at_borders(tbo))


@every_camera
@pytest.mark.parametrize("way", ["tiles", "gs", "tbo"])
def test_circles_given_as_ellipses_are_what_round_splats_are(surfels: Draw, camera: Camera, way: str) -> None:
    """Turned as quads of round splats are, since the rasteriser rounds others otherwise."""
    assert CLOUD.axes is None
    assert CLOUD.normals is not None
    assert CLOUD.radii is not None
    tangents = np.cross([0.0, 1.0, 0.0], CLOUD.normals)
    tangents *= (CLOUD.radii / np.linalg.norm(tangents, axis=1))[:, None]
    circles = with_axes(CLOUD, np.column_stack([tangents, CLOUD.radii]))
    one, other = (surfels(cloud, camera, instancing=way) for cloud in (circles, CLOUD))
    assert_agree(one, other, 0.005)
    same = (one.row == other.row) & (one.row != NOTHING)
    error = np.abs(one.depth[same] / other.depth[same] - 1)
    assert (error > 1e-6 + 2 * moved(other)[same]).mean() < 2e-3


@pytest.mark.parametrize("way", WAYS)
def test_without_a_usable_tangent_a_splat_is_round(surfels: Draw, way: str) -> None:
    """Nothing, no number, and along the normal; the rest of the cloud is elliptical."""
    assert CLOUD.normals is not None
    assert CLOUD.radii is not None
    camera = CAMERAS["perspective"]
    axes = np.array(ELLIPSES.axes)
    along = np.column_stack([CLOUD.normals * CLOUD.radii[:, None], CLOUD.radii])
    bad = np.arange(len(CLOUD)) % 4
    axes[bad == 1] = 0
    axes[bad == 2] = np.nan
    axes[bad == 3] = along[bad == 3]
    surface = surfels(with_axes(CLOUD, axes), camera, instancing=way)
    radii = np.where(bad == 0, ELLIPSES.radii, CLOUD.radii)
    round_ones = surfels(replace(CLOUD, radii=radii.astype(np.float32)), camera, instancing=way)
    same = (surface.row == round_ones.row) & (surface.row != NOTHING) & (bad[surface.row % len(bad)] > 0)
    assert np.count_nonzero(same) > 0.5 * np.count_nonzero(surface.row != NOTHING)
    np.testing.assert_allclose(surface.depth[same], round_ones.depth[same], rtol=2e-6)
    only = replace(CLOUD, axes=np.zeros_like(ELLIPSES.axes))
    assert_equal(surfels(only, camera, instancing=way), surfels(CLOUD, camera, instancing=way))


def test_one_radius_for_all_leaves_them_round(surfels: Draw) -> None:
    camera = CAMERAS["perspective"]
    one, other = (surfels(cloud, camera, radius="uniform") for cloud in (ELLIPSES, CLOUD))
    assert_equal(one, other)
    different = surfels(ELLIPSES, camera).row != surfels(CLOUD, camera).row
    assert different.any()


@pytest.mark.parametrize("way", WAYS)
def test_thin_ones_stay_as_wide_as_a_pixel(surfels: Draw, way: str) -> None:
    """A line of a millionth of a pixel would fall between pixel centres."""
    cloud = PointCloud.from_arrays([[0, 0, -2.0]], normals=[[0, 0, 1.0]], axes=[[0.4, 0.3, 0.5, 1e-6]])
    surface = surfels(cloud, Camera((0, 0, 0), (0, 0, -1), fov_y=60), (64, 48), instancing=way)
    scale = 48 / 2 / np.tan(np.radians(30)) / 2
    expected = np.pi * np.sqrt(0.5) * scale * 0.7072
    assert np.count_nonzero(surface.row != NOTHING) == pytest.approx(expected, abs=8)


def test_factors_count_for_both_half_axes(surfels: Draw) -> None:
    camera, assert_same = CAMERAS["perspective"], np.testing.assert_allclose
    axes = np.array(ELLIPSES.axes)
    larger = with_axes(CLOUD, 2 * axes)
    one, other = surfels(ELLIPSES, camera, radius_scale=2.0), surfels(larger, camera)
    assert (one.row != other.row).mean() < 1e-3
    assert_same(one.depth[one.row == other.row], other.depth[one.row == other.row], rtol=1e-5)


@pytest.mark.parametrize("stretch", [1.0, 6.0])
def test_they_are_averaged_only_where_they_are_not_long(surfels: Draw, stretch: float) -> None:
    """Circles of the same area are under a pixel; ellipses of three pixels are not."""
    cloud, size = sphere(1000), (160, 120)
    assert cloud.normals is not None
    tangents = np.cross(cloud.normals, [0.3, 0.5, 0.7])
    tangents *= stretch * 0.01 / np.linalg.norm(tangents, axis=1, keepdims=True)
    cloud = with_axes(cloud, np.column_stack([tangents, np.full(len(cloud), 0.01 / stretch)]))
    camera = CAMERAS["perspective"]
    surface = surfels(cloud, camera, size, epsilon=0.0)
    assert (surface.stats.chosen["instancing"] == "scatter") == (stretch == 1)
    assert_exact(surface, cloud, 500)
