"""The mean of rest frames has less noise than each of them; what moves between them is not averaged."""

from __future__ import annotations

import numpy as np
import pytest
from rigid_hills import POINTS, RigidHills, opened

from viewer.analysis.motion.rest import mean_of_rest
from viewer.analysis.motion.stabilise import MotionReference
from viewer.errors import InputError

NOISE = 0.05
FRAMES = (0, 1, 2, 4, 5, 6)


def test_noise_falls_and_what_moves_stays() -> None:
    timeline = opened(RigidHills(7, noise=NOISE, rise=0.6, lacking=frozenset({5})))
    pose = timeline.pose(0)
    world = pose.cloud.world()
    x = world[:, 0]
    start = MotionReference.of(pose, np.flatnonzero(x < 6), 0)
    mean = mean_of_rest(timeline, pose, start, FRAMES)
    assert mean.frames == (0, 1, 2, 4, 6)
    assert list(mean.left_out) == [5]
    exact = opened(RigidHills(1, noise=0.0)).pose(0).cloud.world()
    moves, still = x > 15, (np.abs(world[:, 1]) < 17) & (x > -17) & (x < 5)
    assert (mean.counts[moves] == 1).mean() > 0.95
    assert mean.counts[still].mean() > 4.8
    before, after = (np.std((found - exact)[still, 2]) for found in (world, mean.pose.cloud.world()))
    assert 0.95 < before / NOISE < 1.05
    assert before / 5 < after < before / np.sqrt(5)
    assert mean.pose.count == POINTS
    assert mean.pose.index == 0


def test_frames_that_do_not_fit_have_no_mean() -> None:
    timeline = opened(RigidHills(3, lacking=frozenset({1, 2})))
    pose = timeline.pose(0)
    start = MotionReference.of(pose, np.arange(pose.count), 0)
    with pytest.raises(InputError, match="no other frame fits"):
        mean_of_rest(timeline, pose, start, (0, 1, 2))
