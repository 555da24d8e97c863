"""NPY: one NumPy array of positions, (N, 3), or (T, N, 3) for a sequence."""

from __future__ import annotations

import math
from pathlib import Path
from typing import BinaryIO

from ..admission import admit, opened, size_of
from ..points import PointCloud
from ..reading.cloud import cloud_of
from ..reading.sequence import Decided
from ._stored import StoredArray

TITLE = "NPY"
SUFFIXES = (".npy",)


def frame_count(path: Path) -> int:
    """T of a (T, N, 3) array, else 1."""
    with opened(path) as stream:
        return math.prod(_positions(stream).sequence)


def read(path: Path, frame: int, decided: Decided) -> PointCloud:
    """One frame of the positions; the other frames are not read. Raises InputError."""
    with opened(path) as stream:
        positions = _positions(stream)
        share = frame if positions.sequence else None
        admit(size_of(stream), positions.memory(share))
        return cloud_of([positions.read(share)], {}, {}, held=size_of(stream), decided=decided)


def _positions(stream: BinaryIO) -> StoredArray:
    return StoredArray.open("positions", stream, size_of(stream))
