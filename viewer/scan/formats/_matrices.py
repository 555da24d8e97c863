"""Camera matrices as text, which stand beside range scans and are tables of numbers as points are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_ORTHONORMAL = 1e-2  # how far a rotation may be from it: files of three digits are
_SHORTEST = 2.0  # pixels, a focal length
_LAYOUTS = ((4, 4), (3, 4), (3, 3))  # of a matrix, the most certain one first


def camera_matrices(table: NDArray[np.float64]) -> str | None:
    """The matrices of a table without names, (N, C), that is made of camera matrices; None where it is not.

    They stand one below the other, or a row each. Poses are rotations with a translation beside them;
    intrinsics have focal lengths and the last row 0, 0, 1. Three or four points may happen to be
    along the axes: that alone makes no pose of them, unless there is a last row 0, 0, 0, 1.
    """
    if table.shape == (1, 7) and abs(np.linalg.norm(table[0, 3:]) - 1) < _ORTHONORMAL:
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
