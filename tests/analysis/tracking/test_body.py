"""The nodes of a body go along with its limbs, each with its own."""

from __future__ import annotations

import numpy as np
import pytest
from experiments.landmarks.known import KeptFrames
from scenes import rarely
from swinging_arms import APART, LONG, SPACING, THICK, arms, on_arm

from viewer.analysis.landmarks import Landmark
from viewer.analysis.surface_point import SurfacePoint
from viewer.analysis.track import Known
from viewer.analysis.tracking import track_landmarks
from viewer.analysis.tracking.body import DeformableBody
from viewer.analysis.tracking.registration import rotations
from viewer.geometry import vector
from viewer.scan.points import PointCloud
from viewer.scan.timeline import Timeline

ENDS = np.array([[THICK, 0.0, 3 - LONG], [-THICK, 0.0, 3 - LONG], [THICK, 0.0, -LONG / 2]])


@pytest.mark.slow
def test_limbs_that_swing_past_each_other_are_not_taken_for_one_another() -> None:
    body = DeformableBody(arms(0), SPACING)
    grips = {side: [body.gripped(place) for place in on_arm(0, side, ENDS)] for side in (-1, 1)}
    farthest = 0.0
    for frame in range(1, 7):
        body.move_to(arms(frame))
        for side, held in grips.items():
            carried = np.array([body.carried(grip)[0] for grip in held])
            own, other = (np.linalg.norm(carried - on_arm(frame, on, ENDS), axis=1) for on in (side, -side))
            assert (own < 1.5 * body.distance).all()
            assert (own < other).all()
        still = on_arm(frame - 1, 1, ENDS)
        farthest = max(farthest, np.linalg.norm(on_arm(frame, 1, ENDS) - still, axis=1).max())
    assert farthest > 3 * body.distance, "the arms are too slow to tell"


def test_a_place_turns_with_the_body() -> None:
    body = DeformableBody(arms(0), SPACING)
    grip = body.gripped(on_arm(0, 1, ENDS)[2])
    for frame in (1, 2):
        body.move_to(arms(frame))
    (x, _, z) = on_arm(2, 1, np.array([[0.0, 0, -1]]))[0] - on_arm(2, 1, np.zeros((1, 3)))[0]
    (x0, _, z0) = on_arm(0, 1, np.array([[0.0, 0, -1]]))[0] - on_arm(0, 1, np.zeros((1, 3)))[0]
    wanted = np.arctan2(x, z) - np.arctan2(x0, z0)
    _, turn = body.carried(grip)
    assert abs(wanted) > 0.3
    assert abs(np.arctan2(turn[0, 2], turn[0, 0]) - wanted) < 0.15
    assert np.allclose(turn @ turn.T, np.eye(3))


def test_an_empty_frame_leaves_it_where_it_was() -> None:
    body = DeformableBody(arms(0), SPACING)
    body.move_to(np.empty((0, 3)))
    assert np.array_equal(body.pose.positions, DeformableBody(arms(0), SPACING).pose.positions)


@pytest.mark.parametrize("count", [1, *rarely(20)])
def test_a_few_points_are_a_body_too(count: int) -> None:
    points, motion = arms(0)[:count], np.array([0, 0, 0.5])
    body = DeformableBody(points, SPACING)
    grip = body.gripped(points[0])
    body.move_to(points + motion)
    assert np.allclose(body.carried(grip)[0], points[0] + motion, atol=0.2)


def test_landmarks_of_limbs_are_told_on_their_own_limb() -> None:
    places = [*on_arm(0, -1, ENDS), *on_arm(0, 1, ENDS)]
    keys = [SurfacePoint(0, 0.0, vector(place), None, SPACING, 0, (0.0,) * 6) for place in places]
    landmarks = [Landmark(f"{number}").with_key(key) for number, key in enumerate(keys)]
    clouds = [PointCloud.from_arrays(arms(frame)) for frame in range(5)]
    source = KeptFrames("arms", clouds, np.arange(5.0))
    with Timeline(source, source.times(), "mm") as timeline:
        tracks = track_landmarks(timeline, landmarks)
    told = 0
    for side, track in zip([-1] * 3 + [1] * 3, tracks.values(), strict=True):
        for frame in np.flatnonzero(track.known == Known.TRACKED):
            assert track.positions[frame, 1] * side > APART - 1.5 * THICK
            told += 1
    assert told >= 8


def test_points_far_from_all_others_are_no_part_of_it() -> None:
    points = np.concatenate([arms(0), np.random.default_rng(3).uniform(200, 900, (40, 3))])
    body = DeformableBody(points, SPACING)
    assert body.pose.positions.max() < 100
    assert body.distance < 10 * SPACING


@pytest.mark.parametrize("away", [100.0, 1e6])
def test_a_node_that_is_torn_off_a_flat_body_keeps_a_map(away: float) -> None:
    flat = np.stack(np.meshgrid(np.arange(30.0), np.arange(30.0), [0.0]), axis=-1).reshape(-1, 3)
    body = DeformableBody(flat, 1.0)
    pose, wanted = body.pose, body.pose.positions.copy()
    wanted[len(wanted) // 2, 2] += away
    pulls = np.broadcast_to(np.eye(3), (len(wanted), 3, 3))
    for _ in range(6):
        pose = body.strained(pose, 0.1, pulls, wanted)
    assert np.abs(pose.turns).max() < 2


def test_nearest_rotations_are_those_of_the_singular_values() -> None:
    chance = np.random.default_rng(0)
    matrices = chance.normal(size=(400, 3, 3))
    matrices[:100] *= 1e-9
    matrices[100:200, :, 2] = 0.0  # as of the edges of a flat node
    left, _, right = np.linalg.svd(matrices)
    left[..., 2] *= np.linalg.det(left @ right)[:, None]
    assert np.allclose(rotations(matrices), left @ right, atol=1e-10)
    lines = chance.normal(size=(20, 3, 1)) * chance.normal(size=(20, 1, 3))  # which leave a turn open
    found = rotations(np.concatenate([lines, np.zeros((1, 3, 3))]))
    assert np.allclose(found @ found.transpose(0, 2, 1), np.eye(3))
    assert np.allclose(np.linalg.det(found), 1)
    along = (found[:20] * lines).sum(axis=(1, 2))
    assert np.allclose(along, np.linalg.norm(lines, axis=(1, 2)))
