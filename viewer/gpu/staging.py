"""Staging: the only place where the CPU reads what shaders wrote, and the way by which much data comes to it.

Some drivers move a mapped buffer into the memory of the host, and leave it there. Atomics of shaders then go
over the bus, and take a thousand times as long. So the GPU copies what is wanted into another buffer, which
the CPU reads. Software drivers have one memory, and map the buffer itself.

The CPU writes much data into a buffer that stays mapped, and the GPU copies it from there: into new buffers
of 16 MB in a quarter of the time that `glBufferSubData` takes on an NVIDIA H200.
"""

from __future__ import annotations

import ctypes
from functools import partial
from typing import Literal

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..threads import together
from . import gl

_LEAST = 1 << 16  # bytes of the copy: room for all that is read but pictures
_MOST = 1 << 26  # of the copy; more is read in parts
_SLOT, _SLOTS = 1 << 24, 4  # bytes of a slice that is written at once, and how many may be on their way
_MUCH = 1 << 20  # bytes from which on writing by a copy pays, and that pay for a thread
_LIKE_POINTS = 10  # bytes that take a thread as long as one point

Reading = Literal["copy", "get", "map"]


class Staging:
    """Reads and writes buffers of a context.

    reading: "copy" reads a copy that stays mapped, "get" calls glGetBufferSubData, "map" maps the buffer.
    reads: how often anything was read. writes_by_copy: whether much data is written by a copy, too. slice:
    bytes to write at once where others wait meanwhile: a few milliseconds.
    """

    def __init__(self, ctx: moderngl.Context, is_software: bool) -> None:
        self._ctx = ctx
        self._copy: gl.MappedBuffer | None = None
        self._ring: gl.MappedBuffer | None = None
        self._on_their_way: list[gl.Fence | None] = [None] * _SLOTS
        self._slot = 0
        self.reads = 0
        self.reading: Reading = "map" if is_software else "copy" if gl.has_mapped_buffers(ctx) else "get"
        self.writes_by_copy = self.reading == "copy"
        self.slice = _SLOT if self.writes_by_copy else _SLOT // 4

    def read(self, buffer: moderngl.Buffer, nbytes: int, offset: int) -> NDArray[np.uint8]:
        """So many bytes of a buffer, (nbytes,); waits for the GPU."""
        self.reads += 1
        out = np.empty(nbytes, np.uint8)
        if not nbytes:
            return out
        if self.reading == "map":
            buffer.read_into(out, nbytes, offset)
        elif self.reading == "get":
            gl.get_buffer(buffer, offset, out)
        else:
            for start in range(0, nbytes, _MOST):
                part = out[start : start + _MOST]
                copy = self._reserve(len(part))
                copy.take(buffer, offset + start, len(part))
                self._ctx.finish()
                ctypes.memmove(part.ctypes.data, copy.address, len(part))
        return out

    def write(self, buffer: moderngl.Buffer, data: NDArray, offset: int = 0) -> None:
        """Write an array, in memory row by row, into a buffer from a byte on."""
        if data.nbytes < _MUCH or not self.writes_by_copy:
            buffer.write(data, offset=offset)
            return
        words = data.reshape(-1).view(np.uint8)
        for start in range(0, len(words), _SLOT):
            self._write_slice(buffer, words[start : start + _SLOT], offset + start)

    def _write_slice(self, buffer: moderngl.Buffer, words: NDArray[np.uint8], offset: int) -> None:
        ring = self._ring = self._ring or gl.MappedBuffer(_SLOTS * _SLOT, is_read=False)
        if (fence := self._on_their_way[self._slot]) is not None:
            fence.wait()
        at = self._slot * _SLOT
        target, source, nbytes = ring.address + at, words.ctypes.data, len(words)

        def copy(first: int) -> None:
            ctypes.memmove(target + first, source + first, min(step, nbytes - first))

        step = max(-(-nbytes // _SLOTS), _MUCH)
        together(nbytes // _LIKE_POINTS, [partial(copy, first) for first in range(0, nbytes, step)])
        self._on_their_way[self._slot] = ring.give(buffer, offset, nbytes, at)
        self._slot = (self._slot + 1) % _SLOTS

    def _reserve(self, nbytes: int) -> gl.MappedBuffer:
        """A copy that has room for so many bytes."""
        if self._copy is None or self._copy.nbytes < nbytes:
            if self._copy is not None:
                self._copy.release()
            self._copy = gl.MappedBuffer(max(nbytes, _LEAST))
        return self._copy
