"""Gaps: how large a disc must be at each point so that the discs together close the surface.

The radius of a point reaches to the farthest corner of its cell in the Voronoi diagram of its tangent plane:
smaller discs leave that corner open, larger ones show beside the outline. It goes by the points around
alone, so that it follows the density of the scan, and is found without a tree: points are listed by the cells
of a grid, and each looks at those of the 27 cells around. Where a scan is much sparser than in most places,
the search goes on with larger cells.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...gpu import gl
from ...gpu.bindings import Storage, Texture
from ...gpu.bins import Bins
from ...gpu.compact import IndexList, list_flagged
from ...gpu.context import Gpu, Program
from ...gpu.pose import GpuPose
from ...gpu.scatter import Visits

_LEAST, _WANTED, _MOST = 4.0, 6.0, 9.0  # points that share a point's cell, itself included
_TRIALS = 12  # of a size of cells
_ROUNDS = 4
_WIDER = 3.0  # times the cells of the round before
_KNOWN = 0.6  # cells: the 27 around tell all of a radius of 0.5, and nearly always of one little larger
_BORDER = 2.0  # times as far as a point's cell reaches to most sides: where it has no end
_ENOUGH = 100.0  # points on a square as wide as a cell, in squared radii of one: denser ones are thinned out
_SPARE = 1.2  # times the radii found: these go by eight directions, in a plane
_STRAY = 4.0  # usual radii: what is farther from all others is beside the surface
_FEW = 2000  # one in so many may be left without a radius of its own
_AT_ONCE = 1 << 18  # points searched before something else may have its turn
_SLOT = 16  # bytes


class GapRadii:
    """The radii of a pose's points; see the module. Made with `GpuPose.keep`.

    texels: a radius for each row, scan units, once all are found; 0 where a point is far from all others: it
    is to be as large as usual. None where no point has any, or there are more points than the driver takes.
    usual, largest: the radius that nine of ten do not exceed, and that none does.
    """

    def __init__(self, pose: GpuPose) -> None:
        self.texels: gl.BufferTexture | None = None
        self.usual = self.largest = 0.0
        self._steps: Generator[None, None, None] | None = None
        self._positions: gl.BufferTexture | None = None
        self._found = _SLOT * len(pose.cloud) > pose.gpu.max_storage_bytes

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return 0 if self.texels is None else self.texels.buffer.size

    def release(self) -> None:
        """Delete them."""
        if self.texels is not None:
            self.texels.release()

    def find(self, pose: GpuPose, *, wait: bool) -> bool:
        """Go on with finding them: to the end, or for some of the points. Whether all are there."""
        if self._found:
            return True
        positions = pose.array("positions")
        if self._steps is None or self._positions is not positions:  # these count from another origin now
            self._steps, self._positions = self._find(pose), positions
        with pose.preparing("derive"):
            for _ in self._steps:
                if not wait:
                    return False
        self._steps = self._positions = None
        self._found = True
        return True

    def _find(self, pose: GpuPose) -> Generator[None, None, None]:
        gpu, cloud, box = pose.gpu, pose.cloud, pose.bounds
        search = _Search(gpu, pose.array("positions"), pose.array("normals"), len(cloud), box.high - box.low)
        radii = yield from search.radii()
        if radii is None:
            rows, copies = _distinct(cloud.positions)
            assert cloud.normals is not None
            positions, normals = (
                gl.BufferTexture(gpu.ctx.buffer(values[rows]), gl.RGB32F)
                for values in (cloud.positions, cloud.normals)
            )
            search = _Search(gpu, positions, normals, len(rows), search.extent, distinct=True)
            radii = yield from search.radii()
            gpu.discard(positions, normals)
            assert radii is not None
            radii = radii[copies]
        known = radii[radii > 0]
        if known.size:
            self.usual = float(np.quantile(known, 0.9))
            radii = np.where(radii > _STRAY * self.usual, np.float32(0), radii)
            self.largest = float(radii.max())
            self.texels = gl.BufferTexture(gpu.ctx.buffer(radii), gl.R32F)


@dataclass(frozen=True)
class _Grid:
    """Grid of cells in space, as shaders/surfels/gaps/cell.glsl reads it. cell_size: scan units. The others:
    lists from a cell to the next along y and along z, and the bits of a list's number that count."""

    cell_size: float
    row_stride: int
    layer_stride: int
    list_mask: int

    @classmethod
    def of(cls, size: float, extent: NDArray[np.float64], lists: int) -> _Grid:
        """Cells of a size whose lists follow one another as they lie in the box."""
        x, y, _ = np.minimum(np.ceil(extent / size) + 2, 1 << 15).astype(int).tolist()
        return cls(size, x, x * y, lists - 1)


@dataclass(frozen=True, eq=False)
class _Search:
    """Search for radii. extent: the edges of the box round most of the points, (3,), scan units. distinct:
    whether no two points are in one place."""

    gpu: Gpu
    positions: gl.BufferTexture
    normals: gl.BufferTexture
    count: int
    extent: NDArray[np.float64]
    distinct: bool = False

    def radii(self) -> Generator[None, None, NDArray[np.float32] | None]:
        """The radii (N,), 0 where a point is alone. None where copies of points may crowd cells of any size:
        then each place is to count once."""
        gpu = self.gpu
        lists = 1 << max((self.count - 1).bit_length(), 8)
        bins, unknown = Bins(gpu, lists + 2), IndexList(gpu, self.count)
        radii = gl.BufferTexture(gpu.ctx.buffer(reserve=4 * self.count), gl.R32F)
        gl.clear_words(radii.buffer, 0)
        try:
            bins.reserve(self.count + self.count // 16)
            grid, shared = self._fit(bins, lists)
            if shared > _MOST and not self.distinct:
                return None
            visits = self._visits(grid)
            yield from self._round(bins, grid, visits, radii, None)
            for _ in range(1, _ROUNDS):
                self._list_unknown(radii, unknown)
                if len(unknown) * _FEW <= self.count:
                    break
                grid = _Grid.of(_WIDER * grid.cell_size, self.extent, lists)
                visits = self._visits(grid, radii)
                bins.count(visits)
                yield from self._round(bins, grid, visits, radii, unknown)
            return _SPARE * np.frombuffer(radii.buffer.read(), np.float32)
        finally:
            gpu.discard(bins, unknown, radii)

    def _fit(self, bins: Bins, lists: int) -> tuple[_Grid, float]:
        """Find cells in which as many points are together as suits the search, and count; how many are."""
        x, y, z = self.extent
        surface = float(np.sqrt((x * y + y * z + z * x) / self.count))
        size = 2 * surface or max(x, y, z) / self.count or 1.0
        for _ in range(_TRIALS):
            grid = _Grid.of(size, self.extent, lists)
            bins.count(self._visits(grid))
            counts = np.diff(np.frombuffer(bins.starts.buffer.read(), np.uint32)).astype(np.float64)
            shared = float(np.square(counts).sum() / counts.sum())
            if _LEAST <= shared <= _MOST or self.count < _MOST:
                break
            size *= float(np.sqrt(_WANTED / shared))
        return grid, shared

    def _visits(self, grid: _Grid, radii: gl.BufferTexture | None = None) -> Visits:
        """The visits of points to cells; of dense points some, by the radii that were found."""

        def bind(_: Program) -> None:
            self.positions.bind(Texture.POSITIONS)
            if radii is not None:
                radii.bind(Texture.RADII)

        defines = {"THINNED": int(radii is not None), "ENOUGH": _ENOUGH}
        return Visits("surfels/gaps/cells.glsl", self.count, bind, defines, grid)

    def _list_unknown(self, radii: gl.BufferTexture, unknown: IndexList) -> None:
        flags = "surfels/gaps/unknown.glsl"
        list_flagged(self.gpu, flags, self.count, unknown, lambda _: radii.bind(Texture.RADII))

    def _round(
        self,
        bins: Bins,
        grid: _Grid,
        visits: Visits,
        radii: gl.BufferTexture,
        unknown: IndexList | None,
    ) -> Generator[None, None, None]:
        """Search with one grid, whose visits are counted: for the points that are listed, or for all."""
        gpu = self.gpu
        length = bins.length()
        bins.fill(visits, length)
        slots = gl.BufferTexture(gpu.ctx.buffer(reserve=max(_SLOT * length, _SLOT)), gl.RGBA32F)
        try:
            self.positions.bind(Texture.POSITIONS)
            bins.items.bind(Texture.LISTED)
            slots.buffer.bind_to_storage_buffer(Storage.SLOTS)
            gpu.dispatch(gpu.compute("surfels/gaps/arrange.comp"), length)
            for first in range(0, length if unknown is None else 1, _AT_ONCE):
                if first:
                    yield
                defines = {"LISTED": int(unknown is not None), "KNOWN": _KNOWN, "BORDER": _BORDER}
                program = gpu.compute("surfels/gaps/radii.comp", defines, params=grid)
                for texels, unit in (
                    (self.positions, Texture.POSITIONS),
                    (self.normals, Texture.NORMALS),
                    (slots, Texture.SLOTS),
                    (bins.starts, Texture.STARTS),
                ):
                    texels.bind(unit)
                radii.buffer.bind_to_storage_buffer(Storage.RADII)
                with gpu.timers.measure("gaps"):
                    if unknown is None:
                        gpu.set(program, first=first)
                        gpu.dispatch(program, min(_AT_ONCE, length - first))
                    else:
                        unknown.run(program)
        finally:
            gpu.discard(slots)


def _distinct(positions: NDArray[np.float32]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The first row of each place, (M,), and which of these places each row has, (N,)."""
    order = np.lexsort(positions.T)
    ordered = positions[order]
    first = np.ones(len(order), bool)
    first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    place = np.empty(len(order), np.intp)
    place[order] = np.cumsum(first) - 1
    return order[first], place
