"""Rigid motions: a rotation and a translation of a scan."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .bounds import Bounds
from .errors import InputError

_EXACT = 1e-6  # how far the rotation of a `Rigid` may be from orthonormal


@dataclass(frozen=True, eq=False)
class Rigid:
    """A rotation and a translation of column vectors, in float64.

    matrix: (4, 4). The identity changes no bit. Raises InputError for a matrix that is not a rotation and a
    translation.
    """

    matrix: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    is_identity: bool = field(init=False)

    def __post_init__(self) -> None:
        matrix = np.array(self.matrix, np.float64)
        if matrix.shape != (4, 4) or not is_rigid(matrix, _EXACT):
            raise InputError("a transform must be a rotation and a translation", hint="Give a 4 x 4 matrix")
        matrix.setflags(write=False)
        object.__setattr__(self, "matrix", matrix)
        object.__setattr__(self, "is_identity", bool((matrix == np.eye(4)).all()))

    @property
    def rotation(self) -> NDArray[np.float64]:
        """(3, 3)."""
        return self.matrix[:3, :3]

    @cached_property
    def inverse(self) -> Rigid:
        """The motion back."""
        if self.is_identity:
            return self
        return Rigid(rigid_matrix(self.rotation.T, -self.rotation.T @ self.matrix[:3, 3]))

    def points(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Moved points, (..., 3)."""
        return points if self.is_identity else points @ self.rotation.T + self.matrix[:3, 3]

    def directions(self, vectors: NDArray[np.floating]) -> NDArray[np.floating]:
        """Turned vectors (..., 3), of their own type."""
        return vectors if self.is_identity else (vectors @ self.rotation.T).astype(vectors.dtype)

    def bounds(self, bounds: Bounds) -> Bounds:
        """Upright box around a moved box."""
        if self.is_identity:
            return bounds
        corners = self.points(bounds.corners())
        return Bounds(corners.min(axis=0), corners.max(axis=0))

    def after(self, other: Rigid) -> Rigid:
        """Motion that applies the other one first and then this one."""
        if self.is_identity or other.is_identity:
            return other if self.is_identity else self
        return Rigid(self.matrix @ other.matrix)

    def in_frame(self, origin: NDArray[np.float64]) -> Rigid:
        """Motion in coordinates relative to an origin, (3,), that is the same as this one."""
        if self.is_identity:
            return self
        moved = self.matrix.copy()
        moved[:3, 3] += self.rotation @ origin - origin
        return Rigid(moved)


def rigid_matrix(rotation: NDArray[np.floating], translation: NDArray[np.floating]) -> NDArray[np.float64]:
    """The matrix (4, 4) of a rotation (3, 3) and a translation (3,)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, translation
    return matrix


def rotation_about(vector: NDArray[np.floating]) -> NDArray[np.float64]:
    """The rotation (3, 3) about a vector (3,) by its length in radians."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(vector).as_matrix()


def best_rotation(moved: NDArray[np.float64], still: NDArray[np.float64]) -> NDArray[np.float64]:
    """The rotation (3, 3) that brings points (N, 3) nearest to others, by least squares (Kabsch 1976; Umeyama
    1991 for the sign). Both have their mean at zero."""
    left, _, right = np.linalg.svd(still.T @ moved)
    return left @ np.diag([1, 1, np.sign(np.linalg.det(left @ right))]) @ right


def is_rigid(matrix: NDArray[np.float64], tolerance: float) -> bool:
    """Whether a (4, 4) matrix is a rotation and a translation. tolerance: from orthonormal."""
    rotation = matrix[:3, :3]
    return bool(
        np.isfinite(matrix).all()
        and (np.abs(rotation) < 2).all()
        and np.allclose(rotation @ rotation.T, np.eye(3), rtol=0, atol=tolerance)
        and np.linalg.det(rotation) > 0
        and (matrix[3] == (0, 0, 0, 1)).all()
    )


STILL = Rigid()
