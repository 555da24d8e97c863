"""Gaps: how large a disc must be at each point so that the discs together close the surface.

The radius of a point reaches to the farthest corner of its cell in the Voronoi diagram of its tangent plane:
smaller discs leave that corner open, larger ones show beside the outline. It goes by the points around
alone, so that it follows the density of the scan, and is found without a tree: points are listed by the cells
of a grid, and each looks at those of the 27 cells around. Where a scan is much sparser than elsewhere,
the search goes on with larger cells.

Where points lie unevenly, or the surface bends much between them, a disc around a point would reach beyond
outlines. A fitted splat is an ellipse round the Voronoi cell, and its middle may lie beside the point. It
knows up to three neighbours whose planes end it (shaders/surfels/cell.glsl).

Radii that a scan stores are held to this at a sample of its points. Where they leave gaps, they are enlarged.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..gpu import gl
from ..gpu.bindings import Storage, Texture
from ..gpu.bins import Bins
from ..gpu.compact import IndexList, list_flagged
from ..gpu.constants import UNKNOWN
from ..gpu.context import Gpu, Program
from ..gpu.pose import GpuPose
from ..gpu.scatter import Visits
from ..scan.copies import distinct_rows
from ..scan.points import PointCloud

_LEAST, _WANTED, _MOST = 4.0, 6.0, 9.0  # points that share a point's cell, itself included
_TRIALS = 12  # of a size of cells
_ROUNDS = 4
_WIDER = 3.0  # times the cells of the round before
_KNOWN = 0.6  # cells: the 27 around tell all of a radius of 0.5, and nearly always of one little larger
_BORDER = 2.0  # times as far as a point's cell reaches to most sides: where it has no end
_ROWS = 4.0  # times as far, where points lie in rows: to opposite sides alike
_CELL = {"DIRECTIONS": 8, "KNOWN": _KNOWN, "BORDER": _BORDER, "ROWS": _ROWS, "WIDER": _WIDER, "LAST": 0}
_SPARE = 1.2  # times the radii found: these go by some directions, in a plane
_FIT = {
    "SPARE_FIT": 1.25,  # times how far cells reach: how far ellipses do
    "THINNEST": 16.0,  # times as long as wide, at first
    "OPEN": 1.5,  # times as far as the rough ellipse: from where on a side has no end,
    "ENDLESS": 1.2,  # and counts as reaching so far: more would fill holes
    "ROUNDS": 4,  # towards the smallest ellipse
    "ROUND_SHARE": 0.75,  # of the disc's area, from which on the disc is drawn, where
    "ROUND_FAR": 1.2,  # radii that the ellipse reaches at most
    "ROW": 2.0,  # times as long as wide: cells of points in rows
    "SPARE": _SPARE,
    "NEAR": 2.5,  # radii: how far neighbours are that end a splat
    "MARGIN": 0.3,  # radii that a splat reaches beyond all of these
    "BELOW": 0.06,  # sine of the angle by which these lie below the splat's plane at least
    "SLACK": 0.13,  # radii that a splat may rise over their planes
    "LEAST_CUT": 0.05,  # radii that it would rise higher
    "AROUND_CLOSE": 2.0,  # times as far as the third neighbour: points that tell whether they lie on a plane
    "FLAT": 1.5,  # squared half-widths, up to which squared thicknesses are those of a plane
    "BESIDE": 0.85,  # distances to the third neighbour that a disc reaches elsewhere
}
_ENOUGH = 100.0  # points on a square as wide as a cell, in squared radii of one: denser ones are thinned out
_STRAY = 4.0  # usual radii: what is farther from all others is beside the surface
_FEW = 2000  # one in so many may be left without a radius of its own
_FITTED = 0.1  # of the points: where fewer have a cell that a disc does not do for, all get discs
_OFFSET_STEPS = 2047.0  # of a half-axis, as surfels/cell.glsl has it
_SAMPLE = 1 << 13  # points, about, at which stored radii are looked at
_OPEN = 0.1  # of these: where more have too small a radius, the scan's leave gaps
_AT_ONCE = 1 << 18  # points searched before something else may have its turn
_SLOT = 16  # bytes


class GapRadii:
    """The radii of a pose's points; see the module. Made with `GpuPose.cached`.

    texels: a radius for each row, scan units, once all are found; 0 where a point is far from all others: it
    is to be as large as usual. None where no point has any, where there are more points than the driver
    takes, and where the radii that the scan stores leave no gaps: else none is smaller than these.
    fitted: "axes" and "cells" of each row, as `Points.buffers` has them; empty where discs do for nearly all.
    fits: whether ellipses and planes were looked for.
    usual, largest: the radius that nine of ten do not exceed, and how far the largest splat reaches.
    """

    def __init__(self, pose: GpuPose) -> None:
        self.texels: gl.BufferTexture | None = None
        self.fitted: dict[str, gl.BufferTexture] = {}
        self.usual = self.largest = 0.0
        self._steps: Generator[None, None, None] | None = None
        self._sought: tuple[gl.BufferTexture, bool] | None = None
        self._found = self.fits = _SLOT * len(pose.cloud) > pose.gpu.max_storage_bytes

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return sum(texels.buffer.size for texels in self.buffers.values())

    @property
    def buffers(self) -> dict[str, gl.BufferTexture]:
        """Buffers of radii, and of ellipses and planes, for `Points.buffers`; empty without radii."""
        return {} if self.texels is None else {"radii": self.texels, **self.fitted}

    def release(self) -> None:
        """Delete them."""
        for texels in self.buffers.values():
            texels.release()

    def presumes_none(self, pose: GpuPose) -> bool:
        """Whether they are not known, and stored radii left no gaps in the last pose that was looked at, as
        of a scan that plays: this does for a picture that moves, of whose time looking takes a third."""
        return not self._found and pose.stored.radii is not None and pose.gpu.cached(_LastLook).found_none

    def find(self, pose: GpuPose, *, wait: bool, fits: bool = True) -> bool:
        """Go on with finding them: to the end, or for some of the points. Whether all are there. fits: also
        ellipses and planes, which takes twice as long; what was found without them is found anew."""
        if self._found and (self.fits or not fits):
            return True
        sought = pose.array("positions"), fits  # positions may count from another origin by now
        if self._steps is None or self._sought != sought:
            self._steps, self._sought = self._find(pose, fits), sought
        with pose.preparing("derive"):
            for _ in self._steps:
                if not wait:
                    return False
        self._steps = self._sought = None
        self._found, self.fits = True, fits
        return True

    def _find(self, pose: GpuPose, fits: bool) -> Generator[None, None, None]:
        stored = _usable_radii(pose.stored)
        with _searching(pose) as (search, rows, copies):
            if stored is not None:
                sample = _sample(pose.stored.positions[rows])
                last = pose.gpu.cached(_LastLook)
                last.found_none = not search.leave_gaps(stored[rows], sample)
                if last.found_none:
                    return
            found = yield from search.splats(_fit_defines(pose) if fits else {"FITTED": 0})
        found = FittedSplats(*(array[copies] for array in found))
        known = found.radii[found.radii > 0]
        if known.size:
            is_stray = found.radii > _STRAY * np.quantile(known, 0.9)
            found.radii[is_stray] = 0
            if stored is not None:
                is_small = found.radii < stored
                found.radii[is_small] = stored[is_small]
                is_stray |= is_small
            self._take(pose.gpu, found, is_stray)

    def _take(self, gpu: Gpu, found: FittedSplats, is_round: NDArray[np.bool_]) -> None:
        """Upload what was found. is_round: rows whose splats are discs around their points, (N,)."""
        self.release()
        radii, axes, cells = found
        axes[is_round] = 0
        cells[is_round] = 0
        self.fitted = {}
        self.usual, self.largest = float(np.quantile(radii[radii > 0], 0.9)), float(radii.max())
        self.texels = gl.BufferTexture(gpu.buffer(radii), gl.R32F)
        if np.count_nonzero(cells.any(axis=1)) > _FITTED * len(cells):
            self.largest = max(self.largest, float(found.reaches().max()))
            self.fitted = {
                name: gl.BufferTexture(gpu.buffer(array), gl.RGBA32F)
                for name, array in (("axes", axes), ("cells", cells))
            }


class FittedSplats(NamedTuple):
    """Splats of rows.

    radii: (N,) float32, scan units, of discs; 0 where a point is alone. axes: (N, 4) float32, scan units,
    half-axes of ellipses as a pose has them; 0 where a disc does. cells: (N, 4) float32, as
    surfels/cell.glsl reads them.
    """

    radii: NDArray[np.float32]
    axes: NDArray[np.float32]
    cells: NDArray[np.float32]

    def reaches(self) -> NDArray[np.float64]:
        """At most how far ellipses reach from their points, (N,), scan units; 0 where a disc does."""
        code = self.cells[:, 0].astype(np.uint32)
        steps = np.stack([code & 4095, code >> 12]).astype(np.float64) - (_OFFSET_STEPS + 1)
        offset = np.where(code > 0, np.hypot(*steps) / _OFFSET_STEPS, 0.0)
        return np.linalg.norm(self.axes[:, :3], axis=1) * (1 + offset)


class _LastLook:
    """Memory of whether the radii that a scan stores left no gaps when any were looked at last."""

    def __init__(self, gpu: Gpu) -> None:
        self.found_none = False


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


class _Search:
    """Search for radii with one set of points.

    crowded: whether copies of points may crowd cells of any size. extent: the edges of the box round most of
    the points, (3,), scan units.
    """

    def __init__(
        self,
        gpu: Gpu,
        positions: gl.BufferTexture,
        normals: gl.BufferTexture,
        count: int,
        extent: NDArray[np.float64],
    ) -> None:
        self._gpu, self._positions, self._normals = gpu, positions, normals
        self._count, self._extent = count, extent
        self._lists = 1 << max((count - 1).bit_length(), 8)
        self._bins, self._listed = Bins(gpu, self._lists + 2), IndexList(gpu, count)
        self._radii = gl.BufferTexture(gpu.buffer(reserve=4 * count), gl.R32F)
        self._axes = gl.BufferTexture(gpu.buffer(reserve=16 * count), gl.RGBA32F)
        self._cells = gl.BufferTexture(gpu.buffer(reserve=16 * count), gl.RGBA32F)
        for texels in (self._radii, self._axes, self._cells):
            gpu.clear(texels.buffer, 0)
        self._bins.reserve(count + count // 16)
        self._grid, shared = self._fit()
        self.crowded = shared > _MOST

    def release(self) -> None:
        """Delete what it holds."""
        self._gpu.discard(self._bins, self._listed, self._radii, self._axes, self._cells)

    def leave_gaps(self, radii: NDArray[np.float32], sample: NDArray[np.uint32]) -> bool:
        """Whether radii (N,), 0 where unknown, leave gaps, as far as a sample of the rows tells; at
        borders and on lines none are known. To be asked before `radii`."""
        self._listed.write(sample)
        for _ in self._round(self._grid, self._visits(self._grid), self._listed, {"FITTED": 0}, ended=True):
            pass
        reach = self._read(self._radii)
        known = (reach > 0) & (radii > 0)
        return bool((radii < reach)[known].mean() > _OPEN) if known.any() else False

    def splats(self, fit: Mapping[str, object]) -> Generator[None, None, FittedSplats]:
        """The splats of all rows. fit: macros that say whether and how they are fitted to cells."""
        grid = self._grid
        yield from self._round(grid, self._visits(grid), None, fit)
        for number in range(1, _ROUNDS):
            self._list_unknown()
            unknown = len(self._listed)
            is_last = number == _ROUNDS - 1 or unknown * _FEW <= self._count
            if not unknown or (is_last and number == 1):
                break  # in a scan of one density, what is left is as large as usual
            grid = _Grid.of(_WIDER * grid.cell_size, self._extent, self._lists)
            visits = self._visits(grid, thinned=True)
            self._bins.count(visits)
            yield from self._round(grid, visits, self._listed, {**fit, "LAST": int(is_last)})
            if is_last:
                break
        axes, cells = (self._read(texels).reshape(-1, 4) for texels in (self._axes, self._cells))
        return FittedSplats(_SPARE * self._read(self._radii), axes, cells)

    def _read(self, texels: gl.BufferTexture) -> NDArray[np.float32]:
        return self._gpu.read(texels.buffer, np.float32)

    def _fit(self) -> tuple[_Grid, float]:
        """Find cells in which as many points are together as suits the search, and count; how many are."""
        x, y, z = self._extent
        surface = float(np.sqrt((x * y + y * z + z * x) / self._count))
        size = 2 * surface or max(x, y, z) / self._count or 1.0
        for _ in range(_TRIALS):
            grid = _Grid.of(size, self._extent, self._lists)
            self._bins.count(self._visits(grid))
            counts = np.diff(self._gpu.read(self._bins.starts.buffer, np.uint32)).astype(np.float64)
            shared = float(np.square(counts).sum() / counts.sum())
            if _LEAST <= shared <= _MOST or self._count < _MOST:
                break
            size *= float(np.sqrt(_WANTED / shared))
        return grid, shared

    def _visits(self, grid: _Grid, *, thinned: bool = False) -> Visits:
        """The visits of points to cells. thinned: of dense points some, by the radii that were found."""

        def bind(_: Program) -> None:
            self._positions.bind(Texture.POSITIONS)
            if thinned:
                self._radii.bind(Texture.RADII)

        defines = {"THINNED": int(thinned), "ENOUGH": _ENOUGH}
        return Visits("surfels/gaps/cells.glsl", self._count, bind, defines, grid)

    def _list_unknown(self) -> None:
        flags = "surfels/gaps/unknown.glsl"
        list_flagged(self._gpu, flags, self._count, self._listed, lambda _: self._radii.bind(Texture.RADII))

    def _round(
        self,
        grid: _Grid,
        visits: Visits,
        listed: IndexList | None,
        fit: Mapping[str, object],
        *,
        ended: bool = False,
    ) -> Generator[None, None, None]:
        """Search with one grid, whose visits are counted: for the points that are listed, or for all. ended:
        for those alone whose cell has an end on all sides. fit: as `splats` has it."""
        gpu = self._gpu
        bins, length = self._bins, self._bins.length()
        bins.fill(visits, length)
        slots = gl.BufferTexture(gpu.buffer(reserve=max(_SLOT * length, _SLOT)), gl.RGBA32F)
        try:
            self._positions.bind(Texture.POSITIONS)
            bins.items.bind(Texture.LISTED)
            slots.buffer.bind_to_storage_buffer(Storage.SLOTS)
            gpu.dispatch(gpu.compute("surfels/gaps/arrange.comp"), length)
            for first in range(0, length if listed is None else 1, _AT_ONCE):
                if first:
                    yield
                defines: dict[str, object] = {"LISTED": int(listed is not None), "ENDED": int(ended), **_CELL}
                defines |= fit
                program = gpu.compute("surfels/gaps/radii.comp", defines, params=grid)
                for texels, unit in (
                    (self._positions, Texture.POSITIONS),
                    (self._normals, Texture.NORMALS),
                    (slots, Texture.SLOTS),
                    (bins.starts, Texture.STARTS),
                ):
                    texels.bind(unit)
                self._radii.buffer.bind_to_storage_buffer(Storage.RADII)
                self._axes.buffer.bind_to_storage_buffer(Storage.CELL_AXES)
                self._cells.buffer.bind_to_storage_buffer(Storage.CELLS)
                with gpu.timers.measure("gaps"):
                    if listed is None:
                        gpu.set(program, first=first)
                        gpu.dispatch(program, min(_AT_ONCE, length - first))
                    else:
                        listed.run(program)
        finally:
            gpu.discard(slots)


def _fit_defines(pose: GpuPose) -> dict[str, object]:
    """Macros of surfels/gaps/fit.glsl for a pose."""
    return {"FITTED": 1, "TRUSTED": int(pose.stored.normals is not None), **_FIT}


@contextmanager
def _searching(pose: GpuPose) -> Iterator[tuple[_Search, Any, Any]]:
    """A search among a pose's points; the rows of these, and which of them is at each of the pose's rows."""
    gpu, cloud, extent = pose.gpu, pose.cloud, pose.bounds.high - pose.bounds.low
    held: tuple[gl.BufferTexture, ...] = ()
    rows: Any = slice(None)
    copies: Any = slice(None)
    search = _Search(gpu, pose.array("positions"), pose.array("normals"), len(cloud), extent)
    try:
        if search.crowded:
            rows, copies = distinct_rows(cloud.positions)
            assert cloud.normals is not None
            positions, normals = held = (
                gl.BufferTexture(gpu.buffer(cloud.positions[rows]), gl.RGB32F),
                gl.BufferTexture(gpu.buffer(cloud.normals[rows]), gl.RGB32F),
            )
            crowd, search = search, _Search(gpu, positions, normals, len(rows), extent)
            gpu.discard(crowd)
        yield search, rows, copies
    finally:
        gpu.discard(search, *held)


def _usable_radii(cloud: PointCloud) -> NDArray[np.float32] | None:
    """The radii that a scan stores for round splats, 0 where one is of no use; None where all are."""
    if cloud.radii is None:
        return None
    usable = (cloud.radii > 0) & (cloud.radii < np.float32(UNKNOWN))
    return np.where(usable, cloud.radii, np.float32(0)) if usable.any() else None


def _sample(positions: NDArray[np.float32]) -> NDArray[np.uint32]:
    """Some rows, by where their points are (N, 3): whatever the order."""
    x, y, z = np.ascontiguousarray(positions).view(np.uint32).T  # numpy is slow along the short axis
    mixed = x * np.uint32(0x9E3779B1) + y * np.uint32(0x85EBCA77) + z * np.uint32(0xC2B2AE3D)
    mixed = (mixed ^ mixed >> np.uint32(15)) * np.uint32(0x2C1B3C6D)
    share = min(_SAMPLE / len(positions), 1.0)
    return np.flatnonzero(mixed <= share * 0xFFFFFFFF).astype(np.uint32)
