"""Where cameras stand, as data sets write it: from the camera to the world, in an image's axes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..rigid import is_rigid, rigid_matrix

UPRIGHT = np.eye(4)  # of a camera without a pose: the world is its own space
IMAGE_AXES = np.diag([1.0, -1.0, -1.0, 1.0])  # +y down and +z ahead, to up and back; and from there
_ROUNDED = 1e-2  # how far a rotation may be from orthonormal: files of three digits are


def from_camera_to_world(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """The world_to_camera of a range view, (4, 4), of a camera to world matrix in an image's axes.

    Raises InputError where it is not a rotation and a translation, up to some rounding.
    """
    if not is_rigid(pose, _ROUNDED):
        raise InputError("the pose is not a rotation and a translation")
    left, _, right = np.linalg.svd(pose[:3, :3])
    return IMAGE_AXES @ rigid_matrix((left @ right).T, -(left @ right).T @ pose[:3, 3])


def from_world_to_camera(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """The world_to_camera of a range view, (4, 4), of the inverse of such a matrix. Raises InputError."""
    if not is_rigid(matrix, _ROUNDED):
        raise InputError("the pose is not a rotation and a translation")
    return from_camera_to_world(np.asarray(np.linalg.inv(matrix), np.float64))


def rotation_of(quaternion: NDArray[np.float64]) -> NDArray[np.float64]:
    """The matrix (3, 3) of a quaternion x y z w of any length but 0. Raises InputError for others."""
    length = float(np.linalg.norm(quaternion))
    if not (np.isfinite(length) and length > 0):
        raise InputError(f"the quaternion {quaternion.tolist()} is not a rotation")
    x, y, z, w = quaternion / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )  # SciPy's takes longer to import than a scan to read
