"""NPY: one NumPy array of positions, (N, 3), or (T, N, 3) for a sequence."""

from __future__ import annotations

import math
from pathlib import Path
from typing import BinaryIO

from ..points import PointCloud
from ._stored import StoredArray

TITLE = "NPY"
SUFFIXES = (".npy",)


def frame_count(path: Path) -> int:
    """T of a (T, N, 3) array, else 1."""
    with open(path, "rb") as stream:
        return math.prod(_positions(stream, path).sequence)


def read(path: Path, frame: int = 0) -> PointCloud:
    """One frame of the positions; the other frames are not read. Raises InputError."""
    with open(path, "rb") as stream:
        positions = _positions(stream, path)
        return PointCloud.from_arrays(positions.read(frame if positions.sequence else None))


def _positions(stream: BinaryIO, path: Path) -> StoredArray:
    return StoredArray.open("positions", stream, path.stat().st_size)
