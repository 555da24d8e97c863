"""Compact: prefix sums, and lists of the items that need work, so that nothing is computed for the others."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping

import moderngl
import numpy as np
from numpy.typing import NDArray

from . import gl
from .bindings import Storage
from .constants import GROUP, GROUP_LIMIT, NOTHING
from .context import Gpu, Program

_RUN = 8  # pixels an invocation of compact/covered.comp looks at, words one of compact/sums.comp adds
_SOFTWARE_RUN = 256  # words at most on software drivers, where it is work groups that take long
MOST_WORDS = 1 << 27  # that prefix sums are made of

Bind = Callable[[Program], None]  # what a program reads: sets its uniforms, binds its buffers


class IndexList:
    """Indices in a buffer, with an indirect dispatch over them (common/list.glsl).

    texels: the indices, for shaders that only read them. each: invocations for an index, whose length in the
    list that is: `reserve` takes, and `list_count` counts, so many at a time.
    """

    def __init__(self, gpu: Gpu, capacity: int, each: int = 1) -> None:
        self._gpu, self.each = gpu, each
        self.capacity = capacity
        self.nbytes = 4 * capacity + 16
        self.texels = gl.BufferTexture(gpu.buffer(reserve=4 * capacity), gl.R32UI)
        # The three work group counts of an indirect dispatch, then the length of the list.
        self._rows = -(-capacity * each // (GROUP * GROUP_LIMIT))
        self._dispatch = gpu.buffer(reserve=16)

    def clear(self) -> None:
        """Make it empty."""
        self._dispatch.write(struct.pack("4I", 0, self._rows, 1, 0))

    def clear_slots(self, count: int) -> None:
        """Make it `count` slots, to be filled by their numbers; 0xFFFFFFFF, which is no index, in each."""
        self._gpu.clear(self.texels.buffer, NOTHING, count)
        self._write_length(count)

    def write(self, indices: NDArray[np.uint32]) -> None:
        """Make it these indices, (N,)."""
        self.texels.buffer.write(indices)
        self._write_length(len(indices) * self.each)

    def _write_length(self, count: int) -> None:
        self._dispatch.write(struct.pack("4I", -(-count // (GROUP * self._rows)), self._rows, 1, count))

    def bind(self, indices: Storage = Storage.LIST, dispatch: Storage = Storage.DISPATCH) -> None:
        """Bind where shaders that include common/list.glsl find it, or elsewhere."""
        self.texels.buffer.bind_to_storage_buffer(indices)
        self._dispatch.bind_to_storage_buffer(dispatch)

    def run(self, program: moderngl.ComputeShader) -> None:
        """Run the invocations of all indices, without the CPU knowing how many there are."""
        self.bind()
        self._gpu.dispatch_indirect(program, self._dispatch)

    def __len__(self) -> int:
        """How many invocations that is; waits for the GPU."""
        return int(self._gpu.read(self._dispatch, np.uint32)[3])

    def release(self) -> None:
        """Delete both buffers."""
        self.texels.release()
        self._dispatch.release()


def list_covered(gpu: Gpu, pixels: int, listed: IndexList) -> None:
    """List the pixels whose depth (`Texture.DEPTHS`) is finite, for the bound view, in whichever order the
    driver has them: each listed pixel is worked on by itself."""
    with gpu.timers.measure("compact"):
        listed.clear()
        listed.bind()
        gpu.dispatch(gpu.compute("compact/covered.comp"), -(-pixels // _RUN))


def list_flagged(
    gpu: Gpu,
    flags: str,
    count: int,
    listed: IndexList,
    bind: Bind,
    defines: Mapping[str, object] | None = None,
) -> None:
    """List those of `count` items that a shader file says are needed (`is_listed(i)`), ascending.

    As `scan_words`, with twice its reading of flags; nothing is read back. bind: from binding points 0, 1, 4
    and 5. Where no order is needed and few items are listed, `reserve` of common/list.glsl reads flags once.
    """
    if count > listed.capacity:
        raise ValueError(f"a list for {listed.capacity:,} items has no room for {count:,} items")
    listed.clear()

    def bind_list(program: Program) -> None:
        listed.bind()
        bind(program)

    given = {"EACH": f"{listed.each}u", **(defines or {})}
    scan_words(gpu, "compact/flagged.glsl", count, bind_list, given, {"flags": flags})


def prefix_sums(gpu: Gpu, words: moderngl.Buffer, count: int) -> None:
    """Replace each of the first `count` words of a buffer by the sum of those before it, modulo 2^32."""
    scan_words(gpu, "compact/words.glsl", count, lambda _: words.bind_to_storage_buffer(Storage.WORDS))


def scan_words(
    gpu: Gpu,
    words: str,
    count: int,
    bind: Bind,
    defines: Mapping[str, object] | None = None,
    parts: Mapping[str, str] | None = None,
) -> None:
    """Exclusive prefix sums of `count` words, at most 2^27, modulo 2^32: sums before each word in the
    items' order, by sums of blocks of 2048 words or more, of blocks of those, and so on.

    words: the shader file that gives an item's word and takes its sum (shaders/compact/sums.comp says how).
    bind: sets what that file reads, from binding points 0 to 5. parts: what it includes in angle brackets.
    Each word is asked for three times, once where there is one block.
    """
    if count > MOST_WORDS:
        raise ValueError(f"prefix sums of {count:,} words are too many; the limit is {MOST_WORDS:,}")
    _scan_level(gpu, 1, words, count, bind, defines or {}, parts or {})


def _block_sums(gpu: Gpu, level: int) -> moderngl.Buffer:
    """Room for the sums of the blocks of a level."""
    return gpu.buffer(reserve=4 * (MOST_WORDS // (GROUP * _RUN) ** level))


def _scan_level(
    gpu: Gpu,
    level: int,
    words: str,
    count: int,
    bind: Bind,
    defines: Mapping[str, object],
    parts: Mapping[str, str],
) -> None:
    """Sums of words (level 1), of the sums of their blocks (level 2), and so on."""
    length = min(max(-(-count // GROUP), _RUN), _SOFTWARE_RUN) if gpu.software else _RUN
    blocks = -(-count // (GROUP * length))

    def run(step: int) -> None:
        given = {"STEP": step, "BLOCKS": int(blocks > 1), **defines}
        program = gpu.compute("compact/sums.comp", given, {"words": words, **parts})
        bind(program)
        if blocks > 1:
            sums.bind_to_storage_buffer(Storage.BLOCK_SUMS)
        gpu.set(program, word_count=count, run=length)
        gpu.dispatch(program, -(-count // length))

    if blocks > 1:
        sums = gpu.cached(_block_sums, level)
        run(0)

        def bind_sums(_: Program) -> None:
            sums.bind_to_storage_buffer(Storage.WORDS)

        _scan_level(gpu, level + 1, "compact/words.glsl", blocks, bind_sums, {}, {})
    run(1)
