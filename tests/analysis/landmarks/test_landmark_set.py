"""Sets of landmarks: their frames, and whether they are of this scan."""

from __future__ import annotations

import numpy as np
import pytest
from landmark_sets import assert_same, moving

from viewer.analysis.landmarks.landmark_set import LandmarkNotes, LandmarkSet, why_apart
from viewer.analysis.track import Known, Track
from viewer.bounds import Bounds


def test_a_set_of_tracks_is_tracks_again() -> None:
    rng = np.random.default_rng(1)
    times = np.arange(5) / 10
    tracks = {name: Track.pending(times) for name in ("a", "b")}
    for track in tracks.values():
        track.known[:] = [Known.PLACED, Known.TRACKED, Known.GAP, Known.PENDING, Known.TRACKED]
        there = track.known >= Known.TRACKED
        track.positions[there] = rng.normal(size=(3, 3))
        track.covariances[there] = np.eye(3) * rng.random((3, 1, 1))
    found = LandmarkSet.of_tracks(tracks, "mm", {"b": "the second"})
    assert found.about == ("", "the second")
    again = found.tracks(times)
    for name, track in tracks.items():
        np.testing.assert_array_equal(again[name].positions, track.positions)
        np.testing.assert_array_equal(again[name].known, track.known)
        np.testing.assert_allclose(again[name].sigmas, track.sigmas)


def test_tracks_of_a_scan_of_other_frames() -> None:
    some = LandmarkSet.of(["a"], np.ones((3, 1, 3)), frames=[1, 4, 9])
    track = some.tracks(np.arange(6.0))["a"]
    assert (track.known == Known.PLACED).tolist() == [False, True, False, False, True, False]
    assert np.isfinite(track.positions[[1, 4]]).all()


def test_a_set_has_each_frame_between_its_first_and_its_last() -> None:
    some = LandmarkSet.of(["a"], np.ones((2, 1, 3)), frames=[2, 5], times=np.array([0.2, 0.5]))
    even = some.even_rows()
    np.testing.assert_array_equal(even.frames, [2, 3, 4, 5])
    np.testing.assert_allclose(even.times, [0.2, 0.3, 0.4, 0.5])
    assert even.known[:, 0].tolist() == [Known.PLACED, Known.GAP, Known.GAP, Known.PLACED]
    assert_same(moving().even_rows(), moving())


BOX = Bounds(np.array([-90.0, 20, 500]), np.array([90.0, 240, 650]))


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (1.0, None),
        (0.001, "are multiplied by 1000. The landmarks"),
        (1000.0, "are multiplied by 0.001. The landmarks"),
        (np.array([-1, -1, 1]), "signs of x and y are reversed"),
        (-7.0, "belong to another scan"),
    ],
)
def test_landmarks_of_another_scan_are_told(factor: float, words: str | None) -> None:
    rng = np.random.default_rng(2)
    points = BOX.low + rng.random((1, 9, 3)) * (BOX.high - BOX.low)
    told = why_apart(
        LandmarkSet.of([f"{n}" for n in range(9)], points * factor, notes=LandmarkNotes("mm")), BOX
    )
    if words is None:
        assert told is None
    else:
        assert told is not None
        assert words in told


def test_landmarks_that_any_unit_would_shrink_into_the_scan_tell_none() -> None:
    """A scan about the origin has room for landmarks of any other, made small enough."""
    about_the_origin = Bounds(np.full(3, -50.0), np.full(3, 50.0))
    points = 1000.0 + 20 * np.random.default_rng(2).random((1, 9, 3))
    told = why_apart(
        LandmarkSet.of([f"{n}" for n in range(9)], points, notes=LandmarkNotes("mm")), about_the_origin
    )
    assert told is not None
    assert told.endswith("the landmarks belong to another scan")


def test_one_place_that_is_off_is_told() -> None:
    points = np.full((1, 9, 3), 100.0) + np.array([0, 0, 450])
    points[0, 3] += 400
    points[0, 5] = np.nan
    told = why_apart(LandmarkSet.of([f"{n}" for n in range(9)], points, notes=LandmarkNotes("mm")), BOX)
    assert told is not None
    assert told.startswith("1 of 8 positions do not lie on the scan")
    assert why_apart(LandmarkSet.of(["a"], np.full((1, 1, 3), np.nan)), BOX) is None
