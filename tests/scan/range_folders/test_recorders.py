"""Folders as recorders of depth cameras write them: their names, their cameras, their sizes of pictures."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from depth_folders import CAMERA, POSE, write_color, write_depth, write_matrix
from numpy.typing import NDArray

from viewer.errors import InputError
from viewer.scan.open import find_source, open_scan
from viewer.scan.range_view import RangeView

WIDTH, HEIGHT = 32, 24
PINHOLE = {"fx": 30.0, "fy": 30.0, "cx": 15.5, "cy": 11.5}
BY_ROWS = [30, 0, 15.5, 0, 30, 11.5, 0, 0, 1]
BY_COLUMNS = [30, 0, 0, 0, 30, 0, 15.5, 11.5, 1]
LARGE = {"fx": 240, "fy": 240, "cx": 127.5, "cy": 95.5}  # the same camera for 256 x 192 pixels
LARGE_ROWS = [240, 0, 127.5, 0, 240, 95.5, 0, 0, 1]
GL_AXES = np.diag([1.0, -1.0, -1.0, 1.0])


def numbers(frame: int = 0) -> NDArray[np.uint16]:
    return np.full((HEIGHT, WIDTH), 500 + frame, np.uint16)


def halves(width: int, height: int) -> NDArray[np.uint8]:
    """A picture whose left half is red and whose right half is blue."""
    image = np.zeros((height, width, 3), np.uint8)
    image[:, : width // 2, 0], image[:, width // 2 :, 2] = 255, 255
    return image


def put(folder: Path, depth: str = "depth", color: str = "color", stem: str = "00000{}") -> None:
    for n in range(2):
        write_depth(folder / depth / f"{stem.format(n)}.png", numbers(n))
        write_color(folder / color / f"{stem.format(n)}.jpg", halves(WIDTH, HEIGHT))


def with_file(name: str, content: Any, **names: str) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        put(folder, **names)
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(content if isinstance(content, str) else json.dumps(content))

    return write


def scannet(folder: Path) -> None:
    put(folder)
    write_matrix(folder / "intrinsic/intrinsic_depth.txt", matrix(30, 15.5, 11.5))
    write_matrix(folder / "intrinsic/intrinsic_color.txt", matrix(900, 640, 480))
    for n in range(2):
        write_matrix(folder / f"pose/00000{n}.txt", POSE)


def matrix(focal: float, cx: float, cy: float) -> NDArray[np.float64]:
    return np.array([[focal, 0, cx, 0], [0, focal, cy, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])


def polycam(folder: Path) -> None:
    put(folder / "keyframes", color="images")
    pose = {f"t_{row}{column}": (POSE @ GL_AXES)[row, column] for row in range(3) for column in range(4)}
    (folder / "keyframes/cameras").mkdir()
    for n in range(2):
        stored = LARGE | {"width": 256, "height": 192, "timestamp": n} | pose
        (folder / f"keyframes/cameras/00000{n}.json").write_text(json.dumps(stored))


def scanner_app(folder: Path) -> None:
    """A 3D Scanner App's export of ARKit's frames."""
    for n in range(2):
        write_depth(folder / f"depth_0000{n}.png", numbers(n))
        write_color(folder / f"frame_0000{n}.jpg", halves(256, 192))
        write_color(folder / f"conf_0000{n}.png", np.full((HEIGHT, WIDTH), 2, np.uint8))
        stored = {"intrinsics": LARGE_ROWS, "cameraPoseARFrame": (POSE @ GL_AXES).ravel().tolist(), "time": n}
        (folder / f"frame_0000{n}.json").write_text(json.dumps(stored))
    (folder / "info.json").write_text('{"version": 1}')


def arkit_scenes(folder: Path) -> None:
    put(folder, depth="lowres_depth", color="lowres_wide", stem="4_{}.5")
    (folder / "lowres_wide_intrinsics").mkdir()
    for n in range(2):
        (folder / f"lowres_wide_intrinsics/4_{n}.5.pincam").write_text("32 24 30 30 15.5 11.5\n")


RECORDERS = {
    "Open3D with RealSense": with_file(
        "camera_intrinsic.json", {"width": WIDTH, "height": HEIGHT, "intrinsic_matrix": BY_COLUMNS}
    ),
    "Open3D with Azure Kinect": with_file(
        "intrinsic.json", {"intrinsic_matrix": BY_COLUMNS, "stream_length_usec": 1, "color_mode": "MJPG_720P"}
    ),
    "pyrealsense2": with_file(
        "intrinsics.json",
        {"width": WIDTH, "height": HEIGHT, "fx": 30, "fy": 30, "ppx": 15.5, "ppy": 11.5, "model": "none"}
        | {"coeffs": [0.0] * 5, "depth_scale": 0.001},
    ),
    "RealSense Viewer": with_file(
        "a_metadata_Depth.csv", "Resolution x,32\nResolution y,24\nFx,30\nFy,30\nPPx,15.5\nPPy,11.5\n"
    ),
    "ROS": with_file("camera_info.yaml", f"camera_matrix:\n  rows: 3\n  cols: 3\n  data: {BY_ROWS}\n"),
    "by rows": with_file("calibration.json", {"camera_matrix": [BY_ROWS[:3], BY_ROWS[3:6], BY_ROWS[6:]]}),
    "COLMAP": with_file("cameras.txt", "1 PINHOLE 32 24 30 30 16 12\n", depth="depth_maps", color="images"),
    "Record3D": with_file(
        "metadata.json",
        {"K": [240, 0, 0, 0, 240, 0, 127.5, 95.5, 1], "w": 256, "h": 192, "dw": WIDTH, "dh": HEIGHT},
        color="rgb",
    ),
    "ScanNet": scannet,
    "Polycam": polycam,
    "3D Scanner App": scanner_app,
    "ARKitScenes": arkit_scenes,
}  # fmt: skip
PLACED = ("ScanNet", "Polycam", "3D Scanner App")


@pytest.mark.parametrize("name", RECORDERS)
def test_folders_of_recorders(tmp_path: Path, name: str) -> None:
    RECORDERS[name](tmp_path)
    with open_scan(tmp_path) as scan:
        assert (len(scan), scan.unit) == (2, "m")
        views = [scan.pose(index).views[0] for index in range(2)]
        camera = scan.reading["camera"]
    view = views[1]
    assert (view.fx, view.fy, view.cx, view.cy, view.assumed) == pytest.approx((30, 30, 16, 12, ""))
    assert np.unique(view.depth) == pytest.approx(0.501)
    assert view.color is not None
    assert view.color[0, 2, 0] > 200 > 50 > view.color[0, -3, 0]
    assert (camera.source, camera.is_marked) == ("neighbour", False)
    assert (view.confidence is not None) == (name == "3D Scanner App")
    if name in PLACED:
        np.testing.assert_allclose(view.eye, POSE[:3, 3])
        np.testing.assert_allclose(np.linalg.inv(view.world_to_camera), POSE @ GL_AXES, atol=1e-9)


@pytest.mark.parametrize("suffix", [".tif", ".npy", ".exr"])
@pytest.mark.parametrize("folder", ["depth", "."])
def test_depth_of_other_kinds_has_the_camera_beside_it(tmp_path: Path, suffix: str, folder: str) -> None:
    """Floats are lengths. In a folder of their own, too, where they would be scans without a camera."""
    depth = np.linspace(1, 2, 24, dtype=np.float32).reshape(4, 6)
    (tmp_path / folder).mkdir(exist_ok=True)
    for n in range(2):
        save(tmp_path / folder / f"depth_{n}{suffix}", depth + n)
    (tmp_path / "camera.json").write_text(json.dumps(CAMERA))
    with open_scan(tmp_path) as scan:
        assert (len(scan), scan.unit) == (2, "m")
        (view,) = scan.pose(1).views
    np.testing.assert_array_equal(view.depth, depth + 1)
    assert (view.fx, view.cx) == (5, 3)


def save(path: Path, depth: NDArray[np.float32]) -> None:
    if path.suffix == ".npy":
        np.save(path, depth)
    elif path.suffix == ".tif":
        from PIL import Image

        Image.fromarray(depth).save(path)
    else:
        OpenEXR = pytest.importorskip("OpenEXR")
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        OpenEXR.File(header, {"Z": depth}).write(str(path))


def seven_scenes(folder: Path, width: int, height: int) -> None:
    write_depth(folder / "frame-000000.depth.png", np.full((height, width), 1000, np.uint16))
    write_matrix(folder / "frame-000000.pose.txt", np.eye(4))


def tum(folder: Path, width: int, height: int) -> None:
    write_depth(folder / "depth/1.png", np.full((height, width), 5000, np.uint16))
    (folder / "depth.txt").write_text("1.0 depth/1.png\n")
    (folder / "groundtruth.txt").write_text("1.0 0 0 0 0 0 0 1\n")


def open3d(folder: Path, width: int, height: int) -> None:
    write_depth(folder / "depth/1.png", np.full((height, width), 1000, np.uint16))
    (folder / "trajectory.log").write_text("0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")


DATA_SETS: list[tuple[Callable[[Path, int, int], None], float, float]] = [
    (seven_scenes, 585, 320.5),
    (tum, 525, 320),
    (open3d, 525, 320),
]


@pytest.mark.parametrize(("make", "focal", "cx"), DATA_SETS)
@pytest.mark.parametrize("factor", [1, 2, 4])
def test_a_default_camera_is_scaled_to_its_pictures(
    tmp_path: Path, make: Callable[[Path, int, int], None], focal: float, cx: float, factor: int
) -> None:
    make(tmp_path, 640 // factor, 480 // factor)
    with open_scan(tmp_path) as scan:
        (view,) = scan.pose(0).views
        reading = scan.reading
        assert not scan.messages
    assert (view.fx, view.cx, view.assumed) == (focal / factor, cx / factor, "")
    assert np.unique(view.depth) == 1
    assert "camera" in reading.assumed
    assert reading["depth-scale"].source == "folder"


@pytest.mark.parametrize(("make", "focal", "cx"), DATA_SETS)
def test_a_default_camera_that_does_not_fit_is_replaced_and_reported(
    tmp_path: Path, make: Callable[[Path, int, int], None], focal: float, cx: float
) -> None:
    make(tmp_path, 320, 180)
    with open_scan(tmp_path) as scan:
        (view,) = scan.pose(0).views
        assert ["assumes a field of view of 45 degrees" in one.text for one in scan.messages] == [True]
        assert scan.reading.assumed == ("camera",)
        assert len(scan.reading["camera"].alternatives) == 1
    assert (view.cx, view.cy) == (160, 90)
    with open_scan(tmp_path, read={"camera": "290,291,159.5,89.5", "depth-scale": "2000"}) as scan:
        (view,) = scan.pose(0).views
        assert [scan.reading[key].source for key in ("camera", "depth-scale")] == ["user", "user"]
        assert not scan.messages
    assert (view.fx, view.fy, view.cx, view.cy) == (290, 291, 160, 90)
    assert np.unique(view.depth) in (0.5, 2.5)
    (tmp_path / "mine.json").write_text('{"fx": 290, "fy": 290, "cx": 159.5, "cy": 89.5}')
    with open_scan(tmp_path, read={"camera": "mine.json"}) as scan:
        assert scan.pose(0).views[0].fx == 290


def test_depth_without_a_camera_opens_with_an_assumed_one(tmp_path: Path) -> None:
    put(tmp_path)
    with open_scan(tmp_path) as scan:
        assert scan.pose(0).views[0].cx == WIDTH / 2
        assert "camera" in scan.reading.assumed
        assert "depth-scale" in scan.reading.assumed


def test_a_camera_of_another_shape_or_outside_is_refused(tmp_path: Path) -> None:
    put(tmp_path)
    for stored, reason in (
        (
            PINHOLE | {"width": 640, "height": 360},
            "the camera is for pictures of 640 x 360 pixels, but this picture has 32 x 24",
        ),
        (PINHOLE | {"cx": 319.5}, "principal point 319.5, 11.5 of the camera is outside the picture"),
    ):
        (tmp_path / "camera.json").write_text(json.dumps(stored))
        with pytest.raises(InputError) as caught:
            find_source(tmp_path).load(0)
        assert reason in str(caught.value)


@pytest.mark.parametrize("size", [(64, 48), (96, 72), (16, 12), (128, 96), (65, 48)])
def test_pictures_of_another_size_lie_over_the_depth(tmp_path: Path, size: tuple[int, int]) -> None:
    write_depth(tmp_path / "depth.png", numbers())
    write_color(tmp_path / "color.png", halves(*size))
    write_color(tmp_path / "mask.png", halves(*size)[..., 0])
    write_color(tmp_path / "confidence.png", halves(*size)[..., 2])
    (tmp_path / "camera.json").write_text(json.dumps(PINHOLE))
    view = only(tmp_path)
    assert view.color is not None
    assert view.confidence is not None
    np.testing.assert_array_equal(view.color, halves(WIDTH, HEIGHT))
    np.testing.assert_array_equal(view.mask, halves(WIDTH, HEIGHT)[..., 0] > 0)
    np.testing.assert_array_equal(view.confidence, halves(WIDTH, HEIGHT)[..., 2])


def only(folder: Path) -> RangeView:
    (view,) = find_source(folder).load(0)
    assert isinstance(view, RangeView)
    return view


def test_colors_of_another_shape_are_left_out_and_reported(tmp_path: Path) -> None:
    write_depth(tmp_path / "depth.png", numbers())
    write_color(tmp_path / "color.png", halves(64, 36))
    (tmp_path / "camera.json").write_text(json.dumps(PINHOLE))
    with open_scan(tmp_path) as scan:
        assert scan.pose(0).views[0].color is None
        assert [one.kind for one in scan.messages] == ["camera"]
        assert "64 x 36 pixels, but its depth picture has 32 x 24" in scan.messages[0].text
        assert scan.reading.unused == ("colours of 64 x 36 pixels, but its depth picture has 32 x 24",)


def test_a_picture_of_another_size_than_the_first_is_reported(tmp_path: Path) -> None:
    write_depth(tmp_path / "depth_0.png", numbers())
    write_depth(tmp_path / "depth_1.png", np.full((48, 64), 500, np.uint16))
    (tmp_path / "camera.json").write_text(json.dumps(PINHOLE | {"width": WIDTH, "height": HEIGHT}))
    with open_scan(tmp_path) as scan:
        assert [pose.views[0].fx for pose in scan] == [30, 60]
        (contradiction,) = scan.reading.contradictions
    assert (contradiction.frame, contradiction.key) == (1, "camera")


def test_a_file_of_a_common_name_may_be_something_else(tmp_path: Path) -> None:
    put(tmp_path)
    for name in ("info.txt", "metadata.json", "calibration.txt"):
        (tmp_path / name).write_text("a note on this scan\n")
    (tmp_path / "camera.json").write_text(json.dumps(PINHOLE))
    assert only(tmp_path).fx == 30
    (tmp_path / "camera.json").write_text("{")
    with pytest.raises(InputError, match=r"camera\.json: is not JSON"):
        find_source(tmp_path)


def test_a_mark_of_the_order_of_bytes_is_passed_over(tmp_path: Path) -> None:
    put(tmp_path)
    (tmp_path / "camera.json").write_bytes(b"\xef\xbb\xbf" + json.dumps(PINHOLE).encode())
    assert only(tmp_path).fx == 30


PLACE = (1.0, 2.0, 3.0)  # of the camera at the second frame
TIMES = (0.0, 0.2)


def stray(folder: Path) -> None:
    put(folder, stem="00000{}")
    for n in range(2):
        write_color(folder / f"confidence/00000{n}.png", np.full((HEIGHT, WIDTH), 2, np.uint8))
    (folder / "camera_matrix.csv").write_text("1800.0, 0.0, 959.5\n0.0, 1800.0, 719.5\n0.0, 0.0, 1.0\n")
    rows = "".join(f"{9 + n / 5}, 00000{n}, {n}, 2, 3, 0, 0, 0, 1\n" for n in range(2))
    (folder / "odometry.csv").write_text(f"timestamp, frame, x, y, z, qx, qy, qz, qw\n{rows}")
    (folder / "imu.csv").write_text("timestamp, a_x, a_y, a_z\n1, 2, 3, 4\n")


def record3d(folder: Path, channels: str = "R", **more: Any) -> None:
    OpenEXR = pytest.importorskip("OpenEXR")
    (folder / "EXR_RGBD/depth").mkdir(parents=True)
    for n in range(2):
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        depth = {channel: np.full((HEIGHT, WIDTH), 0.5, np.float32) for channel in channels}
        OpenEXR.File(header, depth).write(str(folder / f"EXR_RGBD/depth/{n}.exr"))
        write_color(folder / f"EXR_RGBD/rgb/{n}.jpg", halves(256, 192))
    stored = {"K": [240, 0, 0, 0, 240, 0, 127.5, 95.5, 1], "w": 256, "h": 192, "dw": WIDTH, "dh": HEIGHT}
    stored |= {"poses": [[0, 0, 0, 1, n, 2, 3] for n in range(2)], "fps": 5} | more
    (folder / "EXR_RGBD/metadata.json").write_text(json.dumps(stored))


def cameras_of_frames(folder: Path) -> None:
    record3d(folder, perFrameIntrinsicCoeffs=[[99, 99, 127.5, 95.5], [240, 240, 127.5, 95.5]])


def arkit_scenes_placed(folder: Path) -> None:
    for n in range(2):
        stem = f"41069021_{100 + n / 5:.3f}"
        write_depth(folder / f"lowres_depth/{stem}.png", numbers(n))
        write_color(folder / f"lowres_wide/{stem}.png", halves(WIDTH, HEIGHT))
        (folder / "lowres_wide_intrinsics").mkdir(exist_ok=True)
        (folder / f"lowres_wide_intrinsics/{stem}.pincam").write_text("32 24 30 30 15.5 11.5\n")
    rows = "".join(f"{100 + n / 5 + 0.004} 0 0 0 {-n} -2 -3\n" for n in range(-1, 3))
    (folder / "lowres_wide.traj").write_text(rows)


def nerfstudio(folder: Path) -> None:
    put(folder, color="images")
    frames = []
    for n in (1, 0):  # in any order
        matrix = np.eye(4)
        matrix[:3, 3] = n, 2, 3
        name = {"file_path": f"images/00000{n}.jpg", "depth_file_path": f"depth/00000{n}.png"}
        frames.append(name | {"transform_matrix": matrix.tolist()})
    camera = {"fl_x": 30, "fl_y": 30, "cx": 16, "cy": 12, "w": WIDTH, "h": HEIGHT}
    (folder / "transforms.json").write_text(json.dumps(camera | {"frames": frames}))


def replica(folder: Path) -> None:
    for n in range(2):
        write_depth(folder / f"results/depth00000{n}.png", numbers(n))
        write_color(folder / f"results/frame00000{n}.jpg", halves(WIDTH, HEIGHT))
    (folder / "traj.txt").write_text("".join(f"1 0 0 {n} 0 1 0 2 0 0 1 3 0 0 0 1\n" for n in range(2)))
    (folder / "cam_params.json").write_text(json.dumps({"camera": PINHOLE}))


def scanner_app_beside_its_mesh(folder: Path) -> None:
    for n in range(2):
        write_depth(folder / f"depth_0000{n}.png", numbers(n))
        write_color(folder / f"frame_0000{n}.jpg", halves(256, 192))
        pose = [1, 0, 0, n, 0, 1, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1]
        stored = {"intrinsics": LARGE_ROWS, "cameraPoseARFrame": pose, "time": 7 + n / 5}
        (folder / f"frame_0000{n}.json").write_text(json.dumps(stored))
    (folder / "export.obj").write_text("v 0 0 0\n")


TRAJECTORIES: dict[str, tuple[Callable[[Path], None], bool]] = {  # and whether they state times
    "Stray Scanner": (stray, True),
    "Record3D": (record3d, True),
    "Record3D with time stamps": (lambda folder: record3d(folder, fps=30, frameTimestamps=[4, 4.2]), True),
    "Record3D with three channels": (lambda folder: record3d(folder, "RGB"), True),
    "Record3D with a camera a frame": (cameras_of_frames, True),
    "ARKitScenes": (arkit_scenes_placed, True),
    "nerfstudio": (nerfstudio, False),
    "Replica": (replica, False),
    "3D Scanner App": (scanner_app_beside_its_mesh, True),
}


@pytest.mark.parametrize("name", TRAJECTORIES)
def test_one_file_states_where_the_camera_stood(tmp_path: Path, name: str) -> None:
    write, has_times = TRAJECTORIES[name]
    write(tmp_path)
    with open_scan(tmp_path) as scan:
        assert (len(scan), scan.unit) == (2, "m")
        if has_times:
            assert scan.times.tolist() == pytest.approx(TIMES)
        (view,) = scan.pose(1).views
        assert scan.reading["camera"].source == "neighbour"
    assert (view.fx, view.fy, view.cx, view.cy) == pytest.approx((30, 30, 16, 12))
    assert view.eye == pytest.approx(PLACE)
    assert view.color is not None
    assert np.median(view.depth) == pytest.approx(0.5, abs=0.002)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("odometry.csv", "timestamp, frame, x, y\n1, 2, 3, 4\n"),
        ("traj.txt", "1 2 3\n4 5 6\n"),
        ("metadata.json", '{"poses": [[1, 2, 3]]}'),
    ],
)
def test_a_damaged_trajectory_is_told(tmp_path: Path, name: str, text: str) -> None:
    put(tmp_path)
    (tmp_path / "camera.json").write_text(json.dumps(PINHOLE))
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match="is not a list of camera poses") as caught:
        find_source(tmp_path)
    assert name in str(caught.value)


def test_a_picture_without_a_pose_is_left_out(tmp_path: Path) -> None:
    stray(tmp_path)
    lines = (tmp_path / "odometry.csv").read_text().splitlines()
    (tmp_path / "odometry.csv").write_text("\n".join(lines[:2]))
    with open_scan(tmp_path) as scan:
        assert scan.pose(0).views[0].eye == pytest.approx((0, 2, 3))
        with pytest.raises(InputError, match=r"has no pose in odometry\.csv"):
            scan.pose(1)


def test_names_of_folders_and_partners_count_in_any_case_and_by_number(tmp_path: Path) -> None:
    for n in range(2):
        write_depth(tmp_path / f"Depth/depth_000{n}.png", numbers(n))
        write_color(tmp_path / f"RGB/rgb_000{n}.png", halves(WIDTH, HEIGHT))
    (tmp_path / "Intrinsics.json").write_text(json.dumps(PINHOLE))
    with open_scan(tmp_path) as scan:
        assert scan.pose(1).views[0].color is not None


def test_depth_as_pgm(tmp_path: Path) -> None:
    """ScanNet's own program writes it."""
    text = numbers(1).astype(">u2").tobytes()
    (tmp_path / "frame-000000.depth.pgm").write_bytes(b"P5\n32 24\n65535\n" + text)
    write_matrix(tmp_path / "frame-000000.pose.txt", POSE)
    lines = ["m_depthShift = 1000", "m_calibrationDepthIntrinsic = 30 0 15.5 0 0 30 11.5 0 0 0 1 0 0 0 0 1"]
    (tmp_path / "_info.txt").write_text("\n".join(["m_depthWidth = 32", "m_depthHeight = 24", *lines]))
    with open_scan(tmp_path) as scan:
        (view,) = scan.pose(0).views
    assert np.unique(view.depth) == pytest.approx(0.501)
    assert view.fx == 30


def test_a_recording_of_record3d_that_is_only_unpacked_is_told(tmp_path: Path) -> None:
    (tmp_path / "rgbd").mkdir()
    (tmp_path / "rgbd/0.depth").write_bytes(b"bvx-")
    (tmp_path / "metadata").write_text(json.dumps({"K": BY_COLUMNS}))
    with pytest.raises(InputError, match="export the recording as EXR with RGB-D"):
        find_source(tmp_path)


def test_far_values_of_pictures_are_left_out(tmp_path: Path) -> None:
    depth = np.linspace(1, 2, 48, dtype=np.float32).reshape(4, 12)
    depth[1] = 65504
    np.save(tmp_path / "depth_0.npy", depth)
    (tmp_path / "camera.json").write_text(json.dumps(CAMERA))
    with open_scan(tmp_path) as scan:
        assert scan.pose(0).count == 36
        assert scan.reading["missing"].value == "65504"
