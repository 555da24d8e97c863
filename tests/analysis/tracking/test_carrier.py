"""Many landmarks of one frame are carried by its surface, as far as that is seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from experiments.landmarks.known import KeptFrames
from moving_hills import SPACING, MovingHills, key, placed, truth

from viewer.analysis.landmarks import Landmark
from viewer.analysis.surface_point import SurfacePoint
from viewer.analysis.track import Known, Track
from viewer.analysis.tracking import Tracker, track_landmarks
from viewer.scan.points import PointCloud
from viewer.scan.timeline import Timeline
from viewer.task import Cancelled, Task

FRAMES = 4
SIDE = np.linspace(-15.0, 15.0, 11)
PLACES = [(float(x), float(y)) for x in SIDE for y in SIDE]
MIDDLE = len(PLACES) // 2


def landmarks(frame: int = 0) -> list[Landmark]:
    return [placed(f"{number}", key(*place, frame)) for number, place in enumerate(PLACES)]


def timeline_of(source: MovingHills) -> Timeline:
    return Timeline(source, source.times(), "mm")


def errors(tracks: Mapping[str, Track]) -> np.ndarray:
    """How far off, (N, T)."""
    paths = [truth(*place, FRAMES) for place in PLACES]
    found = [tracks[f"{number}"].positions for number in range(len(PLACES))]
    return np.linalg.norm(np.array(found) - paths, axis=2)


def test_many_landmarks_are_followed_to_both_ends_and_know_how_well() -> None:
    tracks = track_landmarks(timeline_of(MovingHills(FRAMES)), landmarks(1))
    off, sigmas = errors(tracks), np.array([track.sigmas for track in tracks.values()])
    assert off[:, 1].max() < 1e-9
    others = np.arange(FRAMES) != 1
    assert np.median(off[:, others]) < 0.1 * SPACING
    assert np.quantile(off[:, others], 0.95) < 0.3 * SPACING
    assert (off <= 2 * sigmas)[:, others].mean() > 0.9


def test_in_a_hole_there_are_gaps_and_the_other_landmarks_go_on() -> None:
    def hole(frame: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.hypot(x, y) < (5 * SPACING if frame == 1 else 0)

    source = MovingHills(FRAMES, hole=hole, broken=frozenset({2}))
    tracks = track_landmarks(timeline_of(source), landmarks())
    middle = tracks[f"{MIDDLE}"]
    assert middle.known.tolist() == [Known.PLACED, Known.GAP, Known.GAP, Known.CARRIED]
    assert "damaged" in middle.reasons[2]
    assert "hole" in middle.reasons[1]
    off = errors(tracks)
    assert np.nanmax(off) < 0.6 * SPACING
    assert np.isnan(off[:, 1]).mean() < 0.1
    assert not np.isnan(off[:, 3]).any()


@pytest.mark.slow
def test_a_cancelled_run_goes_on_with_the_same_surface() -> None:
    whole = track_landmarks(timeline_of(MovingHills(FRAMES)), landmarks())
    timeline = timeline_of(MovingHills(FRAMES))
    begun = Tracker(timeline, landmarks())
    task = Task("tracking")
    with task.current():
        run = begun.run()
        assert next(run) == 1
        task.cancel()
        with pytest.raises(Cancelled):
            next(run)
    left_out = landmarks()[:3]
    later = Tracker(timeline, left_out, known=begun)
    assert list(later.run()) == [2, 3]
    for landmark in left_out:
        np.testing.assert_array_equal(later.tracks[landmark.name].positions, whole[landmark.name].positions)


def test_points_that_recur_tell_positions_exactly() -> None:
    rest = MovingHills(1, noise=0.0).load(0)
    moves = [np.array([0.8 * frame, -0.3 * frame, 0.5 * frame]) for frame in range(FRAMES)]
    orders = [np.random.default_rng(frame).permutation(len(rest)) for frame in range(FRAMES)]
    clouds = [
        PointCloud.from_arrays((rest.world() + move)[order])
        for move, order in zip(moves, orders, strict=True)
    ]
    scan = KeptFrames("hills", clouds, np.arange(float(FRAMES)))
    tracks = track_landmarks(Timeline(scan, scan.times(), "mm"), landmarks())
    ways = np.array([track.positions - track.positions[0] for track in tracks.values()])
    assert np.nanmax(np.abs(ways - np.array(moves))) < 1e-6


def test_the_doubt_of_the_keys_is_told_and_a_landmark_off_the_surface_is_a_gap() -> None:
    doubt = 3 * SPACING
    unsure = (doubt**2, 0.0, 0.0, doubt**2, 0.0, doubt**2)
    there: list[Landmark] = []
    for landmark in landmarks():
        spot: SurfacePoint = landmark.keys[0]
        there.append(replace(landmark, keys=(replace(spot, covariance=unsure),)))
    beside = replace(key(0.0, 0.0, 0), position=(0.0, 0.0, 50.0))
    source = MovingHills(2)
    sure, told = (
        track_landmarks(timeline_of(source), [*those, placed("beside", beside)])
        for those in (landmarks(), there)
    )
    for landmark in there:
        one, other = sure[landmark.name], told[landmark.name]
        np.testing.assert_array_equal(one.known[1], other.known[1])
        np.testing.assert_allclose(other.sigmas[1] ** 2, one.sigmas[1] ** 2 + doubt**2, rtol=1e-6)
    assert told["beside"].known.tolist() == [Known.PLACED, Known.GAP]
    assert "no surface" in told["beside"].reasons[1]
