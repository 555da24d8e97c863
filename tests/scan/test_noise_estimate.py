"""Noise of points: estimated as it is, and points without it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import sphere

from viewer.scan.noise import Noise, noise_of, steadied, steady_positions
from viewer.scan.points import PointCloud

COUNT = 20_000
SPACING = np.sqrt(4 * np.pi / COUNT)
Floats = NDArray[np.float64]


def noisy(by: float, count: int = COUNT) -> Floats:
    """Points of the unit sphere, moved off it. by: standard deviation."""
    points = sphere(count).positions.astype(np.float64)
    return points * (1 + np.random.default_rng(3).normal(0, by, (count, 1)))


def off(points: NDArray) -> float:
    """How far points lie off a sphere around zero, the root of the mean square."""
    return float(np.linalg.norm(points, axis=1).std())


@pytest.mark.parametrize("times", [0.25, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
def test_noise_is_found_as_it_is(times: float, scale: float) -> None:
    by = times * SPACING
    noise = noise_of(PointCloud.from_arrays(noisy(by) * scale))
    assert noise.stands_out
    assert noise.deviation == pytest.approx(by * scale, rel=0.2)
    assert noise.spacing == pytest.approx(SPACING * scale, rel=0.2)


def test_surfaces_have_no_noise() -> None:
    bent = noisy(0) + 0.1 * np.sin(5 * noisy(0))
    cube = np.stack(np.meshgrid(np.arange(80.0), np.arange(60.0), [0.0]), axis=-1).reshape(-1, 3)
    for points in (noisy(0), bent, cube, cube * [1, 0, 0], np.zeros((500, 3)), noisy(0.1, 9)):
        assert not noise_of(PointCloud.from_arrays(points)).stands_out


def test_what_float32_rounds_off_far_from_the_origin_is_no_noise() -> None:
    """Offsets from the origin are rounded to about a spacing there; their remainders are not."""
    cloud = PointCloud.from_arrays(noisy(0) + 1e5, origin=np.zeros(3))
    assert cloud.remainders is not None
    assert not noise_of(cloud).stands_out
    assert noise_of(cloud).deviation < 0.02 * SPACING


def test_copies_are_no_noise_and_hide_none() -> None:
    points = noisy(0.5 * SPACING)
    once, often = (noise_of(PointCloud.from_arrays(np.repeat(points, times, axis=0))) for times in (1, 30))
    assert often.deviation == pytest.approx(once.deviation, rel=0.1)


@pytest.mark.parametrize(("times", "left"), [(0.25, 0.6), (1.0, 0.5), (2.0, 0.4)])
def test_noise_is_taken_off(times: float, left: float) -> None:
    by = times * SPACING
    cloud = PointCloud.from_arrays(noisy(by))
    steady = steady_positions(cloud, noise_of(cloud))
    assert off(steady) < left * by
    assert np.abs(steady - cloud.positions).max() < 9 * by


@pytest.mark.parametrize("times", [0.3, 0.6])
def test_steady_points_lie_on_the_surface_and_have_its_normals(times: float) -> None:
    cloud = PointCloud.from_arrays(noisy(times * SPACING), origin=np.zeros(3))
    steady = steadied(cloud, noise_of(cloud))
    radii = np.linalg.norm(steady.positions, axis=1)
    assert abs(radii.mean() - 1) < 0.05 * SPACING
    facing = np.abs((steady.normals * steady.positions).sum(axis=1)) / radii
    assert np.rad2deg(np.arccos(np.clip(facing, 0, 1))).mean() < 6
    np.testing.assert_allclose(np.linalg.norm(steady.normals, axis=1), 1, rtol=1e-5)


def test_points_of_a_plane_stay() -> None:
    rng = np.random.default_rng(1)
    flat = rng.random((3000, 2)) @ np.array([[1, 0.3, 0.2], [0, 0.8, -0.5]])
    cloud = PointCloud.from_arrays(flat)
    np.testing.assert_allclose(steady_positions(cloud, Noise(0.02, 0.02)), cloud.positions, atol=1e-6)


def test_what_lies_far_from_all_others_stays() -> None:
    points = np.append(noisy(SPACING), [[0, 0, 3.0], [1e9, 0, 0]], axis=0)
    cloud = PointCloud.from_arrays(points)
    steady = steady_positions(cloud, noise_of(cloud))
    np.testing.assert_array_equal(steady[-2:], cloud.positions[-2:])
    np.testing.assert_array_equal(steadied(cloud, noise_of(cloud)).normals[-2:], 0)
    assert np.isfinite(steady).all()
    assert off(steady[:-2]) < 0.7 * SPACING


def test_points_in_one_place_stay_in_one() -> None:
    cloud = PointCloud.from_arrays(np.repeat(noisy(SPACING), 3, axis=0))
    steady = steady_positions(cloud, noise_of(cloud)).reshape(-1, 3, 3)
    np.testing.assert_array_equal(steady, steady[:, :1].repeat(3, axis=1))
