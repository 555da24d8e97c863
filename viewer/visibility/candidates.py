"""Candidates: the point of each sector whose flip lies farthest along its direction.

Machado e Silva 2014, 4.2 and 4.3.
"""

from __future__ import annotations

import math
from itertools import chain
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..gpu import gl
from ..gpu.bindings import Storage, Texture
from ..gpu.compact import IndexList
from ..gpu.constants import NOTHING
from ..gpu.context import Gpu, Program
from ..gpu.scatter import Visits, scatter
from .clipping import EVERYWHERE, Planes
from .sectors import Sectors

UNLIMITED = 1 << 30  # steps: until nothing changes
_RUN = 8  # sectors an invocation of hpr/empty.comp looks at, points one of hpr/near.comp
_STEPS_OF_ALL = 2  # of propagation, in which most sectors change: lists of those that do would take longer
_STEPS_AT_ONCE = 32  # of propagation, before the CPU asks whether anything still changes
_EMPTY_BELOW = 0.25  # sectors for each point, above which the map of empty ones is coarser (4.3)
# The same among visible points, half of all: where 12 of them usually lie in a cell, chance leaves none
# inside empty, however unevenly they lie. Where 2 do, it leaves one in eight.
_EMPTY_AMONG_VISIBLE = 1 / 24


class RowSample(NamedTuple):
    """Rows that are looked at in place of all."""

    rows: gl.BufferTexture  # R32UI
    length: int
    share: float = 1.0  # of all points


class Candidates:
    """Candidates of the sectors around an eye, and what is visible, on the GPU.

    rows: R32UI, a texel a sector, the row of its candidate, NOTHING where it has none. inside: the
    sectors that may have one. sector_positions: RGB32F, a texel a row of the pose (`Sectors`). homes: RG32UI,
    a texel a row, the sector that it lies in, NOTHING in none, and its key there. visible: R32UI, a texel a
    row, 1 where it is on the hull of the flipped candidates around it, or lies in no sector, so that nothing
    known hides it; but see `stride` of `find`. state: another object after each `find`. sectors: what `rows`
    are of; shaders that include hpr/sectors.glsl take it as `params`, with `defines`.

    Raises InputError for more sectors or points than the driver takes.
    """

    def __init__(self, gpu: Gpu, sectors: Sectors, points: int) -> None:
        self._gpu = gpu
        self.sectors, self.points = sectors, points
        self._capacity = sectors.count
        if 4 * sectors.count > gpu.max_storage_bytes or 12 * points > gpu.max_storage_bytes:
            raise InputError(
                f"{sectors.count:,} sectors for {points:,} points are more than this graphics driver can "
                "handle",
                hint="Use fewer sectors",
            )

        def texels(count: int, texel_format: int, words: int) -> gl.BufferTexture:
            return gl.BufferTexture(gpu.buffer(reserve=4 * words * max(count, 1)), texel_format)

        self.rows, self._keys, self._stamps, self._found, self._occupied = (
            texels(sectors.count, gl.R32UI, 1) for _ in range(5)
        )
        self.sector_positions = texels(points, gl.RGB32F, 3)
        self.homes = texels(points, gl.RG32UI, 2)
        self.visible = texels(points, gl.R32UI, 1)
        self.inside, self._todo, self._changed = (IndexList(gpu, sectors.count) for _ in range(3))
        self._near = IndexList(gpu, max(points, 1))
        self.steps, self.looked_at = 0, points
        self.state = object()
        self.distinct = points  # positions that points have, as far as that is known

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU: 28 a sector and up to 4 of cells, 28 a point."""
        held = (self.rows, self._keys, self._stamps, self._found, self._occupied)
        by_row = (self.sector_positions, self.homes, self.visible)
        return sum(each.buffer.size for each in (*held, *by_row)) + sum(
            each.nbytes for each in (self.inside, self._todo, self._changed, self._near)
        )

    @property
    def defines(self) -> dict[str, object]:
        """Macros of hpr/sectors.glsl."""
        return {"CUBE": int(self.sectors.mapping == "cube")}

    def fits(self, sectors: Sectors, points: int) -> bool:
        """Whether there is room for these, and not for many more."""
        return points == self.points and sectors.count <= self._capacity <= 4 * sectors.count

    def find(
        self,
        positions: gl.BufferTexture,
        sectors: Sectors,
        steps: int,
        stride: int = 1,
        *,
        sample: RowSample | None = None,
        among: gl.BufferTexture | None = None,
        clip: Planes = EVERYWHERE,
    ) -> None:
        """Find the candidates of sectors, and which points are visible.

        positions: RGB32F, a texel a point, relative to the origin of the sectors. steps: of propagation at
        most. stride: sectors between those whose candidates a point is compared with; 0: with none, so that
        the candidates are visible, and nothing more, as in the paper. sample: None: all rows are looked at.
        among: R32UI, a texel a point, leaves out those where it is 0; `visible` is then left as it is. clip:
        planes, points below one of which are left out, and not visible.
        """
        self.sectors, self.steps, self.state = sectors, steps, object()
        gpu, shift = self._gpu, self._cell_shift(_EMPTY_BELOW if among is None else _EMPTY_AMONG_VISIBLE)
        self._gpu.clear(self._occupied.buffer, 0)

        def bind(program: Program) -> None:
            positions.bind(Texture.POSITIONS)
            self.homes.bind(Texture.HOMES)
            self.sector_positions.buffer.bind_to_storage_buffer(Storage.POINT_SPOTS)
            self.homes.buffer.bind_to_storage_buffer(Storage.HOMES)
            self._occupied.buffer.bind_to_storage_buffer(Storage.OCCUPIED)
            if among is not None:
                among.bind(Texture.VISIBLE)
            if sample is not None:
                sample.rows.bind(Texture.DRAWN_ROWS)
            if "cell_shift" in program:  # the first pass alone has it
                gpu.set(program, clip=clip[0], sides=tuple(chain.from_iterable(clip[1:])), cell_shift=shift)

        self.looked_at = self.points if sample is None else sample.length
        sampled = {"SAMPLED": int(sample is not None)}
        defines = {"FILTERED": int(among is not None), "CELLS": 1, **sampled, **self.defines}
        visits = Visits("hpr/candidates.glsl", self.looked_at, bind, defines, sectors)
        with gpu.timers.measure("candidates"):
            scatter(gpu, visits, self._keys, self.rows)
        self._list_inside(shift)
        with gpu.timers.measure("propagate"):
            self._propagate(steps)
        if among is None and stride:
            self._mark_visible(sampled, stride)
        elif among is None:
            self._mark_candidates()

    def _cell_shift(self, cells: float) -> int:
        """Halvings of the grid, until it has no more cells than so many for each point."""
        most = max(cells * self.distinct, 1.0)
        edge = self.sectors.edge
        return min(max(math.ceil(math.log2(self.sectors.count / most) / 2), 0), edge.bit_length())

    def _list_inside(self, shift: int) -> None:
        gpu = self._gpu
        program = gpu.compute("hpr/empty.comp", self.defines, params=self.sectors)
        with gpu.timers.measure("empty"):
            self.inside.clear()
            self.inside.bind()
            self._occupied.bind(Texture.OCCUPIED)
            self._stamps.buffer.bind_to_storage_buffer(Storage.STAMPS)
            gpu.set(program, cell_shift=shift)
            gpu.dispatch(program, -(-self.sectors.count // _RUN))

    def _propagate(self, steps: int) -> None:
        gpu = self._gpu
        every, some = (
            gpu.compute("hpr/propagate.comp", {"EVERY": every, **self.defines}, params=self.sectors)
            for every in (1, 0)
        )
        take, take_last = (
            gpu.compute("hpr/take.comp", {"LAST": last, **self.defines}, params=self.sectors)
            for last in (0, 1)
        )
        self.sector_positions.bind(Texture.SPOTS)
        of_all = _STEPS_OF_ALL if steps >= _STEPS_OF_ALL else 0
        for step in range(of_all):
            source, target = (self.rows, self._found)[:: 1 if step % 2 == 0 else -1]
            if step == 0:
                gpu.clear(target.buffer, NOTHING)
            source.bind(Texture.BEST)
            target.buffer.bind_to_storage_buffer(Storage.NEXT_ROWS)
            self.inside.run(every)
        self.rows.bind(Texture.BEST)
        self._found.bind(Texture.FOUND)
        todo = self.inside
        for step in range(of_all + 1, steps + 1):
            self._changed.clear()
            self._changed.bind(Storage.NEXT_LIST, Storage.NEXT_DISPATCH)
            self._found.buffer.bind_to_storage_buffer(Storage.NEXT_ROWS)
            todo.run(some)
            todo = self._todo
            todo.clear()
            todo.bind(Storage.NEXT_LIST, Storage.NEXT_DISPATCH)
            self.rows.buffer.bind_to_storage_buffer(Storage.BEST)
            self._stamps.buffer.bind_to_storage_buffer(Storage.STAMPS)
            gpu.set(take, step_number=step)
            self._changed.run(take if step < steps else take_last)
            if step % _STEPS_AT_ONCE == 0 and not len(todo):
                break

    def _mark_visible(self, sampled: dict[str, int], stride: int) -> None:
        gpu = self._gpu
        near, on_hull = (
            gpu.compute(f"hpr/{name}.comp", {**sampled, **self.defines}, params=self.sectors)
            for name in ("near", "visible")
        )
        self._gpu.clear(self.visible.buffer, 0)
        with gpu.timers.measure("visible"):
            self.visible.buffer.bind_to_storage_buffer(Storage.VISIBLE)
            self.homes.bind(Texture.HOMES)
            self.rows.bind(Texture.BEST)
            self.sector_positions.bind(Texture.SPOTS)
            self._near.clear()
            self._near.bind()
            gpu.set(near, point_count=self.looked_at, stride=stride)
            gpu.set(on_hull, stride=stride)
            gpu.dispatch(near, -(-self.looked_at // _RUN))
            self._near.run(on_hull)

    def _mark_candidates(self) -> None:
        self._gpu.clear(self.visible.buffer, 0)
        with self._gpu.timers.measure("visible"):
            self.rows.bind(Texture.BEST)
            self.visible.buffer.bind_to_storage_buffer(Storage.VISIBLE)
            self.inside.run(self._gpu.compute("hpr/mark_candidates.comp"))

    def visible_rows(self) -> NDArray[np.uint32]:
        """The rows that are visible, ascending; waits for the GPU."""
        flags = self._gpu.read(self.visible.buffer, np.uint32, self.points)
        return np.flatnonzero(flags).astype(np.uint32)

    def count(self) -> dict[str, int]:
        """How many points and sectors there are, and became visible or occupied; waits for the GPU."""
        rows = self._gpu.read(self.rows.buffer, np.uint32, self.sectors.count)
        return {
            "in": self.looked_at,
            "visible": len(self.visible_rows()),
            "sectors": self.sectors.count,
            "occupied": int(np.count_nonzero(rows != NOTHING)),
        }

    def release(self) -> None:
        """Delete all of it."""
        for each in (self.rows, self._keys, self._stamps, self._found, self._occupied):
            each.release()
        for each in (self.sector_positions, self.homes, self.visible):
            each.release()
        for listed in (self.inside, self._todo, self._changed, self._near):
            listed.release()
