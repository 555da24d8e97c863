"""Numbers of followed points, and landmarks that they carry, through frames whose motion is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from moving_hills import SIDE
from numpy.typing import NDArray

from viewer.analysis.landmarks import Landmark
from viewer.analysis.motion.followed_points import FollowedPoints, dense_folder
from viewer.analysis.motion.quantities import (
    AREA,
    DISPLACEMENT,
    FIRST,
    NORMAL,
    QUANTITIES,
    SECOND,
    SPEED,
    TANGENTIAL,
)
from viewer.analysis.motion.region import RigidRegion
from viewer.analysis.surface_point import SurfacePoint
from viewer.analysis.track import Known
from viewer.analysis.tracking import Tracker
from viewer.errors import InputError
from viewer.rigid import Rigid, rigid_matrix
from viewer.scan.faces import Faces
from viewer.scan.points import PointCloud
from viewer.scan.timeline import Timeline
from viewer.task import Cancelled, Task

Float = NDArray[np.float64]
STRETCH, RISE, RATE, FRAMES = 0.05, 0.5, 25.0, 4
TURN = Rigid(rigid_matrix(np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1.0]]), np.array([3.0, -2.0, 1.0])))


class Sheet:
    """A source of frames that share their points: a flat sheet, which stretches along x and rises. The last
    one lacks those at x > 15."""

    name, unit = "sheet", "mm"
    files: tuple[Path, ...] = ()

    def __len__(self) -> int:
        return FRAMES

    def label(self, index: int) -> str:
        return f"frame {index + 1}"

    def times(self) -> Float:
        return np.arange(FRAMES) / RATE

    def places(self, frame: int) -> Float:
        side = np.linspace(-SIDE / 2, SIDE / 2, 41)
        x, y = (each.ravel() for each in np.meshgrid(side, side))
        return np.column_stack([x * (1 + STRETCH * frame), y, np.full(len(x), RISE * frame)])

    def load(self, index: int) -> PointCloud:
        points = self.places(index)
        there = points[:, 0] <= (15 * (1 + STRETCH * index) if index == FRAMES - 1 else SIDE)
        normals = np.tile(np.float32([0, 0, 1]), (len(points), 1))
        cloud = replace(PointCloud.from_arrays(points, normals=normals), topology="sheet")
        return cloud.of_rows(np.flatnonzero(there))

    def faces(self, index: int) -> Faces:
        raise InputError("has no faces")


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def opened() -> Timeline:
    source = Sheet()
    return Timeline(source, source.times(), "mm")


def followed(timeline: Timeline) -> FollowedPoints:
    return FollowedPoints(timeline, 0, {"scan": "sheet"})


def still(frame: int) -> Rigid:
    return Rigid()


def numbers(
    points: FollowedPoints, name: str, frame: int, motions: Mapping[int, Rigid] | None = None
) -> Float:
    """A number at all points of a frame."""
    rows = points.rows_nearest(points.timeline.pose(frame))
    return points.of_pose(name, frame, rows, still if motions is None else motions.get)


def test_a_region_has_a_mean_path() -> None:
    points = followed(opened())
    cloud = points.timeline.pose(0).cloud
    region = RigidRegion(np.array([[4.0, 2.0, 0.0, 3.0]]), np.empty(0, np.int64))
    middle = cloud.world()[region.rows(cloud, {})].mean(axis=0)
    path = points.mean_path(region)
    right = [(middle[0] * (1 + STRETCH * each), middle[1], RISE * each) for each in range(FRAMES)]
    assert np.allclose(path.positions, right, atol=0.02)
    with pytest.raises(InputError, match="no followed points"):
        points.mean_path(RigidRegion(np.array([[0.0, 0, 99.0, 1.0]]), np.empty(0, np.int64)))


def test_numbers_of_a_sheet_that_stretches_and_rises() -> None:
    points, frame = followed(opened()), 2
    x = Sheet().places(0)[:, 0]
    aside, up = STRETCH * frame * x, RISE * frame
    assert np.allclose(numbers(points, DISPLACEMENT, frame), np.hypot(aside, up), atol=1e-4)
    assert np.allclose(numbers(points, NORMAL, frame), up, atol=1e-4)
    assert np.allclose(numbers(points, TANGENTIAL, frame), np.abs(aside), atol=1e-3)
    assert np.allclose(numbers(points, FIRST, frame), 100 * STRETCH * frame, rtol=0.01)
    assert np.allclose(numbers(points, SECOND, frame), 0, atol=0.01)
    assert np.allclose(numbers(points, AREA, frame), 100 * STRETCH * frame, rtol=0.01)
    speed = RATE * np.hypot(STRETCH * x, RISE)
    assert np.allclose(numbers(points, SPEED, frame), speed, atol=1e-2)
    assert np.allclose(numbers(points, SPEED, 0), speed, atol=1e-2), "from the next frame alone"


def test_numbers_are_of_frames_as_they_are_shown() -> None:
    points = followed(opened())
    rising = {
        frame: Rigid(rigid_matrix(np.eye(3), np.array([0, 0, -RISE * frame]))) for frame in range(FRAMES)
    }
    assert np.allclose(numbers(points, NORMAL, 2, rising), 0, atol=1e-4), "the rise is removed"
    turned = {frame: TURN.after(motion) for frame, motion in rising.items()}
    for name in QUANTITIES:
        assert np.allclose(numbers(points, name, 2, turned), numbers(points, name, 2, rising), atol=2e-3), (
            name
        )
    gap = {frame: motion for frame, motion in rising.items() if frame != 2}
    assert np.isnan(numbers(points, DISPLACEMENT, 2, gap)).all()
    assert np.isfinite(numbers(points, FIRST, 2, gap)).all(), "no motion changes strains"


def test_points_that_a_frame_lacks_have_no_numbers() -> None:
    points, last = followed(opened()), FRAMES - 1
    values = numbers(points, DISPLACEMENT, last)
    assert len(values) == len(points.timeline.pose(last).cloud)
    assert np.isfinite(values).all(), "of those that are there"
    facts = points.facts(last)
    assert facts.is_exact
    assert facts.shares[2] == pytest.approx(5 / 41, abs=1e-6)
    assert not points.facts(0).is_exact
    speed = numbers(points, SPEED, last - 1)
    right = RATE * np.hypot(STRETCH * Sheet().places(0)[:, 0], RISE)
    assert np.allclose(speed, right, atol=1e-2), "where the next frame lacks a point, from the one before"


def test_the_largest_number_is_that_of_nearly_all_points() -> None:
    points = followed(opened())
    values = numbers(points, DISPLACEMENT, 2)
    assert points.largest(DISPLACEMENT, 2, still) == pytest.approx(np.quantile(values, 0.98), rel=0.02)
    assert np.isnan(points.largest(DISPLACEMENT, 2, {}.get))


def test_points_are_kept_and_cancelled_work_goes_on() -> None:
    timeline = opened()
    first, task = followed(timeline), Task("test")

    def find() -> None:
        for _ in first.find():
            if len(first.known) == 2:
                task.cancel()

    with task.current(), pytest.raises(Cancelled):
        find()
    assert (len(first.known), first.is_whole) == (2, False)
    (folder,) = dense_folder().iterdir()
    before = {file: file.stat().st_mtime_ns for file in folder.glob("frame_*")}
    again = followed(timeline)
    assert again.known == first.known
    assert len(list(again.find())) == FRAMES - 2
    assert again.is_whole
    assert all(file.stat().st_mtime_ns == time for file, time in before.items()), "not found again"
    (folder / "key.json").write_text("no")
    assert not followed(timeline).known, "what is damaged is found again"
    FollowedPoints(timeline, 1, {"scan": "sheet"})
    assert len(list(dense_folder().iterdir())) == 2, "of another reference"


def landmark(name: str, frame: int, x: float) -> Landmark:
    """One that is placed in a frame, at y = 2.6 of the sheet."""
    position = (x * (1 + STRETCH * frame), 2.6, RISE * frame)
    return Landmark(name).with_key(SurfacePoint(frame, frame / RATE, position, None, 1.0, 0))


@pytest.mark.parametrize("frame", [0, 2])
def test_landmarks_have_their_whole_path_at_once_and_can_be_corrected(frame: int) -> None:
    points = followed(opened())
    for _ in points.find():
        pass
    placed = landmark("one", frame, 4.3)
    tracker = Tracker(points.timeline, [placed], carry=points.carried)
    assert next(tracker.run()) == 0
    track = tracker.tracks["one"]
    assert track.is_whole
    right = np.array([(4.3 * (1 + STRETCH * each), 2.6, RISE * each) for each in range(FRAMES)])
    assert np.allclose(track.positions, right, atol=0.02)
    wanted = np.where(np.arange(4) == frame, Known.PLACED, Known.CARRIED)
    assert (track.known == wanted).all(), "where the path comes from"
    key = SurfacePoint(1, 1 / RATE, (right[1, 0] + 0.5, 2.6, RISE), None, 1.0, 0)
    again = Tracker(points.timeline, [placed.with_key(key)], known=tracker, carry=points.carried)
    for _ in again.run():
        pass
    corrected = again.tracks["one"]
    assert corrected.known[1] == Known.PLACED
    beyond = 0 if frame else 3
    at_rest = (right[1, 0] + 0.5) / (1 + STRETCH)
    assert corrected.positions[beyond, 0] == pytest.approx(at_rest * (1 + STRETCH * beyond), abs=0.03)


def test_landmarks_beside_the_followed_points_are_tracked_as_without() -> None:
    points = followed(opened())
    far = SurfacePoint(0, 0.0, (0.0, 0.0, 50.0), None, 1.0, 0)
    assert points.carried([far]) == [{}]
    lacking = points.carried([landmark("edge", 0, 19.5).keys[0]])[0]
    assert [bool(one.reason) for one in lacking.values()] == [False, False, False, True]
