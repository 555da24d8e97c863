"""Bins: a list of its visitors for each cell, where items may visit any number of cells."""

from __future__ import annotations

import moderngl

from ..errors import InputError
from . import gl
from .bindings import Storage, Texture
from .compact import prefix_sums
from .context import Fill, Gpu, Program
from .scatter import Visits

_SPARE = 4  # times the room that is asked for, beyond which room is given up
_RUN = 64  # pairs that an invocation of bins/sort.comp moves
_DIGIT_BITS = 4


class Bins:
    """Lists per cell, one after another in one buffer, made in three steps: count, prefix sums, fill.

    starts: cells + 1 words; the list of a cell goes from starts[cell] to before starts[cell + 1].
    items: all lists.

    ordered: each list keeps the order of the items, so that it is the same each time; without it that is
    left to the driver. Visits are then written down as pairs and sorted by cell, stably, by a radix sort of
    four bits at a time: 2 to 5 times as long in all, by the number of cells, and 16 bytes a visit and 4 an
    item more while lists are filled. It does not matter how visits are spread over the cells.
    """

    def __init__(self, gpu: Gpu, cells: int, ordered: bool = False) -> None:
        self._gpu = gpu
        self.cells = cells
        self.ordered = ordered
        self.starts = self._texture(cells + 1)
        self.items = self._texture(1)
        self._cursors = gpu.buffer(reserve=4)  # of cells, or of items where ordered

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return self.starts.buffer.size + self.items.buffer.size + self._cursors.size

    def count(self, visits: Visits) -> None:
        """Count the visits of each cell, for which PASS is 0; `starts` is then as `fill` leaves it.

        They may use storage blocks from binding point 2 on.
        """
        gpu = self._gpu
        with gpu.timers.measure("count"):
            cleared = [Fill(self.starts.buffer, 0)]
            if self.ordered:
                self._cursors = self._at_least(self._cursors, 4 * visits.count)
                cleared.append(Fill(self._cursors, 0))
            self._gpu.fill(*cleared)
            self._send(visits, 0, self.starts.buffer, self._cursors)
        with gpu.timers.measure("scan"):
            prefix_sums(gpu, self.starts.buffer, self.cells + 1)
            if self.ordered:
                prefix_sums(gpu, self._cursors, visits.count)

    def length(self) -> int:
        """How many entries all lists have, once they are counted; waits for the GPU."""
        return int(self._gpu.read(self.starts.buffer, "u4", 1, 4 * self.cells)[0])

    @property
    def room(self) -> int:
        """Entries that there is room for."""
        return self.items.buffer.size // 4

    def reserve(self, entries: int) -> None:
        """Make room for so many entries, and give up much more room than that."""
        if not entries <= self.room <= _SPARE * max(entries, 1):
            self._gpu.discard(self.items)
            self.items = self._texture(entries)

    def fill(self, visits: Visits, length: int | None = None) -> None:
        """Write the lists of the visits that were counted, for which PASS is 1.

        length: how many entries they have, where that is known already. Raises InputError where they are
        longer than a buffer may be.
        """
        gpu = self._gpu
        length = self.length() if length is None else length
        if length * (8 if self.ordered else 4) > gpu.max_storage_bytes:
            raise InputError(f"lists of {length:,} entries are too long for this graphics driver")
        with gpu.timers.measure("list"):
            if 4 * length > self.items.buffer.size:
                self.reserve(min(length * 5 // 4, gpu.max_storage_bytes // 4))
            if self.ordered:
                pairs = self._pairs(length)
                self._send(visits, 1, self._cursors, pairs.buffer)
                self._sort(pairs, length)
            else:
                self._cursors = self._at_least(self._cursors, 4 * self.cells)
                gpu.ctx.copy_buffer(self._cursors, self.starts.buffer, 4 * self.cells)
                self._send(visits, 1, self._cursors, self.items.buffer)

    def release(self) -> None:
        """Delete everything."""
        self._gpu.discard(self.starts, self.items, self._cursors)

    def _send(self, visits: Visits, number: int, cursors: moderngl.Buffer, written: moderngl.Buffer) -> None:
        def bind(_: Program) -> None:
            cursors.bind_to_storage_buffer(Storage.CURSORS)
            written.bind_to_storage_buffer(Storage.VISITS)

        visits.send(self._gpu, "bins/lists.glsl", bind, PASS=number, ORDERED=int(self.ordered))

    def _sort(self, pairs: gl.BufferTexture, length: int) -> None:
        """Sort pairs of cell and item by cell, items with the same cell staying in their order."""
        gpu = self._gpu
        runs = -(-length // _RUN)
        digits = 1 << _DIGIT_BITS
        offsets = gpu.buffer(reserve=4 * max(digits * runs, 1))
        other = self._pairs(length)
        shifts = range(0, max((self.cells - 1).bit_length(), 1), _DIGIT_BITS)
        for shift in shifts:
            last = shift == shifts[-1]
            self._gpu.clear(offsets, 0)
            for step in range(2):
                program = gpu.compute("bins/sort.comp", {"STEP": step, "LAST": int(last), "RUN": f"{_RUN}u"})
                gpu.set(program, pair_count=length, shift=shift)
                pairs.bind(Texture.PAIRS)
                offsets.bind_to_storage_buffer(Storage.DIGITS)
                (self.items if last else other).buffer.bind_to_storage_buffer(Storage.SORTED)
                gpu.dispatch(program, runs)
                if step == 0:
                    prefix_sums(gpu, offsets, digits * runs)
            pairs, other = other, pairs
        gpu.discard(pairs, other, offsets)

    def _texture(self, words: int) -> gl.BufferTexture:
        return gl.BufferTexture(self._gpu.buffer(reserve=4 * max(words, 1)), gl.R32UI)

    def _pairs(self, length: int) -> gl.BufferTexture:
        return gl.BufferTexture(self._gpu.buffer(reserve=8 * max(length, 1)), gl.RG32UI)

    def _at_least(self, buffer: moderngl.Buffer, nbytes: int) -> moderngl.Buffer:
        """The buffer, or one that is as large in its place."""
        if buffer.size >= nbytes:
            return buffer
        self._gpu.discard(buffer)
        return self._gpu.buffer(reserve=nbytes)
