"""Tables of cameras, poses and trajectories, which stand beside range scans and hold numbers as points do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .numbers import is_numeral, value

_ORTHONORMAL = 1e-2  # how far a rotation may be from it: files of three digits are
_SHORTEST = 2.0  # pixels, a focal length
_MODELS = {  # of COLMAP
    "SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "OPENCV_FISHEYE", "FULL_OPENCV", "FOV",
    "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE", "THIN_PRISM_FISHEYE",
}  # fmt: skip
_ANNOUNCED = {
    ("CAMERA_ID", "MODEL"): "a list of cameras (COLMAP)",
    ("IMAGE_ID", "QW"): "a list of camera poses (COLMAP)",
    ("FRAME_ID", "RIG_ID"): "a list of camera poses (COLMAP)",
    ("RIG_ID", "NUM_SENSORS"): "a list of cameras (COLMAP)",
}
_QUATERNION = {"qx", "qy", "qz", "qw"}
_LAYOUTS = ((4, 4), (3, 4), (3, 3))  # of a matrix, the most certain one first


def cameras_in_words(rows: Sequence[Sequence[str]]) -> str | None:
    """The cameras or poses that the first rows of a table list, as COLMAP writes them; None for none."""
    if any(len(words) > 4 and words[1].upper() in _MODELS for words in rows):
        return "a list of cameras (COLMAP)"
    if rows and 2 * sum(map(_is_image, rows)) >= len(rows):  # each before a line of its points, perhaps blank
        return "a list of camera poses (COLMAP)"
    return None


def _is_image(words: Sequence[str]) -> bool:
    """Whether a row is a picture of COLMAP: id, quaternion, translation, camera and file name."""
    if len(words) < 10 or not (words[0].isdecimal() and words[8].isdecimal()) or is_numeral(words[9]):
        return False
    return all(map(is_numeral, words[1:8])) and _is_unit(np.array([value(word) for word in words[1:5]]))


def cameras_in_names(names: Sequence[str]) -> str | None:
    """The cameras that names of columns state: intrinsics, or quaternions with times; None for none."""
    plain = {
        name.strip("# ").split(" ")[0].lower().replace("q_rs_", "q").replace("q_", "q") for name in names
    }
    if plain >= {"fx", "fy", "cx", "cy"}:
        return "intrinsics of a camera (fx, fy, cx, cy)"
    if plain >= _QUATERNION and any("time" in name or name in ("frame", "t") for name in plain):
        return "a camera trajectory (times, positions and quaternions)"
    if plain >= _QUATERNION and all(name.strip("tp_") in ("", "x", "y", "z") for name in plain - _QUATERNION):
        return "camera poses (positions and quaternions)"
    return None


def cameras_in_comment(text: str) -> str | None:
    """The cameras that a comment above a table announces, as COLMAP writes it; None for none."""
    words = text.replace(",", " ").replace("[", " ").split()[:3]
    return next((what for start, what in _ANNOUNCED.items() if tuple(words[: len(start)]) == start), None)


def cameras_in_table(table: NDArray[np.float64]) -> str | None:
    """The cameras, poses or matrices of a table without names, (N, C); None where it holds none."""
    if not table.size or not np.isfinite(table).all():
        return None
    return _intrinsics_in_a_row(table) or _trajectory(table) or camera_matrices(table)


def _intrinsics_in_a_row(table: NDArray[np.float64]) -> str | None:
    """Focal lengths, principal point and lens of one camera, perhaps behind the size of its picture."""
    if len(table) != 1:
        return None
    row = table[0]
    centers = row[4:6] if len(row) >= 6 else row[:0]
    is_sized = len(centers) and (row[:2] == np.rint(row[:2])).all() and (centers > 1).all()
    is_sized = is_sized and (centers < row[:2]).all()
    numbers = row[2:] if is_sized else row
    if len(numbers) < 4 or (numbers[:4] <= _SHORTEST).any():
        return None
    fx, fy, cx, cy = numbers[:4]
    is_camera = 0.5 < fx / fy < 2 and fx > 10 and 0.1 < cx / fx < 5 and 0.1 < cy / fy < 5
    return (
        "intrinsics of a camera (fx, fy, cx, cy)" if is_camera and (np.abs(numbers[4:]) < 10).all() else None
    )


def _trajectory(table: NDArray[np.float64]) -> str | None:
    """Poses as rows of a time, a translation and a quaternion, as TUM has them; or without the times."""
    count, width = table.shape
    if width == 8 and _are_unit(table[:, 4:]) and (np.diff(table[:, 0]) > 0).all():
        return f"a camera trajectory ({count} times, translations and quaternions)"
    if width == 7 and count > 1 and _are_unit(table[:, 3:]) and not _are_unit(table[:, 3:6]):
        return f"{count} camera poses (translations and quaternions)"
    return None


def _is_unit(quaternion: NDArray[np.float64]) -> bool:
    return bool(abs(np.linalg.norm(quaternion) - 1) < _ORTHONORMAL)


def _are_unit(rows: NDArray[np.float64]) -> bool:
    return bool((np.abs(np.linalg.norm(rows, axis=1) - 1) < _ORTHONORMAL).all())


def camera_matrices(table: NDArray[np.float64]) -> str | None:
    """The matrices of a table without names, (N, C), that is made of camera matrices; None where it is not.

    They stand one below the other, or a row each. Poses are rotations with a translation beside them;
    intrinsics have focal lengths and the last row 0, 0, 1. Three or four points may happen to be
    along the axes: that alone makes no pose of them, unless there is a last row 0, 0, 0, 1.
    """
    if table.shape == (1, 7) and _is_unit(table[0, 3:]):
        return "a camera pose (a translation and a quaternion)"
    for height, width in _LAYOUTS:
        size = height * width
        if not table.size or table.size % size or table.shape[1] not in (width, size):
            continue
        if table.shape[1] == width and len(table) % height:
            continue
        blocks = table.reshape(-1, height, width)
        count = len(blocks)
        several = f"{count} {{}} ({height} x {width} each)" if count > 1 else f"a {{}} ({height} x {width})"
        if width == 4 and _are_poses(blocks):
            return several.format("camera poses" if count > 1 else "camera pose")
        if _are_intrinsics(blocks):
            return several.format(
                "matrices of camera intrinsics" if count > 1 else "matrix of camera intrinsics"
            )
    return None


def _are_poses(blocks: NDArray[np.float64]) -> bool:
    """blocks: (K, 3 or 4, 4)."""
    rotations = blocks[:, :3, :3]
    if not np.isfinite(blocks).all() or (np.abs(rotations) > 1 + _ORTHONORMAL).any():
        return False
    products = rotations @ rotations.transpose(0, 2, 1)
    if np.abs(products - np.eye(3)).max() > _ORTHONORMAL:
        return False
    if blocks.shape[1] == 4:
        return bool((blocks[:, 3] == (0, 0, 0, 1)).all())
    return bool((np.abs(rotations) % 1 > _ORTHONORMAL).any())


def _are_intrinsics(blocks: NDArray[np.float64]) -> bool:
    """blocks: (K, 3 or 4, 3 or 4)."""
    focal_x, focal_y = blocks[:, 0, 0], blocks[:, 1, 1]
    centers = blocks[:, :2, 2]
    rest = blocks.copy()
    rest[:, 0, :3] = rest[:, 1, 1:3] = 0
    rest[:, 2, 2] -= 1
    if blocks.shape[1] == 4:
        rest[:, 3, 3] -= 1
    return bool(
        ((focal_x > _SHORTEST) & (focal_y > _SHORTEST)).all() and (centers > 0).all() and not rest.any()
    )
