"""Landmarks are followed through all frames, in the order of need, and what nobody knows is a gap."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from moving_hills import SPACING, MovingHills, key, placed, truth
from scenes import rarely

from viewer.analysis.track import Known, Track
from viewer.analysis.tracking import Tracker, TrackingSettings, track_landmarks
from viewer.analysis.tracking.blending import track_of
from viewer.analysis.tracking.follower import Sighting
from viewer.errors import InputError
from viewer.scan.points import PointCloud
from viewer.scan.timeline import Timeline
from viewer.task import Cancelled, Task

FRAMES = 7
PLACES = {"middle": (0.0, 0.0), "beside": (6.0, -5.0)}


def timeline_of(source: MovingHills) -> Timeline:
    return Timeline(source, source.times(), "mm")


def errors(track: Track, place: tuple[float, float]) -> np.ndarray:
    return np.linalg.norm(track.positions - truth(*place, len(track.times)), axis=1)


@pytest.mark.parametrize("frame", [*rarely(0), 3])
def test_landmarks_are_followed_to_both_ends(frame: int) -> None:
    landmarks = [placed(name, key(*place, frame)) for name, place in PLACES.items()]
    tracks = track_landmarks(timeline_of(MovingHills(FRAMES)), landmarks)
    assert list(tracks) == list(PLACES)
    for name, place in PLACES.items():
        track = tracks[name]
        assert track.known[frame] == Known.PLACED
        assert (np.delete(track.known, frame) == Known.TRACKED).all()
        assert not track.reasons
        off = errors(track, place)
        assert off.max() < 0.25 * SPACING
        others = np.arange(FRAMES) != frame
        assert (off <= 3 * track.sigmas)[others].all()
        assert off[frame] < 1e-9


def test_a_hole_is_a_gap_and_the_landmark_is_found_again() -> None:
    def hole(frame: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.hypot(x, y) < (4 * SPACING if frame in (3, 4) else 0)

    tracks = track_landmarks(
        timeline_of(MovingHills(FRAMES, hole=hole)), [placed("middle", key(0.0, 0.0, 0))]
    )
    track = tracks["middle"]
    assert track.known.tolist() == [4, 2, 2, 1, 1, 2, 2]
    assert sorted(track.reasons) == [3, 4]
    assert "hole" in track.reasons[3]
    assert np.isnan(track.positions[3]).all()
    assert np.isnan(track.sigmas[4])
    assert np.nanmax(errors(track, (0.0, 0.0))) < 0.25 * SPACING


def test_between_keys_both_sides_count_and_a_key_that_was_moved_is_met() -> None:
    first, last = key(0.0, 0.0, 0), key(0.5, 0.0, 6)  # the second one is set half a unit beside
    track = track_landmarks(timeline_of(MovingHills(FRAMES)), [placed("middle", first, last)])["middle"]
    assert track.known.tolist() == [4, 2, 2, 2, 2, 2, 4]
    off = errors(track, (0.0, 0.0))
    assert (np.diff(off) > -0.1).all()
    assert 0.15 < off[3] < 0.4
    assert track.sigmas[3] > track.sigmas[1]


def test_what_is_marked_as_missing_is_a_gap() -> None:
    landmark = replace(placed("middle", key(0.0, 0.0, 0)), missing=(2,))
    track = track_landmarks(timeline_of(MovingHills(4)), [landmark])["middle"]
    assert track.known.tolist() == [4, 2, 1, 2]
    assert track.reasons == {2: "you marked the landmark as not visible"}


def test_a_broken_frame_is_a_gap() -> None:
    source = MovingHills(5, broken=frozenset({2}))
    landmarks = [placed("middle", key(0.0, 0.0, 0)), placed("beside", key(6.0, -5.0, 4))]
    track = track_landmarks(timeline_of(source), landmarks)["middle"]
    assert track.known.tolist() == [4, 2, 1, 2, 2]
    assert "damaged" in track.reasons[2]
    assert source.read.count(2) == 1
    lost = track_landmarks(timeline_of(source), [placed("middle", key(0.0, 0.0, 2))])["middle"]
    assert lost.known.tolist() == [1, 1, 4, 1, 1]
    assert source.read.count(2) == 2, "once for each scan"


def test_the_frame_looked_at_comes_first_and_frames_are_read_once_in_each_direction() -> None:
    source = MovingHills(FRAMES)
    landmarks = [placed(name, key(*place, 3)) for name, place in PLACES.items()]
    tracker = Tracker(timeline_of(source), landmarks, first=1)
    order = tracker.run()
    assert [next(order), next(order)] == [2, 1]
    assert all(track.known[1] == Known.TRACKED for track in tracker.tracks.values())
    assert all(track.known[5] == Known.PENDING for track in tracker.tracks.values())
    tracker.look_at(5)
    assert [next(order), next(order)] == [4, 5]
    assert 0 < tracker.progress < 1
    assert sorted(order) == [0, 6]
    assert tracker.progress == 1
    assert len(source.read) <= FRAMES + 4


@pytest.mark.slow
def test_only_what_changed_is_tracked_anew() -> None:
    source = MovingHills(FRAMES)
    timeline = timeline_of(source)
    landmarks = [placed(name, key(*place, 0)) for name, place in PLACES.items()]
    before = Tracker(timeline, landmarks)
    list(before.run())
    corrected = landmarks[0].with_key(key(*PLACES["middle"], 4))
    after = Tracker(timeline, [corrected, landmarks[1]], known=before)
    assert after.tracks["beside"] is before.tracks["beside"]
    assert after.tracks["middle"].known.tolist() == [4, 2, 2, 2, 4, 0, 0]
    assert sorted(after.run()) == [0, 1, 2, 3, 5, 6]
    assert after.tracks["beside"] is before.tracks["beside"]
    assert after.tracks["middle"].is_whole
    assert errors(after.tracks["middle"], PLACES["middle"]).max() < 0.25


def test_a_cancelled_tracker_goes_on_later() -> None:
    tracker = Tracker(timeline_of(MovingHills(4)), [placed("middle", key(0.0, 0.0, 0))])
    task = Task("tracking")
    with task.current():
        run = tracker.run()
        assert next(run) == 1
        task.cancel()
        with pytest.raises(Cancelled):
            next(run)
    assert tracker.tracks["middle"].known.tolist() == [4, 2, 0, 0]
    assert list(tracker.run()) == [2, 3]
    assert tracker.tracks["middle"].is_whole


def test_one_topology_is_followed_exactly() -> None:
    from viewer.analysis.pick import Neighbor
    from viewer.analysis.surface_point import SurfacePoint
    from viewer.geometry import vector
    from viewer.scan.demo import DemoSource

    source = DemoSource()
    timeline = Timeline(source, source.times(), source.unit)
    row = 4321
    spot = SurfacePoint(
        0,
        0.0,
        vector(timeline.pose(0).cloud.world(row)),
        row,
        1.0,
        0,
        None,
        (Neighbor(row, (0.0, 0.0, 0.0)),),
    )
    tracker = Tracker(timeline, [placed("point", spot)])
    for frame in tracker.run():
        if frame >= 5:
            break
    track = tracker.tracks["point"]
    for frame in range(6):
        assert np.array_equal(track.positions[frame], timeline.pose(frame).cloud.world(row))


@pytest.mark.parametrize("names", [("far", "near"), *rarely(("near", "far"))])
def test_landmarks_in_one_place_are_each_followed_as_far_as_they_go(names: tuple[str, str]) -> None:
    first = key(0.0, 0.0, 0)
    landmarks = {"far": placed("far", first), "near": placed("near", first, key(0.0, 0.0, 2))}
    tracks = track_landmarks(timeline_of(MovingHills(5)), [landmarks[name] for name in names])
    assert tracks["far"].known.tolist() == [4, 2, 2, 2, 2]
    assert tracks["near"].known.tolist() == [4, 2, 4, 2, 2]


def test_where_points_are_the_same_a_place_that_follows_none_is_followed_by_its_surface() -> None:
    class Same(MovingHills):
        def load(self, index: int) -> PointCloud:
            return replace(super().load(index), topology="hills")

    timeline = timeline_of(Same(5))
    landmark = placed("middle", key(0.0, 0.0, 0), key(0.0, 0.0, 2))
    before = Tracker(timeline, [landmark])
    list(before.run())
    farther = Tracker(timeline, [landmark.without_key(2)], known=before)
    list(farther.run())
    track = farther.tracks["middle"]
    assert track.known.tolist() == [4, 2, 2, 2, 2]
    assert errors(track, (0.0, 0.0)).max() < 0.25 * SPACING


def test_keys_that_are_certain_are_blended_half_and_half() -> None:
    def sighting(x: float) -> Sighting:
        return Sighting(np.array([x, 0.0, 0.0]), np.zeros((3, 3)))

    first, last = (replace(key(0.0, 0.0, frame), position=(0.0, 0.0, 0.0)) for frame in (0, 2))
    forward, backward = {1: sighting(1.0), 2: sighting(0.0)}, {1: sighting(3.0), 0: sighting(0.0)}
    track = track_of(
        placed("middle", first, last),
        {(first, 1): forward, (last, -1): backward},
        10.0,
        Track.pending(np.arange(3.0)),
        range(3),
    )
    assert track.known.tolist() == [4, 2, 4]
    assert track.positions[1].tolist() == [2, 0, 0]
    assert track.sigmas[1] == 1


def test_a_scan_of_one_frame_and_landmarks_that_are_not_placed() -> None:
    from viewer.analysis.landmarks import Landmark

    tracks = track_landmarks(
        timeline_of(MovingHills(1)),
        [placed("middle", key(0.0, 0.0, 0)), Landmark("none"), placed("late", key(0.0, 0.0, 3))],
    )
    assert tracks["middle"].known.tolist() == [4]
    assert "none" not in tracks
    assert tracks["late"].known.tolist() == [1]


def test_settings_are_numbers_above_zero() -> None:
    with pytest.raises(InputError):
        TrackingSettings(bound=-1.0)


@pytest.mark.slow
def test_what_an_earlier_tracker_saw_of_a_key_is_told_where_another_key_changes() -> None:
    timeline = timeline_of(MovingHills(FRAMES))
    landmark = replace(placed("middle", key(0.0, 0.0, 0), key(0.0, 0.0, 4)), missing=(6, FRAMES + 3))
    before = Tracker(timeline, [landmark])
    assert before.tracks["middle"].known.tolist() == [4, 0, 0, 0, 4, 0, 1]
    for _ in before.run():
        pass
    changed = replace(landmark.without_key(0), missing=(5,))
    after = Tracker(timeline, [changed], known=before).tracks["middle"]
    assert after.known.tolist() == [2, 2, 2, 2, 4, 1, 2]
    np.testing.assert_array_equal(after.known == Known.GAP, [key in after.reasons for key in range(FRAMES)])


def test_a_landmark_that_was_set_in_a_frame_that_is_not_there_is_a_gap_in_all() -> None:
    track = Tracker(timeline_of(MovingHills(3)), [placed("middle", key(0.0, 0.0, 5))]).tracks["middle"]
    assert track.known.tolist() == [Known.GAP] * 3
