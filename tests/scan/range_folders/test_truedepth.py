"""A phone's TrueDepth frames: depth, linear colours and time in one file each."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from depth_folders import seen_points

from viewer.errors import InputError
from viewer.scan.listing import list_folder
from viewer.scan.open import find_source, open_scan

CAMERA = (2.5, 2.4, 1.6, 1.1)  # for pictures of 3 columns; stored for those of 30


def write_frame(path: Path, time: float, **others: np.ndarray) -> None:
    depth = np.array([[1, 2, np.nan], [3, 4, 5]], np.float32)
    color = np.arange(18, dtype=np.uint8).reshape(2, 3, 3) * 10
    np.savez(path, **({"depth": depth, "color": color, "timestamp": np.float64(time)} | others))


def put(folder: Path, *times: float) -> Path:
    fx, fy, cx, cy = (10 * value for value in CAMERA)
    stored = {
        "intrinsic_matrix": [fx, 0, 0, 0, fy, 0, cx, cy, 1],
        "intrinsic_matrix_reference_dimensions_width": 30,
    }
    (folder / "camera_intrinsics.json").write_text(json.dumps(stored))
    for n, time in enumerate(times):
        write_frame(folder / f"frame-{3 * n:03d}.npz", time)
    return folder


def test_frames_with_their_times(tmp_path: Path) -> None:
    put(tmp_path, 42.0, 42.5, 43.1)
    np.save(tmp_path / "reference.npy", np.eye(3))
    with open_scan(tmp_path) as scan:
        assert (len(scan), scan.unit, scan.label(1)) == (3, "m", "frame-003.npz")
        np.testing.assert_allclose(scan.times, [0, 0.5, 1.1])
        (view,) = scan.pose(1).views
    np.testing.assert_allclose(view.positions(), seen_points([[1, 2, 0], [3, 4, 5]], CAMERA), rtol=1e-6)
    assert view.color is not None
    assert view.color[0, 0].tolist() == [0, 56, 79]  # 0, 10 and 20 of 255, linear, as sRGB
    assert [(one.kind, one.frames) for one in list_folder(tmp_path)] == [("whole", 3), ("file", 1)]


@pytest.mark.parametrize(("gravity", "turns"), [((0, -1), 1), ((1, 0.1), 0), ((-1, 0), 2), ((0.1, 1), 3)])
def test_pictures_stand_upright(tmp_path: Path, gravity: tuple[float, float], turns: int) -> None:
    put(tmp_path, 42.0)
    x, y = gravity
    motion = [{"gravity_x": x, "gravity_y": y, "gravity_z": 0.0, "timestamp": 42.0}] * 2
    (tmp_path / "motion-data.json").write_text(json.dumps(motion))
    with open_scan(tmp_path) as scan:
        (view,) = scan.pose(0).views
        assert len(scan.files) == 3
        camera = scan.reading["camera"]
    assert (camera.source, camera.where) == ("neighbour", "camera_intrinsics.json")
    assert (f"by {90 * turns} degrees" in camera.why) == (turns > 0)
    assert json.loads(json.dumps(camera.to_json()))["value"]["fx"] == pytest.approx(view.fx)
    flat = seen_points([[1, 2, 0], [3, 4, 5]], CAMERA)
    for _ in range(turns):  # what was up goes to the right, what was left goes up
        flat = flat[:, [1, 0, 2]] * (1, -1, 1)
    assert view.depth.shape == ((2, 3), (3, 2))[turns % 2]
    found = view.positions()
    np.testing.assert_allclose(found[found[:, 2].argsort()], flat[flat[:, 2].argsort()], rtol=1e-5)
    assert view.color is not None
    middle = {0: (0, 0), 1: (0, 1), 2: (1, 2), 3: (2, 0)}[turns]  # where the first pixel went
    assert view.color[middle].tolist() == [0, 56, 79]


@pytest.mark.parametrize("text", ["{}", "[]", "[1]", '[{"gravity_x": "a"}]', '[{"gravity_x": 1}]'])
def test_motion_that_tells_no_gravity_is_told(tmp_path: Path, text: str) -> None:
    put(tmp_path, 1)
    (tmp_path / "motion-data.json").write_text(text)
    with pytest.raises(InputError, match=r"motion-data\.json: has no usable gravity"):
        find_source(tmp_path)


def test_times_that_do_not_increase_need_a_frame_rate(tmp_path: Path) -> None:
    put(tmp_path, 42.0, 41.0)
    with pytest.raises(InputError, match="times of the frames do not increase"):
        open_scan(tmp_path)
    with open_scan(tmp_path, fps=10) as scan:
        np.testing.assert_allclose(scan.times, [0, 0.3])


def test_a_frame_that_is_damaged_is_left_out(tmp_path: Path) -> None:
    put(tmp_path, 1, 2, 3, 4, 5)
    damaged = tmp_path / "frame-000.npz"
    damaged.write_bytes(damaged.read_bytes()[:50])
    write_frame(tmp_path / "frame-003.npz", 2, depth=np.zeros(5, np.float32))
    write_frame(tmp_path / "frame-006.npz", 2, color=np.zeros((2, 3, 3)))
    write_frame(tmp_path / "frame-009.npz", 2, depth=np.ones((2, 3)))
    with open_scan(tmp_path) as scan:
        assert [pose.index for pose in scan] == [4]
        np.testing.assert_allclose(scan.times[1], 3 / 25)  # by the numbers, since a time is missing
        assert set(scan.broken) == {0, 1, 2, 3}
        assert all(f"frame-{3 * n:03d}.npz" in str(error) for n, error in scan.broken.items())


@pytest.mark.parametrize(
    "text",
    [
        "{",
        "[]",
        "{}",
        '{"intrinsic_matrix": [1, 2], "intrinsic_matrix_reference_dimensions_width": 3}',
        '{"intrinsic_matrix": [1,0,0,0,1,0,1,1,1], "intrinsic_matrix_reference_dimensions_width": 0}',
        '{"intrinsic_matrix": [-1,0,0,0,1,0,1,1,1], "intrinsic_matrix_reference_dimensions_width": 3}',
        '{"intrinsic_matrix": ["a",0,0,0,1,0,1,1,1], "intrinsic_matrix_reference_dimensions_width": 3}',
    ],
)
def test_a_calibration_that_is_none_is_told(tmp_path: Path, text: str) -> None:
    put(tmp_path, 1)
    (tmp_path / "camera_intrinsics.json").write_text(text)
    with pytest.raises(
        InputError, match=r"camera_intrinsics\.json: is not (a calibration|JSON|a JSON object)"
    ):
        find_source(tmp_path)


def test_real_frames(data_dir: Path) -> None:
    with open_scan(data_dir / "range" / "truedepth_head_30") as scan:
        assert len(scan) == 30
        assert scan.times[-1] == pytest.approx(2.894784)
        (view,) = scan.pose(9).views
    assert view.depth.shape == (320, 240)  # the phone was upright, its sensor on its side
    assert (view.fx, view.cx, view.cy) == pytest.approx((298.565, 240 - 119.601, 159.732), abs=1e-3)
    head = view.positions()[view.depth[view.valid()] < 0.75]
    size = np.ptp(head, axis=0)
    assert 0.2 < size[0] < 0.4  # metres
    assert 0.2 < size[1] < 0.5
    assert scan.unit == "m"
