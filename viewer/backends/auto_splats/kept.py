"""Neighbors that pictures of a pose found, for later pictures of the same pose from other eyes."""

from __future__ import annotations

import weakref

import moderngl
import numpy as np

from ...gpu import gl
from ...gpu.bindings import Storage
from ...gpu.context import Gpu
from ...gpu.pose import GpuPose

MOST_BYTES = 1 << 27  # storage blocks have this size on each driver


class KeptNeighbors:
    """The k nearest of each row whose neighborhood no other eye finds to be another one, as
    shaders/auto_splats/kept.glsl has them.

    is_open: whether neighbors that are found are kept. is_filled: whether an earlier picture kept some.
    """

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._buffer: moderngl.Buffer | None = None
        self._stamp = 0
        self._of: tuple[weakref.ref[GpuPose], int] | None = None  # whose, and how many of a row
        self.is_open = self.is_filled = False

    def begin(self, pose: GpuPose, k: int, whole: bool) -> None:
        """Begin a picture, and forget what is kept of another pose or of another k. whole: whether all points
        take part that are not far behind; else nothing is kept, nor where there is no room."""
        nbytes = 4 + 4 * (k + 1) * len(pose.cloud)
        self.is_open = whole and nbytes <= MOST_BYTES
        of = (weakref.ref(pose), k) if self.is_open else None
        self.is_filled = self.is_open and self._of == of
        if not self.is_filled:
            self._stamp, self._of = self._stamp + 1, of
        if self._buffer is not None and not (self.is_open and self._buffer.size == nbytes):
            self.release()
        if not self.is_open:
            return
        if self._buffer is None:
            self._buffer = self._gpu.buffer(reserve=nbytes)
            self._gpu.clear(self._buffer, 0)
        gl.clear_words(self._buffer, 0, 1)

    def bind(self, program: moderngl.ComputeShader) -> None:
        """Bind what a program reads and writes, where these are open."""
        assert self._buffer is not None
        self._buffer.bind_to_storage_buffer(Storage.KEPT)
        self._gpu.set(program, stamp=self._stamp)

    def read_count(self) -> int:
        """How many neighborhoods the last picture took of these; waits for the GPU."""
        return 0 if self._buffer is None else int(self._gpu.read(self._buffer, np.uint32, 1)[0])

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return 0 if self._buffer is None else self._buffer.size

    def release(self) -> None:
        """Delete what is kept."""
        self._gpu.discard(self._buffer)
        self._buffer = None
