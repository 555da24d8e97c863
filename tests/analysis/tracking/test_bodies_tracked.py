"""Landmarks of files are followed on a moving body, with as much doubt as following adds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from experiments.landmarks.known import KeptFrames
from swinging_arms import LONG, SPACING, THICK, arms, on_arm

from viewer.analysis.landmarks import Landmark
from viewer.analysis.landmarks.files import read_landmarks, write_landmarks
from viewer.analysis.landmarks.landmark_set import LandmarkNotes, LandmarkSet
from viewer.analysis.landmarks.placed import landmarks_of
from viewer.analysis.surface_point import SurfacePoint
from viewer.analysis.track import Known, Track
from viewer.analysis.tracking import TrackingSettings, track_landmarks
from viewer.analysis.tracking.body import DeformableBody
from viewer.analysis.tracking.follower import Follower
from viewer.analysis.tracking.hold import Hold
from viewer.analysis.tracking.registration import Placement, patch_of
from viewer.analysis.tracking.surface import MomentSurface
from viewer.analysis.tracking.tracker import _lose, _move_apart
from viewer.geometry import vector
from viewer.scan.points import PointCloud
from viewer.scan.timeline import Timeline

FRAMES = 4
ENDS = np.array([[0.0, 0.0, -LONG], [0.0, THICK, -LONG]])  # the middle of the flat end, and its rim
PATHS = np.array([[*on_arm(frame, -1, ENDS), *on_arm(frame, 1, ENDS)] for frame in range(FRAMES)])


def timeline(frames: Sequence[np.ndarray] | None = None) -> Timeline:
    frames = [arms(n) for n in range(FRAMES)] if frames is None else frames
    clouds = [PointCloud.from_arrays(points) for points in frames]
    source = KeptFrames("arms", clouds, np.arange(float(len(clouds))))
    return Timeline(source, source.times(), "mm")


def tracks_of(landmarks: list[Landmark], scan: Timeline) -> list[Track]:
    return list(track_landmarks(scan, landmarks).values())


def keyed(sigma: float, scale: float = 1.0) -> list[Landmark]:
    six = (sigma**2, 0.0, 0.0, sigma**2, 0.0, sigma**2)
    return [
        Landmark(f"{n}").with_key(SurfacePoint(0, 0.0, vector(place), None, scale * SPACING, 0, six))
        for n, place in enumerate(scale * PATHS[0])
    ]


@pytest.mark.slow
def test_landmarks_of_a_file_without_deviations_are_tracked_on_a_moving_body(tmp_path: Path) -> None:
    file = tmp_path / "ends.mrk.json"
    write_landmarks(file, LandmarkSet.of(["a", "b", "c", "d"], PATHS[:1], notes=LandmarkNotes("mm")))
    with timeline() as scan:
        found = list(landmarks_of(read_landmarks(file, "mm"), scan.visit, FRAMES, 0))
        tracks = tracks_of(found, scan)
    told = np.array([track.known[1:] == Known.TRACKED for track in tracks])
    assert told.mean() > 0.8
    off = np.array(
        [np.linalg.norm(track.positions - PATHS[:, n], axis=1)[1:] for n, track in enumerate(tracks)]
    )
    assert off[told].max() < SPACING


def test_the_doubt_of_the_key_is_told_and_makes_no_gap() -> None:
    with timeline() as scan:
        sure, unsure = (tracks_of(keyed(sigma), scan) for sigma in (0.0, 3 * SPACING))
    for one, other in zip(sure, unsure, strict=True):
        np.testing.assert_array_equal(one.known, other.known)
        told = one.known == Known.TRACKED
        np.testing.assert_allclose(other.sigmas[told] ** 2, one.sigmas[told] ** 2 + 9 * SPACING**2, rtol=1e-6)
        assert one.sigmas[told].max() < SPACING


def test_the_unit_of_a_scan_changes_lengths_alone() -> None:
    scale = 64.0  # changes the exponents of numbers, and no digit
    frames = [arms(n) for n in range(2)]
    with timeline(frames) as scan, timeline([scale * places for places in frames]) as scaled:
        for one, other in zip(tracks_of(keyed(0.0), scan), tracks_of(keyed(0.0, scale), scaled), strict=True):
            np.testing.assert_array_equal(other.known, one.known)
            np.testing.assert_allclose(other.positions, scale * one.positions, rtol=1e-6)
            np.testing.assert_allclose(other.sigmas, scale * one.sigmas, rtol=1e-6)


def followers(*places: tuple[float, float, float]) -> list[Follower]:
    surface = MomentSurface(arms(0), SPACING)
    keys = [SurfacePoint(0, 0.0, place, None, SPACING, 0) for place in places]
    return [Follower(key, surface, np.zeros(3), TrackingSettings()) for key in keys]


def test_a_body_is_followed_where_any_two_landmarks_move_apart() -> None:
    surface = MomentSurface(arms(0), SPACING)
    far = 1.01 * max(0.04 * surface.size, 3 * SPACING)
    before = followers((0, 0, 0), (10, 0, 0), (0, 10, 0))
    assert _move_apart(before, followers((0, 0, 0), (10, 0, 0), (0, 10 + far, 0)), surface)
    assert not _move_apart(before, followers((0, 0, far), (10, 0, far), (0, 10, far)), surface)
    assert not _move_apart([], [], surface)


def test_a_body_is_followed_where_most_landmarks_are_lost() -> None:
    before, after = (followers((0, 0, 0), (10, 0, 0), (0, 10, 0)) for _ in range(2))
    after[0]._is_lost = True
    assert not _lose(before, after)
    after[1]._is_lost = True
    assert _lose(before, after)
    assert not _lose(after[:2], before[:2]), "those were lost before"


def test_stretched_edges_yield() -> None:
    body = DeformableBody(arms(0), SPACING)
    still = body._holds(body.pose)
    np.testing.assert_allclose(still, 1.0)
    places = body.pose.positions * (1.2, 1.2, 1.2)
    np.testing.assert_allclose(body._holds(type(body.pose)(places, body.pose.turns)), 0.5)


def test_a_body_comes_back_where_it_was_as_long_as_it_holds_on() -> None:
    body = DeformableBody(arms(0), SPACING)
    body.move_to(arms(1))
    assert np.quantile(body.slips, 0.95) < SPACING
    body.move_to(arms(1) + np.array([0.0, 60.0, 0.0]))  # out of reach
    body.move_to(arms(2))
    assert body.slips.max() > 2.5 * SPACING


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_a_patch_goes_along_with_a_body(angle: float) -> None:
    s, c = np.sin(angle), np.cos(angle)
    begun_turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    key = on_arm(0, 1, ENDS)[1]
    surface = MomentSurface(arms(0) @ begun_turn, SPACING)  # the key's frame: turned back
    place = key @ begun_turn
    patch = patch_of(surface, place, 9.0, 200)
    assert patch is not None
    body = DeformableBody(arms(0), SPACING)
    hold = Hold.at(body, Placement(key, begun_turn))
    grip = hold.gripped(patch)
    still = hold.bent(patch, grip)
    np.testing.assert_allclose(still.local, patch.local, atol=1e-6)
    np.testing.assert_allclose(still.normals, patch.normals, atol=1e-6)
    body.move_to(arms(1))
    carried = hold.carried()
    assert np.linalg.norm(carried.position - on_arm(1, 1, ENDS)[1]) < SPACING
    moved = hold.bent(patch, grip)
    assert np.abs(moved.local - patch.local).max() < SPACING  # an arm is rigid
    here = patch_of(MomentSurface(arms(1), SPACING), carried.position, 9.0, 200)
    assert here is not None
    back = hold.unbent(here, carried.turn)
    assert np.abs(back.local - here.local).max() < SPACING
    np.testing.assert_allclose(np.linalg.norm(back.normals, axis=1), 1.0, atol=1e-6)
