"""Range samples: all pixels of a pose's range views on the GPU, as they were measured, in pyramids.

A sample is a pixel of a range view. Its depth stays a float32 as it was read. Its position follows from its
index in the buffers, so neither is stored: 8 bytes a sample, and a third for the coarser levels.
shaders/range/samples.glsl reads them.

Coarser levels are made here, by the filters of viewer/gpu/pyramid.py, of samples that are there and of one
surface: those within `STEEPEST` times their lateral spacing of the nearest in reach. Depths, colours (in
linear light) and measured positions are means weighted by taps and alphas, alpha is the mean of all, there or
not. A coarse sample counts as lying in the middle of its reach (`level_to_pixel` in samples.glsl); where only
some of that is there, it is off by up to half a coarse sample along its surface.

That is 10.9 bytes a sample with all levels and tiles; Farooq 2013 (4.4) has 39 for a mesh, 23 for a strip,
14.7 for a pyramid and 9.5 where tiles share indices. Shaders do well to work on several samples of a row at
once, 16 or so: on software drivers what an invocation does before costs more than the sample.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scan.colors import srgb8
from ..scan.lens import steps_to_undo
from ..scan.range_view import RangeView
from ..view import View
from . import gl
from .bindings import Storage, Texture
from .compact import IndexList
from .constants import (
    RANGE_ALONG_RAY,
    RANGE_ENTRY,
    RANGE_HEIGHT,
    RANGE_LEVELS_AT,
    RANGE_MOST_LEVELS,
    RANGE_TILE,
    RANGE_TILE_TEXELS,
    RANGE_Z,
)
from .context import Fill, Gpu
from .pyramid import BOX, Filter, sizes

LEVELS = 6
_KINDS = {"z": RANGE_Z, "range": RANGE_ALONG_RAY, "height": RANGE_HEIGHT}
_AT_ONCE = 1 << 22  # samples of which all normals are found together
_EVERY = 8  # pixels along rows and columns that are looked at
_ALIGNED = 64  # samples: a level begins where any driver can bind a buffer (OpenGL 4.3, table 23.64)
_SLICE = 1 << 17  # samples uploaded, or read by what is made of them, at a time: a few milliseconds
_LOOKED_AT = 17  # pixels along either edge that tell how a lens is undone
_LAST_STEP = 1e-4  # at depth 1: what is missing after it is below float32's rounding
_MOST_STEPS = 9
_MOST_SAMPLES = 1 << 29  # of which shaders count eight parts each in 32 bits
_SOFTWARE_RUN = 16  # samples of a row that an invocation makes where it is invocations that take long


@dataclass(frozen=True)
class SampleLevel:
    """Samples of one level of a view.

    first: of its samples, and first_tile: of its tiles, in the buffers. size: columns and rows.
    """

    first: int
    first_tile: int
    size: tuple[int, int]

    @property
    def count(self) -> int:
        """How many samples it has."""
        return self.size[0] * self.size[1]

    @property
    def tiles(self) -> int:
        """How many tiles it has."""
        return -(-self.size[0] // RANGE_TILE) * -(-self.size[1] // RANGE_TILE)


@dataclass(frozen=True, eq=False)
class _Pod:
    """Pod of a range view: what stays of that when its samples are on the GPU.

    lens_steps: of Newton's method, that undo its distortion to float32.
    """

    kind: int
    size: tuple[int, int]
    pinhole: tuple[float, float, float, float]
    distortion: tuple[float, ...]
    lens_steps: int
    has_xy: bool
    world_to_camera: NDArray[np.float64]


@dataclass
class _Normals:
    """Normals of samples. rows: which rows of tiles have them, a word each; filter: of the levels."""

    words: gl.BufferTexture
    rows: moderngl.Buffer
    filter: Filter | None = None
    complete: bool = False

    @property
    def nbytes(self) -> int:
        return self.words.buffer.size + self.rows.size


class RangeSamples:
    """The samples of range views as buffer textures: view after view, each level after level, in row order.

    depths: R32F, of level 0 the bits that were read. looks: RGBA8, sRGB; alpha 0: no sample, else 1 to 255 by
    the confidence relative to the view's largest. xy: RG32F, measured x and y in the pod's camera space, None
    where no view has such. Where a driver takes no so many texels, each of these holds four samples, or x
    and y of two. tiles: RGBA32F, bounds of 16 x 16 samples of a level each, for
    shaders/range/tiles.glsl. view_levels: of each view, of each level, where its samples are. levels: of each
    view; level k has 2^k times fewer columns and rows, rounded up. defines: macros for programs that include
    range/samples.glsl: what the views have, so that nothing is computed for what none has.

    levels: at most 8; None: 6, or fewer where all views are small. Raises
    InputError where the driver takes no so many samples.
    """

    def __init__(
        self,
        gpu: Gpu,
        views: Sequence[RangeView],
        levels: int | None = None,
        how: Filter = BOX,
    ) -> None:
        self._gpu, self.filter = gpu, how
        if not 0 <= (levels or 0) <= RANGE_MOST_LEVELS:
            raise ValueError(f"{levels} levels; at most {RANGE_MOST_LEVELS}")
        self._pods = [_pod(view) for view in views]
        self.levels = levels or min(LEVELS, max(len(sizes(pod.size)) for pod in self._pods))
        self.view_levels, self._total, self.tile_count = _view_levels(self._pods, self.levels)
        self._check_size()
        has_xy = any(pod.has_xy for pod in self._pods)
        self._wide = self._total > gpu.max_points
        self.depths = self._texels(gl.RGBA32F if self._wide else gl.R32F, 4 * self._total)
        self.looks = self._texels(gl.RGBA32UI if self._wide else gl.RGBA8, 4 * self._total)
        self.xy = self._texels(gl.RGBA32F if self._wide else gl.RG32F, 8 * self._total) if has_xy else None
        self.tiles = self._texels(gl.RGBA32F, 16 * RANGE_TILE_TEXELS * self.tile_count)
        self._table = self._texels(gl.RGBA32UI, 16 * RANGE_ENTRY * len(views))
        self._run = _SOFTWARE_RUN if gpu.software else 1
        self._tabled: tuple[object, ...] | None = None  # what the table holds
        self.defines: dict[str, object] = {
            "RANGE_KINDS": int(np.bitwise_or.reduce([pod.kind for pod in self._pods])),
            "RANGE_LENS_STEPS": max(pod.lens_steps for pod in self._pods),
            "RANGE_HAS_XY": int(has_xy),
            "RANGE_WIDE": int(self._wide),
            "RANGE_COUNT": len(views),
        }
        self.spacing = max(_spacing(view) for view in views)
        self.has_color = any(view.color is not None for view in views)
        self._normals: _Normals | None = None
        self._heights: gl.BufferTexture | None = None
        self._heights_of: tuple[object, ...] = ()  # the axis and origin of these
        self._steps: Iterator[Callable[[], object]] = chain(self._uploads(views), self._reductions())
        self.complete = False  # all is uploaded, and the coarser levels made

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        textures = (self.depths, self.looks, self.xy, self.tiles, self._table, self._heights)
        normals = self._normals.nbytes if self._normals else 0
        return sum(texture.buffer.size for texture in textures if texture is not None) + normals

    @property
    def count(self) -> int:
        """How many samples the views have, there or not."""
        return sum(levels[0].count for levels in self.view_levels)

    @property
    def bytes_per_sample(self) -> float:
        """Bytes held on the GPU for each sample of the views, coarser levels and all."""
        return self.nbytes / self.count

    def upload(self, end: float) -> bool:
        """Upload and reduce, a slice at a time, until that time of `time.perf_counter`, at least one; whether
        all is there."""
        while not self.complete:
            step = next(self._steps, None)
            if step is None:
                self.complete = True
            else:
                step()
            if time.perf_counter() > end:
                break
        return self.complete

    def reduce(self, how: Filter) -> None:
        """Have the coarser levels made by this filter; nothing is done where they are. All is uploaded."""
        if how == self.filter:
            return
        self.filter, self._tabled = how, None
        for step in self._reductions(tiled_from=1):
            step()

    def heights(self, axis: tuple[float, ...], origin: NDArray[np.float64]) -> gl.BufferTexture:
        """Texels of the height along an axis, (3,) in the world, of each sample of level 0 by its id, scan
        units, relative to an origin, (3,); any number where there is no sample. Those of the last axis and
        origin are cached. Raises InputError where a driver takes no texel for each."""
        check_values(self._gpu, self.count)
        if self._heights is not None and self._heights_of == (axis, origin.tobytes()):
            return self._heights
        self._gpu.discard(self._heights)
        self._heights_of = axis, origin.tobytes()
        made = self._heights = self._texels(gl.R32F, 4 * self.count)
        program = self._gpu.compute("range/heights.comp", self.defines)
        self._bind_read()
        made.buffer.bind_to_storage_buffer(Storage.RANGE_VALUES)
        for number, (pod, levels) in enumerate(zip(self._pods, self.view_levels, strict=True)):
            to_world = np.linalg.inv(pod.world_to_camera)
            up = (*(np.array(axis) @ to_world[:3, :3]), axis @ (to_world[:3, 3] - origin))
            for first in range(0, levels[0].count, _SLICE):
                self._gpu.set(program, number=number, up=up, first=first)
                with self._gpu.timers.measure("heights"):
                    self._gpu.dispatch(program, min(_SLICE, levels[0].count - first))
        return made

    def bind(self, view: View) -> None:
        """Bind all that shaders/range/samples.glsl and tiles.glsl read, for pictures of this view."""
        self._write_table(view)
        self.depths.bind(Texture.RANGE_DEPTHS)
        self.looks.bind(Texture.RANGE_LOOKS)
        self.tiles.bind(Texture.RANGE_TILES)
        self._table.bind(Texture.RANGE_VIEWS)
        if self.xy is not None:
            self.xy.bind(Texture.RANGE_XY)

    def normals(self, tiles: IndexList) -> gl.BufferTexture:
        """Normals of the samples in these tiles, which have `RANGE_TILE` invocations each, and of others that
        were asked for before: R32UI, in the pod's space, as shaders/common/octahedron.glsl has them.

        Each is found once: 4 bytes a sample where anything asks for any. Of up to four million samples all
        are found at once; of more, what is seen at the rim of tiles may turn on what was drawn before.
        """
        gpu = self._gpu
        if self._normals is None:
            self._normals = _Normals(
                self._texels(gl.RGBA32UI if self._wide else gl.R32UI, 4 * self._total),
                gpu.buffer(reserve=4 * RANGE_TILE * self.tile_count),
            )
        known = self._normals
        if known.filter != self.filter:
            self._gpu.fill(Fill(known.words.buffer, 0), Fill(known.rows, 0))
            known.filter, known.complete = self.filter, False
        if known.complete:
            return known.words
        if self._total <= _AT_ONCE:
            tiles = IndexList(gpu, self.tile_count, RANGE_TILE)
            tiles.write(np.arange(self.tile_count, dtype=np.uint32))
            known.complete = True
            gpu.discard(tiles)
        program = gpu.compute("range/normals.comp", self.defines)
        self._bind_read()
        self.tiles.bind(Texture.RANGE_TILES)
        tiles.texels.bind(Texture.DRAWN_ROWS)
        with gpu.timers.measure("normals"):
            page = gpu.max_storage_bytes // 4 // _ALIGNED * _ALIGNED  # that a shader writes at a time
            for first in range(0, self._total, page):
                size = min(page, self._total - first)
                words = known.words.buffer
                words.bind_to_storage_buffer(Storage.RANGE_NORMALS, offset=4 * first, size=4 * size)
                known.rows.bind_to_storage_buffer(Storage.RANGE_ROWS)
                gpu.set(program, page=first, page_size=size)
                tiles.run(program)
        return known.words

    def release(self) -> None:
        """Delete all of it."""
        if self._normals is not None:
            self._gpu.discard(self._normals.words, self._normals.rows)
        self._steps = iter(())
        self._gpu.discard(self.depths, self.looks, self.xy, self.tiles, self._table, self._heights)

    def _texels(self, texel_format: int, nbytes: int) -> gl.BufferTexture:
        return gl.BufferTexture(self._gpu.buffer(reserve=nbytes), texel_format)

    def _check_size(self) -> None:
        """Raise InputError for more samples than a driver's texels hold, or than shaders count."""
        a_texel = 2 if any(pod.has_xy for pod in self._pods) else 4
        if self._total > min(a_texel * self._gpu.max_points, _MOST_SAMPLES):
            count = sum(levels[0].count for levels in self.view_levels)
            raise InputError(
                f"the range views of one pose have {count:,} pixels, which is too many for this graphics "
                "driver",
                hint="Split the scan, or reduce the size of its images",
            )

    # --- level 0 ----------------------------------------------------------------------

    def _uploads(self, views: Sequence[RangeView]) -> Iterator[Callable[[], object]]:
        """Steps that upload the samples as they were measured."""
        for view, levels in zip(views, self.view_levels, strict=True):
            width, height = levels[0].size
            most = _most_confidence(view)
            rows = max(1, _SLICE // width)
            for top in range(0, height, rows):
                yield partial(self._write, view, most, top, top + rows, levels[0].first + top * width)

    def _write(self, view: RangeView, most: float, top: int, bottom: int, first: int) -> None:
        """Upload rows of a view."""
        part = view.cropped(slice(top, bottom), slice(None))
        write = self._gpu.staging.write
        write(self.depths.buffer, np.ascontiguousarray(part.depth), 4 * first)
        write(self.looks.buffer, _looks(part, most), 4 * first)
        if part.xy is not None:
            assert self.xy is not None
            write(self.xy.buffer, np.ascontiguousarray(part.xy), 8 * first)

    # --- levels and tiles -------------------------------------------------------------

    def _reductions(self, tiled_from: int = 0) -> Iterator[Callable[[], object]]:
        """Steps that make the coarser levels, and the tiles from a level on."""
        for number, levels in enumerate(self.view_levels):
            for level, made in enumerate(levels[1:]):
                runs = made.size[1] * -(-made.size[0] // self._run)
                at_once = max(1, _SLICE // (4 * self._run))
                for first in range(0, runs, at_once):
                    yield partial(self._reduce, number, level, first, min(at_once, runs - first))
            for level, made in enumerate(levels[tiled_from:], tiled_from):
                tiles = max(1, _SLICE // RANGE_TILE**2)
                for first in range(0, made.tiles, tiles):
                    yield partial(self._bound, number, level, first, tiles)

    def _reduce(self, number: int, level: int, first: int, count: int) -> None:
        """Make runs of samples of the level after this one."""
        how, made = self.filter, self.view_levels[number][level + 1]
        taps = ", ".join(str(np.float32(tap)) for tap in how.taps)
        taken = {"FIRST": how.first, "COUNT": len(how.taps), "TAPS": f"float[]({taps})"}
        program = self._gpu.compute(
            "range/reduce.comp", {**self.defines, **taken, "NEAREST": int(how.nearest)}
        )
        self._bind_read()
        runs = -(-made.size[0] // self._run)
        page = first // runs * made.size[0] // _ALIGNED * _ALIGNED
        end = min(-(-(first + count) // runs), made.size[1]) * made.size[0]
        for texels, storage, nbytes in (
            (self.depths, Storage.RANGE_DEPTHS, 4),
            (self.looks, Storage.RANGE_LOOKS, 4),
            (self.xy, Storage.RANGE_XY, 8),
        ):
            if texels is not None:
                texels.buffer.bind_to_storage_buffer(
                    storage, offset=nbytes * (made.first + page), size=nbytes * (end - page)
                )
        self._gpu.set(program, number=number, level=level, first=first, run=self._run, page=page)
        with self._gpu.timers.measure("reduce"):
            self._gpu.dispatch(program, count)

    def _bound(self, number: int, level: int, first: int, count: int) -> None:
        """Make tiles of a level."""
        made = self.view_levels[number][level]
        program = self._gpu.compute("range/bounds.comp", self.defines)
        self._bind_read()
        self.tiles.buffer.bind_to_storage_buffer(Storage.RANGE_TILES)
        self._gpu.set(program, number=number, level=level, first=first)
        with self._gpu.timers.measure("bounds"):
            self._gpu.dispatch(program, min(count, made.tiles - first))

    def _bind_read(self) -> None:
        if self._tabled is None:
            self._write_table(None)
        self.depths.bind(Texture.RANGE_DEPTHS)
        self.looks.bind(Texture.RANGE_LOOKS)
        self._table.bind(Texture.RANGE_VIEWS)
        if self.xy is not None:
            self.xy.bind(Texture.RANGE_XY)

    # --- the table --------------------------------------------------------------------

    def _write_table(self, view: View | None) -> None:
        """Write what shaders know of each view, as `range_view` of samples.glsl reads it. view: None leaves
        each in its pod's space."""
        seen = () if view is None else (view.rotation, view.translation, view.origin)
        key = tuple(values.tobytes() for values in seen)
        if key == self._tabled:
            return
        words = np.zeros((len(self._pods), RANGE_ENTRY, 4), np.uint32)
        first_id = 0
        for number, (pod, entry) in enumerate(zip(self._pods, words, strict=True)):
            floats = entry.view(np.float32)
            to_screen = np.eye(4) if view is None else self._to_screen(pod, view)
            floats[0:3] = to_screen[:3]
            floats[3:6] = np.linalg.inv(to_screen)[:3]
            floats[6] = pod.pinhole
            floats[7:9].flat[: len(pod.distortion)] = pod.distortion
            entry[9] = (*pod.size, pod.kind, first_id)
            entry[10, :3] = bool(pod.distortion), pod.has_xy, len(self.filter.taps) % 2
            entry[RANGE_LEVELS_AT:] = self._levels_after(number)
            first_id += pod.size[0] * pod.size[1]
        self._table.buffer.write(words)
        self._tabled = key

    def _levels_after(self, number: int) -> NDArray[np.uint32]:
        """The levels of a view in the table; those that it lacks begin where the next view does."""
        rest = self.view_levels[number + 1 :]
        after = rest[0][0].first if rest else self._total
        tiles_after = rest[0][0].first_tile if rest else self.tile_count
        rows = np.full((RANGE_MOST_LEVELS, 4), (after, tiles_after, 1, 1), np.uint32)
        for row, level in zip(rows, self.view_levels[number], strict=False):
            row[:] = level.first, level.first_tile, *level.size
        return rows

    def _to_screen(self, pod: _Pod, view: View) -> NDArray[np.float64]:
        """The way from the pod's space to the picture's, (4, 4)."""
        to_view = np.eye(4)
        to_view[:3, :3] = view.rotation
        to_view[:3, 3] = view.translation - view.rotation @ view.origin
        return to_view @ np.linalg.inv(pod.world_to_camera)


def check_values(gpu: Gpu, count: int) -> None:
    """Raise InputError where a driver takes no texel of its own for a number of each sample."""
    if count > gpu.max_points:
        raise InputError(
            f"cannot colour {count:,} pixels of range views by a number on this graphics driver, "
            f"which takes {gpu.max_points:,}",
            hint="Choose another colour, such as the scan's own, or reduce the size of its images",
        )


def _spacing(view: RangeView) -> float:
    """How far apart samples are across the line of sight, where they are far apart, scan units."""
    if view.kind == "height":
        return 1 / min(view.fx, view.fy)
    some = slice(None, None, _EVERY)
    depth, mask = view.depth[some, some], view.mask[some, some]
    few = replace(view, depth=depth, mask=mask, color=None, confidence=None, xy=None)
    depth = few.depth[few.valid()]
    return float(np.quantile(depth, 0.9)) / min(view.fx, view.fy) if len(depth) else 0.0


def _pod(view: RangeView) -> _Pod:
    height, width = view.depth.shape
    pinhole = (view.fx, view.fy, view.cx, view.cy)
    has_xy, matrix = view.xy is not None, view.world_to_camera
    steps = _lens_steps(view) if view.distortion else 0
    return _Pod(_KINDS[view.kind], (width, height), pinhole, view.distortion, steps, has_xy, matrix)


def _lens_steps(view: RangeView) -> int:
    """The number of steps by which shaders undo a lens, of what some pixels need, those at the edges too."""
    height, width = view.depth.shape
    row, column = np.linspace(0, height - 1, _LOOKED_AT)[:, None], np.linspace(0, width - 1, _LOOKED_AT)
    x, y = np.broadcast_arrays((column + 0.5 - view.cx) / view.fx, (row + 0.5 - view.cy) / view.fy)
    return min(steps_to_undo(x, y, view.distortion, _LAST_STEP), _MOST_STEPS)


def _view_levels(pods: Sequence[_Pod], levels: int) -> tuple[list[list[SampleLevel]], int, int]:
    """All levels, the number of samples with the free room between levels, and the number of tiles."""
    view_levels, samples, tiles = [], 0, 0
    for pod in pods:
        own = []
        for size in sizes(pod.size, levels):
            own.append(SampleLevel(samples, tiles, size))
            samples += -(-own[-1].count // _ALIGNED) * _ALIGNED
            tiles += own[-1].tiles
        view_levels.append(own)
    return view_levels, samples, tiles


def _most_confidence(view: RangeView) -> float:
    """The largest confidence of a view that is a number; 0 where none is."""
    if view.confidence is None:
        return 0.0
    return float(np.max(view.confidence, initial=0.0, where=np.isfinite(view.confidence)))


def _looks(view: RangeView, most: float) -> NDArray[np.uint8]:
    """Colour and alpha of the samples, (H, W, 4). most: the confidence that counts as full."""
    looks = np.full((*view.depth.shape, 4), 255, np.uint8)
    if view.color is not None:
        looks[..., :3] = srgb8(view.color)
    if view.confidence is not None and most > 0:
        part = np.clip(np.nan_to_num(view.confidence / np.float32(most), nan=0.0), 0, 1)
        looks[..., 3] = 1 + np.rint(254 * part)
    looks[..., 3][~view.valid()] = 0
    return looks
