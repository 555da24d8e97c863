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
        (PINHOLE | {"width": 640, "height": 360}, "its camera is for 640 x 360, the picture has 32 x 24"),
        (PINHOLE | {"cx": 319.5}, "principal point 319.5, 11.5 of its camera is outside the picture"),
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
