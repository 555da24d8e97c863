"""SVO: octrees of all poses in one file; `viewer/scan/octree/file.py` reads and writes them.

That package takes longer to import than all other formats together, so each function imports it when called.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..points import PointCloud
from ..pose import Pose

TITLE = "SVO"
SUFFIXES = (".svo",)


def frame_count(path: Path) -> int:
    """How many octrees there are; reads their headers."""
    from ..octree import file

    return file.frame_count(path)


def read_times(path: Path) -> NDArray[np.float64]:
    """(T,) seconds."""
    from ..octree import file

    return file.read_times(path)


def read_unit(path: Path) -> str:
    """The unit of the first octree."""
    from ..octree import file

    return file.read_unit(path)


def check(path: Path) -> None:
    """Raise InputError where a pose is too large to be read again, by the headers alone."""
    from ..octree import file

    file.check(path)


def read(path: Path, frame: int = 0) -> PointCloud:
    """The leaves of one pose. Raises InputError where it, or a pose that it refers to, is damaged."""
    return Frames(path).read(frame)


class Frames:
    """The poses of one file, see `viewer/scan/octree/file.py`."""

    def __init__(self, path: Path) -> None:
        """Reads the headers. Raises InputError where the file holds something else."""
        from ..octree import file

        self.read = file.Frames(path).read


def coarser(path: Path, frame: int) -> Iterator[PointCloud]:
    """The leaves of coarser octrees of one pose, each finer than the one before."""
    from ..octree import file

    return file.Frames(path).coarser(frame)


def write_poses(path: Path, poses: Iterable[Pose], unit: str, **options: Any) -> None:
    """Write the octrees of all poses. options: of `viewer.scan.octree.file.write_poses`."""
    from ..octree import file

    file.write_poses(path, poses, unit, **options)
