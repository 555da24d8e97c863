"""Whole folders of range images, one of each kind that Scan4D reads, as small as can be."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
from depth_folders import (
    CAMERA,
    POSE,
    colors,
    depth_numbers,
    write_camera,
    write_color,
    write_depth,
    write_matrix,
)
from PIL import Image


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


def depth_pictures(folder: Path) -> None:
    for n in range(2):
        write_depth(folder / f"a_depth_{n}.png", depth_numbers(n))
        write_color(folder / f"a_color_{n}.png", colors(n))
        write_matrix(folder / f"a_pose_{n}.txt", POSE)
    write_camera(folder)


FOLDERS: dict[str, Callable[[Path], None]] = {
    make.__name__: make
    for make in (sevenscenes, open3d, tum, truedepth, middlebury, stanford, scanner, depth_pictures)
}
