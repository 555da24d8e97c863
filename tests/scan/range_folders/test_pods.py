"""A scanner's range images: pods.json, float TIFF, textures and masks, as frames of several views."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from range_scenes import shape_view

from viewer.errors import InputError
from viewer.scan.colors import srgb8
from viewer.scan.open import open_scan
from viewer.scan.range_view import RangeView

TO_IMAGE = np.diag([1.0, -1, -1, 1])


def pod(view: RangeView, **others: object) -> dict[str, Any]:
    """The calibration of a view as pods.json tells it."""
    return {
        "name": view.name, "kind": view.kind, "distortion": list(view.distortion),
        "fx": view.fx, "fy": view.fy, "cx": view.cx - 0.5, "cy": view.cy - 0.5,
        "pose": (np.linalg.inv(view.world_to_camera) @ TO_IMAGE).tolist(),
    } | others  # fmt: skip


def write(folder: Path, *pods: dict[str, Any], **others: object) -> Path:
    (folder / "pods.json").write_text(json.dumps({"unit": "mm", "pods": pods} | others))
    return folder


def save(path: Path, numbers: np.ndarray) -> None:
    path.parent.mkdir(exist_ok=True)
    Image.fromarray(numbers).save(path)


VIEWS = {
    "left": shape_view("sphere", "range", "barrel")[0],
    "right": shape_view("plane", "z")[0],
    "above": shape_view("sphere", "height")[0],
}
COLORS = np.random.default_rng(3).integers(0, 256, (97, 121, 3), np.uint8)


def rig(folder: Path, frames: int = 2) -> Path:
    """Three pods: one with everything, one with a mask of numbers, one with depth alone in a folder."""
    for frame in range(frames):
        for name, view in VIEWS.items():
            save(
                folder / ("top" if name == "above" else "") / f"{name}_{frame}_range.tif", view.depth + frame
            )
        save(folder / f"left_{frame}_texture.png", COLORS)
        save(folder / f"left_{frame}_mask.png", (np.arange(97 * 121).reshape(97, 121) % 2).astype(np.uint8))
        save(folder / f"left_{frame}_confidence.tif", VIEWS["left"].depth)
        halves = np.where(np.arange(121) < 60, np.float32(0.009), np.float32(0.02))
        save(folder / f"right_{frame}_mask.tif", np.tile(halves, (97, 1)))
    names = {image: f"left_*_{image}" for image in ("range", "texture", "mask", "confidence")}
    left = {"range": ".tif", "texture": ".png", "mask": ".png", "confidence": ".tif"}
    return write(
        folder,
        pod(VIEWS["left"], name="left", **{image: names[image] + suffix for image, suffix in left.items()}),
        pod(VIEWS["right"], name="right", range="right_*_range.tif", mask="right_*_mask.tif"),
        pod(VIEWS["above"], name="above", range="top/above_*_range.tif"),
    )


def test_pods_of_every_kind(tmp_path: Path) -> None:
    folder = rig(tmp_path)
    with open_scan(folder) as scan:
        assert (len(scan), scan.unit, scan.label(1)) == (2, "mm", "left_1_range.tif")
        poses = list(scan)
    for frame, pose in enumerate(poses):
        assert [view.name for view in pose.views] == [*VIEWS]
        for view, expected in zip(pose.views, VIEWS.values(), strict=True):
            assert view.depth.tobytes() == (expected.depth + frame).tobytes(), "bit for bit"
            assert (view.kind, view.distortion, view.unit) == (expected.kind, expected.distortion, "mm")
    left, right, above = poses[0].views
    assert np.array_equal(srgb8(left.color), COLORS)
    assert np.array_equal(left.mask, np.arange(97 * 121).reshape(97, 121) % 2 == 1)
    assert left.confidence.tobytes() == VIEWS["left"].depth.tobytes()
    assert not right.mask[:, :60].any()
    assert right.mask[:, 60:].all()
    assert right.color is right.confidence is None
    assert above.positions() == pytest.approx(VIEWS["above"].positions(), abs=1e-6)


def test_the_file_opens_its_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rig(tmp_path)
    with open_scan(tmp_path / "pods.json") as scan:
        assert len(scan) == 2
        assert tmp_path / "left_0_texture.png" in scan.files
    monkeypatch.chdir(tmp_path)
    with open_scan("pods.json") as scan:
        assert len(scan.pose(0).views) == 3


def test_a_single_frame_of_16_bits(tmp_path: Path) -> None:
    depth = np.arange(12, dtype=np.uint16).reshape(3, 4) * 1000
    save(tmp_path / "d.png", depth)
    given = {"fx": 9, "fy": 9, "cx": 1.5, "cy": 1, "depth_scale": 10, "unit": "cm"}
    with open_scan(write(tmp_path, {"range": "d.png"} | given)) as scan:
        (view,) = scan.pose(0).views
    assert np.array_equal(view.depth, depth)
    assert (view.name, view.unit, np.count_nonzero(view.valid())) == ("pod0", "mm", 11)


def test_a_pod_may_miss_a_frame_but_not_its_texture(tmp_path: Path) -> None:
    rig(tmp_path, 3)
    (tmp_path / "right_1_range.tif").unlink()
    (tmp_path / "left_2_texture.png").unlink()
    with open_scan(tmp_path) as scan:
        assert [view.name for view in scan.pose(1).views] == ["left", "above"]
        with pytest.raises(InputError, match=r"left_2_texture\.png: .*no such file"):
            scan.pose(2)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"range": None}, "pod 'left' has the range None, but this must be a file name"),
        ({"range": "a_*_*.tif"}, "with at most one ."),
        ({"range": "../x.tif"}, r"pod 'left' names '../x.tif', which is not a file in its folder"),
        ({"range": "/etc/passwd"}, "which is not a file in its folder"),
        ({"range": "*/x.tif"}, "with at most one ."),
        ({"range": "none.tif"}, r"there is no range image none\.tif"),
        ({"mask": 3}, "has the mask 3, but this must be a file name"),
        ({"fx": None}, "pod 'left' is not a calibration: fx is None"),
        ({"fx": 0}, "fx is 0"),
        ({"kind": "far"}, "unknown kind of depth 'far'"),
        ({"pose": [1, 2]}, "has a pose that is not a 4 x 4 matrix"),
        ({"pose": np.zeros((4, 4)).tolist()}, "the pose is not a rotation and a translation"),
        ({"name": ""}, "the name of pod0 is"),
    ],
)
def test_pods_that_cannot_be_used(changes: dict[str, object], reason: str, tmp_path: Path) -> None:
    given = pod(VIEWS["left"], name="left", range="left.tif") | changes
    with pytest.raises(InputError, match=reason) as caught:
        open_scan(write(tmp_path, given))
    assert "pods.json" in str(caught.value)
    assert caught.value.hint


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "is not JSON"),
        ("{", "is not JSON"),
        ("[]", "is not a JSON object"),
        ("{}", "lists no pods"),
        ('{"pods": []}', "lists 0 pods"),
        ('{"pods": [3]}', "pod0 is not a JSON object"),
    ],
)
def test_files_that_tell_no_pods(text: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "pods.json").write_text(text)
    with pytest.raises(InputError, match=reason):
        open_scan(tmp_path)


def test_pods_of_one_name_are_refused(tmp_path: Path) -> None:
    one = pod(VIEWS["left"], range="a.tif")
    with pytest.raises(InputError, match="gives several pods the same name"):
        open_scan(write(tmp_path, one, one))


def test_images_of_another_shape_are_left_out_and_a_mask_is_refused(tmp_path: Path) -> None:
    rig(tmp_path, 1)
    save(tmp_path / "left_0_texture.png", COLORS[40:])
    with open_scan(tmp_path) as scan:
        assert scan.pose(0).views[0].color is None
        assert "121 x 57 pixels, but its depth picture has 121 x 97" in scan.reading.unused[0]
    save(tmp_path / "left_0_mask.png", COLORS[40:, :, 0])
    with open_scan(tmp_path) as scan, pytest.raises(InputError, match="mask has a different shape"):
        scan.pose(0)


def test_a_large_mask_of_one_colour_is_no_bomb(tmp_path: Path) -> None:
    """It packs to a thousandth of what it takes; textures and depths of that size do not."""
    shape = 2000, 3000
    save(tmp_path / "range.tif", np.ones(shape, np.float32))
    save(tmp_path / "mask.png", np.full(shape, 255, np.uint8))
    assert (tmp_path / "mask.png").stat().st_size < 20_000
    given = {"fx": 3000, "fy": 3000, "cx": 1500, "cy": 1000, "range": "range.tif", "mask": "mask.png"}
    with open_scan(write(tmp_path, given)) as scan:
        assert scan.pose(0).views[0].mask.all()
