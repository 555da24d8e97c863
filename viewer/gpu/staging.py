"""Reading of buffers: the only place where the CPU reads what shaders wrote.

Some drivers move a mapped buffer into the memory of the host, and leave it there. Atomics of shaders then go
over the bus, and take a thousand times as long. So the GPU copies what is wanted into another buffer, which
the CPU reads. Software drivers have one memory, and map the buffer itself.
"""

from __future__ import annotations

import ctypes
from typing import Literal

import moderngl
import numpy as np
from numpy.typing import NDArray

from . import gl

_LEAST = 1 << 16  # bytes of the copy: room for all that is read but pictures
_MOST = 1 << 26  # of the copy; more is read in parts

Reading = Literal["copy", "get", "map"]


class Staging:
    """Reads buffers of a context.

    reading: "copy" reads a copy that stays mapped, "get" calls glGetBufferSubData, "map" maps the buffer.
    reads: how often anything was read.
    """

    def __init__(self, ctx: moderngl.Context, is_software: bool) -> None:
        self._ctx = ctx
        self._copy: gl.MappedBuffer | None = None
        self.reads = 0
        self.reading: Reading = "map" if is_software else "copy" if gl.has_mapped_buffers(ctx) else "get"

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

    def _reserve(self, nbytes: int) -> gl.MappedBuffer:
        """A copy that has room for so many bytes."""
        if self._copy is None or self._copy.nbytes < nbytes:
            if self._copy is not None:
                self._copy.release()
            self._copy = gl.MappedBuffer(max(nbytes, _LEAST))
        return self._copy
