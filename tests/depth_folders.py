"""Small folders of depth pictures as data sets have them, and the points that they stand for."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

SIZE = (6, 4)  # columns and rows
CAMERA = {"fx": 5.0, "fy": 4.0, "cx": 2.5, "cy": 1.5}  # pixel centres at whole numbers
POSE = np.array([[0, 0, 1, 10], [1, 0, 0, 20], [0, 1, 0, 30], [0, 0, 0, 1]], float)  # from the camera

IMAGE_AXES = np.diag([1.0, -1.0, -1.0, 1.0])


def depth_numbers(seed: int = 0) -> NDArray[np.uint16]:
    """Random numbers (4, 6), two of which mean that there is none."""
    numbers = np.random.default_rng(seed).integers(1, 65535, SIZE[::-1], np.uint16)
    numbers[1, 2], numbers[3, 5] = 0, 65535
    return numbers


def colors(seed: int = 0) -> NDArray[np.uint8]:
    """Random colours (4, 6, 3)."""
    return np.random.default_rng(seed).integers(0, 256, (*SIZE[::-1], 3), np.uint8)


def write_depth(path: Path, numbers: NDArray[np.uint16]) -> None:
    """Write a 16-bit grey PNG, from its specification: rows without a filter."""
    height, width = numbers.shape
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in numbers)
    head = struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0)
    chunks = ((b"IHDR", head), (b"IDAT", zlib.compress(rows)), (b"IEND", b""))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + b"".join(
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
            for name, data in chunks
        )
    )


def write_color(path: Path, image: NDArray[np.uint8]) -> None:
    """Write a picture of colours, (H, W, 3)."""
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(image).save(path)


def write_matrix(path: Path, matrix: NDArray[np.float64]) -> None:
    """Write a matrix as text."""
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(path, matrix)


def write_camera(folder: Path, **others: object) -> None:
    """Write the camera.json of a folder."""
    (folder / "camera.json").write_text(json.dumps(CAMERA | others))


def seen_points(
    depth: NDArray[np.floating], camera: Sequence[float], pose: NDArray[np.float64] = IMAGE_AXES
) -> NDArray[np.float64]:
    """The points of all pixels with a depth > 0, (N, 3), as data sets define it.

    depth: (H, W). camera: fx, fy, cx, cy, the centre of the first pixel at 0, 0. pose: from the camera, that
    looks down +z with +y down, to the world; without it that is the camera's space, x right, y up.
    """
    fx, fy, cx, cy = camera
    points = [
        ((column - cx) * d / fx, (row - cy) * d / fy, d)
        for row, line in enumerate(depth)
        for column, d in enumerate(line)
        if d > 0
    ]
    return np.array(points) @ pose[:3, :3].T + pose[:3, 3]


def metres(numbers: NDArray[np.uint16], scale: float = 1000) -> NDArray[np.float64]:
    """Depths as data sets define them; 0: none."""
    return np.where(numbers == 65535, 0, numbers / scale)
