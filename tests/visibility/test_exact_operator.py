"""The exact operator: what a sphere shows, any radius and distance, degenerate points; and Katz's radius."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import sphere

from viewer.errors import InputError
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.visibility.exact import as_cloud, exact_visible_points, katz_radius

COUNT = 4000
SPACING = np.sqrt(4 * np.pi / COUNT)


def spread(count: int = COUNT) -> np.ndarray:
    """Points of a sphere of radius 1, in float64."""
    return sphere(count).positions.astype(np.float64)


def farthest(points: np.ndarray, eye: np.ndarray) -> float:
    return float(np.linalg.norm(points - eye, axis=1).max())


def before_horizon(points: np.ndarray, eye: np.ndarray) -> np.ndarray:
    """By how much points of the unit sphere lie before its horizon: positive in front, a length."""
    return points @ (eye / np.linalg.norm(eye)) - 1 / np.linalg.norm(eye)


@pytest.mark.parametrize("eye", [(0, 0, 3.0), (0.3, 1.2, -0.2), (1e3, 0, 0), (1e6, -2e5, 1e5)])
def test_of_a_sphere_the_front_is_seen_and_the_back_is_not(eye: tuple[float, float, float]) -> None:
    points, at = spread(), np.array(eye)
    seen = np.zeros(COUNT, bool)
    seen[exact_visible_points(points, at, farthest(points, at))] = True
    before = before_horizon(points, at)
    assert seen[before > 0].all()
    assert not seen[before < -2 * SPACING].any()


@pytest.mark.parametrize("times", [1e2, 1e4, 1e6, 1e8])
@pytest.mark.parametrize("eye", [(0, 0, 3.0), (0, 1e6, 0), (0.1, 0.2, 0.3)])
def test_a_larger_radius_loses_no_point(eye: tuple[float, float, float], times: float) -> None:
    points, at = spread(), np.array(eye)
    least = farthest(points, at)
    smaller, larger = (exact_visible_points(points, at, least * by) for by in (1.0, times))
    assert np.isin(smaller, larger).all()


def test_far_away_what_is_seen_goes_by_the_radius_over_the_distance() -> None:
    """A hull in which R or the distance cancels leaves some hundred of them."""
    points, at = spread(), np.array([1e6, 0.0, 0.0])
    far = exact_visible_points(points, at, 1e12)
    near = exact_visible_points(points, at, 1e9)
    assert np.isin(near, far).all()
    assert COUNT / 2 < len(near) <= len(far) < COUNT


@pytest.mark.parametrize("eye", [(0, 0, 2.5), (0.2, 0.1, 0.3), (0.9, 0.9, 0.9)])
@pytest.mark.parametrize("times", [1.5, 30.0, 1e3])
def test_open3d_says_the_same(eye: tuple[float, float, float], times: float) -> None:
    from open3d import geometry, utility

    rng = np.random.default_rng(3)
    points = spread() * rng.uniform(0.8, 1.2, (COUNT, 1))
    radius = times * farthest(points, np.array(eye))
    cloud = geometry.PointCloud(utility.Vector3dVector(points))
    _, rows = cloud.hidden_point_removal(np.array(eye), radius)
    np.testing.assert_array_equal(exact_visible_points(points, eye, radius), np.sort(rows))


def test_of_two_spheres_the_one_behind_is_hidden() -> None:
    points = np.concatenate([spread(), 0.5 * spread() + [0, 0, -3]])
    at = np.array([0, 0, 4.0])
    seen = exact_visible_points(points, at, 30 * farthest(points, at))
    assert seen.max() < COUNT
    assert np.isin(np.flatnonzero(before_horizon(points[:COUNT], at) > 0), seen).all()


@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_scale_and_place_do_not_matter(scale: float) -> None:
    points, at = spread(), np.array([0, 0.5, 3.0])
    radius = 100 * farthest(points, at)
    seen = exact_visible_points(points, at, radius)
    scaled = exact_visible_points(points * scale, at * scale, radius * scale)
    moved = exact_visible_points(points + 4096.0, at + 4096.0, radius)
    np.testing.assert_array_equal(scaled, seen)
    assert len(np.setxor1d(moved, seen)) < 0.01 * len(seen)


def test_ids_are_those_of_the_file() -> None:
    points = spread()
    broken = np.insert(points, [0, 10], np.nan, axis=0)
    seen = exact_visible_points(points, (0, 0, 3), 400)
    expected = np.delete(np.arange(len(broken)), [0, 11])[seen]
    cloud = PointCloud.from_arrays(broken)
    for given in (broken, cloud, Pose(0, 0.0, "", cloud)):
        found = exact_visible_points(given, (0, 0, 3), 400)
        assert found.dtype == np.uint32
        np.testing.assert_array_equal(found, expected)


LINE = np.array([[0, 0, -1], [0, 0, -2], [0, 0, -3]], float)


@pytest.mark.parametrize(
    ("points", "seen"),
    [
        (np.zeros((0, 3)), []),
        ([[0, 0, 0]], [0]),  # in the eye
        ([[0, 0, 0], [0, 0, -1], [0, 0, -2]], [0, 1]),
        ([[1, 2, 3]], [0]),
        (LINE, [0]),
        (LINE[::-1], [2]),
        ([[0, 0, -1], [0, 0, 2], [0, 0, -3], [0, 0, 4]], [0, 1]),  # on both sides
        ([[0, 0, -1], [0.1, 0, -1]], [0, 1]),
        ([[0, 0, -1], [0.1, 0, -1], [0, 0.1, -1]], [0, 1, 2]),
        ([[-0.1, 0, -1], [0.1, 0, -1], [0, 0, -3], [0, 0, -0.9]], [0, 1, 3]),  # a plane through the eye
        ([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [5, 0.1, 0]], [0, 1, 2, 3]),  # all round in a plane
    ],
)
def test_few_and_flat_points(points: object, seen: list[int]) -> None:
    np.testing.assert_array_equal(exact_visible_points(np.array(points, float), (0, 0, 0), 8.0), seen)


@pytest.mark.parametrize("eye", [(0, 0, 0), (3.0, 0, 0)])
def test_a_circle_in_a_slanted_plane_through_the_eye(eye: tuple[float, float, float]) -> None:
    angle = np.linspace(0, 2 * np.pi, 100, endpoint=False)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    at = np.array(eye)
    seen = np.zeros(100, bool)
    seen[exact_visible_points(circle @ turn, at @ turn, 4.0)] = True
    expected = (circle * at).sum(axis=1) > 1 if at.any() else np.ones(100, bool)
    assert seen[expected].all()
    assert seen.sum() <= expected.sum() + 4


def test_a_flat_grid_before_the_eye_is_seen() -> None:
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(-1, 1, 21), np.linspace(-1, 1, 21)))
    grid = np.stack([x, y, np.full(x.size, -2.0)], axis=1)
    assert len(exact_visible_points(grid, (0, 0, 0), 1000.0)) == len(grid)
    behind = np.concatenate([grid, grid[grid[:, :2].max(axis=1) < 0.5] * [1, 1, 2]])
    seen = exact_visible_points(behind, (0, 0, 0), 50.0)
    assert seen.max() < len(grid)


def test_of_points_in_one_place_one_is_seen() -> None:
    points = np.repeat(spread(500), 2, axis=0)
    seen = exact_visible_points(points, (0, 0, 3), 400)
    assert len(np.unique(seen // 2)) == len(seen)
    np.testing.assert_array_equal(np.unique(seen // 2), exact_visible_points(spread(500), (0, 0, 3), 400))


def test_what_cannot_be_is_refused() -> None:
    points = spread()
    for radius in (3.9, 0.0, np.nan, np.inf):
        with pytest.raises(InputError, match=r"does not contain all points\. Use a radius larger than"):
            exact_visible_points(points, (0, 0, 3), radius)
    for eye in ((0, 0), (0, 0, np.nan), [[0, 0, 3]]):
        with pytest.raises(InputError, match="the eye must have three finite coordinates"):
            exact_visible_points(points, eye, 400)
    with pytest.raises(InputError, match=r"shape \(12,\)"):
        exact_visible_points(np.zeros(12), (0, 0, 3), 400)
    with pytest.raises(InputError, match="no points"):
        katz_radius(np.zeros((0, 3)), (0, 0, 3))


@pytest.mark.slow
def test_katz_finds_a_radius_that_tells_front_from_back() -> None:
    """Of a sphere with dents, which small radii lose."""
    points = spread()
    points *= 1 + 0.1 * np.sin(6 * points).prod(axis=1)[:, None]
    at = np.array([0, 0, 3.0])
    radius = katz_radius(points, at)
    seen = {name: exact_visible_points(points, at, radius * by) for name, by in (("found", 1), ("less", 0.1))}
    other = exact_visible_points(points, -at, radius)
    assert len(seen["less"]) < len(seen["found"]) < 0.6 * COUNT
    assert len(np.intersect1d(seen["found"], other)) < 0.1 * COUNT
    more, others = (exact_visible_points(points, side, 30 * radius) for side in (at, -at))
    assert len(np.setxor1d(more, others)) < len(np.setxor1d(seen["found"], other))


def test_a_cloud_is_taken_as_it_is() -> None:
    cloud = sphere(100)
    assert as_cloud(cloud) is cloud
    assert as_cloud(Pose(0, 0.0, "", cloud)) is cloud
