"""Calibration: numbers that suit a cloud, against their formulas."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scenes import sphere

from viewer.scan.points import NOTHING, PointCloud
from viewer.visibility.calibration import body_of, calibrate
from viewer.visibility.search import calibrated
from viewer.visibility.sectors import Sectors

EYE = np.array([0.0, 0.0, 4.0])


def test_half_of_the_sectors_inside_the_outline_have_a_point() -> None:
    """Eq. 5, on points at random all over the front."""
    towards = np.random.default_rng(0).uniform(-1, 1, (20_000, 2))
    points = np.column_stack([towards, np.zeros(len(towards))])
    found = calibrated(points, EYE)
    sectors, origin = found.sectors, PointCloud.from_arrays(points).origin
    home = sectors.sector_of(sectors.sector_positions(points - origin))
    counts = np.bincount(home[home != NOTHING], minlength=found.sectors.count)
    inside = found.occupied * found.sectors.count
    # The edge is on a scale of four steps an octave.
    assert np.count_nonzero(counts) / inside == pytest.approx(0.5, abs=0.08)


@pytest.mark.parametrize("depth", [0.5, 2.0])
def test_the_radius_is_that_of_the_formula(depth: float) -> None:
    """cos(alpha / 2) = (2R - 1 - d) / (2R - 1) at unit distance, d being so many alphas."""
    cloud = sphere(5000)
    sectors = Sectors.around(np.zeros(3), 1.0, EYE, cloud.origin)
    found = calibrate(cloud, sectors, cloud.origin, depth)
    alpha = 2 * found.sectors.angle
    surface = np.linalg.norm(cloud.positions - EYE, axis=1).mean()
    radius, d = found.radius / surface, depth * alpha
    assert math.cos(alpha / 2) == pytest.approx((2 * radius - 1 - d) / (2 * radius - 1), rel=1e-6)


def test_parallel_rays_are_the_limit_of_an_eye_far_away() -> None:
    cloud = sphere(5000)
    far = Sectors.around(np.zeros(3), 1.0, 1e6 * EYE, cloud.origin)
    flat = Sectors.along(np.zeros(3), 1.0, np.array([0.0, 0.0, -1.0]), cloud.origin)
    one, other = (calibrate(cloud, each, cloud.origin, 2.0) for each in (far, flat))
    assert other.radius == math.inf
    assert one.sectors.edge == other.sectors.edge
    assert one.sectors.weight == pytest.approx(other.sectors.weight, rel=1e-5)


@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_scale_and_copies_change_nothing(scale: float) -> None:
    points = np.asarray(sphere(2000).positions, np.float64)
    one = calibrated(points, EYE)
    scaled = calibrated(points * scale, EYE * scale)
    copied = calibrated(np.repeat(points, 50, axis=0), EYE)
    for other, factor in ((scaled, scale), (copied, 1.0)):
        assert other.sectors.edge == one.sectors.edge
        assert other.sectors.weight == pytest.approx(one.sectors.weight, rel=1e-4)
        assert other.radius / factor == pytest.approx(one.radius, rel=1e-4)


def test_one_far_outlier_leaves_the_body_as_it_is() -> None:
    points = np.concatenate([sphere(2000).positions, [[1e5, 0, 0]]])
    body = body_of(PointCloud.from_arrays(points))
    assert body.radius == pytest.approx(1, rel=0.01)
    assert body.count == 2001


def test_steps_close_the_gaps_between_visible_points() -> None:
    found = calibrated(sphere(5000).positions, EYE)
    for factor in (1, 2, 4):
        sectors, steps, _ = found.with_sectors(factor * found.sectors.edge)
        apart = np.sqrt(found.occupied * sectors.count / 2500)  # half of the points are seen
        assert 0.6 * apart < steps < 2 * apart
