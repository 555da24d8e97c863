"""Organised grids of points as range views: whose calibration, and when x and y stay as measured."""

from __future__ import annotations

import numpy as np
import pytest
from range_scenes import camera_points

from viewer.scan.grids import view_of_camera
from viewer.scan.image_poses import UPRIGHT

DOWN = np.array([1, -1, -1])  # between a camera's axes and an image's


def grid(shape: str = "sphere", fx: float = 110.0, fy: float = 105.0) -> np.ndarray:
    """Points (97, 121, 3) in the image's axes that a pinhole sees, rounded to float32."""
    row, column = np.mgrid[:97, :121].astype(float)
    points, _ = camera_points(shape, (column + 0.5 - 60.8) / fx, (47.9 - row - 0.5) / fy, "z")
    return (points * DOWN).astype(np.float32)


@pytest.mark.parametrize("shape", ["sphere", "plane"])
def test_a_pinhole_is_found_in_its_points(shape: str) -> None:
    points = grid(shape)
    view = view_of_camera(points, UPRIGHT, "camera", "m")
    assert (view.fx, view.fy, view.cx, view.cy) == pytest.approx((110, 105, 60.8, 47.9), abs=1e-4)
    assert (view.kind, view.xy, view.name, view.unit) == ("z", None, "camera", "m")
    seen = np.isfinite(points).all(axis=2)
    assert np.array_equal(view.valid(), seen)
    assert np.array_equal(view.depth[seen], points[seen][:, 2])
    assert view.positions() == pytest.approx(points[seen] * DOWN, abs=1e-5)


def test_places_off_the_rays_are_kept() -> None:
    points = grid()
    points[..., 0] += 0.01 * np.sin(5 * points[..., 1])  # a quarter of a pixel
    view = view_of_camera(points, UPRIGHT, "camera", "m")
    seen = np.isfinite(points).all(axis=2)
    assert view.xy is not None
    assert np.array_equal(view.positions(), points[seen] * DOWN)
    pixels, _ = view.project(view.positions())
    assert np.abs(pixels - np.argwhere(seen)[:, ::-1] - 0.5).max() < 1


@pytest.mark.parametrize(
    "points",
    [
        grid() * DOWN,  # behind it
        grid()[::-1],
        grid()[:, ::-1],
        np.random.default_rng(1).uniform(1, 2, (97, 121, 3)).astype(np.float32),
        np.full((97, 121, 3), np.nan, np.float32),
        np.ones((97, 121, 3), np.float32),
        np.full((97, 121, 3), np.inf, np.float32),
    ],
)
def test_what_no_camera_has_measured(points: np.ndarray) -> None:
    assert view_of_camera(points, UPRIGHT, "camera", "m") is None


def test_a_laser_that_turns_round_is_no_camera() -> None:
    azimuth, elevation = np.meshgrid(np.linspace(0, 2 * np.pi, 512), np.linspace(0.2, -0.4, 32))
    points = 5 * np.stack([np.cos(azimuth), np.sin(azimuth), np.tan(elevation)], axis=2)
    assert view_of_camera(points.astype(np.float32), UPRIGHT, "laser", "m") is None
