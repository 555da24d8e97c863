"""Covering: which points others cover, by how far apart points lie.

The hull of the flipped points drops what lies in folds, and shows what lies behind gaps between points: its
one radius stands for the density and the bends of the whole surface. Here each point covers a disc, a little
wider than the distance to its neighbours. What lies behind it is hidden where discs come from all around: on
a surface that is seen aslant, nearer points lie on one side only, however steep it is. So neither normals nor
faces are needed, and points may lie as unevenly as they like.
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
from ..gpu.bins import Bins
from ..gpu.compact import IndexList
from ..gpu.constants import NO_DEPTH
from ..gpu.context import Gpu, Program
from ..gpu.scatter import Visits, take_keys
from ..scan.points import NOTHING
from .candidates import RowSample
from .clipping import EVERYWHERE, Planes
from .sectors import Sectors

REACH = 1.7  # of a disc, in distances between points
CLEAR = 0.05  # of the reach: how far behind a point others may lie, beside it, that it does not cover
CLEAR_OF_NOISE = 0.4  # where some is left: times what it was, in distances between points
STEEP = 1.0  # and how much farther for each length aside
_FRONT = 2.5  # edge of the cells that tell what is far behind, in usual distances between points
_BEHIND = 1.2  # of such cells: how far
_CELL = 0.7  # edge of the cells that discs are listed by, in usual distances between points
_WINDOW = 3  # of these cells that a disc usually reaches
_FARTHEST = 64  # of these cells that a disc reaches at most
_BLOCK = 8  # of these cells
_RUN = 8  # points that an invocation of hpr/near_front.comp looks at
_FACE_BITS = 3


class SpacedPoints(NamedTuple):
    """Points on the GPU, with a texel for each row."""

    positions: gl.BufferTexture  # RGB32F, relative to the origin of the sectors
    spacings: gl.BufferTexture  # R32F, distance between the points around, scan units
    repeated: gl.BufferTexture | None = None  # R32UI, `copies_in` of the pose


class Covering:
    """Finds which points are visible, since no others cover them.

    visible: R32UI, a texel a row, 1 where it is, or lies in no cell, so that nothing is known that hides it.
    state: another object after each `find`. Holds up to 44 bytes a point, from an eye near the scan 100, and
    lists of cells.

    Raises InputError for more points than the driver takes.
    """

    def __init__(self, gpu: Gpu, points: int) -> None:
        self._gpu, self.points = gpu, points
        if 16 * points > gpu.max_storage_bytes or points >= 1 << 32 - _FACE_BITS:
            raise InputError(f"{points:,} points are more than this graphics driver can handle")
        self._held: dict[str, gl.BufferTexture] = {}
        self._lists: dict[str, IndexList] = {}
        self._bins = Bins(gpu, 1)
        self.visible = self._texels("visible", points, gl.R32UI, 1)
        self.looked_at = points
        self.state = object()

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        held = sum(each.buffer.size for each in self._held.values())
        return held + self._bins.nbytes + sum(each.nbytes for each in self._lists.values())

    def count(self) -> dict[str, int]:
        """How many points there are, and became visible; waits for the GPU."""
        return {"in": self.looked_at, "visible": len(self.visible_rows())}

    def find(
        self,
        points: SpacedPoints,
        sectors: Sectors,
        spacing: float,
        clear: float = CLEAR,
        *,
        sample: RowSample | None = None,
        clip: Planes = EVERYWHERE,
        front: bool = True,
    ) -> None:
        """Find which points are visible.

        sectors: say how directions are divided, by any number. spacing: usual distance between visible
        points, as a share of a face of the sectors. clear: behind discs, in their reach. sample: None: all
        points are looked at. clip: planes; points below one of them are left out, and not visible. front:
        whether points far behind others are left out first.
        """
        self.state = object()
        self.looked_at = self.points if sample is None else sample.length
        near_cells = sectors.divided(max(round(1 / (_CELL * spacing)), 1))
        sampled = {"SAMPLED": int(sample is not None), "CUBE": int(sectors.mapping == "cube")}
        with self._gpu.timers.measure("front"):
            self._find_front(points.positions, sectors, spacing, sampled, sample, clip, front)
        with self._gpu.timers.measure("near"):
            near = self._list_near(near_cells, sampled, points.repeated, sample)
        with self._gpu.timers.measure("discs"):
            self._list_discs(near, near_cells, sampled, points.spacings)
        with self._gpu.timers.measure("cover"):
            self._cover(near, near_cells, sampled, clear)

    def _find_front(
        self,
        positions: gl.BufferTexture,
        sectors: Sectors,
        spacing: float,
        sampled: dict[str, int],
        sample: RowSample | None,
        clip: Planes,
        front: bool,
    ) -> None:
        """Find how far away points are, and beyond which distance those of a cell are hidden."""
        gpu = self._gpu
        cells = sectors.divided(max(round(1 / (_FRONT * spacing)), 1)).weighted(0.0)
        sector_positions = self._texels("sector_positions", self.points, gl.RGB32F, 3)
        homes = self._texels("homes", self.points, gl.RG32UI, 2)
        keys = self._texels("keys", cells.count, gl.R32UI, 1)
        limits = self._texels("limits", cells.count, gl.R32F, 1)

        def bind(program: Program) -> None:
            positions.bind(Texture.POSITIONS)
            sector_positions.buffer.bind_to_storage_buffer(Storage.POINT_SPOTS)
            homes.buffer.bind_to_storage_buffer(Storage.HOMES)
            _bind_sample(sample)
            gpu.set(program, clip=clip[0], sides=tuple(chain.from_iterable(clip[1:])))

        defines = {"FILTERED": 0, "CELLS": 0, **sampled}
        visits = Visits("hpr/candidates.glsl", self.looked_at, bind, defines, cells)
        self._gpu.clear(keys.buffer, NO_DEPTH)
        take_keys(gpu, visits, keys)
        program = gpu.compute(
            "hpr/front.comp", {"CUBE": sampled["CUBE"], "ROOM": _BEHIND if front else 1e30}, params=cells
        )
        keys.bind(Texture.KEYS)
        limits.buffer.bind_to_storage_buffer(Storage.LIMITS)
        gpu.dispatch(program, cells.count)

    def _list_near(
        self,
        cells: Sectors,
        sampled: dict[str, int],
        repeated: gl.BufferTexture | None,
        sample: RowSample | None,
    ) -> IndexList:
        share = 1.0 if sample is None else sample.share
        gpu, faces = self._gpu, 3 if sampled["CUBE"] else 1
        near = self._list("near", faces * self.points)
        defines = {"COPIES": int(repeated is not None), "FARTHEST": _FARTHEST, **sampled}
        program = gpu.compute("hpr/near_front.comp", defines, params=cells)
        near.clear()
        near.bind()
        if sample is not None:
            self._gpu.clear(self.visible.buffer, 0)  # of those that are not looked at
        self.visible.buffer.bind_to_storage_buffer(Storage.VISIBLE)
        self._held["homes"].bind(Texture.HOMES)
        self._held["sector_positions"].bind(Texture.SPOTS)
        self._held["limits"].bind(Texture.LIMITS)
        _bind_sample(sample)
        if repeated is not None:
            repeated.bind(Texture.COPIES)
            gpu.set(program, lots=min(math.ceil(share * 2.0**32), NOTHING))
        gpu.set(program, point_count=self.looked_at)
        gpu.dispatch(program, -(-self.looked_at // _RUN))
        return near

    def _list_discs(
        self, near: IndexList, cells: Sectors, sampled: dict[str, int], spacings: gl.BufferTexture
    ) -> None:
        gpu, faces = self._gpu, cells.count // cells.edge**2
        edge = cells.edge + (2 * _FARTHEST if sampled["CUBE"] else 0)
        if self._bins.cells != faces * edge**2:
            self._bins.release()
            self._bins = Bins(gpu, faces * edge**2)

        def bind(_: Program) -> None:
            near.bind()
            self._held["sector_positions"].bind(Texture.SPOTS)

        defines = {"FARTHEST": _FARTHEST, **sampled}
        visits = Visits("hpr/cover_cells.glsl", near.capacity, bind, defines, cells, near)
        self._bins.count(visits)
        self._bins.fill(visits, near.capacity)
        discs = self._texels("discs", near.capacity, gl.RGBA32F, 4)
        windows = self._texels("windows", faces * (edge // _BLOCK + 1) ** 2, gl.R32I, 1)
        self._gpu.clear(windows.buffer, 0)
        program = gpu.compute(
            "hpr/cover_discs.comp", {"REACH": REACH, "WINDOW": _WINDOW, **defines}, params=cells
        )
        self._held["sector_positions"].bind(Texture.SPOTS)
        spacings.bind(Texture.SPACINGS)
        self._bins.items.bind(Texture.LISTED)
        discs.buffer.bind_to_storage_buffer(Storage.SIGHTS)
        windows.buffer.bind_to_storage_buffer(Storage.WINDOWS)
        gpu.set(program, sparser=math.sqrt(self.points / self.looked_at))
        near.run(program)

    def _cover(self, near: IndexList, cells: Sectors, sampled: dict[str, int], clear: float) -> None:
        defines = {"STEEP": STEEP, "WINDOW": _WINDOW, "FARTHEST": _FARTHEST, **sampled}
        program = self._gpu.compute("hpr/cover.comp", defines, params=cells)
        self._gpu.set(program, clear=clear)
        self._held["discs"].bind(Texture.SIGHTS)
        self._held["windows"].bind(Texture.WINDOWS)
        self._bins.starts.bind(Texture.STARTS)
        self._bins.items.bind(Texture.LISTED)
        self.visible.buffer.bind_to_storage_buffer(Storage.VISIBLE)
        near.run(program)

    def visible_rows(self) -> NDArray[np.uint32]:
        """The rows that are visible, ascending; waits for the GPU."""
        flags = self._gpu.read(self.visible.buffer, np.uint32, self.points)
        return np.flatnonzero(flags).astype(np.uint32)

    def _texels(self, name: str, count: int, texel_format: int, words: int) -> gl.BufferTexture:
        """Room for so many texels, kept by name."""
        nbytes, held = 4 * words * max(count, 1), self._held.get(name)
        if held is None or not nbytes <= held.buffer.size <= 4 * nbytes:
            self._gpu.discard(held)
            self._held[name] = gl.BufferTexture(self._gpu.buffer(reserve=nbytes), texel_format)
        return self._held[name]

    def _list(self, name: str, capacity: int) -> IndexList:
        held = self._lists.get(name)
        if held is None or held.capacity != capacity:
            self._gpu.discard(held)
            self._lists[name] = IndexList(self._gpu, capacity)
        return self._lists[name]

    def release(self) -> None:
        """Delete all of it."""
        self._bins.release()
        for texels in self._held.values():
            texels.release()
        for listed in self._lists.values():
            listed.release()


def _bind_sample(sample: RowSample | None) -> None:
    if sample is not None:
        sample.rows.bind(Texture.DRAWN_ROWS)
