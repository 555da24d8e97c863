"""Deviations from the surface that points show: of balls and sheets, with noise, and none over holes."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.analysis.deviation.reference import ESTIMATED, STORED, PointReference, deviation_reference
from viewer.analysis.deviation.statistics import DeviationStatistics
from viewer.errors import InputError
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

NO_FACES = np.zeros((0, 3), np.uint32)


def ball(count: int, radius: float = 1.0) -> np.ndarray:
    """Points spread evenly over a ball (Fibonacci)."""
    number = np.arange(count) + 0.5
    polar, turn = np.arccos(1 - 2 * number / count), np.pi * (1 + 5**0.5) * number
    return radius * np.stack(
        [np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=1
    )


def pose(points: np.ndarray, **attributes: np.ndarray) -> Pose:
    return Pose.of(0, 0.0, "reference", PointCloud.from_arrays(points, **attributes))


@pytest.mark.parametrize("has_normals", [True, False])
@pytest.mark.parametrize("origin", [0.0, 1e5])
def test_a_ball_is_left_by_as_much_as_points_leave_it(has_normals: bool, origin: float) -> None:
    points = ball(8000)
    normals = {"normals": points} if has_normals else {}
    reference = PointReference(pose(points + origin, **normals))
    assert reference.outside_by == (STORED if has_normals else ESTIMATED)
    directions = ball(777)
    for radius in (0.7, 0.95, 1.0, 1.05, 2.0):
        found = reference.signed(radius * directions + origin, 1.5)
        assert np.isfinite(found).all()
        np.testing.assert_allclose(found, radius - 1, atol=2e-4 + 2e-8 * origin)


def test_noise_of_the_reference_is_averaged() -> None:
    rng = np.random.default_rng(1)
    flat = np.stack(np.meshgrid(np.arange(60.0), np.arange(60.0)), axis=-1).reshape(-1, 2)
    noisy = np.column_stack([flat, rng.normal(0, 0.1, len(flat))])
    reference = PointReference(pose(noisy, normals=np.broadcast_to([0, 0, 1.0], noisy.shape)))
    places = np.column_stack([rng.uniform(5, 54, (4000, 2)), np.full(4000, 2.0)])
    found = reference.signed(places, 5.0) - 2
    assert abs(found.mean()) < 0.01
    assert found.std() < 0.07


@pytest.mark.parametrize("is_random", [False, True])
def test_values_cover_the_area_that_the_reference_covers(is_random: bool) -> None:
    rng = np.random.default_rng(2)
    flat = np.stack(np.meshgrid(np.arange(80.0), np.arange(80.0)), axis=-1).reshape(-1, 2)
    if is_random:
        flat = rng.uniform(0, 79, (6400, 2))
    flat = flat[np.linalg.norm(flat - 40, axis=1) > 15]  # a hole
    reference = PointReference(pose(np.column_stack([flat, 0 * flat[:, 0]])))
    places = rng.uniform(-20, 100, (40_000, 2))
    found = np.isfinite(reference.signed(np.column_stack([places, np.full(len(places), 0.5)]), 10.0))
    edge = np.minimum(np.minimum(places, 79 - places).min(axis=1), np.linalg.norm(places - 40, axis=1) - 15)
    margin = 2.0 if is_random else 1.5
    assert found[edge > margin].mean() > (0.998 if is_random else 0.9999)
    assert not found[edge < -margin].any()
    area, truth = found.mean() * 120**2, 79**2 - np.pi * 15**2
    assert abs(area / truth - 1) < 0.02


def test_nothing_is_found_beyond_the_reach_or_at_the_centre_of_a_ball() -> None:
    reference = PointReference(pose(ball(8000)))
    found = reference.signed(np.array([[0, 0, 1.31], [0, 0, 1.29], [0, 0, 0.0]]), 0.3)
    assert np.isnan(found).tolist() == [True, False, True]
    assert np.isnan(reference.signed(np.zeros((1, 3)), 2.0)).all(), "every direction is as good"


def test_faces_are_used_where_there_are_some() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, np.nan, 0], [1, 1, 0], [0, 1, 0]], float)
    faces = np.array([[0, 1, 3], [0, 3, 4], [0, 1, 2]], np.uint32)
    found = deviation_reference(pose(corners), faces).signed(np.array([[0.5, 0.5, -0.25]]), 1.0)
    assert found.tolist() == [-0.25]


def test_a_reference_without_points_is_refused() -> None:
    with pytest.raises(InputError, match="no points"):
        deviation_reference(pose(np.zeros((0, 3))), NO_FACES)


def test_statistics() -> None:
    found = DeviationStatistics.of(np.array([3.0, -4.0, np.nan, np.nan], np.float32))
    assert found.mean == -0.5
    assert found.rms == pytest.approx(12.5**0.5)
    assert (found.max, found.share) == (4.0, 0.5)
    assert found.p95 == pytest.approx(3.95)
    none = DeviationStatistics.of(np.full(3, np.nan))
    assert none.share == 0
    assert np.isnan(none[:4]).all()
