"""Where the frames of a scan come from: a sequence of files, or one file of many frames."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import printable
from . import formats
from .faces import Faces
from .points import PointCloud
from .pose import Scanned
from .reading.sequence import Decided
from .reading.times_table import read_times_csv
from .times import OTHER_TIMES_FILES, TIMES_FILE, frame_in_words

_SAMPLES = 4  # frames beside the first one that an uncertain decision looks at
FACES_FILE = "mesh_topology.ply"  # beside the frames or their folder: the faces that all of them have


class FrameSource(Protocol):
    """A source of frames for a Timeline. Nothing is read before `load`, which several threads may call.

    It may have an attribute `decided`, the decisions about how Scan4D reads it, and a method
    `coarser(index)`, which gives coarser clouds of a frame while it is being read, each finer than the one
    before.
    """

    @property
    def name(self) -> str:
        """The name of the scan, as a window's title has it."""

    @property
    def unit(self) -> str | None:
        """The name of its unit of length as its files state it, perhaps any text; or None."""

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

    def faces(self, index: int) -> Faces:
        """Read the faces between the points of a frame, perhaps none. Raises InputError."""


class FileSequence:
    """A sequence of files, one frame each, in the order given. paths: at least one."""

    def __init__(self, paths: Sequence[Path], name: str, decided: Decided | None = None) -> None:
        self.decided = decided or Decided()
        self.decided.other_colors = self._other_colors
        self.decided.frames = len(paths)
        self.name = printable(name)
        self.files = tuple(paths)
        self._folder = Path(os.path.commonpath([path.parent for path in paths]))

    @cached_property
    def unit(self) -> str | None:
        """The unit that the first file states, where its format knows units."""
        try:
            return formats.read_unit(self.files[0], self.decided)
        except InputError:  # reading its pose will say why
            return None

    def __len__(self) -> int:
        return len(self.files)

    def label(self, index: int) -> str:
        """The file's name; with its folder where the sequence spans several."""
        return printable(self.files[index].relative_to(self._folder).as_posix())

    @property
    def times_file(self) -> Path | None:
        """The times.csv beside the frames, or beside their folder where that is called `frames`."""
        return None if len(self) == 1 else self._beside(TIMES_FILE)

    @property
    def other_times_files(self) -> list[Path]:
        """Tables of times with other names, such as timestamps.txt, where there is no times.csv."""
        if len(self) == 1 or self.times_file is not None:
            return []
        return [file for name in OTHER_TIMES_FILES if (file := self._beside(name)) is not None]

    def times(self) -> NDArray[np.float64] | None:
        """Times of the times.csv."""
        file = self.times_file
        labels = [self.label(index) for index in range(len(self))]
        return None if file is None else read_times_csv(file, labels).seconds

    def load(self, index: int) -> Scanned:
        path = self.files[index]
        decided = self.decided.at(index)
        if (count := formats.frame_count(path, decided)) > 1:
            raise InputError(
                f"contains {count} frames, but each file of a sequence must contain one frame",
                path,
                "Open this file alone",
            )
        scanned = formats.read(path, decided=decided)
        if not isinstance(scanned, PointCloud) or scanned.topology is not None:
            return scanned
        points, topology = self._shared_topology
        return replace(scanned, topology=topology) if len(scanned) + scanned.dropped == points else scanned

    def coarser(self, index: int) -> Iterator[PointCloud]:
        """Coarser clouds of a frame, see `FrameSource`."""
        return formats.coarser(self.files[index])(0)

    def faces(self, index: int) -> Faces:
        """The frame's own faces; where it has none, those of the file beside the frames."""
        own = formats.read_faces(self.files[index], decided=self.decided.at(index))
        return own if len(own) else self._shared_faces

    @cached_property
    def _shared_faces(self) -> Faces:
        file = self._beside(FACES_FILE)
        return Faces.joined([]) if file is None else formats.read_faces(file)

    @cached_property
    def _shared_topology(self) -> tuple[int, str | None]:
        """How many points the shared faces are between, and their topology; none where unreadable."""
        file = self._beside(FACES_FILE)
        try:
            mesh = file and formats.read_points(file)
        except InputError:
            mesh = None
        return (len(mesh) + mesh.dropped, mesh.topology) if mesh else (0, None)

    def _other_colors(self) -> Iterator[NDArray]:
        """The colours of some frames as stored."""
        for index in _spread(len(self)):
            with suppress(InputError):
                found = formats.read_colors(self.files[index], 0, self.decided.at(index))
                if found is not None:
                    yield found

    def _beside(self, name: str) -> Path | None:
        """The file of this name beside the frames, or beside their folder where that is called `frames`."""
        folders = [self._folder, self._folder.parent] if self._folder.name == "frames" else [self._folder]
        candidates = [folder / name for folder in folders]
        return next((file for file in candidates if file.is_file() and file not in self.files), None)


class MultiFrameFile:
    """One file that holds all frames, such as NPY or NPZ with positions (T, N, 3), or SVO."""

    def __init__(self, path: Path, count: int, decided: Decided | None = None) -> None:
        self.decided = decided or Decided()
        self.name = printable(path.name)
        self.files = (path,)
        self._path = path
        self._count = count
        self._read = formats.frames(path, self.decided)
        self.coarser = formats.coarser(path)
        self.decided.other_colors = self._other_colors

    @cached_property
    def unit(self) -> str | None:
        return formats.read_unit(self._path, self.decided)

    def __len__(self) -> int:
        return self._count

    def label(self, index: int) -> str:
        return f"{self.name} {frame_in_words(index)}"

    def times(self) -> NDArray[np.float64] | None:
        return formats.read_times(self._path, self.decided)

    def load(self, index: int) -> Scanned:
        return self._read(index)

    def faces(self, index: int) -> Faces:
        return formats.read_faces(self._path, index, self.decided.at(index))

    def _other_colors(self) -> Iterator[NDArray]:
        """The colours of some frames as stored."""
        for index in _spread(len(self)):
            with suppress(InputError):
                found = formats.read_colors(self._path, index, self.decided.at(index))
                if found is not None:
                    yield found


def _spread(count: int) -> list[int]:
    """Some of so many frames, spread evenly, the first and the last one among them."""
    return sorted({round((count - 1) * step / _SAMPLES) for step in range(_SAMPLES + 1)})
