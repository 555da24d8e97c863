"""The local surface: the mean of a layer as plainly computed; without bias under noise, and the nearest splat
without it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace

import numpy as np
import pytest
from hardware import at_borders, moved
from numpy.typing import NDArray
from scenes import BUFFERS, rarely, sphere

from viewer.backends import backend
from viewer.bench.scenes.defects import noisy
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.gpu.constants import LAYER_SLOPE, NOTHING
from viewer.mesh.reference import pixel_rays
from viewer.picture.surface import Surface
from viewer.scan.noise import Noise, noise_of
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose, ScanKey
from viewer.scan.spacing import typical_spacing
from viewer.splatting.local import Layer, PoseNoise
from viewer.view import View

Draw = Callable[..., Surface]
Floats = NDArray[np.float64]
SIZE = (96, 72)
COUNT = 3000
FALLOFF, EPSILON = 4.0, 1.0  # defaults of surfels
BARE = ("auto_splats", "hpr", "voxels")
SPLATS = [
    pytest.param(name, {"passes": passes}, marks=pytest.mark.backend(name), id=f"{name} {passes}")
    for name in ("surfels", "auto_splats", "voxels")
    for passes in ("one", "two")
] + [pytest.param("hpr", {}, marks=pytest.mark.backend("hpr"), id="hpr")]
LOCAL = {"surface": "local"}


def noisy_sphere(spacings: float, count: int = COUNT) -> PointCloud:
    """A unit sphere whose points lie off it, with the normals and radii of those on it."""
    return noisy(spacings)(sphere(count), np.random.default_rng(1))


def looking_at(cloud: PointCloud, projection: str = "perspective") -> Camera:
    return Camera.orbit(cloud.bounds(), 30, 20, aspect=4 / 3).projected(projection)


def true_depths(view: View) -> Floats:
    """Depths (H, W) of the unit sphere, +inf beside it."""
    starts, steps = pixel_rays(view, np.arange(view.size[0] * view.size[1]))
    starts = starts + view.origin
    a, b = (steps**2).sum(axis=1), (starts * steps).sum(axis=1)
    inside = b**2 - a * ((starts**2).sum(axis=1) - 1)
    depth = (-b - np.sqrt(np.maximum(inside, 0))) / a
    return np.where(inside > 0, depth, np.inf).reshape(view.size[::-1])


def plain(cloud: PointCloud, view: View, layer: Layer) -> tuple[Floats, NDArray[np.uint32]]:
    """Depth and row of each pixel, (H, W): all discs of all pixels in float64.

    The row is that of the nearest disc. The depth is the mean of the discs that lie behind it by no more than
    the thickness of the layer; discs that are only close behind in depth count as the nearest.
    """
    starts, steps = pixel_rays(view, np.arange(view.size[0] * view.size[1]))
    assert cloud.normals is not None
    assert cloud.radii is not None
    centers, normals = cloud.positions.astype(np.float64), cloud.normals.astype(np.float64)
    facing = steps @ normals.T
    depths = ((centers * normals).sum(axis=1) - starts @ normals.T) / facing
    away = starts[:, None] + depths[..., None] * steps[:, None] - centers
    t = (away**2).sum(axis=2) / cloud.radii.astype(np.float64) ** 2
    depths = np.where(t <= 1, depths, np.inf)
    row, pixels = depths.argmin(axis=1), np.arange(len(depths))
    nearest = depths[pixels, row]
    is_shown = np.isfinite(nearest)
    slope = np.minimum(1 / np.maximum(np.abs(facing[pixels, row]), 1e-9), LAYER_SLOPE)
    thick = layer.thickness * slope
    weights = np.rint(31 * np.exp(-FALLOFF * layer.smoothing * np.minimum(t, 1)))
    with np.errstate(invalid="ignore"):
        behind = depths - nearest[:, None]
    reach = np.maximum(thick, EPSILON * cloud.radii[row])
    weights = np.where(behind <= reach[:, None], weights, 0)
    voted = np.where(behind <= thick[:, None], depths, nearest[:, None])
    # In perspective, values that are linear in the picture are averaged.
    values = 1 / voted if view.perspective else voted
    mean = (weights * np.where(weights > 0, values, 0)).sum(axis=1) / weights.sum(axis=1).clip(1)
    mean = 1 / np.where(is_shown, mean, 1) if view.perspective else mean
    shape = view.size[::-1]
    return np.where(is_shown, mean, np.inf).reshape(shape), np.where(is_shown, row, NOTHING).reshape(shape)


def surfels(draw: Draw, cloud: PointCloud, camera: Camera, **params: object) -> Surface:
    given = {"passes": "two", "enlarge": 1.0, "radius": "own", **LOCAL, **params}
    return draw(cloud, camera, SIZE, "surfels", params=given)


@pytest.mark.backend("surfels")
@pytest.mark.parametrize("projection", ["perspective", *rarely("orthographic")])
@pytest.mark.parametrize("instancing", ["tiles", *rarely("gs")])
def test_the_depth_is_the_mean_of_the_layer(draw: Draw, projection: str, instancing: str) -> None:
    cloud = noisy_sphere(0.3, 600)
    cloud = replace(cloud, radii=np.full(len(cloud), 1.2 * typical_spacing(cloud), np.float32))
    layer = Layer(noise_of(cloud))
    assert layer.is_local
    camera = looking_at(cloud, projection)
    found = surfels(draw, cloud, camera, instancing=instancing)
    depth, row = plain(cloud, found.view, layer)
    same = found.row == row
    assert same.mean() > 0.995, "other discs are the nearest"
    both = same & np.isfinite(depth)
    error = np.abs(found.depth[both] - depth[both]) / layer.thickness
    assert np.quantile(error, 0.99) < 0.01
    nearest = surfels(draw, cloud, camera, instancing=instancing, surface="nearest")
    np.testing.assert_array_equal(nearest.row, found.row)
    assert np.mean(found.depth[both] - nearest.depth[both]) > 0.1 * layer.thickness


@pytest.mark.parametrize(("name", "params"), SPLATS)
@pytest.mark.parametrize("noise", [0.3, *rarely(0.6)])
def test_noise_does_not_move_the_surface(
    draw: Draw, name: str, params: dict[str, object], noise: float
) -> None:
    cloud = noisy_sphere(noise, 20_000)
    spacing = typical_spacing(sphere(20_000))
    cloud = replace(cloud, radii=None, normals=None if name in BARE else cloud.normals)
    size, camera = (240, 180), looking_at(cloud)

    def bias(surface: str) -> float:
        drawn = draw(cloud, camera, size, name, params={**params, "surface": surface})
        true = true_depths(drawn.view)
        both = np.isfinite(true) & np.isfinite(drawn.depth)
        error = (drawn.depth[both] - true[both]) / spacing
        return float(error[np.abs(error) < 4].mean())

    assert bias("nearest") < -0.3
    most = 0.05 if name == "auto_splats" else 0.05 * max(1.0, noise / 0.3)
    assert abs(bias("local")) < most


@pytest.mark.backend("auto_splats")
def test_without_noise_auto_splats_move_onto_round_bodies(draw: Draw) -> None:
    """Discs at the points lie outside of it."""
    cloud = replace(sphere(COUNT), radii=None, normals=None)
    camera, bias = looking_at(cloud), {}
    for surface in ("nearest", "local"):
        drawn = draw(cloud, camera, SIZE, "auto_splats", params={"surface": surface})
        true = true_depths(drawn.view)
        both = np.isfinite(true) & np.isfinite(drawn.depth)
        bias[surface] = float(np.median(drawn.depth[both] - true[both])) / typical_spacing(cloud)
    assert -0.05 < bias["nearest"] < 2 * bias["local"] < 0, bias


@pytest.mark.parametrize(("name", "params"), [each for each in SPLATS if each.id.split()[0] != "auto_splats"])
def test_without_noise_it_is_the_nearest_splat(draw: Draw, name: str, params: dict[str, object]) -> None:
    cloud = sphere(COUNT)
    cloud = replace(cloud, radii=None, normals=None if name in BARE else cloud.normals)
    nearest, local = (
        draw(cloud, looking_at(cloud), SIZE, name, params={**params, "surface": surface})
        for surface in ("nearest", "local")
    )
    for channel, values in nearest.arrays().items():
        np.testing.assert_array_equal(values, local.arrays()[channel], channel)
    assert "too little noise" in local.stats.chosen["surface"]


@pytest.mark.backend("surfels")
@pytest.mark.parametrize("enlarge", [1.0, 2.0])
def test_feeds_give_the_same_bits(draw: Draw, enlarge: float) -> None:
    """Where a rasteriser moves corners, a pixel may have another one of its splats in its layer."""
    cloud = noisy_sphere(0.3)
    first, *others, tiles = (
        surfels(draw, cloud, looking_at(cloud), instancing=feed, enlarge=enlarge)
        for feed in (*BUFFERS, "tiles")
    )
    for other in others:
        for channel, values in first.arrays().items():
            np.testing.assert_array_equal(values, other.arrays()[channel], channel)
    same = (tiles.id == first.id) & np.isfinite(first.depth)
    assert same.mean() > 0.98 * np.isfinite(first.depth).mean()
    splats = len(cloud) * float(cloud.radii[0]) ** 2 / 4  # that a pixel shows of a unit sphere
    error = np.abs(tiles.depth[same] / first.depth[same] - 1)
    assert np.count_nonzero(error > 1e-4 + moved(first)[same]) <= splats * at_borders(first)


@pytest.mark.backend("surfels")
@pytest.mark.slow
def test_the_order_of_points_does_not_matter(draw: Draw) -> None:
    cloud = noisy_sphere(0.3)
    order = np.random.default_rng(2).permutation(len(cloud))
    shuffled = PointCloud.from_arrays(
        cloud.world()[order], normals=cloud.normals[order], radii=cloud.radii[order], origin=cloud.origin
    )
    first, second = (surfels(draw, each, looking_at(cloud)) for each in (cloud, shuffled))
    np.testing.assert_array_equal(order[second.row[second.row != NOTHING]], first.row[first.row != NOTHING])
    # The noise is that of other points.
    np.testing.assert_allclose(first.depth, second.depth, rtol=0.01)


@pytest.mark.backend("surfels")
def test_layers_that_lie_apart_stay_apart(draw: Draw) -> None:
    """A noisy sphere in one that is half as large: the mean is that of the front alone."""
    outer = noisy_sphere(0.2, 6000)
    inner = PointCloud.from_arrays(0.5 * outer.world(), normals=outer.normals, radii=outer.radii)
    both = PointCloud.from_arrays(
        np.concatenate([outer.world(), inner.world()]),
        normals=np.concatenate([outer.normals, inner.normals]),
        radii=np.concatenate([outer.radii, inner.radii]),
    )
    drawn = surfels(draw, both, looking_at(outer))
    true = true_depths(drawn.view)
    shown = np.isfinite(drawn.depth) & np.isfinite(true)
    error = (drawn.depth[shown] - true[shown]) / typical_spacing(outer)
    assert abs(np.median(error)) < 0.15  # the noise is half as large in one of the spheres
    assert (error > 4).mean() < 0.01


@pytest.mark.parametrize(("name", "params"), SPLATS)
def test_the_background_estimates_the_noise(
    renderer: Renderer, draw: Draw, name: str, params: dict[str, object]
) -> None:
    cloud = replace(noisy_sphere(0.3), radii=None)
    request = Request(
        Pose(0, 0.0, "noisy", cloud), looking_at(cloud), name, backend(name).params({**params, **LOCAL})
    )
    surface = Surface(renderer.gpu, SIZE)
    while render_frame(renderer, request, surface, wait=False):
        pass
    finished = draw(cloud, looking_at(cloud), SIZE, name, params={**params, **LOCAL})
    np.testing.assert_array_equal(surface.depth, finished.depth)


@pytest.mark.backend("surfels")
def test_a_picture_goes_by_the_last_known_noise_of_its_scan(renderer: Renderer) -> None:
    scan, other = ScanKey(), ScanKey()
    clouds = [replace(noisy_sphere(noise), radii=None) for noise in (0.3, 0.4)]
    drawn_by = backend("surfels")
    surface = Surface(renderer.gpu, SIZE)

    def words(pose: Pose, wait: bool) -> str:
        request = Request(pose, looking_at(clouds[0]), drawn_by, drawn_by.params(LOCAL))
        is_refinable = render_frame(renderer, request, surface, wait=wait)
        assert is_refinable == ("until" in surface.stats.chosen["surface"] or "last" in words_of())
        return words_of()

    def words_of() -> str:
        return surface.stats.chosen["surface"]

    def unknown(cloud: PointCloud, scan: ScanKey) -> tuple[Pose, Future[Noise]]:
        """A pose whose noise is being estimated, and what ends that."""
        pose, future = Pose(1, 0.0, "noisy", replace(cloud), scan=scan), Future[Noise]()
        renderer.resident(pose).cached(PoseNoise)._future = future
        return pose, future

    assert words(Pose(0, 0.0, "first", clouds[0], scan=scan), wait=True) == words_of()
    stranger, _ = unknown(clouds[1], other)
    assert "until" in words(stranger, wait=False), "another scan tells nothing"
    second, future = unknown(clouds[1], scan)
    assert "in the last frame" in words(second, wait=False)
    future.set_result(noise_of(clouds[1]))
    own = words(second, wait=False)
    assert "in the last frame" not in own
    shown = surface.depth
    words(Pose(2, 0.0, "again", replace(clouds[1]), scan=scan), wait=True)
    np.testing.assert_array_equal(shown, surface.depth)


def test_noise_tells_how_thick_layers_are() -> None:
    assert not Layer(Noise(0.08, 1.0)).is_local
    little, more, most = (Layer(Noise(deviation, 1.0)) for deviation in (0.081, 0.3, 2.0))
    assert 0 < little.thickness < 0.1 < more.thickness < most.thickness
    assert 1 > little.smoothing > more.smoothing >= most.smoothing == 0.5
    assert not Layer(None).known
