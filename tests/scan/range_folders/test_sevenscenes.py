"""7-Scenes: frames of depth, colours and pose side by side."""

from __future__ import annotations

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
    write_matrix,
)

from viewer.errors import InputError
from viewer.scan.image_poses import UPRIGHT
from viewer.scan.open import find_source, open_scan
from viewer.scan.range_view import RangeView


def put(folder: Path, *numbers: int) -> Path:
    for n in numbers:
        write_depth(folder / f"frame-{n:06d}.depth.png", depth_numbers(n))
        write_color(folder / f"frame-{n:06d}.color.png", colors(n))
        write_matrix(folder / f"frame-{n:06d}.pose.txt", POSE)
    return folder


def test_each_frame_is_a_view_in_the_world(tmp_path: Path) -> None:
    put(tmp_path, 0, 33, 66)
    write_camera(tmp_path)
    with open_scan(tmp_path) as scan:
        assert (len(scan), scan.unit, scan.label(1)) == (3, "m", "frame-000033.depth.png")
        np.testing.assert_allclose(scan.times, [0, 33 / 25, 66 / 25])
        (view,) = scan.pose(1).views
    expected = seen_points(metres(depth_numbers(33)), [*CAMERA.values()], POSE)
    np.testing.assert_allclose(view.positions(), expected, rtol=1e-5)
    np.testing.assert_array_equal(view.color, colors(33))


@pytest.mark.parametrize("name", ["camera-intrinsics.txt", "camera.txt"])
def test_a_matrix_beside_them_is_the_camera(tmp_path: Path, name: str) -> None:
    put(tmp_path, 0)
    (tmp_path / name).write_text("500 0 3\n0 501 2\n0 0 1\n")
    (view,) = find_source(tmp_path).load(0)
    assert isinstance(view, RangeView)
    assert (view.fx, view.fy, view.cx, view.cy) == (500, 501, 3.5, 2.5)


def test_without_poses_frames_are_in_their_cameras_space(tmp_path: Path) -> None:
    put(tmp_path, 0)
    (tmp_path / "camera-intrinsics.txt").write_text("500 0 3\n0 501 2\n0 0 1\n")
    (tmp_path / "frame-000000.pose.txt").unlink()
    (view,) = find_source(tmp_path).load(0)
    assert isinstance(view, RangeView)
    np.testing.assert_array_equal(view.world_to_camera, UPRIGHT)
    put(tmp_path, 1)
    with pytest.raises(InputError, match="has no camera pose"):
        find_source(tmp_path).load(0)


def test_real_frames_agree_in_the_world(data_dir: Path) -> None:
    from scipy.spatial import cKDTree

    with open_scan(data_dir / "range" / "sevenscenes_kinect_31") as scan:
        assert (len(scan), scan.unit) == (31, "m")
        views = [scan.pose(index).views[0] for index in range(3)]
    assert [np.count_nonzero(view.valid()) for view in views] == [273_943, 275_202, 286_535]
    one, two, three = (view.positions()[::9] for view in views)
    for before, after in ((one, two), (two, three)):
        distance, _ = cKDTree(before).query(after)
        assert np.median(distance) < 0.02  # metres: a second of a camera in motion lies between
