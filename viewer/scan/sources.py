"""Where the frames of a scan come from: a sequence of files, or one file of many frames."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import printable
from . import formats
from .points import PointCloud
from .pose import Scanned
from .times import TIMES_FILE, read_times_csv

FACES_FILE = "mesh_topology.ply"  # beside a folder `frames`: the faces that all frames in it have


class FrameSource(Protocol):
    """What a Timeline plays. Nothing is read before `load`, which several threads may call at once."""

    @property
    def name(self) -> str:
        """What a window's title calls the scan."""

    @property
    def unit(self) -> str | None:
        """The name of its unit of length, or None where the scan does not tell."""

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that hold its frames; none where they are made up."""

    def __len__(self) -> int:
        """How many frames there are; at least one."""

    def label(self, index: int) -> str:
        """The name of a frame, for example its file's."""

    def times(self) -> NDArray[np.float64] | None:
        """(T,) seconds as recorded with the scan, or None where nothing was recorded."""

    def load(self, index: int) -> Scanned:
        """Read one frame. Raises InputError where it is unusable."""


class FileSequence:
    """One frame a file, in the order given. paths: at least one."""

    def __init__(self, paths: Sequence[Path], name: str) -> None:
        self.name = printable(name)
        self.files = tuple(paths)
        self._folder = Path(os.path.commonpath([path.parent for path in paths]))

    @cached_property
    def unit(self) -> str | None:
        """As the first file tells, where its format knows units."""
        try:
            return formats.read_unit(self.files[0])
        except InputError:  # asking for its pose will tell
            return None

    def __len__(self) -> int:
        return len(self.files)

    def label(self, index: int) -> str:
        """The file's name; with its folder where the sequence spans several."""
        return printable(self.files[index].relative_to(self._folder).as_posix())

    def times(self) -> NDArray[np.float64] | None:
        """From a times.csv beside the frames, or beside their folder where that is called `frames`."""
        if len(self) == 1:
            return None
        folders = [self._folder, self._folder.parent] if self._folder.name == "frames" else [self._folder]
        for file in (folder / TIMES_FILE for folder in folders):
            if file.is_file():
                return read_times_csv(file, [self.label(index) for index in range(len(self))])
        return None

    def load(self, index: int) -> Scanned:
        path = self.files[index]
        if (count := formats.frame_count(path)) > 1:
            raise InputError(
                f"holds {count} frames, where each file of a sequence holds one", path, "Open this file alone"
            )
        scanned = formats.read(path)
        faces = self._shared_faces
        if faces is None or not isinstance(scanned, PointCloud) or scanned.topology is not None:
            return scanned
        fits = len(scanned) + scanned.dropped == len(faces) + faces.dropped
        return replace(scanned, topology=faces.topology) if fits else scanned

    @cached_property
    def _shared_faces(self) -> PointCloud | None:
        """The mesh whose faces all frames have, None where there is none; it may as well be unreadable."""
        file = self._folder.parent / FACES_FILE
        if self._folder.name != "frames" or not file.is_file():
            return None
        try:
            return formats.read_points(file)
        except InputError:
            return None


class MultiFrameFile:
    """One file that holds all frames, such as NPY or NPZ with positions (T, N, 3), or SVO."""

    def __init__(self, path: Path, count: int) -> None:
        self.name = printable(path.name)
        self.files = (path,)
        self._path = path
        self._count = count
        self._read = formats.frames(path)

    @cached_property
    def unit(self) -> str | None:
        return formats.read_unit(self._path)

    def __len__(self) -> int:
        return self._count

    def label(self, index: int) -> str:
        return f"{self.name} frame {index}"

    def times(self) -> NDArray[np.float64] | None:
        return formats.read_times(self._path)

    def load(self, index: int) -> Scanned:
        return self._read(index)
