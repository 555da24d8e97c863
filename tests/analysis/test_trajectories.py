"""Trajectories of landmarks that move as is known exactly, with the head's motion and without."""

from __future__ import annotations

import math

import numpy as np
import pytest

from viewer.analysis.curves import Smoothing
from viewer.analysis.track import Known, Track
from viewer.analysis.trajectories import held_still, stabilising, trajectory_of
from viewer.errors import InputError
from viewer.rigid import Rigid

TIMES = np.arange(90) / 30
FAR = np.array([1e5, -2e5, 1e5])
ANCHORS = {"left": (40.0, 0, 0), "right": (-40.0, 0, 0), "nose": (0, -30.0, 20.0), "brow": (0, 35.0, 5.0)}


def track_of(positions: np.ndarray, variance: float = 0.01) -> Track:
    known = np.where(np.isfinite(positions).all(axis=1), Known.TRACKED, Known.GAP).astype(np.uint8)
    covariances = np.tile(variance * np.eye(3), (len(positions), 1, 1))
    covariances[known == Known.GAP] = np.nan
    return Track(TIMES, positions, covariances, known, {})


def sway() -> list[Rigid]:
    """A head that turns by 15 degrees to either side and is carried about."""
    motions = []
    for time in TIMES:
        angle = math.radians(15) * math.sin(2 * math.pi * time / 3)
        matrix = np.eye(4)
        matrix[:3, :3] = [
            [math.cos(angle), 0, math.sin(angle)], [0, 1, 0], [-math.sin(angle), 0, math.cos(angle)],
        ]  # fmt: skip
        matrix[:3, 3] = FAR + np.array([30 * angle, 5 * time, 0])
        motions.append(Rigid(matrix))
    return motions


def moved(place: np.ndarray) -> Track:
    """A track of (3,) or (T, 3) places of the head that sways."""
    places = np.broadcast_to(place, (len(TIMES), 3))
    return track_of(np.stack([motion.points(one) for motion, one in zip(sway(), places, strict=True)]))


def heads(**others: Track) -> dict[str, Track]:
    return {name: moved(np.array(place)) for name, place in ANCHORS.items()} | others


def test_a_rigid_motion_is_taken_off_and_what_moves_is_left() -> None:
    opening = np.stack([0 * TIMES, -40 - 8 * np.sin(2 * math.pi * TIMES / 3), 0 * TIMES + 15], axis=1)
    tracks = heads(chin=moved(opening))
    still = stabilising(tracks, list(ANCHORS))
    seen = trajectory_of(tracks["chin"], Smoothing(), still)
    start = sway()[0]
    np.testing.assert_allclose(seen.positions, start.points(opening), atol=1e-6)
    wanted = np.abs(8 * 2 * math.pi / 3 * np.cos(2 * math.pi * TIMES / 3))
    np.testing.assert_allclose(seen.speeds[5:-5], wanted[5:-5], atol=0.05)
    wanted = np.abs(8 * (2 * math.pi / 3) ** 2 * np.sin(2 * math.pi * TIMES / 3))
    np.testing.assert_allclose(seen.pace(2)[0][5:-5], wanted[5:-5], atol=0.5)
    for name in ANCHORS:
        fixed = trajectory_of(tracks[name], Smoothing(), still)
        assert np.ptp(fixed.positions, axis=0).max() < 1e-6
        assert fixed.speeds.max() < 1e-5
    carried = trajectory_of(tracks["chin"], Smoothing())
    np.testing.assert_array_equal(carried.positions, tracks["chin"].positions)
    assert carried.speeds.max() > seen.speeds.max()


def test_noise_of_anchors_is_spread_over_them_and_that_of_speeds_is_told() -> None:
    rng = np.random.default_rng(7)
    tracks = {
        name: track_of(track.positions + 0.1 * rng.normal(size=(90, 3))) for name, track in heads().items()
    }
    still = stabilising(tracks, list(ANCHORS))
    for motion, true in zip(still, sway(), strict=True):
        assert motion is not None
        turned = motion.rotation @ true.rotation @ sway()[0].rotation.T
        angle = math.degrees(math.acos(min((np.trace(turned) - 1) / 2, 1)))
        assert angle < 1
    line = np.stack([20 * TIMES, 0 * TIMES, 0 * TIMES], axis=1)
    noisy = [trajectory_of(track_of(line + 0.1 * rng.normal(size=(90, 3))), Smoothing()) for _ in range(100)]
    speeds = np.array([one.speeds for one in noisy])
    np.testing.assert_allclose(speeds.mean(axis=0)[5:-5], 20, atol=0.5)
    np.testing.assert_allclose(speeds.std(axis=0), noisy[0].pace(1)[1], rtol=0.3)


def test_gaps_of_landmarks_and_of_anchors_are_gaps() -> None:
    tracks = heads(chin=moved(np.array([0, -40.0, 15])))
    for name, frames in (("left", range(10, 20)), ("brow", range(15, 25)), ("chin", range(50, 60))):
        positions = tracks[name].positions.copy()
        positions[frames] = np.nan
        tracks[name] = track_of(positions)
    still = stabilising(tracks, list(ANCHORS))
    assert [frame for frame, motion in enumerate(still) if motion is None] == list(range(15, 20))
    seen = trajectory_of(tracks["chin"], Smoothing(), still)
    gaps = [*range(15, 20), *range(50, 60)]
    assert np.flatnonzero(np.isnan(seen.positions).any(axis=1)).tolist() == gaps
    assert np.flatnonzero(np.isnan(seen.speeds)).tolist() == gaps
    held = held_still(tracks["chin"], still)
    assert np.flatnonzero(held.known == Known.GAP).tolist() == gaps
    assert seen.speeds[seen.speeds > 0].max() < 1e-5


def test_what_cannot_hold_a_scan_still_is_told() -> None:
    tracks = heads(between=moved(np.array([0.0, 0, 0])))
    with pytest.raises(InputError, match="needs at least three rigid references"):
        stabilising(tracks, ["left", "right", "left"])
    with pytest.raises(InputError, match="'chin' is not placed"):
        stabilising(tracks, ["left", "right", "chin"])
    with pytest.raises(InputError, match="do not lie on one line"):
        stabilising(tracks, ["left", "right", "between"])
    hidden = tracks | {"nose": track_of(np.full((90, 3), np.nan))}
    with pytest.raises(InputError, match="no frame has three"):
        stabilising(hidden, ["left", "right", "nose"])


def test_a_mirror_image_is_no_motion() -> None:
    """Anchors in a plane leave two rotations and reflections: it has to be the rotation."""
    flat = ["left", "right", "nose"]
    tracks = heads()
    for motion in stabilising(tracks, flat):
        assert motion is not None
        assert np.linalg.det(motion.rotation) == pytest.approx(1)
