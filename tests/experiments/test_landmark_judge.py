"""The judge of tracked landmarks: it finds the errors, the calibration and the gaps that are put in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from experiments.landmarks.known import KnownScan, resampled_demo, scanned_demo, shuffled_mesh
from experiments.landmarks.landmark_judge import judge_tracking, judge_tracks, keyed_landmarks

from viewer.analysis.landmarks import Landmark
from viewer.analysis.track import Known, Track
from viewer.scan.demo import DemoSource
from viewer.scan.timeline import Timeline


@pytest.fixture(scope="module")
def known() -> KnownScan:
    return resampled_demo("demo:smile:1", 0.0, range(20, 36, 2), behind=84.0)


def tracks_of(known: KnownScan, errors: np.ndarray, sigma: float) -> dict[str, Track]:
    """Tracks that are off along x by errors (T, N), and say that sigma is their standard deviation."""
    times = known.source.times()
    covariances = np.tile(sigma**2 * np.diag([1.0, 0.25, 0.0]), (len(times), 1, 1))
    return {
        name: Track(
            times,
            known.paths[:, number] + errors[:, number, None] * (1, 0, 0),
            covariances,
            np.full(len(times), Known.TRACKED, np.uint8),
        )
        for number, name in enumerate(known.names)
    }


@pytest.mark.slow
def test_landmarks_are_set_once_at_the_truth(known: KnownScan) -> None:
    landmarks = keyed_landmarks(known)
    assert [landmark.name for landmark in landmarks] == list(known.names)
    for number, landmark in enumerate(landmarks):
        (key,) = landmark.keys
        assert (key.frame, key.position) == (0, tuple(known.paths[0, number]))
        assert key.spread is not None
        assert not key.spread.any()
        near = known.source.load(0).world(np.array([key.id]))[0]
        assert np.linalg.norm(near - key.position) < 1.5 * known.spacing
    later = replace(known, counted=np.arange(8)[:, None].repeat(len(known.names), 1) >= 3)
    assert {landmark.keys[0].frame for landmark in keyed_landmarks(later)} == {3}
    assert [key.frame for key in keyed_landmarks(later, keys=3)[0].keys] == [3, 5, 7]


def test_errors_and_their_calibration_are_found(known: KnownScan) -> None:
    errors = np.abs(np.random.default_rng(0).normal(0, 0.1, known.counted.shape))
    told = judge_tracks(known, tracks_of(known, errors, 0.1), 0.25)
    assert (told.frames, told.landmarks, told.seconds) == (8, len(known.names), 0.25)
    np.testing.assert_allclose(
        [told.median, told.p95, told.worst], np.quantile(errors, [0.5, 0.95, 1]), rtol=1e-9
    )
    assert told.within == np.mean(errors <= 0.2)
    assert (told.hidden, told.gaps_false) == (0, 0)
    assert np.isnan(told.gaps_hit)


def test_gaps_are_told_right_from_false(known: KnownScan) -> None:
    hidden = np.zeros_like(known.hidden)
    hidden[2:6, 0] = True  # four frames of one landmark
    hidden_there = replace(known, hidden=hidden, counted=~hidden)
    tracks = tracks_of(known, np.where(hidden, 50.0, 0.1), 0.1)
    (name, other), times = known.names[:2], known.source.times()
    for landmark, frames in ((name, [2, 3, 4]), (other, [7])):
        states = tracks[landmark].known.copy()
        states[frames] = Known.GAP
        tracks[landmark] = replace(tracks[landmark], known=states)
    told = judge_tracks(hidden_there, tracks)
    assert (told.hidden, told.gaps_hit) == (4, 0.75)
    assert told.gaps_false == pytest.approx(1 / (len(times) * len(known.names) - 4))
    assert told.worst == pytest.approx(0.1)  # what is hidden has no place that could be right


def test_nothing_tracked_is_no_number(known: KnownScan) -> None:
    pending = {name: Track.pending(known.source.times()) for name in known.names}
    told = judge_tracks(known, pending)
    assert np.isnan([told.median, told.p95, told.worst, told.within]).all()


def test_a_tracker_is_judged_by_what_it_gives(known: KnownScan) -> None:
    """One that holds still is as wrong as the places move."""

    def still(timeline: Timeline, landmarks: Sequence[Landmark]) -> dict[str, Track]:
        tracks = tracks_of(known, np.zeros(known.counted.shape), 1.0)
        return {
            landmark.name: replace(
                tracks[landmark.name], positions=np.tile(landmark.keys[0].position, (len(timeline), 1))
            )
            for landmark in landmarks
        }

    told = judge_tracking(known, still)
    assert told.worst == pytest.approx(np.linalg.norm(known.paths - known.paths[0], axis=2).max())
    assert told.worst > 0.5
    assert told.seconds >= 0


@pytest.mark.slow
def test_places_are_hidden_where_no_pod_sees_them() -> None:
    """One pod, from the front: the sides of the head come and go as it turns, its middle stays."""
    (known,) = scanned_demo("demo:sway:1", [0.0], range(0, 64, 8), pods=1)
    side, middle = known.names.index("tragion left"), known.names.index("pronasale")
    assert known.counted[:, middle].all()
    assert known.hidden[:, side].any()
    assert known.counted[:, side].any()
    assert not (known.hidden & known.counted).any()
    for frame in range(8):
        points = known.source.load(frame).world()
        nearest = np.array([np.linalg.norm(points - place, axis=1).min() for place in known.paths[frame]])
        assert nearest[known.counted[frame]].max() < 2.01 * known.spacing
        assert (nearest[known.hidden[frame]] > 1.99 * known.spacing).all()


@pytest.mark.slow
def test_a_shuffled_mesh_has_its_vertices_in_another_order_in_each_frame() -> None:
    known = shuffled_mesh(DemoSource("demo:smile:1"), "smile", 3, seed=1)
    first, second = (known.source.load(index).world() for index in (0, 1))
    assert np.median(np.linalg.norm(first - second, axis=1)) > 20.0  # mm
    for frame, points in enumerate((first, second)):
        for place in known.paths[frame]:
            assert np.linalg.norm(points - place, axis=1).min() < 1e-4
    assert known.counted.all()
