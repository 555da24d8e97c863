"""Files that state a depth camera, in the forms of the recorders."""

from __future__ import annotations

import json
from typing import Any

import pytest

from viewer.errors import InputError
from viewer.scan.contents import StatedCamera
from viewer.scan.reading.camera_files import camera_names, must_state_a_camera, stated_cameras

BY_ROWS = [290, 0, 159.5, 0, 291, 89.5, 0, 0, 1]
BY_COLUMNS = [290, 0, 0, 0, 291, 0, 159.5, 89.5, 1]
FIELDS = {"fx": 290, "fy": 291, "cx": 159.5, "cy": 89.5}
NESTED = [BY_ROWS[:3], BY_ROWS[3:6], BY_ROWS[6:]]
PINHOLE = (290, 291, 159.5, 89.5)


def pinhole(camera: StatedCamera) -> tuple[float, ...]:
    return camera.fx, camera.fy, camera.cx, camera.cy


def only(name: str, content: Any) -> StatedCamera:
    text = content if isinstance(content, str) else json.dumps(content)
    (camera,) = stated_cameras(name, text)
    return camera


@pytest.mark.parametrize(
    "stored",
    [
        FIELDS,
        {"intrinsic_matrix": BY_COLUMNS},  # Open3D
        {"intrinsic_matrix": BY_ROWS},
        {"intrinsic_matrix": NESTED},
        {"camera_matrix": NESTED},
        {"cameraMatrix": {"rows": 3, "cols": 3, "data": BY_ROWS}},
        {"K": BY_ROWS, "w": 320, "h": 180},
        {"K": BY_COLUMNS, "fps": 60, "dw": 256, "dh": 192, "poses": [[0, 0, 0, 1, 0, 0, 0]]},  # Record3D
        {"intrinsics": BY_ROWS, "cameraPoseARFrame": [0.0] * 16, "projectionMatrix": [0.5] * 16},  # ARKit
        {"intrinsics": FIELDS},
        {"intrinsics": list(PINHOLE)},
        {"width": 320, "height": 180, "ppx": 159.5, "ppy": 89.5, "fx": 290, "fy": 291, "coeffs": [0.0] * 5},
        {"focal_x": 290, "focal_y": 291, "principal_x": 159.5, "principal_y": 89.5},
        {"fl_x": 290, "fl_y": 291, "cx": 160, "cy": 90, "w": 320, "h": 180, "frames": []},
        {"camera_intrinsics": FIELDS},
        {"depth": {"intrinsics": FIELDS}},
        {"intrinsics": {"depth": FIELDS}},
        {"depth_intrinsics": BY_ROWS},
    ],
)
def test_json_of_many_recorders(stored: dict[str, Any]) -> None:
    camera = only("intrinsic.json", stored)
    assert pinhole(camera) == PINHOLE
    assert (camera.distortion, camera.where, camera.is_color) == ((), "intrinsic.json", False)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("K.txt", "290 0 159.5\n0 291 89.5\n0 0 1\n"),
        ("intrinsic_depth.txt", "290 0 159.5 0\n0 291 89.5 0\n0 0 1 0\n0 0 0 1\n"),
        ("calibration.txt", "290 291 159.5 89.5\n"),
        ("intrinsics.txt", "290, 291, 159.5, 89.5"),
        ("intrinsics.csv", "fx,fy,cx,cy\n290,291,159.5,89.5\n"),
        ("K.txt", "[[290, 0, 159.5],\n [0, 291, 89.5],\n [0, 0, 1]]\n"),
        ("info.txt", "a = 4\nm_calibrationDepthIntrinsic = 290 0 159.5 0 0 291 89.5 0 0 0 1 0 0 0 0 1\n"),
        ("scene0000_00.txt", "fx_depth = 290\nfy_depth = 291\nmx_depth = 159.5\nmy_depth = 89.5\n"),
        ("a_metadata_Depth.csv", "Type,Depth\nIntrinsic:,\nFx,290\nFy,291\nPPx,159.5\nPPy,89.5\n"),
        ("camera.txt", "fx: 290\nfy: 291\ncx: 159.5\ncy: 89.5\n"),
        ("a.pincam", "320 180 290 291 159.5 89.5\n"),
        ("camera_info.yaml", "camera_matrix:\n  data: [290.0, 0., 159.5,\n   0, 291, 89.5, 0, 0, 1]\n"),
        ("camera.yaml", "%YAML:1.0\nCamera.fx: 290\nCamera.fy: 291\nCamera.cx: 159.5 #\nCamera.cy: 89.5\n"),
        ("camera.yml", "K:\n- 290\n- 0\n- 159.5\n- 0\n- 291\n- 89.5\n- 0\n- 0\n- 1\n"),
    ],
)  # fmt: skip
def test_texts_of_many_recorders(name: str, text: str) -> None:
    assert pinhole(only(name, text)) == PINHOLE
    assert pinhole(only(name, "\ufeff" + text)) == PINHOLE


@pytest.mark.parametrize(
    ("stored", "size"),
    [
        ({"width": 640, "height": 480}, (640, 480)),
        ({"w": 640, "h": 480}, (640, 480)),
        ({"image_width": 640, "image_height": 480}, (640, 480)),
        ({"m_depthWidth": 640, "m_depthHeight": 480, "m_colorWidth": 1296}, (640, 480)),
        ({"resolution": [640, 480]}, (640, 480)),
        ({}, (None, None)),
    ],
)
def test_the_size_of_the_pictures(stored: dict[str, Any], size: tuple[int | None, int | None]) -> None:
    camera = only("camera.json", FIELDS | stored)
    assert (camera.width, camera.height) == size


@pytest.mark.parametrize(
    ("stored", "scale"),
    [
        ({"depth_scale": 5000}, 5000),
        ({"depthScale": 0.001}, 1000),
        ({"depth_units": 0.0010000000474974513}, 1000),  # a float32 of RealSense
        ({"m_depthShift": 1000}, 1000),
        ({"DepthMapFactor": 5000.0}, 5000),
        ({"factor_depth": 4000}, 4000),
        ({"scale": 2, "shift": 3}, None),  # of something else
    ],
)
def test_the_depth_scale(stored: dict[str, Any], scale: float | None) -> None:
    assert only("camera.json", FIELDS | stored).depth_scale == scale


@pytest.mark.parametrize(
    ("stored", "lens"),
    [
        ({"distortion": [0.1, 0, 0, 0]}, (0.1, 0, 0, 0)),
        ({"D": [0.1, 0.2, 0, 0, 0.3]}, (0.1, 0.2, 0, 0, 0.3)),
        ({"distortion_coefficients": {"rows": 1, "cols": 5, "data": [0.1, 0, 0, 0, 0]}}, (0.1, 0, 0, 0, 0)),
        ({"k1": 0.1, "k2": 0.2, "p1": 0.3, "p2": 0.4}, (0.1, 0.2, 0.3, 0.4)),
        ({"k1": 0.1, "k3": 0.5}, (0.1, 0, 0, 0, 0.5)),
        ({"coeffs": [0.0] * 14, "model": "fisheye"}, ()),
        ({"distortion": [0.1] + [0] * 13}, (0.1, 0, 0, 0, 0, 0, 0, 0)),
        ({"distortion": "brown_conrady"}, ()),
    ],
)
def test_the_lens(stored: dict[str, Any], lens: tuple[float, ...]) -> None:
    assert only("camera.json", FIELDS | stored).distortion == lens


def test_depth_comes_before_color() -> None:
    color = {"fx": 900, "fy": 900, "cx": 640, "cy": 360}
    for stored in (
        {"color": color, "depth": FIELDS, "depth_scale": 0.001},
        {"streams": {"Color": color, "Depth": FIELDS}, "depth_scale": 0.001},
        {"cameras": [{"rgb": color}, {"ir": FIELDS}], "depth_scale": 1000},
        {"m_calibrationColorIntrinsic": [900, 0, 640, 0, 900, 360, 0, 0, 1]}
        | {"m_calibrationDepthIntrinsic": BY_ROWS, "m_depthShift": 1000},
    ):
        depth, of_color = stated_cameras("calibration.json", json.dumps(stored))
        assert (pinhole(depth), depth.is_color, depth.depth_scale) == (PINHOLE, False, 1000)
        assert (pinhole(of_color), of_color.is_color) == ((900, 900, 640, 360), True)


def test_cameras_of_colmap_count_from_the_corner() -> None:
    text = (
        "# Camera list\n"
        "1 PINHOLE 320 180 290 291 160 90\n"
        "2 SIMPLE_RADIAL 640 480 500 320 240 0.1\n"
        "3 OPENCV 640 480 500 501 320 240 0.1 0.2 0.3 0.4\n"
    )
    one, two, three = stated_cameras("cameras.txt", text)
    assert (pinhole(one), one.width, one.height) == (PINHOLE, 320, 180)
    assert (pinhole(two), two.distortion) == ((500, 500, 319.5, 239.5), (0.1, 0, 0, 0))
    assert three.distortion == (0.1, 0.2, 0.3, 0.4)


def kinect(**others: Any) -> dict[str, Any]:
    """A raw calibration as an Azure Kinect stores it: parts of the sensor's width and height."""
    depth = [0.5, 0.51, 0.49, 0.48, 0.1, 0.2, 0.01, 0.4, 0.5, 0.6, 0, 0, 0.002, 0.001]
    color = [0.5, 0.5, 0.475, 0.633, *[0.0] * 10]
    cameras = [
        {"Purpose": f"CALIBRATION_CameraPurpose{purpose}", "Intrinsics": {"ModelParameters": numbers}}
        for purpose, numbers in (("PhotoVideo", color), ("Depth", depth))
    ]
    return {"CalibrationInformation": {"Cameras": cameras}} | others


def test_an_azure_kinect_has_a_camera_for_each_of_its_modes() -> None:
    cameras = stated_cameras("calibration.json", json.dumps(kinect()))
    by_size = {(one.width, one.height): one for one in cameras}
    narrow, wide, color = by_size[640, 576], by_size[1024, 1024], by_size[1280, 720]
    assert pinhole(narrow) == pytest.approx((501.76, 491.52, 512 - 192 - 0.5, 522.24 - 180 - 0.5))
    assert pinhole(wide) == pytest.approx((501.76, 491.52, 511.5, 521.74))
    assert narrow.distortion == (0.1, 0.2, 0.001, 0.002, 0.01, 0.4, 0.5, 0.6)
    assert narrow.depth_scale == 1000
    assert pinhole(color) == pytest.approx((608, 607.68, 639.5, 359.5))
    assert [one.is_color for one in cameras] == sorted(one.is_color for one in cameras)


@pytest.mark.parametrize(
    ("name", "text", "stated"),
    [
        ("camera.json", "{", "not JSON"),
        ("camera.json", "[1, 2]", "not a JSON object"),
        ("camera.json", '{"fx": 5}', "lacks fy, cx, cy"),
        ("camera.json", json.dumps(FIELDS | {"fx": "wide"}), "fx is wide"),
        ("camera.json", json.dumps(FIELDS | {"fx": 0}), "fx is 0"),
        ("camera.json", json.dumps({"K": [1, 2]}), "expected 9 numbers"),
        ("camera.json", json.dumps(FIELDS | {"depth_scale": 0}), "1000 for millimetres"),
        ("camera.json", json.dumps(FIELDS | {"D": [0.1] * 4, "model": "equidistant"}), "equidistant"),
        ("K.txt", "1 2 3\n", "3 numbers"),
        ("K.txt", "", "0 numbers"),
        ("info.txt", "m_versionNumber = 4\nfocus = near\n", "lacks fx"),
        ("camera_info.yaml", "a: 1\n", "lacks fx"),
        ("calibration.json", json.dumps({"CalibrationInformation": {"Cameras": []}}), "states no camera"),
        ("calibration.json", json.dumps({"CalibrationInformation": {}}), "states no camera"),
    ],
)
def test_other_texts_are_no_calibration(name: str, text: str, stated: str) -> None:
    with pytest.raises(InputError) as caught:
        stated_cameras(name, text)
    assert stated in str(caught.value)


def test_the_better_file_comes_first() -> None:
    names = ["info.txt", "a.ply", "Intrinsic.json", "camera.json", "times.csv", "intrinsic_depth.txt"]
    assert camera_names(names) == ["camera.json", "intrinsic_depth.txt", "Intrinsic.json", "info.txt"]
    assert [must_state_a_camera(name) for name in ("camera.json", "k.txt", "info.txt")] == [True, True, False]
