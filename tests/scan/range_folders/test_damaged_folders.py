"""Folders of range images, damaged in many ways: read, or refused in one message that says where."""

from __future__ import annotations

import json
import random
import shutil
from pathlib import Path

import numpy as np
import pytest
from depth_folders import CAMERA, POSE, colors, depth_numbers, write_color, write_depth, write_matrix
from PIL import Image

from viewer.errors import InputError
from viewer.scan.listing import list_folder
from viewer.scan.open import open_scan

DAMAGES = 120  # of each kind
INSERTED = (b"nan ", b"1e999 ", b"-", b"\0", b"9" * 50, b"[", b'"', b"\xff")


def sevenscenes(folder: Path) -> None:
    for n in range(2):
        write_depth(folder / f"frame-{n:06d}.depth.png", depth_numbers(n))
        write_color(folder / f"frame-{n:06d}.color.jpg", colors(n))
        write_matrix(folder / f"frame-{n:06d}.pose.txt", POSE)
    write_matrix(folder / "camera-intrinsics.txt", np.array([[5, 0, 2.0], [0, 5, 2], [0, 0, 1]]))


def open3d(folder: Path) -> None:
    for n in range(2):
        write_depth(folder / f"depth/{n}.png", depth_numbers(n))
        write_color(folder / f"color/{n}.png", colors(n))
    (folder / "trajectory.log").write_text(2 * ("0 0 1\n" + " ".join(map(str, POSE.ravel())) + "\n"))
    (folder / "rgbd.match").write_text("depth/0.png color/0.png\ndepth/1.png color/1.png\n")
    (folder / "camera.json").write_text(json.dumps(CAMERA | {"distortion": [0.1, 0, 0, 0]}))


def tum(folder: Path) -> None:
    for n in range(2):
        write_depth(folder / f"depth/{n}.png", depth_numbers(n))
        write_color(folder / f"rgb/{n}.png", colors(n))
    (folder / "depth.txt").write_text("1.0 depth/0.png\n2.0 depth/1.png\n")
    (folder / "rgb.txt").write_text("1.01 rgb/0.png\n2.01 rgb/1.png\n")
    (folder / "groundtruth.txt").write_text("1.001 0 0 0 0 0 0 1\n2.001 1 1 1 0 0 0 1\n")


def truedepth(folder: Path) -> None:
    stored = {
        "intrinsic_matrix": [30, 0, 0, 0, 30, 0, 15, 10, 1],
        "intrinsic_matrix_reference_dimensions_width": 30,
    }
    (folder / "camera_intrinsics.json").write_text(json.dumps(stored))
    for n in range(2):
        depth, color = np.ones((2, 3), np.float32), np.zeros((2, 3, 3), np.uint8)
        np.savez(folder / f"frame-{n}.npz", depth=depth, color=color, timestamp=float(n))


def middlebury(folder: Path) -> None:
    numbers = dict.fromkeys(
        ("principal_point_left_x_px", "principal_point_y_px", "principal_point_dx_px"), 1.5
    )
    numbers |= {"focal_length_px": 100.0, "baseline_mm": 200.0}
    (folder / "calibration.json").write_text(json.dumps(numbers))
    np.savez(folder / "cup_disp.npz", disparity=np.ones((2, 3), np.float32))
    write_color(folder / "cup_left.png", np.zeros((2, 3, 3), np.uint8))


def stanford(folder: Path) -> None:
    (folder / "scans.conf").write_text("bmesh a.ply 0 0 0 0 0 0 1\n")
    y, x = np.mgrid[:3, :4]
    np.savez(folder / "a.npz", xyz=np.stack([x, y, 0.1 * x], axis=2).astype(np.float32))


def scanner(folder: Path) -> None:
    told = []
    for name in ("left", "right"):
        for n in range(2):
            Image.fromarray(np.ones((4, 5), np.float32)).save(folder / f"{name}_{n}.tif")
            write_color(folder / f"{name}_{n}.png", np.zeros((4, 5, 3), np.uint8))
        camera = {"fx": 9, "fy": 9, "cx": 2, "cy": 2, "distortion": [0.1, 0, 0, 0], "pose": POSE.tolist()}
        told.append({"name": name, "range": f"{name}_*.tif", "texture": f"{name}_*.png"} | camera)
    (folder / "pods.json").write_text(json.dumps({"unit": "mm", "pods": told}))


def damage(folder: Path, chance: random.Random) -> None:
    """Change a byte, cut, empty, insert, exchange or delete: one file of the folder."""
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    file, how = chance.choice(files), chance.randrange(6)
    data = bytearray(file.read_bytes())
    place = chance.randrange(len(data))
    if how == 0:
        data[place] = chance.randrange(256)
    elif how == 1:
        del data[place:]
    elif how == 2:
        data.clear()
    elif how == 3:
        data[place:place] = chance.choice(INSERTED)
    elif how == 4:
        data = bytearray(chance.choice(files).read_bytes())
    file.write_bytes(data)
    if how == 5:
        file.unlink()


@pytest.mark.parametrize("make", [sevenscenes, open3d, tum, truedepth, middlebury, stanford, scanner])
def test_whatever_is_wrong_is_one_message(make: object, tmp_path: Path) -> None:
    assert callable(make)
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    whole.mkdir()
    make(whole)
    with open_scan(whole) as scan:
        assert len(list(scan)) == len(scan)
    chance, refused = random.Random(1), 0
    for _ in range(DAMAGES):
        shutil.rmtree(broken, ignore_errors=True)
        shutil.copytree(whole, broken)
        damage(broken, chance)
        list_folder(broken)
        try:
            with open_scan(broken) as scan:
                for pose in scan:
                    assert len(pose.cloud)
                errors = [*scan.broken.values()]
        except InputError as error:
            errors = [error]
        for error in errors:
            assert "broken" in str(error.where) or error.where in labels(broken)
            assert len(str(error)) < 900
        refused += bool(errors)
    assert refused > DAMAGES / 4


def labels(folder: Path) -> set[str]:
    """What messages call the files of a folder for short."""
    return {file.relative_to(folder).as_posix() for file in folder.rglob("*")}
