"""Faces between the points of a scan: polygons as files hold them, and what they say of the points."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .points import NOTHING

Triangles = NDArray[np.uint32]  # (F, 3) rows of points


@dataclass(frozen=True, eq=False)
class Faces:
    """Polygons between the points of a file, in the file's order.

    sizes:   (F,) uint32, how many corners each has
    corners: (C,) uint32, the ids of their points, polygon after polygon
    """

    sizes: NDArray[np.uint32]
    corners: NDArray[np.uint32]

    @classmethod
    def of(cls, corners: NDArray, sizes: NDArray | None = None) -> Faces:
        """Polygons from whole numbers of any type and byte order.

        corners: (F, k), or (C,) where sizes (F,) tell how many each has. Raises InputError for a corner
        that cannot be the id of a point.
        """
        if corners.dtype.kind not in "iu":
            raise InputError(
                f"the vertex indices of a face are not whole numbers, but of type {corners.dtype}"
            )
        ids = np.ascontiguousarray(corners, corners.dtype.newbyteorder("="))
        if ids.size and not 0 <= ids.min() <= ids.max() < NOTHING:
            raise InputError("a face refers to a vertex that does not exist")
        if sizes is None:
            sizes = np.full(len(ids), ids.shape[1], np.uint32)
        return cls(sizes.astype(np.uint32, copy=False), ids.ravel().astype(np.uint32, copy=False))

    @classmethod
    def joined(cls, pieces: Iterable[Faces]) -> Faces:
        """All polygons of the pieces, in order."""
        held = list(pieces)
        none = np.empty(0, np.uint32)
        return cls(
            np.concatenate([none, *(piece.sizes for piece in held)]),
            np.concatenate([none, *(piece.corners for piece in held)]),
        )

    def __len__(self) -> int:
        return len(self.sizes)

    @property
    def nbytes(self) -> int:
        """Bytes of both arrays."""
        return self.sizes.nbytes + self.corners.nbytes

    def triangles(self) -> Triangles:
        """Polygons as fans around their first corners, (T, 3); less than three corners make none."""
        if (self.sizes == 3).all():
            return self.corners.reshape(-1, 3)
        fans = np.maximum(self.sizes.astype(np.int64), 2) - 2  # triangles of each polygon
        first = np.repeat(np.cumsum(self.sizes, dtype=np.int64) - self.sizes, fans)
        step = np.arange(len(first)) - np.repeat(np.cumsum(fans) - fans, fans)  # in its fan
        return self.corners[np.stack([first, first + step + 1, first + step + 2], axis=1)]


def topology(points: int, pieces: Iterable[Faces]) -> str | None:
    """A name for faces between so many points, the same for the same faces, or None where there are none.

    It does not depend on how a file stores them, nor on where one piece ends. The order of the faces and of
    their corners counts: where it differs, nothing says that the points are the same.
    """
    sizes, corners = hashlib.blake2b(digest_size=16), hashlib.blake2b(digest_size=16)
    empty = True
    for piece in pieces:
        sizes.update(piece.sizes.astype("<u4", copy=False).data)
        corners.update(piece.corners.astype("<u4", copy=False).data)
        empty = empty and not len(piece)
    return None if empty else f"{points} points, faces {sizes.hexdigest()} {corners.hexdigest()}"


def rows_of_faces(faces: Triangles, ids: NDArray[np.uint32] | None) -> NDArray[np.int64]:
    """Faces (F, 3) of ids as faces of rows, without those of points that are not among the ids."""
    if ids is None:
        return faces.astype(np.int64)
    if not len(ids):
        return np.zeros((0, 3), np.int64)
    rows = np.searchsorted(ids, faces).clip(max=len(ids) - 1)
    return rows[(ids[rows] == faces).all(axis=1)].astype(np.int64)
