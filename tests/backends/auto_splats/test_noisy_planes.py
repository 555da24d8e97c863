"""Planes of noisy points go through all points of a wider ball and are about as right as normals of the whole
cloud. Without noise, they go through the neighbourhood."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import rarely_together, sphere
from scipy.spatial import cKDTree

import viewer
from viewer.analysis.visible_normals import NormalSearch, VisibleNormals, read_normals
from viewer.backends import backend
from viewer.backends.auto_splats import search_of
from viewer.backends.auto_splats.neighborhoods import Neighborhoods
from viewer.bench.metrics import angles_between
from viewer.bench.scenes import catalog
from viewer.bench.scenes.defects import noisy
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.request import Request
from viewer.gpu.constants import NOTHING
from viewer.mesh.reference import visible
from viewer.picture.surface import Surface
from viewer.scan.estimate import cloud_normals
from viewer.scan.noise import Noise, noise_of
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.spacing import typical_spacing

if TYPE_CHECKING:
    from viewer.drawing.renderer import Renderer

pytestmark = pytest.mark.backend("auto_splats")

NAME, SIZE = "auto_splats", (320, 240)
BENT = 0.6  # the share of the bend that counts in shaders/auto_splats/steady.comp
WORST = 1.1  # times the error of the normals of the whole cloud


def bare(cloud: PointCloud, noise: float) -> PointCloud:
    moved = noisy(noise)(cloud, np.random.default_rng(1)) if noise else cloud
    return PointCloud(moved.positions, moved.origin)


def camera_of(cloud: PointCloud) -> Camera:
    return Camera.orbit(cloud.bounds(), 30, 10, aspect=SIZE[0] / SIZE[1])


def drawn(draw: Callable[..., Surface], cloud: PointCloud, **params: Any) -> VisibleNormals:
    """The normals of the splats of a picture."""
    surface = draw(cloud, camera_of(cloud), SIZE, NAME, params={"cull": False, **params})
    return read_normals(cloud, surface.cached(Neighborhoods))


def subject(
    data_dir: Path, name: str, noise: float
) -> tuple[PointCloud, NDArray[np.floating], Callable[[VisibleNormals], NDArray[np.bool_]]]:
    """A bare cloud with noise, its true normals, and a function that tells which splats are truly seen."""
    moment = catalog.subject(name, data_dir).moment(0)
    even = moment.pose.cloud
    assert even.normals is not None
    camera, spacing = camera_of(bare(even, noise)), typical_spacing(even)

    def is_seen(found: VisibleNormals) -> NDArray[np.bool_]:
        return visible(moment.mesh, even.positions[found.rows], camera, spacing)

    return bare(even, noise), even.normals, is_seen


def errors(normals: NDArray[np.floating], true: NDArray[np.floating]) -> NDArray[np.float64]:
    """Angles without regard to the sides of normals, degrees."""
    angles = angles_between(normals, true)
    return np.minimum(angles, 180 - angles)


@pytest.mark.parametrize(
    ("name", "noise"),
    [
        ("bunny", 0.3),
        *rarely_together(
            ("bunny", 0.1), ("bunny", 0.6), ("armadillo", 0.1), ("armadillo", 0.3), ("armadillo", 0.6)
        ),
    ],
)
def test_normals_are_about_as_right_as_those_of_the_whole_cloud(
    draw: Callable[..., Surface], data_dir: Path, name: str, noise: float
) -> None:
    cloud, true, is_seen = subject(data_dir, name, noise)
    found = drawn(draw, cloud)
    seen = is_seen(found)
    rows = found.rows[seen]
    of_splats = errors(found.normals[seen], true[rows])
    of_cloud = errors(cloud_normals(cloud)[rows], true[rows])
    assert np.nanmean(of_splats) < WORST * np.nanmean(of_cloud)
    assert np.nanquantile(of_splats, 0.95) < WORST * np.nanquantile(of_cloud, 0.95)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bunny", "armadillo"])
@pytest.mark.parametrize("noise", [0.0, 0.1, 0.2, 0.3, 0.5, 1.0])
def test_normals_are_about_as_right_as_with_the_best_number_of_neighbors(
    draw: Callable[..., Surface], data_dir: Path, name: str, noise: float
) -> None:
    cloud, true, is_seen = subject(data_dir, name, noise)

    def median(found: VisibleNormals) -> float:
        seen = is_seen(found)
        return float(np.nanmedian(errors(found.normals[seen], true[found.rows[seen]])))

    fixed = [
        median(viewer.estimate_normals(cloud, camera_of(cloud), size=SIZE, search=NormalSearch(k, False)))
        for k in (6, 10, 16, 24, 32)
    ]
    assert median(drawn(draw, cloud)) < 1.1 * min(fixed)


@pytest.mark.parametrize("noise", [0.0, 0.5])
def test_scripts_get_the_normals_that_pictures_show(draw: Callable[..., Surface], noise: float) -> None:
    cloud = bare(sphere(6000), noise)
    shown = drawn(draw, cloud)
    found = viewer.estimate_normals(cloud, camera_of(cloud), size=SIZE)
    _, here, there = np.intersect1d(shown.rows, found.rows, return_indices=True)
    assert len(here) > 0.9 * len(found.rows)
    apart = np.degrees(np.arccos(np.clip((shown.normals[here] * found.normals[there]).sum(axis=1), -1, 1)))
    assert np.median(apart) < 0.1


@pytest.mark.parametrize("noise", [0.3, 0.5])
@pytest.mark.parametrize("k", [10, 16])
def test_planes_go_through_all_points_of_a_wider_ball(
    renderer: Renderer, draw: Callable[..., Surface], noise: float, k: int
) -> None:
    cloud = bare(sphere(6000), noise)
    found = drawn(draw, cloud, k=k)
    pose = renderer.resident(Pose(0, 0.0, "noisy", cloud))
    widening = search_of(backend(NAME).params({"k": k}), pose, noise_of(cloud)).widening
    assert widening > 1
    participants = cloud.positions[found.neighbors].astype(np.float64)
    places, reaches = cloud.positions[found.rows].astype(np.float64), widening * found.radii
    expected = np.empty((len(places), 3))
    gap = np.empty(len(places))
    for i, rows in enumerate(cKDTree(participants).query_ball_point(places, reaches)):
        away = (participants[rows] - places[i]) / reaches[i]
        weights = 1 - (away**2).sum(axis=1)
        values, vectors = np.linalg.eigh(np.cov(away.T, aweights=weights, ddof=0))
        expected[i], gap[i] = vectors[:, 0], values[1] - values[0]
    distinct = gap > 0.02
    assert distinct.mean() > 0.9
    away = errors(found.normals[distinct], expected[distinct])
    assert (away < 0.1).mean() > 0.99  # at outlines, some points of a ball may lie outside the cells searched


def plain_centers(
    participants: NDArray[np.float64], places: NDArray[np.float64], reaches: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Where splats of places (N, 3) lie by least squares in float64, (N, 3), and whether normals are distinct
    and the heights around bend in a way that is well known, (N,).

    Heights above the plane are a level plus a bend times the squared distance, of which BENT counts.
    """
    centers, is_clear = np.empty_like(places), np.zeros(len(places), bool)
    for i, rows in enumerate(cKDTree(participants).query_ball_point(places, reaches)):
        away = (participants[rows] - places[i]) / reaches[i]
        squared = (away**2).sum(axis=1)
        weights = 1 - squared
        values, vectors = np.linalg.eigh(np.cov(away.T, aweights=weights, ddof=0))
        heights = away @ vectors[:, 0]
        level = np.average(heights, weights=weights)
        spread = np.average(squared**2, weights=weights) - np.average(squared, weights=weights) ** 2
        terms = np.stack([np.ones(len(rows)), squared], axis=1) * np.sqrt(weights)[:, None]
        bent = np.linalg.lstsq(terms, heights * np.sqrt(weights), rcond=None)[0][0]
        centers[i] = places[i] + reaches[i] * (level + BENT * (bent - level)) * vectors[:, 0]
        is_clear[i] = values[1] - values[0] > 0.02 and spread > 0.01
    return centers, is_clear


def test_centers_of_splats_move_onto_the_surface(renderer: Renderer, draw: Callable[..., Surface]) -> None:
    cloud, even = bare(sphere(6000), 0.5), sphere(6000)
    surface = draw(cloud, camera_of(cloud), SIZE, NAME, params={"cull": False})
    found, neighborhoods = drawn(draw, cloud), surface.cached(Neighborhoods)
    pose = renderer.resident(Pose(0, 0.0, "noisy", cloud))
    widening = search_of(backend(NAME).params({}), pose, noise_of(cloud)).widening
    places = cloud.positions[found.rows].astype(np.float64)
    reaches = widening * found.radii.astype(np.float64)
    expected, is_clear = plain_centers(cloud.positions[found.neighbors].astype(np.float64), places, reaches)
    assert is_clear.mean() > 0.8
    centers = neighborhoods.read("places", np.float32, 3)[found.rows].astype(np.float64)
    spacing = typical_spacing(even)
    # Where splats are cut, their middles also move along their planes.
    off = np.abs(((centers - expected) * found.normals).sum(axis=1))[is_clear] / spacing
    assert (off < 0.01).mean() > 0.99  # at outlines, some points of a ball may lie outside the cells searched

    def distances(points: NDArray[np.float64]) -> NDArray[np.float64]:
        return (np.linalg.norm(points + (cloud.origin - even.origin), axis=1) - 1) / spacing

    assert distances(places).std() > 0.4
    assert distances(centers).std() < 0.25
    assert abs(distances(centers).mean()) < 0.1  # of a ball of three spacings on a sphere of 22


def test_the_nearest_splats_stay_at_their_points(draw: Callable[..., Surface]) -> None:
    """Moved centres show in the local surface alone."""
    cloud = bare(sphere(6000), 0.5)
    camera = camera_of(cloud)
    local, nearest = (
        draw(cloud, camera, SIZE, NAME, params={"surface": surface}).depth for surface in ("local", "nearest")
    )
    both = np.isfinite(local) & np.isfinite(nearest)
    assert np.mean(nearest[both] - local[both]) < -0.3 * typical_spacing(sphere(6000))


def test_a_noisy_floor_of_few_digits_stays_closed(draw: Callable[..., Surface]) -> None:
    """Steps of a hundredth are as wide as points are apart, and many points coincide: these make no tips."""
    rng = np.random.default_rng(3)
    floor = rng.uniform(-1, 1, (28_000, 3)) * (1, 0, 1) + rng.normal(0, 0.008, (28_000, 3)) * (0, 1, 0)
    cloud = PointCloud.from_arrays(floor.round(2))
    camera = Camera((0, 3, 0.5), (0, 0, 0), fov_y=25)
    assert (draw(cloud, camera, SIZE, NAME).coverage > 0).mean() > 0.999


@pytest.mark.parametrize(("noise", "params"), [(0.0, {}), (0.5, {"adaptive": False})])
def test_other_planes_are_those_of_neighborhoods(
    draw: Callable[..., Surface], noise: float, params: dict[str, Any]
) -> None:
    cloud = bare(sphere(6000), noise)
    found = drawn(draw, cloud, **params, surface="nearest")
    plain = viewer.estimate_normals(cloud, camera_of(cloud), size=SIZE, search=NormalSearch(**params))
    _, at, there = np.intersect1d(found.rows, plain.rows, return_indices=True)
    assert len(at) > 0.9 * len(plain.rows)
    np.testing.assert_array_equal(found.normals[at], plain.normals[there])
    np.testing.assert_array_equal(found.splat_radii[at], plain.splat_radii[there])


def test_pictures_of_noisy_points_stay_the_same(draw: Callable[..., Surface]) -> None:
    cloud = bare(sphere(6000), 0.5)
    surface = draw(cloud, camera_of(cloud), SIZE, NAME)
    assert "because the points are noisy" in surface.stats.chosen["adaptive"]
    first = surface.arrays()
    again = draw(bare(sphere(6000), 0.5), camera_of(cloud), SIZE, NAME).arrays()
    assert (first["id"] != NOTHING).any()
    for channel, values in first.items():
        np.testing.assert_array_equal(values, again[channel], channel)


def test_a_picture_is_complete_once_the_noise_is_known(
    renderer: Renderer, draw: Callable[..., Surface]
) -> None:
    cloud = bare(sphere(6000), 0.5)
    params = {"surface": "nearest", "passes": "one"}
    request = Request(Pose(0, 0.0, "noisy", cloud), camera_of(cloud), NAME, backend(NAME).params(params))
    surface = Surface(renderer.gpu, SIZE)
    while render_frame(renderer, request, surface, wait=False):
        pass
    finished = draw(cloud, camera_of(cloud), SIZE, NAME, params=params)
    np.testing.assert_array_equal(surface.normal, finished.normal)


def test_more_noise_takes_in_more_points(renderer: Renderer) -> None:
    pose = renderer.resident(Pose(0, 0.0, "points", bare(sphere(500), 0)))

    def widening(noise: float, k: int = 10) -> float:
        return search_of(backend(NAME).params({"k": k}), pose, Noise(noise, 1.0)).widening

    assert widening(0.0) == widening(0.08) == 1
    assert 1 < widening(0.1) < widening(0.3) < widening(0.6) == widening(5.0) < 2
    assert widening(0.3, k=32) < widening(0.3, k=10) == widening(0.3, k=6)
