"""Compact: lists of the items that need work, so that nothing is computed for the others."""

from __future__ import annotations

import struct

import moderngl

from .context import GROUP, GROUP_LIMIT, Gpu

_RUN = 8  # pixels an invocation of compact/covered.comp looks at


class IndexList:
    """Indices in a buffer, with an indirect dispatch of one invocation each (common/list.glsl)."""

    def __init__(self, gpu: Gpu, capacity: int) -> None:
        self.nbytes = 4 * capacity + 16
        self._indices = gpu.ctx.buffer(reserve=4 * capacity)
        # The three work group counts of an indirect dispatch, then the length of the list.
        self._rows = -(-capacity // (GROUP * GROUP_LIMIT))
        self._dispatch = gpu.ctx.buffer(reserve=16)

    def clear(self) -> None:
        """Make it empty."""
        self._dispatch.write(struct.pack("4I", 0, self._rows, 1, 0))

    def bind(self) -> None:
        """Bind where shaders that include common/list.glsl find it."""
        self._indices.bind_to_storage_buffer(2)
        self._dispatch.bind_to_storage_buffer(3)

    def run(self, program: moderngl.ComputeShader) -> None:
        """Run one invocation for each index, without the CPU knowing how many there are."""
        self.bind()
        program.run_indirect(self._dispatch)

    def __len__(self) -> int:
        """How many indices there are; waits for the GPU."""
        return int(struct.unpack("4I", self._dispatch.read())[3])

    def release(self) -> None:
        """Delete both buffers."""
        self._indices.release()
        self._dispatch.release()


def list_covered(gpu: Gpu, pixels: int, listed: IndexList) -> None:
    """List the pixels whose depth (`Texture.DEPTHS`) is finite, for the bound view."""
    with gpu.timers.measure("compact"):
        listed.clear()
        listed.bind()
        gpu.dispatch(gpu.compute("compact/covered.comp"), -(-pixels // _RUN))
