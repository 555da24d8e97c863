"""Folders of depth pictures: read exactly, coloured, placed; and what is wrong with them told."""

from __future__ import annotations

import json
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

from viewer.camera import Camera
from viewer.errors import InputError
from viewer.scan.listing import list_folder
from viewer.scan.open import find_source, open_scan
from viewer.scan.range_view import RangeView


def put(folder: Path, *stems: str, camera: bool = True) -> Path:
    """Depth and colours by the same name."""
    for seed, stem in enumerate(stems):
        write_depth(folder / f"{stem}.png", depth_numbers(seed))
        write_color(folder / f"{stem.replace('depth', 'color')}.jpg", colors(seed))
    if camera:
        write_camera(folder)
    return folder


def only_view(folder: Path, frame: int = 0) -> RangeView:
    (view,) = find_source(folder).load(frame)
    assert isinstance(view, RangeView)
    return view


def refusal(folder: Path) -> str:
    with pytest.raises(InputError) as caught:
        find_source(folder).load(0)
    return str(caught.value)


@pytest.mark.parametrize(
    ("depth", "color", "pose"),
    [
        ("a.png", "a.jpg", "a.txt"),
        ("a.png", "a.jpeg", "a.pose.txt"),
        ("7_depth.png", "7_rgb.png", "7_pose.txt"),
        ("depth.png", "image.jpg", "pose.txt"),
        ("frame.depth.png", "frame.color.png", "frame.pose.txt"),
        ("depth/1.png", "color/1.jpg", "pose/1.txt"),
        ("depth/1.png", "rgb/1.png", "pose/1.txt"),
    ],
)
def test_partners_are_found_by_name(tmp_path: Path, depth: str, color: str, pose: str) -> None:
    write_depth(tmp_path / depth, depth_numbers())
    write_color(tmp_path / color, colors())
    write_matrix(tmp_path / pose, POSE)
    write_camera(tmp_path)
    with open_scan(tmp_path) as scan:
        assert (len(scan), scan.unit, scan.label(0)) == (1, "m", depth)
        assert {file.relative_to(tmp_path).as_posix() for file in scan.files} == {
            depth,
            color,
            pose,
            "camera.json",
        }
        (view,) = scan.pose(0).views
    np.testing.assert_allclose(
        view.positions(), seen_points(metres(depth_numbers()), [*CAMERA.values()], POSE), rtol=1e-5
    )
    assert view.color is not None
    assert view.color.dtype == np.uint8
    if color.endswith(".png"):
        np.testing.assert_array_equal(view.color, colors())


def test_depth_is_read_exactly(tmp_path: Path) -> None:
    numbers = np.arange(65536, dtype=np.uint16).reshape(256, 256)
    write_depth(tmp_path / "a.png", numbers)
    write_camera(tmp_path, depth_scale=1, unit="mm")
    view = only_view(tmp_path)
    np.testing.assert_array_equal(view.depth, numbers.astype(np.float32))
    np.testing.assert_array_equal(view.mask, (numbers > 0) & (numbers < 65535))
    assert (view.unit, view.kind, view.color) == ("mm", "z", None)


def test_a_camera_says_all_that_it_can(tmp_path: Path) -> None:
    distortion = [0.1, -0.05, 0.001, 0.002, 0.01]
    put(tmp_path, "a", camera=False)
    write_camera(tmp_path, distortion=distortion, kind="range", depth_scale=5000, unit="ft", maker="?")
    view = only_view(tmp_path)
    assert (view.kind, view.unit, view.distortion) == ("range", "ft", tuple(distortion))
    assert (view.fx, view.fy, view.cx, view.cy) == (5.0, 4.0, 3.0, 2.0)  # centres at +0.5
    np.testing.assert_allclose(view.depth, depth_numbers() / 5000, rtol=1e-6)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        (
            "camera.json",
            json.dumps({"intrinsic_matrix": [5, 0, 0, 0, 4, 0, 2.5, 1.5, 1], "width": 6, "height": 4}),
        ),
        ("camera.txt", "5 0 2.5\n0 4 1.5\n0 0 1\n"),
        ("camera.txt", "# by somebody\n5 0 2.5 0\n0 4 1.5 0\n0 0 1 0\n0 0 0 1\n"),
        ("camera.txt", "5 4 2.5 1.5\n"),
        ("camera.txt", "5 4 2.5 1.5 0 0 0 0\n"),
    ],
)
def test_forms_of_a_calibration(tmp_path: Path, name: str, text: str) -> None:
    put(tmp_path, "a", camera=False)
    (tmp_path / name).write_text(text)
    view = only_view(tmp_path)
    assert (view.fx, view.fy, view.cx, view.cy) == (5.0, 4.0, 3.0, 2.0)


@pytest.mark.parametrize(
    ("stored", "told"),
    [
        ("{", "not JSON"),
        ("[1, 2]", "not a JSON object"),
        ('{"fx": 5}', "lacks fy, cx, cy"),
        (json.dumps(CAMERA | {"fx": "wide"}), "fx is wide"),
        (json.dumps(CAMERA | {"fy": float("nan")}), "fy is nan"),
        (json.dumps(CAMERA | {"fy": 10**400}), "calibration"),
        (json.dumps(CAMERA | {"fx": -5}), "fx is -5"),
        (json.dumps(CAMERA | {"distortion": [1, 2, 3]}), "3 distortion coefficients"),
        (json.dumps(CAMERA | {"distortion": 7}), "must be a list"),
        (json.dumps(CAMERA | {"depth_scale": -1}), "1000 for millimetres"),
        (json.dumps(CAMERA | {"depth_scale": None}), "depth_scale is None"),
        (json.dumps(CAMERA | {"kind": "disparity"}), "unknown kind of depth"),
        (json.dumps(CAMERA | {"kind": []}), "unknown kind of depth"),
        (
            json.dumps(CAMERA | {"width": 640, "height": 480}),
            "a.png: the camera is for pictures of 640 x 480 pixels, but this picture has 6 x 4",
        ),
        (json.dumps({"intrinsic_matrix": [1, 2]}), "9 numbers"),
    ],
)
def test_a_calibration_that_is_none_is_told(tmp_path: Path, stored: str, told: str) -> None:
    put(tmp_path, "a", camera=False)
    (tmp_path / "camera.json").write_text(stored)
    assert told in refusal(tmp_path)


def test_without_a_calibration_it_says_what_is_missing(tmp_path: Path) -> None:
    put(tmp_path, "a", "b", camera=False)
    (tmp_path / "a.txt").write_text("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
    assert "no file states their camera" in refusal(tmp_path)
    assert "depth_scale" in refusal(tmp_path)
    assert [one.kind for one in list_folder(tmp_path)] == ["file"]  # the table alone


def test_pictures_beside_a_scan_are_left_alone(tmp_path: Path) -> None:
    put(tmp_path, "a", camera=False)
    np.save(tmp_path / "scan.npy", np.eye(3))
    assert find_source(tmp_path).label(0) == "scan.npy"
    (tmp_path / "a.png").unlink()
    write_color(tmp_path / "depth_shown.png", colors())
    Camera().save(tmp_path / "camera.json")  # that of a picture of ours
    assert find_source(tmp_path).label(0) == "scan.npy"


def test_text_tables_beside_pictures_are_no_scan(tmp_path: Path) -> None:
    write_color(tmp_path / "photo.png", colors())
    (tmp_path / "poses.txt").write_text("0 0 1\n0 1 0\n")
    assert "text tables, but no scan" in refusal(tmp_path)
    assert len(find_source(tmp_path / "*.txt")) == 1


def test_a_folder_that_lacks_its_depth_says_what_it_looks_like(tmp_path: Path) -> None:
    def emptied() -> None:
        for path in tmp_path.iterdir():
            path.unlink()

    for number in range(3):
        write_color(tmp_path / f"frame-{number}.color.png", colors())
        write_matrix(tmp_path / f"frame-{number}.pose.txt", np.diag([1.0, 2, 3, 1]))
    assert "looks like 7-Scenes, but the depth pictures, frame-N.depth.png, are missing" in refusal(tmp_path)
    for number in range(3):
        (tmp_path / f"frame-{number}.color.png").unlink()
    assert "looks like 7-Scenes" in refusal(tmp_path)
    assert len(find_source(tmp_path / "*.txt")) == 3
    emptied()
    for name, told in (
        ("groundtruth.txt", "TUM's RGB-D images, but the list of depth pictures"),
        ("trajectory.log", "Open3D's RGB-D images, but the folder 'depth' of 16-bit PNG"),
        ("camera_intrinsics.json", "TrueDepth frames, but the frames, frame-N.npz, are"),
        ("calibration.json", "a stereo pair of Middlebury's, but the disparity picture"),
    ):
        (tmp_path / name).write_text("0.0 1 2 3 0 0 0 1\n")
        assert f"looks like {told}" in refusal(tmp_path)
        np.save(tmp_path / "scan.npy", np.eye(3))
        assert find_source(tmp_path).label(0) == "scan.npy", "a scan beside it is one"
        emptied()


def test_frames_follow_their_numbers(tmp_path: Path) -> None:
    put(tmp_path, "depth_2", "depth_10", "depth_11")
    with open_scan(tmp_path, fps=10) as scan:
        assert [scan.label(i) for i in range(3)] == ["depth_2.png", "depth_10.png", "depth_11.png"]
        np.testing.assert_allclose(scan.times, [0, 0.8, 0.9])
        assert [pose.index for pose in scan] == [0, 1, 2]
        np.testing.assert_array_equal(
            scan.pose(1).views[0].depth, depth_numbers(1).astype(np.float32) / np.float32(1000)
        )


def test_a_camera_without_poses_is_upright(tmp_path: Path) -> None:
    put(tmp_path, "a")
    view = only_view(tmp_path)
    np.testing.assert_array_equal(view.world_to_camera, np.eye(4))
    np.testing.assert_allclose(
        view.positions(), seen_points(metres(depth_numbers()), [*CAMERA.values()]), rtol=1e-5
    )


def test_broken_frames_are_left_out(tmp_path: Path) -> None:
    put(tmp_path, *(f"depth_{n}" for n in range(8)))
    for n in range(8):
        write_matrix(tmp_path / f"pose_{n}.txt", POSE)
    (tmp_path / "depth_1.png").write_bytes((tmp_path / "depth_1.png").read_bytes()[:60])
    write_color(tmp_path / "depth_2.png", colors())
    (tmp_path / "color_3.jpg").write_bytes(b"no picture")
    write_color(tmp_path / "color_4.jpg", colors()[:2])
    (tmp_path / "pose_5.txt").unlink()
    (tmp_path / "pose_6.txt").write_text("1 0 0\n0 1 0\n0 0 1\n")
    write_matrix(tmp_path / "pose_7.txt", np.full((4, 4), np.nan))
    with open_scan(tmp_path) as scan:
        assert [pose.index for pose in scan] == [0, 4]
        assert scan.pose(4).views[0].color is None
        told = {index: str(error) for index, error in scan.broken.items()}
    assert "depth_1.png: is not a valid PNG or TIFF file" in told[1]
    assert "depth_2.png: is a picture of type RGB" in told[2]
    assert "color_3.jpg: is not a valid PNG or JPEG" in told[3]
    assert "depth_5.png: has no camera pose" in told[5]
    assert "pose_6.txt: holds 9 numbers" in told[6]
    assert "pose_7.txt: the pose is not a rotation" in told[7]


def test_a_frame_may_lack_colours(tmp_path: Path) -> None:
    put(tmp_path, "depth_0", "depth_1")
    (tmp_path / "color_1.jpg").unlink()
    assert only_view(tmp_path, 0).color is not None
    assert only_view(tmp_path, 1).color is None


def test_a_picture_that_unpacks_to_far_more_is_refused(tmp_path: Path) -> None:
    write_depth(tmp_path / "a.png", np.zeros((6000, 6000), np.uint16))
    write_camera(tmp_path)
    assert "suspiciously much" in refusal(tmp_path)


def test_a_color_may_be_grey(tmp_path: Path) -> None:
    write_depth(tmp_path / "depth.png", depth_numbers())
    write_color(tmp_path / "color.png", colors()[..., 0])
    write_camera(tmp_path)
    view = only_view(tmp_path)
    np.testing.assert_array_equal(view.color, np.repeat(colors()[..., :1], 3, axis=2))
    write_depth(tmp_path / "color.png", depth_numbers())
    assert "but Scan4D needs colours" in refusal(tmp_path)
