"""A scan of octrees that arrive: from a server, or on standard input. Each pose is drawn level by level."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...files import printable
from ..faces import Faces
from ..points import PointCloud
from ..reading.sequence import Decided
from ..times import frame_in_words
from .byte_sources import HttpBytes, StreamBytes
from .file import Octrees, find_extents


@cache  # whoever opens a stream again finds the bytes that have come
def _stream_of(buffer: BinaryIO) -> StreamBytes:
    return StreamBytes(buffer)


class ArrivingOctrees:
    """The frames of octrees that arrive, see `FrameSource`. Opening waits for the first header."""

    files: tuple[Path, ...] = ()

    def __init__(self, scan: str) -> None:
        """scan: an address, or "-" for standard input. Raises InputError where no octree is there."""
        is_input = scan == "-"
        self.name = "standard input" if is_input else printable(scan.rstrip("/").rsplit("/", 1)[-1])
        self.decided = Decided()
        source = self._source = _stream_of(sys.stdin.buffer) if is_input else HttpBytes(scan)
        try:
            self._octrees = Octrees(source, find_extents(source), self._held)
        except InputError as error:
            self._close()
            where = "standard input" if is_input else scan
            hint = error.hint or "Scan4D reads octree files (.svo) from there"
            raise InputError(error.what, error.where or where, hint) from error
        if source.is_stream:
            what = f"Scan4D reads only the first octree of {'a stream' if is_input else 'this server'}"
            self.decided.report("assumed", f"{what}. To see all frames, save the octrees to a file.")
        self.unit = self._octrees.extents[0].header.unit

    def _close(self) -> None:
        """Let go of the answer of a server that sends all at once, of which the first octree is enough."""
        if isinstance(self._source, HttpBytes):
            self._source.close()

    def _held(self) -> int:
        return sum(extent.behind - extent.offset + extent.header.stored for extent in self._octrees.extents)

    def __len__(self) -> int:
        return len(self._octrees.extents)

    def label(self, index: int) -> str:
        """The name of a frame."""
        return f"{self.name} {frame_in_words(index)}"

    def times(self) -> NDArray[np.float64]:
        """(T,) seconds."""
        return np.array([extent.header.time for extent in self._octrees.extents])

    def load(self, index: int) -> PointCloud:
        """Read one frame, and wait until it is there. Raises InputError where it is damaged or cut off."""
        try:
            *_, finest = self._octrees.levels(index)
        finally:
            self._close()
        return finest()

    def coarser(self, index: int) -> Iterator[PointCloud]:
        """The coarser levels of a frame as they arrive, see `octree.file.Frames`."""
        return self._octrees.coarser(index)

    def faces(self, index: int) -> Faces:
        """Octrees have no faces."""
        return Faces.joined([])
