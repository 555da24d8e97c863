"""Averages of frames: less noise where nothing moves, the very points where something does."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.scan.averaging import Averaging, averaged
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.range_view import RangeView
from viewer.scan.timeline import Timeline

COUNT, FRAMES, SIDE = 6000, 8, 60
NOISE = 0.02  # of a sphere of radius 1, whose points are 0.046 apart
RNG = np.random.default_rng(0)
NORMALS = RNG.normal(size=(COUNT, 3))
NORMALS /= np.linalg.norm(NORMALS, axis=1, keepdims=True)
TOP = NORMALS[:, 2] > 0.7
SPHERE = 10 * NORMALS
SIGMA = 0.1 * NOISE * 10
Motion = Callable[[int], NDArray[np.float64]]


def still(frame: int) -> NDArray[np.float64]:
    return np.zeros((COUNT, 3))


def top_moves(step: float) -> Motion:
    """The top of the sphere moves up by so many deviations of the noise in each frame."""
    return lambda frame: TOP[:, None] * np.array([0, 0, step * SIGMA * frame])


def scanned(frame: int, motion: Motion = still, sigma: float = SIGMA) -> Pose:
    rng = np.random.default_rng((1, frame))
    positions = SPHERE + motion(frame) + sigma * NORMALS * rng.normal(size=(COUNT, 1))
    colors = np.clip(128 + 3 * rng.normal(size=(COUNT, 3)), 0, 255).astype(np.uint8)
    cloud = PointCloud.from_arrays(positions, colors=colors, origin=np.zeros(3), precise=False)
    return Pose(frame, frame / 30, f"{frame}", cloud)


def average(poses: list[Pose], frames: int = FRAMES) -> Pose:
    return averaged(poses[-1], reversed(poses[-frames:-1]), Averaging(frames))


def run_of(motion: Motion = still, sigma: float = SIGMA, count: int = FRAMES) -> list[Pose]:
    return [scanned(frame, motion, sigma) for frame in range(count)]


def off(pose: Pose, motion: Motion) -> NDArray[np.float64]:
    """How far each point is from where it truly is, in deviations of the noise."""
    return np.linalg.norm(pose.cloud.positions - SPHERE - motion(pose.index), axis=1) / SIGMA


def test_noise_falls_by_the_root_of_the_frames() -> None:
    made = average(run_of())
    assert made.average is not None
    assert made.average.share > 0.99
    assert made.average.usual == FRAMES
    assert np.sqrt(np.square(off(made, still)).mean()) == pytest.approx(1 / np.sqrt(FRAMES), rel=0.1)
    assert made.cloud.colors is not None
    assert made.cloud.colors[:, :3].std() < 1.3  # 3.0 in a frame; 1.06, and what rounding adds


@pytest.mark.parametrize("step", [3, 10, 300])
def test_moving_points_keep_their_bits(step: float) -> None:
    motion = top_moves(step)
    poses = run_of(motion)
    made = average(poses)
    assert made.average is not None
    moved = made.average.counts == 1
    assert moved[TOP].mean() > 0.98
    assert moved[~TOP].mean() < 0.03  # few of those beside it
    for name in ("positions", "colors"):
        before, after = getattr(poses[-1].cloud, name), getattr(made.cloud, name)
        assert np.array_equal(before[moved], after[moved])


@pytest.mark.parametrize("step", [0.05, 0.1, 0.2, 0.5, 1, 2, 3, 5, 10, 50])
def test_no_motion_leaves_a_ghost(step: float) -> None:
    """The mean error of a moving part stays below 1.3 times the noise of one frame, at any speed."""
    made = average(run_of(top_moves(step)))
    assert np.sqrt(np.square(off(made, top_moves(step))[TOP]).mean()) < 1.3


@pytest.mark.parametrize("at", [4, 7])
def test_a_part_that_has_moved_shows_no_former_place(at: int) -> None:
    def motion(frame: int) -> NDArray[np.float64]:
        return TOP[:, None] * np.array([0, 0, 30 * SIGMA * (frame >= at)])

    poses = run_of(motion, count=12)
    now = averaged(poses[at], reversed(poses[:at]), Averaging(FRAMES))
    assert np.array_equal(now.cloud.positions[TOP], poses[at].cloud.positions[TOP])
    later = average(poses)
    frames = len(poses) - at
    assert later.average is not None
    assert np.median(later.average.counts[TOP]) == min(frames, FRAMES)
    assert off(later, motion)[TOP].max() < 5


def test_without_noise_nothing_changes() -> None:
    poses = run_of(top_moves(1), sigma=0.0)
    made = average(poses)
    assert np.array_equal(made.cloud.positions, poses[-1].cloud.positions)
    assert made.average is not None
    assert not (made.average.counts[TOP] > 1).any()
    assert (made.average.counts[~TOP] == FRAMES).mean() > 0.95


def test_the_first_frame_is_as_scanned() -> None:
    poses = run_of(count=1)
    made = average(poses)
    assert np.array_equal(made.cloud.positions, poses[0].cloud.positions)
    assert made.average is not None
    assert made.average.share == 0


def resampled(frame: int, step: float, sigma: float = SIGMA) -> Pose:
    """Other points of the sphere in each frame, whose top moves up by so many deviations a frame."""
    rng = np.random.default_rng((3, frame))
    normals = rng.normal(size=(COUNT + 10 * frame, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = normals * (10 + sigma * rng.normal(size=(len(normals), 1)))
    points[normals[:, 2] > 0.7] += (0, 0, step * SIGMA * frame)
    return Pose(frame, 0.0, "", PointCloud.from_arrays(points, origin=np.zeros(3), precise=False))


def test_frames_without_common_points_are_averaged_along_the_normal() -> None:
    poses = [resampled(frame, 0.0) for frame in range(FRAMES)]
    made = average(poses)
    assert made.average is not None
    assert made.average.matched == "surface"
    assert made.average.share > 0.85
    still = made.average.counts > 1
    before, after = (np.linalg.norm(pose.cloud.positions, axis=1)[still] - 10 for pose in (poses[-1], made))
    assert after.std() < before.std() / 2
    assert abs(after.mean()) < SIGMA / 5
    moved = made.cloud.positions - poses[-1].cloud.positions
    along = np.abs(np.einsum("ij,ij->i", moved, poses[-1].cloud.positions)) / 10
    assert along[still] == pytest.approx(np.linalg.norm(moved[still], axis=1), rel=0.05, abs=0.02 * SIGMA)


@pytest.mark.parametrize("step", [5, 30])
def test_moving_surfaces_keep_their_bits(step: float) -> None:
    poses = [resampled(frame, step) for frame in range(FRAMES)]
    made = average(poses)
    assert made.average is not None
    raised = poses[-1].cloud.positions / 10
    top = np.linalg.norm(raised - (0, 0, 0.1 * step * SIGMA * (FRAMES - 1)), axis=1) < 1.05
    top &= raised[:, 2] > 0.9 + 0.1 * step * SIGMA * (FRAMES - 1)
    assert top.sum() > 50
    assert (made.average.counts[top] == 1).mean() > 0.98
    one = made.average.counts == 1
    assert np.array_equal(made.cloud.positions[one], poses[-1].cloud.positions[one])


def test_without_noise_a_surface_stays_where_it_is() -> None:
    poses = [resampled(frame, 0.0, sigma=0.0) for frame in range(FRAMES)]
    made = average(poses)
    spacing = np.sqrt(4 * np.pi * 100 / COUNT)
    assert np.abs(np.linalg.norm(made.cloud.positions, axis=1) - 10).mean() < 0.02 * spacing


def test_dropped_points_are_matched_by_their_ids() -> None:
    poses = []
    for pose in run_of():
        positions = pose.cloud.positions.copy()
        positions[pose.index :: 50] = np.nan
        poses.append(Pose(pose.index, 0.0, "", PointCloud.from_arrays(positions, origin=np.zeros(3))))
    made = average(poses)
    ids = made.cloud.ids
    assert ids is not None
    assert made.average is not None
    assert made.average.share > 0.99
    errors = np.linalg.norm(made.cloud.positions - SPHERE[ids], axis=1) / SIGMA
    assert np.sqrt(np.square(errors).mean()) < 0.4


def test_stored_normals_are_averaged_and_scalars_are_not() -> None:
    poses = []
    for pose in run_of():
        rng = np.random.default_rng(pose.index)
        normals = NORMALS + 0.1 * rng.normal(size=(COUNT, 3))
        cloud = PointCloud.from_arrays(
            pose.cloud.positions, normals=normals, scalars={"heat": rng.normal(size=COUNT)}
        )
        poses.append(Pose(pose.index, 0.0, "", cloud))
    made = average(poses)
    assert made.cloud.normals is not None
    assert made.average is not None
    lengths = np.linalg.norm(made.cloud.normals, axis=1)
    assert lengths[made.average.counts > 1] == pytest.approx(1, abs=1e-5)
    assert np.linalg.norm(made.cloud.normals - NORMALS, axis=1).mean() < 0.07
    assert made.cloud.scalars["heat"] is poses[-1].cloud.scalars["heat"]


def image(frame: int, motion: float = 0.0) -> RangeView:
    """A wavy wall of 60 x 60 pixels, whose left half comes nearer by so many deviations in each frame."""
    rng = np.random.default_rng((2, frame))
    rows, columns = np.mgrid[:SIDE, :SIDE]
    depth = 100 + np.sin(rows / 9) + 0.05 * rng.normal(size=(SIDE, SIDE))
    depth -= 0.05 * motion * frame * (columns < SIDE // 2)
    mask = rng.uniform(size=(SIDE, SIDE)) > 0.05
    color = np.clip(100 + 5 * rng.normal(size=(SIDE, SIDE, 3)), 0, 255).astype(np.uint8)
    return RangeView(
        depth=depth.astype(np.float32), mask=mask, color=color, fx=80, fy=80, cx=30, cy=30,
        world_to_camera=np.eye(4),
    )  # fmt: skip


def test_range_images_are_averaged_by_pixel() -> None:
    poses = [Pose.of(frame, 0.0, "", (image(frame, motion=10),)) for frame in range(FRAMES)]
    made = average(poses)
    (before,), (after,) = poses[-1].views, made.views
    left = np.arange(SIDE)[None] < SIDE // 2
    assert np.array_equal(before.depth[:, : SIDE // 2 - 4], after.depth[:, : SIDE // 2 - 4])
    true = 100 + np.sin(np.mgrid[:SIDE, :SIDE][0] / 9)
    right = after.mask & ~left & (np.arange(SIDE)[None] > SIDE // 2 + 4)
    assert (after.depth - true)[right].std() == pytest.approx(0.05 / np.sqrt(7.6), rel=0.15)
    assert after.color is not None
    assert after.color[right].std() < 2.6
    assert np.array_equal(before.mask, after.mask)  # no pixel is filled
    counts = made.average and made.average.counts.reshape(SIDE, SIDE)
    assert counts is not None
    assert (counts[~before.mask] == 0).all()


def steep_wall(frame: int, motion: float = 0.0) -> RangeView:
    """A wall that faces the pod, and on the right one at 75 degrees to it, whose noise is four times as deep.
    motion: of the right one, deviations of its noise in each frame."""
    rng = np.random.default_rng((3, frame))
    right = np.maximum(np.arange(SIDE) - SIDE // 2, 0)
    sigma = np.where(right > 0, 0.04, 0.01)
    depth = 100 + 0.466 * right + sigma * (rng.normal(size=(SIDE, SIDE)) - motion * frame)
    return RangeView(
        depth=depth.astype(np.float32), mask=np.ones((SIDE, SIDE), bool), fx=800, fy=800, cx=30, cy=30,
        world_to_camera=np.eye(4),
    )  # fmt: skip


def test_deeper_noise_of_steep_surfaces_is_no_motion() -> None:
    made = average([Pose.of(frame, 0.0, "", (steep_wall(frame),)) for frame in range(FRAMES)])
    wall = slice(SIDE // 2 + 4, None)
    assert made.average is not None
    assert (made.average.counts.reshape(SIDE, SIDE)[:, wall] == FRAMES).mean() > 0.95
    true = 100 + 0.466 * np.maximum(np.arange(SIDE) - SIDE // 2, 0)
    assert (made.views[0].depth - true)[:, wall].std() == pytest.approx(0.04 / np.sqrt(FRAMES), rel=0.15)


@pytest.mark.parametrize("motion", [2.0, 10.0, 50.0])
def test_steep_surfaces_that_move_stay_as_scanned(motion: float) -> None:
    poses = [Pose.of(frame, 0.0, "", (steep_wall(frame, motion),)) for frame in range(FRAMES)]
    wall = slice(SIDE // 2 + 4, None)
    assert np.array_equal(average(poses).views[0].depth[:, wall], poses[-1].views[0].depth[:, wall])


@pytest.mark.parametrize("motion", [0.05, 0.2, 0.5, 1.0])
def test_steep_surfaces_that_move_slowly_leave_no_ghost(motion: float) -> None:
    poses = [Pose.of(frame, 0.0, "", (steep_wall(frame, motion),)) for frame in range(FRAMES)]
    true = 100 + 0.466 * np.maximum(np.arange(SIDE) - SIDE // 2, 0) - 0.04 * motion * (FRAMES - 1)
    error = (average(poses).views[0].depth - true)[:, SIDE // 2 + 4 :]
    assert np.sqrt(np.square(error).mean()) < 1.3 * 0.04


def test_a_moving_camera_ends_the_runs() -> None:
    moved = np.eye(4)
    moved[0, 3] = 1
    first = image(0)
    other = RangeView(**{**vars(first), "world_to_camera": moved})
    poses = [Pose.of(0, 0.0, "", (first,)), Pose.of(1, 0.0, "", (other,))]
    made = average(poses)
    assert made.average is not None
    assert made.average.share == 0
    assert np.array_equal(made.views[0].depth, other.depth)


class Poses:
    """A source of frames in memory."""

    name = "poses"
    unit = None
    files = ()

    def __init__(self, poses: list[Pose]) -> None:
        self.poses, self.loads = poses, 0

    def __len__(self) -> int:
        return len(self.poses)

    def label(self, index: int) -> str:
        return f"{index}"

    def times(self) -> None:
        return None

    def load(self, index: int) -> PointCloud:
        self.loads += 1
        return self.poses[index].cloud


def timeline_of(poses: list[Pose], cache_bytes: int | None = None) -> Timeline:
    made = Timeline(Poses(poses), np.arange(len(poses)) / 30, cache_bytes=cache_bytes)  # type: ignore[arg-type]
    made.average(Averaging(4))
    return made


def shown(timeline: Timeline, index: int, direction: int = 1) -> Pose:
    """The pose that the worker brings after the playhead came there."""
    timeline.prefetch(index, direction)
    while (pose := timeline.ready(index)) is None:
        pass
    return pose


@pytest.mark.parametrize("cached", [1000, 6, 1])
def test_any_order_of_frames_gives_the_same_average(cached: int) -> None:
    """Playing forward, backward, seeking and scripts: also where hardly a frame stays in memory."""
    poses = run_of(top_moves(2), count=10)
    size = poses[0].nbytes
    with timeline_of(poses) as forward:
        expected = [forward.drawn(index).cloud.positions for index in range(10)]
    orders = [list(range(10)), list(range(9, -1, -1)), [7, 2, 9, 0, 5]]
    for order, direction in zip(orders, (1, -1, 1), strict=True):
        with timeline_of(poses, cached * size) as timeline:
            for index in order:
                pose = shown(timeline, index, direction)
                assert np.array_equal(pose.cloud.positions, expected[index]), index
                assert np.array_equal(pose.raw.cloud.positions, poses[index].cloud.positions)


def test_playing_reads_each_frame_once() -> None:
    poses = run_of(count=10)
    with timeline_of(poses) as timeline:
        for index in range(10):
            shown(timeline, index)
        assert timeline.source.loads == 10  # type: ignore[attr-defined]


def test_poses_and_visits_are_as_scanned() -> None:
    poses = run_of(count=5)
    with timeline_of(poses) as timeline:
        drawn = timeline.drawn(4)
        for pose in (timeline.pose(4), timeline.visit(4), drawn.raw, drawn.measured):
            assert pose.average is None
            assert np.array_equal(pose.cloud.positions, poses[4].cloud.positions)


def test_memory_counts_averages() -> None:
    poses = run_of(count=5)
    with timeline_of(poses) as timeline:
        timeline.pose(4)
        raw = timeline.pose(4).nbytes
        drawn = timeline.drawn(4)
        assert drawn.cloud.colors is not None
        own = drawn.cloud.positions.nbytes + drawn.cloud.colors.nbytes + COUNT
        assert drawn.nbytes == raw + own


def test_switching_off_brings_back_the_frames_as_scanned() -> None:
    poses = run_of(count=5)
    with timeline_of(poses) as timeline:
        shown(timeline, 4)
        timeline.average(Averaging())
        pose = timeline.ready(4)
        assert pose is not None
        assert pose.average is None
        timeline.average(Averaging(3, is_measured=True))
        pose = shown(timeline, 4)
        assert pose.average is not None
        assert pose.average.frames == 3
        assert pose.measured is pose
        timeline.average(Averaging(3))
        pose = timeline.ready(4)
        assert pose is not None
        assert pose.measured is pose.raw


def test_broken_frames_are_passed_over() -> None:
    poses = run_of(count=5)
    with timeline_of(poses) as timeline:
        load = timeline.source.load

        def damaged(index: int) -> PointCloud:
            if index == 3:
                raise ValueError("damaged")
            return load(index)  # type: ignore[return-value]

        timeline.source.load = damaged  # type: ignore[method-assign]
        made = timeline.drawn(4)
        assert made.average is not None
        assert made.average.usual == 3
