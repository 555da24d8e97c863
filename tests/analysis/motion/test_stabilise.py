"""The rigid motion of a region is found in each frame, with how sure it is; what does not fit is a gap."""

from __future__ import annotations

import numpy as np
import pytest
from experiments.motion.heads import motion_error
from rigid_hills import RigidHills, RollingHills, opened, truth, whole

from viewer.analysis.motion.axes import anatomical_axes, weak_directions
from viewer.analysis.motion.found import found_region
from viewer.analysis.motion.stabilise import (
    FrameMotion,
    MotionReference,
    MotionState,
    WeakLimits,
    outward,
    stabilise,
)
from viewer.errors import InputError
from viewer.scan.timeline import Timeline
from viewer.task import Cancelled, Task

WORLD = np.eye(3)
LIMITS = WeakLimits(0.5)


def motions(timeline: Timeline, reference: MotionReference) -> dict[int, FrameMotion]:
    known: dict[int, FrameMotion] = {}
    for _ in stabilise(timeline, reference, LIMITS.shift, known):
        pass
    return known


@pytest.mark.parametrize("reference", [0, 3])
def test_frames_are_registered_from_the_reference_on(reference: int) -> None:
    timeline = opened(RigidHills(5))
    start = whole(timeline, reference)
    found = motions(timeline, start)
    assert sorted(found) == [0, 1, 2, 3, 4]
    assert found[reference].motion is not None
    assert found[reference].motion.is_identity
    for frame in set(found) - {reference}:
        motion = found[frame].motion
        assert motion is not None
        off, told = motion_error(motion, truth(frame, reference), start.middle), found[frame].spread(WORLD)
        assert (np.abs(off) < (0.1, 0.1, 0.1, 0.05, 0.05, 0.05)).all()
        assert (np.abs(off) < 2 * told).all()
        assert found[frame].state(WORLD, LIMITS) is MotionState.OK
        assert found[frame].within > 0.99


@pytest.mark.parametrize("faults", [{"outliers": 0.05}, {"hidden": 0.3}])
def test_outliers_and_hidden_parts_do_no_harm(faults: dict[str, float]) -> None:
    timeline = opened(RigidHills(3, **faults))
    start = whole(timeline)
    motion = motions(timeline, start)[2].motion
    assert motion is not None
    assert np.abs(motion_error(motion, truth(2, 0), start.middle)).max() < 0.1


def test_a_frame_that_does_not_fit_is_a_gap_and_the_next_one_is_found() -> None:
    timeline = opened(RigidHills(4, lacking=frozenset({2})))
    start = whole(timeline)
    found = motions(timeline, start)
    assert found[2].motion is None
    assert found[2].reason
    assert found[2].state(WORLD, LIMITS) is MotionState.GAP
    motion = found[3].motion
    assert motion is not None
    assert np.abs(motion_error(motion, truth(3, 0), start.middle)).max() < 0.1


def test_a_flat_region_leaves_directions_open_and_they_are_named() -> None:
    timeline = opened(RigidHills(2, is_flat=True))
    found = motions(timeline, whole(timeline))
    assert found[1].state(WORLD, LIMITS) is MotionState.WEAK
    weak = weak_directions(found, anatomical_axes("+y"), LIMITS)
    open_ones = {("front-back", True), ("left-right", False), ("vertical", False)}
    assert {(one.axis, one.is_turn) for one in weak[:3]} == open_ones
    words = next(one for one in weak if one.is_turn).in_words("mm")
    assert words.startswith("This region does not determine rotation about the front-back axis: ±")
    assert words.endswith("°")


def test_the_found_region_leaves_out_what_moves_otherwise() -> None:
    timeline = opened(RigidHills(5, rise=0.6))
    pose = timeline.pose(0)
    rows = found_region(timeline, pose, 0)
    x = pose.cloud.world()[rows, 0]
    assert 0.4 * pose.count < len(rows) < 0.75 * pose.count
    assert np.quantile(x, 0.99) < 10
    start = MotionReference.of(pose, rows, 0)
    motion = motions(timeline, start)[4].motion
    assert motion is not None
    assert np.abs(motion_error(motion, truth(4, 0), start.middle)).max() < 0.1


def test_a_subject_without_a_rigid_part_has_no_region() -> None:
    timeline = opened(RollingHills(3))
    with pytest.raises(InputError, match="no region that stays rigid"):
        found_region(timeline, timeline.pose(0), 0)


def test_work_that_was_cancelled_goes_on_where_it_stopped() -> None:
    timeline = opened(RigidHills(4))
    start, known, task = whole(timeline), {}, Task("motion")
    with task.current():
        work = stabilise(timeline, start, 0.5, known)
        assert [next(work), next(work)] == [0, 1]
        task.cancel()
        with pytest.raises(Cancelled):
            next(work)
    assert sorted(known) == [0, 1]
    assert list(stabilise(timeline, start, 0.5, known)) == [2, 3]
    whole_way = motions(timeline, start)
    for frame, found in known.items():
        assert found.motion is not None
        assert whole_way[frame].motion is not None
        assert (found.motion.matrix == whole_way[frame].motion.matrix).all()


def test_frames_go_outward_from_the_start() -> None:
    assert outward(range(5), 2) == [(2, None), (1, 2), (3, 2), (0, 1), (4, 3)]
    assert outward([1, 2], 0) == [(1, None), (2, 1)]
    assert outward([0], 0) == [(0, None)]


def test_a_region_of_few_points_is_refused() -> None:
    pose = opened(RigidHills(1)).pose(0)
    with pytest.raises(InputError, match="3 points"):
        MotionReference.of(pose, np.arange(3), 0)


def test_axes_follow_what_is_up_and_where_the_front_is() -> None:
    assert np.allclose(anatomical_axes("+y"), np.eye(3))
    assert np.allclose(anatomical_axes("+z"), [[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    assert np.allclose(anatomical_axes("+y", 90.0), [[0, 0, -1], [0, 1, 0], [1, 0, 0]])
