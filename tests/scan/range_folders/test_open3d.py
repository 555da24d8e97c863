"""Open3D's RGB-D folders: pairs of pictures, and poses in a log."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from depth_folders import (
    CAMERA,
    POSE,
    colors,
    depth_numbers,
    metres,
    seen_points,
    write_camera,
    write_color,
    write_depth,
)

from viewer.errors import InputError
from viewer.scan.open import find_source, open_scan
from viewer.scan.range_view import RangeView


def put(folder: Path, count: int) -> Path:
    for n in range(count):
        write_depth(folder / f"depth/{n:05d}.png", depth_numbers(n))
        write_color(folder / f"color/{n:05d}.png", colors(n))
    return folder


def write_log(path: Path, poses: list[np.ndarray]) -> None:
    path.write_text(
        "".join(
            f"{n}\t{n}\t{n + 1}\n" + "\n".join(" ".join(map(str, row)) for row in pose) + "\n"
            for n, pose in enumerate(poses)
        )
    )


def only_view(folder: Path, frame: int = 0) -> RangeView:
    (view,) = find_source(folder).load(frame)
    assert isinstance(view, RangeView)
    return view


def moved(by: float) -> np.ndarray:
    pose = POSE.copy()
    pose[0, 3] += by
    return pose


@pytest.mark.parametrize("log", ["trajectory.log", "odometry.log"])
def test_frames_stand_where_the_log_says(tmp_path: Path, log: str) -> None:
    put(tmp_path, 3)
    write_log(tmp_path / log, [moved(0), moved(1), moved(2)])
    write_camera(tmp_path)
    with open_scan(tmp_path) as scan:
        assert (len(scan), scan.unit, scan.label(2)) == (3, "m", "depth/00002.png")
        for pose in scan:
            expected = seen_points(metres(depth_numbers(pose.index)), [*CAMERA.values()], moved(pose.index))
            np.testing.assert_allclose(pose.views[0].positions(), expected, atol=1e-5)
            np.testing.assert_array_equal(pose.views[0].color, colors(pose.index))


def test_pairs_are_those_that_are_listed(tmp_path: Path) -> None:
    put(tmp_path, 3)
    (tmp_path / "rgbd.match").write_text(
        "depth/00002.png color/00000.png\n\ndepth/00001.png color/00001.png\n"
    )
    assert len(find_source(tmp_path)) == 2
    np.testing.assert_array_equal(only_view(tmp_path).color, colors(0))
    np.testing.assert_array_equal(only_view(tmp_path).world_to_camera, np.eye(4))  # no log: upright
    (tmp_path / "rgbd.match").write_text("depth/00002.png\n")
    with pytest.raises(InputError, match="not a pair of names"):
        find_source(tmp_path)


def test_the_better_log_counts_and_a_camera_beside_it(tmp_path: Path) -> None:
    put(tmp_path, 1)
    write_log(tmp_path / "odometry.log", [moved(7)])
    write_log(tmp_path / "trajectory.log", [moved(3)])
    write_camera(tmp_path)
    view = only_view(tmp_path)
    np.testing.assert_allclose(view.eye, moved(3)[:3, 3])
    assert view.fx == 5


def test_a_frame_without_a_pose_is_left_out(tmp_path: Path) -> None:
    put(tmp_path, 2)
    write_log(tmp_path / "trajectory.log", [POSE])
    with open_scan(tmp_path) as scan:
        assert [pose.index for pose in scan] == [0]
        assert "has no camera pose: trajectory.log contains only 1" in str(scan.broken[1])


@pytest.mark.parametrize("text", ["0 0 1\n1 0 0 0\n", "one two three\n", "\0\xff"])
def test_a_damaged_log_is_told(tmp_path: Path, text: str) -> None:
    put(tmp_path, 1)
    (tmp_path / "trajectory.log").write_bytes(text.encode("latin-1"))
    with pytest.raises(InputError, match=r"trajectory\.log: is (damaged, or is not a log|not a UTF-8 text)"):
        find_source(tmp_path)


def test_no_depth_at_all_is_told(tmp_path: Path) -> None:
    (tmp_path / "depth").mkdir()
    write_log(tmp_path / "trajectory.log", [POSE])
    with pytest.raises(InputError, match="no depth pictures"):
        find_source(tmp_path)


def test_real_frames_agree_in_the_world(data_dir: Path) -> None:
    from scipy.spatial import cKDTree

    with open_scan(data_dir / "range" / "open3d_rgbd") as scan:
        assert len(scan) == 5
        views = [pose.views[0] for pose in scan]
    assert all(view.color is not None and view.depth.shape == (480, 640) for view in views)
    clouds = [view.positions()[::9] for view in views]
    for before, after in itertools.pairwise(clouds):
        distance, _ = cKDTree(before).query(after)
        assert np.median(distance) < 0.008  # metres: the step of its depth there
