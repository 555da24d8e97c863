"""Scatter: a compute shader sends items to cells, and keeps the best per cell or adds up what they give."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from . import gl
from .bindings import Storage, Texture
from .blocks import Values
from .compact import IndexList
from .constants import NO_DEPTH, NOTHING
from .context import Fill, Gpu, Program

_LARGEST_SUM = 2**31 - 1


@dataclass(frozen=True)
class Visits:
    """Visits of items to cells, of which there may be any number: pixels, tiles, sectors, ...

    cells: the shader file that says so; its `scatter(i)` calls `visit(cell, key, item)` for each cell that
    the i-th of `count` items goes to. bind: sets what that file reads. defines: its macros. params: what it
    finds in `<params>`. listed: has an invocation for each item in place of `count`, where only the GPU knows
    how many there are.
    """

    cells: str
    count: int
    bind: Callable[[Program], None]
    defines: Mapping[str, object] = field(default_factory=dict)
    params: Values | None = None
    listed: IndexList | None = None

    def send(self, gpu: Gpu, target: str, bind: Callable[[Program], None], **defines: object) -> None:
        """Send the items to their cells. target: the shader file that says what becomes of a visit; bind:
        sets what that one reads and writes."""
        parts = {"target": target, "cells": self.cells}
        listed = int(self.listed is not None)
        items = ("item_count", "list_count")[listed]
        given = {"ITEMS": items, "LISTED": listed}
        given |= {**defines, **self.defines}
        program = gpu.compute("scatter/scatter.comp", given, parts, self.params)
        bind(program)
        self.bind(program)
        if self.listed is None:
            gpu.dispatch(program, self.count)
        else:
            self.listed.run(program)


class HitCells(NamedTuple):
    """A list to be filled with the cells that were hit, some of them more than once, and slots that are none.
    slots: how many cells an item visits at most."""

    cells: IndexList
    slots: int


def scatter(
    gpu: Gpu,
    visits: Visits,
    keys: gl.BufferTexture,
    best: gl.BufferTexture,
    hits: HitCells | None = None,
) -> None:
    """Keep the least key of those that visit a cell, then the lowest item that has it.

    visits: their keys are below +inf bits. keys, best: one R32UI texel a cell; +inf bits and 0xFFFFFFFF where
    nothing went. hits: is filled with the cells that were hit; all of them are clear then.
    """
    if hits is None:
        with keeping_nearest(gpu, keys, best) as nearest:
            nearest.take(visits)
        return
    take_keys(gpu, visits, keys)
    take_items(gpu, visits, keys, best, hits)


@contextmanager
def keeping_nearest(
    gpu: Gpu,
    keys: gl.BufferTexture,
    best: gl.BufferTexture,
    shown: Callable[[], Visits] | None = None,
    beside: Callable[[], Sequence[Fill]] = tuple,
) -> Iterator[TwoPasses | OnePass]:
    """Keep the best of all visits that are taken inside, as `scatter` does of one.

    shown: gives visits that have all the best ones; None: all of them may. beside: gives what to fill at
    once with keys and best, where these are filled.
    """
    is_wide = gpu.wide_atomics and 2 * keys.buffer.size <= gpu.max_storage_bytes
    nearest = OnePass(gpu, keys, best) if is_wide else TwoPasses(gpu, keys, best, beside())
    yield nearest
    nearest.finish(shown)


class TwoPasses:
    """Visits whose keys are found first, then the items: 32-bit atomics, which all drivers have."""

    def __init__(
        self, gpu: Gpu, keys: gl.BufferTexture, best: gl.BufferTexture, beside: Sequence[Fill] = ()
    ) -> None:
        self._gpu, self._keys, self._best = gpu, keys, best
        self._visits: list[Visits] = []
        # A key buffer of depths reads as floats.
        gpu.fill(Fill(keys.buffer, NO_DEPTH), Fill(best.buffer, NOTHING), *beside)

    def take(self, visits: Visits) -> None:
        """Take visits to cells."""
        self._visits.append(visits)
        take_keys(self._gpu, visits, self._keys)

    def show_keys(self) -> None:
        """Let `keys` hold the least keys so far."""

    def finish(self, shown: Callable[[], Visits] | None) -> None:
        """Let `keys` and `best` hold what all visits found. shown: see `keeping_nearest`."""
        for visits in self._visits if shown is None else (shown(),):
            take_items(self._gpu, visits, self._keys, self._best)


class OnePass:
    """Visits whose keys and items are found at once: 64-bit atomics, to cells that are split in the end. The
    result is that of `TwoPasses` to the bit."""

    def __init__(self, gpu: Gpu, keys: gl.BufferTexture, best: gl.BufferTexture) -> None:
        self._gpu, self._keys, self._best = gpu, keys, best
        self._wide, self._cells = gpu.cached(_WideCells), keys.buffer.size // 4
        self._wide.begin(self._cells)

    def take(self, visits: Visits) -> None:
        """Take visits to cells."""
        with self._gpu.timers.measure("depth"):
            visits.send(self._gpu, "scatter/best.glsl", lambda _: self._wide.bind(), PASS=0, LISTS=0, WIDE=1)

    def show_keys(self) -> None:
        """Let `keys` hold the least keys so far."""
        self._split(0)

    def finish(self, _: Callable[[], Visits] | None) -> None:
        """Let `keys` and `best` hold what all visits found."""
        self._split(1)
        self._wide.is_clear = True

    def _split(self, last: int) -> None:
        program = self._gpu.compute("scatter/split.comp", {"LAST": last})
        with self._gpu.timers.measure("id"):
            self._wide.bind()
            self._keys.buffer.bind_to_storage_buffer(Storage.SPLIT_KEYS)
            self._best.buffer.bind_to_storage_buffer(Storage.BEST)
            self._gpu.dispatch(program, self._cells)


class _WideCells:
    """64-bit cells that all pictures share. is_clear: whether nothing went to any."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._buffer: moderngl.Buffer | None = None
        self.is_clear = False

    def begin(self, cells: int) -> None:
        """Make room for so many cells, and clear them unless they are."""
        if self._buffer is None or self._buffer.size < 8 * cells:
            self._gpu.discard(self._buffer)
            self._buffer, self.is_clear = self._gpu.buffer(reserve=8 * cells), False
        if not self.is_clear:
            clear = np.array([NOTHING, NO_DEPTH], np.uint32)  # the item is the lower word
            self._buffer.write(np.tile(clear, self._buffer.size // 8))
        self.is_clear = False

    def bind(self) -> None:
        """Bind them for shaders."""
        assert self._buffer is not None
        self._buffer.bind_to_storage_buffer(Storage.KEYS)


def take_keys(gpu: Gpu, visits: Visits, keys: gl.BufferTexture) -> None:
    """The first step of `scatter`: keep the least key of each cell, and of what `keys` holds."""

    def bind(_: Program) -> None:
        keys.buffer.bind_to_storage_buffer(Storage.KEYS)

    with gpu.timers.measure("depth"):
        visits.send(gpu, "scatter/best.glsl", bind, PASS=0, LISTS=0)


def take_items(
    gpu: Gpu, visits: Visits, keys: gl.BufferTexture, best: gl.BufferTexture, hits: HitCells | None = None
) -> None:
    """The second step of `scatter`: where keys hold the least ones already, keep the lowest item that has its
    cell's."""

    def bind(program: Program) -> None:
        keys.bind(Texture.KEYS)
        best.buffer.bind_to_storage_buffer(Storage.BEST)
        if hits is not None:
            gpu.set(program, slots=hits.slots)
            hits.cells.texels.buffer.bind_to_storage_buffer(Storage.HITS)

    if hits is not None:
        hits.cells.clear_slots(hits.slots * visits.count)
    with gpu.timers.measure("id"):
        visits.send(gpu, "scatter/best.glsl", bind, PASS=1, LISTS=int(hits is not None))


@dataclass(frozen=True)
class FixedPoint:
    """How numbers of several channels are added up as whole numbers of steps, with sign, in 32 bits.

    limits: the largest absolute number of each channel; larger ones count as that. finest: the least step of
    each channel. most: how many numbers a cell may be given. Raises InputError where so many do not fit even
    in steps as large as a limit, ValueError for limits or steps that are none, and for fewer than no numbers.
    """

    limits: tuple[float, ...]
    finest: tuple[float, ...]
    most: int

    def __post_init__(self) -> None:
        if self.most < 0:
            raise ValueError(f"a count of numbers must be 0 or more, not {self.most}")
        _ = self.steps

    @cached_property
    def steps(self) -> tuple[float, ...]:
        """The step of each channel: the least power of two, not below the finest, with which `most` numbers
        of the limit sum to less than 2^31."""
        pairs = zip(self.limits, self.finest, strict=True)
        return tuple(_step(limit, finest, self.most) for limit, finest in pairs)

    @property
    def defines(self) -> dict[str, object]:
        """Macros of scatter/sums.glsl."""
        limits, steps = (", ".join(map(str, map(np.float32, each))) for each in (self.limits, self.steps))
        return {
            "CHANNELS": f"{len(self.limits)}u",
            "LIMITS": f"float[]({limits})",
            "STEPS": f"float[]({steps})",
        }


def _step(limit: float, finest: float, most: int) -> float:
    if not (0 < finest <= limit < np.inf):
        raise ValueError(
            f"the step {finest} of a channel must be above 0, and at most the channel's limit {limit}"
        )
    step = float(2.0 ** np.ceil(np.log2(finest)))
    while most * round(float(np.float32(limit)) / step) > _LARGEST_SUM:
        step *= 2
        if step > limit:
            raise InputError(f"sums of {most:,} numbers do not fit into 32 bits")
    return step


class CellSums:
    """Sums of several channels for each of any number of cells. They are the same each time, whichever order
    items come in, since numbers are rounded before they are added.

    Raises InputError where the driver takes no so large buffer: 4 bytes a channel of each cell; ValueError
    where there is no channel.
    """

    def __init__(self, gpu: Gpu, cells: int, channels: int) -> None:
        if cells < 0 or channels < 1:
            raise ValueError(f"sums need 0 or more cells and at least 1 channel, not {cells} and {channels}")
        nbytes = 4 * channels * cells
        if nbytes > gpu.max_storage_bytes:
            raise InputError(
                f"sums of {channels} channels in {cells:,} cells are too large for this graphics driver"
            )
        self._gpu = gpu
        self.cells, self.channels = cells, channels
        self.buffer = gpu.buffer(reserve=max(nbytes, 4))

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return self.buffer.size

    def clear(self) -> None:
        """Set all sums to zero."""
        self._gpu.clear(self.buffer, 0)

    def add(self, visits: Visits, fixed: FixedPoint) -> None:
        """Add what items give to cells: the file of `visits` calls `add(cell, numbers)`, as
        shaders/scatter/sums.glsl has it, in place of `visit`.

        No cell may be given more than `fixed.most` numbers in all since it was cleared.
        """
        if len(fixed.limits) != self.channels:
            raise ValueError(f"{len(fixed.limits)} limits for {self.channels} channels")

        def bind(_: Program) -> None:
            self.buffer.bind_to_storage_buffer(Storage.SUMS)

        visits.send(self._gpu, "scatter/sums.glsl", bind, **fixed.defines)

    def read(self, fixed: FixedPoint) -> NDArray[np.float64]:
        """All sums, (cells, channels); waits for the GPU."""
        sums = self._gpu.read(self.buffer, np.int32, self.cells * self.channels)
        return sums.reshape(self.cells, self.channels) * np.array(fixed.steps)

    def release(self) -> None:
        """Delete it."""
        self.buffer.release()
