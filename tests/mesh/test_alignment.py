"""Drift of calibrations: found where there is one, none where there is none, and corrected."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from covering import bumpy_ball, places_on, scanned, times_covered
from scenes import sphere_mesh

from viewer.mesh.merging.alignment import drifts, refine
from viewer.mesh.merging.merged import merge_views
from viewer.mesh.triangles import Mesh
from viewer.scan.range_view import RangeView
from viewer.simulate.scanner import Faults

SIZE = (240, 180)
OFF = Faults(noise=0.002, calibration_error=1.0)
RIGHT = Faults(noise=0.002)


@pytest.fixture(scope="module")
def ball() -> Mesh:
    return bumpy_ball()


def degrees_between(first: RangeView, second: RangeView, true: tuple[RangeView, RangeView]) -> float:
    """By how many degrees two views are turned against each other, beside what is true of them."""
    turns = [
        given.world_to_camera[:3, :3].T @ of.world_to_camera[:3, :3]
        for given, of in zip((first, second), true, strict=True)
    ]
    cosine = (np.trace(turns[0].T @ turns[1]) - 1) / 2
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


@pytest.mark.slow
def test_a_right_calibration_has_no_drift(ball: Mesh) -> None:
    for faults in (Faults(), RIGHT, Faults(noise=0.01)):
        views = scanned(ball, SIZE, faults, faults)
        (drift,) = drifts(views).values()
        assert not drift.is_significant
        assert drift.shift < 3 * drift.shift_error
        refined = refine(views)
        assert all(motion.is_identity for motion in refined.motions)
        assert refined.views == tuple(views)


@pytest.mark.slow
def test_a_degree_is_found_and_corrected(ball: Mesh) -> None:
    views, true = scanned(ball, SIZE, RIGHT, OFF), scanned(ball, SIZE, RIGHT, RIGHT)
    assert degrees_between(*views, true) == pytest.approx(1.0, abs=1e-3)
    (drift,) = drifts(views).values()
    assert drift.is_significant
    assert drift.loose == 0
    assert drift.rotation == pytest.approx(1.0, abs=max(0.1, 3 * drift.rotation_error))
    refined = refine(views)
    assert degrees_between(*refined.views, true) < 0.1
    assert refined.motions[0].is_identity
    assert not refined.motions[1].is_identity
    (left,) = drifts(refined.views).values()
    assert not left.is_significant
    assert left.shift < 0.02 * drift.shift


@pytest.mark.slow
def test_the_view_that_is_off_is_the_one_that_moves(ball: Mesh) -> None:
    views = scanned(ball, (160, 120), OFF, RIGHT, RIGHT, RIGHT)
    moved = [np.abs(motion.matrix - np.eye(4)).max() for motion in refine(views).motions]
    assert moved[0] > 5 * max(moved[1:])


@pytest.mark.slow
def test_refined_views_are_merged_as_if_they_had_been_right(ball: Mesh) -> None:
    views = scanned(ball, SIZE, RIGHT, OFF)
    plain, refined = merge_views(views), merge_views(views, refined=True)
    assert plain.drifted
    assert not refined.drifted
    assert refined.competition.overlap[1] < 0.01
    (pair,) = refined.facts()["pairs"]
    assert pair["drift"]["is_significant"]
    assert not pair["drift_left"]["is_significant"]
    assert pair["depth_rmse"] < 0.2 * plain.facts()["pairs"][0]["depth_rmse"]
    places = places_on(ball)
    true = scanned(ball, SIZE, RIGHT, RIGHT)
    before, after = (times_covered(each, places, 0.02) for each in (true, refined.views))
    assert np.count_nonzero(before.astype(bool) & (after == 0)) <= 0.005 * np.count_nonzero(before)


def test_what_slides_is_left_alone() -> None:
    """A ball turns on itself however it is measured: no rotation about its middle is told of it."""
    views = scanned(sphere_mesh(96), SIZE, RIGHT, RIGHT)
    (drift,) = drifts(views).values()
    assert drift.loose == 3
    assert not drift.is_significant


def test_views_that_do_not_overlap_stay(ball: Mesh) -> None:
    left, right = scanned(ball, (120, 90), RIGHT, OFF)
    away = right.world_to_camera.copy()
    away[:3, 3] += 50
    apart = left, replace(right, world_to_camera=away)
    assert drifts(apart) == {}
    assert all(motion.is_identity for motion in refine(apart).motions)
    found = merge_views(apart, refined=True)
    assert found.facts()["pairs"][0]["drift"] is None
    assert [view.valid().sum() for view in found.views] == [view.valid().sum() for view in apart]


def test_far_from_zero_nothing_changes(ball: Mesh) -> None:
    views = scanned(ball, (160, 120), RIGHT, OFF)
    far = [moved_by(view, np.array([4e5, 5.5e6, 200.0])) for view in views]
    (near_drift,), (far_drift,) = drifts(views).values(), drifts(far).values()
    assert far_drift.rotation == pytest.approx(near_drift.rotation, rel=1e-3)
    assert far_drift.translation == pytest.approx(near_drift.translation, rel=1e-3)


def moved_by(view: RangeView, shift: np.ndarray) -> RangeView:
    matrix = view.world_to_camera.copy()
    matrix[:3, 3] -= matrix[:3, :3] @ shift
    return replace(view, world_to_camera=matrix)
