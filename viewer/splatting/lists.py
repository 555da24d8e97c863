"""Lists: which discs reach each tile of a picture, as splatting/tiles.py draws them."""

from __future__ import annotations

import operator
import struct
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import moderngl
import numpy as np

from ..gpu import gl
from ..gpu.bindings import Storage, Texture, storage, texture
from ..gpu.bins import Bins
from ..gpu.compact import scan_words
from ..gpu.constants import NOTHING
from ..gpu.context import Gpu, Program
from ..gpu.scatter import Visits, take_items
from ..picture.surface import Surface
from .amplify import Points
from .looks import looks_of
from .splats import Splats

DISC_BITS = 24  # of an entry, beside which it says which parts of a tile its disc reaches
DISC_BYTES = 16  # of a point in each of three buffers
_FEW = 4  # pixels of the box of a disc that is sent to them: a square that the smallest discs fit into
_SENT = "0xFFFFFFFFu"  # what cells.glsl says in place of the parts that such a disc reaches
_ROOM = 4  # entries of the list for each point, to begin with
# Entries of one tile's list, or of both where they are blended together: of more, sums of light could exceed
# 32 bits (31 x 4095 each); llvmpipe ends all loops of an invocation after 65 535 turns, and a pass may go
# over its list twice, with 73 turns for 64 entries; on hardware a pixel alone with so many would be slow.
_LONGEST = 28_000
_SPARE = 4  # times the points that there is room for, beyond which room is given up
_MORE = 8  # part of the points that there is room for beside them
_WORK_HEAD = 16  # bytes before the tiles that discs reach, and before those that are shown again
ALL, TOWARDS, AWAY, NOT_HIDDEN = range(4)  # which discs are listed: SIDE of cells.glsl


class ListPurpose(NamedTuple):
    """The use of lists of discs."""

    # `run` goes over the first lists, too: "work" is then all tiles where there are large discs, and "rest"
    # those that have first lists alone and open pixels.
    both: bool = False
    sends: bool = (
        False  # discs of a few pixels are in no list, but their depths on the surface, which is empty
    )
    looks: bool = False  # the looks of discs are wanted, for blending
    numbered: bool = False  # the disc of each point is stored


class _Filling(NamedTuple):
    """The counts of a filling, as surfels/tiles/filled.glsl has them. length: entries of the lists of all
    tiles. longest: entries of the longest. discs: those listed. away: those left to a second filling."""

    large: int = 0
    length: int = 0
    longest: int = 0
    sent: int = 0
    discs: int = 0
    away: int = 0

    @property
    def entries(self) -> int:
        """All entries: those of the lists of tiles, and those of homes."""
        return self.length + self.discs


class TileLists:
    """The discs that reach each tile of a picture, made anew for each frame (shaders/surfels/tiles/).

    Discs are numbered by tiles, so that those of one lie together in memory whatever the order of the points.
    length: entries of all lists. discs: how many are in lists. large: how many are left to the rasteriser.
    away: how many that face away from the eye were left to a second filling. sent: how many were sent to
    pixels in place of lists. waits: whether the CPU waits for these numbers, which each filling counts; else
    it goes by those of the last picture, in as many lists as there is room for, until `held` looks at them.
    """

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self._gpu = gpu
        self.grid = grid = _grid(gpu)
        self.tiles = (-(-size[0] // grid.tile[0]), -(-size[1] // grid.tile[1]))
        self.length = self.discs = self.large = self.away = self.sent = 0
        self._room = 0  # points
        words = self.tiles[0] * self.tiles[1]
        self._bins, self._away_bins = Bins(gpu, 2 * words), Bins(gpu, 2 * words)
        self.waits = True
        self._fits = self._has_second = self._both = False
        self._fillings = (_Filling(),) * 2
        self._textures = {"farthest": self._texture(4 * words, gl.R32UI)}
        self._textures["filled"] = self._texture(4 * len(_Filling._fields) * 2, gl.R32UI)
        for name in ("work", "rest", "again"):
            self._textures[name] = self._texture(_WORK_HEAD + 4 * words, gl.R32UI)
        self._large_rows: gl.BufferTexture | None = None
        self._rows: gl.BufferTexture | None = None

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        textures = [*self._textures.values(), *([self._large_rows] if self._large_rows else [])]
        bins = self._bins.nbytes + self._away_bins.nbytes
        return bins + sum(texture.buffer.size for texture in textures)

    def fill(
        self,
        points: Points,
        surface: Surface,
        splats: Splats,
        side: int = ALL,
        purpose: ListPurpose | None = None,
    ) -> bool:
        """List the discs of points for the surface's view; False where the lists would grow too long.

        side: ALL; TOWARDS, those that face the eye; AWAY, the others that it found, in lists beside, unless
        they are hidden by what `show` found of the first; NOT_HIDDEN, all that lie before `farthest`. Large
        ones are counted but for AWAY.
        """
        purpose = purpose or ListPurpose()
        gpu, second, both, sends = self._gpu, side == AWAY, purpose.both, purpose.sends
        bins = self._away_bins if second else self._bins
        if not second:
            self._reserve(points)
            self._rows = points.rows
            self._gpu.clear(self._buffer("filled"), 0)
        self._has_second, self._both = second, both

        def bind(program: Program) -> None:
            points.bind(program)
            for name in ("farthest", "reach", "away"):
                self._textures[name].bind(texture(name))
            self._bind_storage("filled", "reach", "large", "away", "noted")
            if sends:
                surface.depths.buffer.bind_to_storage_buffer(Storage.NEAREST)

        given = {
            **{"PERSPECTIVE": int(surface.view.perspective), **self.grid.defines, **points.defines},
            **{"SIDE": side, "SECOND": int(second), "FEW": _FEW if sends else 0, "SENT": _SENT},
        }
        count = self.away if second and self.waits else points.count
        counted = {**given, "TOGETHER": int(not self.grid.masked and not second)}
        visits = Visits("surfels/tiles/cells.glsl", count, bind, counted, splats)
        bins.count(visits)
        with gpu.timers.measure("work"):
            self._find_work(bins, "work", second, both)
            if both:
                self._find_work(bins, "rest", second, both)
            if self.waits and not self._take_filled():
                return False
        filling = self._fillings[second]
        sizes = (filling.discs, filling.entries) if self.waits else (count, bins.room)
        self._write(points, bins, given, splats, sizes, purpose)
        return True

    def _take_filled(self) -> bool:
        """Read the counts since the first filling; whether lists may be so long. Waits for the GPU."""
        words = self._gpu.read(self._buffer("filled"), np.uint32).reshape(2, -1).tolist()
        first, second = self._fillings = _Filling(*words[0]), _Filling(*words[1])
        self.large, self.sent, self.away, self.discs = first.large, first.sent, first.away, first.discs
        self.length = (second if self._has_second else first).length
        longest = (max, operator.add)[self._both](first.longest, second.longest)
        most = self._gpu.max_storage_bytes // 4
        self._fits = longest <= _LONGEST and all(each.entries <= most for each in self._fillings)
        return self._fits

    def foresees(self, points: Points) -> bool:
        """Whether lists of these points may be filled without a wait, going by those of the last picture."""
        return not self._gpu.software and self._are_usual and self._has_room(points.count)

    def held(self) -> bool:
        """Whether lists that were filled without a wait are right; else the picture is to be drawn anew, with
        waits. Waits for the GPU."""
        self._take_filled()
        return self._are_usual

    @property
    def _are_usual(self) -> bool:
        """Whether lists are right that are filled without a wait: they had room, no disc is large, and there
        are second lists where any disc was left to these."""
        first, second = self._fillings
        has_room = first.entries <= self._bins.room and second.entries <= self._away_bins.room
        is_alone = not first.large + first.sent and (self._has_second or not first.away)
        return self._fits and has_room and is_alone

    def _write(
        self,
        points: Points,
        bins: Bins,
        given: Mapping[str, object],
        splats: Splats,
        sizes: tuple[int, int],
        purpose: ListPurpose,
    ) -> None:
        """Write the lists. given: macros. sizes: how many discs there are at most, all entries."""
        discs, entries = sizes

        def bind_homes(_: Program) -> None:
            for name in ("filled", "reach", "noted"):
                self._textures[name].bind(texture(name))
            self._bind_storage("numbers")

        def bind_discs(program: Program) -> None:
            points.bind(program)
            for name in ("filled", "reach"):
                self._textures[name].bind(texture(name))
            bins.items.bind(Texture.LISTED)
            if purpose.looks:
                looks_of(points).bind(Texture.LOOKS)
            self._bind_storage("centers", "forms", "disc_looks")

        if purpose.numbered:
            self._gpu.clear(self._buffer("numbers"), NOTHING, points.count)
        homes = {**given, "NUMBERED": int(purpose.numbered)}
        bins.fill(Visits("surfels/tiles/homes.glsl", discs, bind_homes, homes), entries)
        listed = {**given, "LOOKS": int(purpose.looks)}
        bins.fill(Visits("surfels/tiles/discs.glsl", discs, bind_discs, listed, splats), entries)

    def take_sent(self, points: Points, surface: Surface, splats: Splats) -> None:
        """Find the points of the discs that were sent to pixels, whose depths the surface has."""

        def bind(program: Program) -> None:
            points.bind(program)
            self._textures["reach"].bind(Texture.REACH)

        defines = {"SENT": _SENT, **points.defines}
        visits = Visits("surfels/scatter.glsl", points.count, bind, defines, splats)
        take_items(self._gpu, visits, surface.depths, surface.rows)

    def _find_work(self, bins: Bins, work: str, second: bool, both: bool) -> None:
        """List the tiles that discs reach: "work", those of these lists; "rest", those of the first alone
        where a pixel shows nothing."""

        def bind(_: Program) -> None:
            bins.starts.buffer.bind_to_storage_buffer(Storage.STARTS)
            self._bins.starts.bind(Texture.STARTS)
            self._bind_storage("filled", "farthest")
            self._buffer(work).bind_to_storage_buffer(Storage.WORK)

        defines = {
            **{"TILES": f"{self.grid.tiles}u", "SECOND": int(second), "REST": int(work == "rest")},
            "ALL": int(both or not second),
        }
        scan_words(self._gpu, "surfels/tiles/work.glsl", self.tiles[0] * self.tiles[1], bind, defines)

    def large_points(self, points: Points) -> Points:
        """The points that are left to the rasteriser."""
        rows = self._gpu.read(self._buffer("large"), np.uint32, self.large)
        self._gpu.discard(self._large_rows)
        # Ascending, so that ties fall to the lowest row.
        self._large_rows = gl.BufferTexture(self._gpu.buffer(np.sort(rows)), gl.R32UI)
        return replace(points, rows=self._large_rows, count=self.large)

    def run(self, program: moderngl.ComputeShader, work: str = "work") -> None:
        """Run a program that includes surfels/tiles/nearest.glsl.

        work: on which tiles: "work", those that discs of the last filling reach; "rest", those that discs of
        the first alone do, where a pixel shows nothing; "again", those that are to be shown again.
        """
        for name in ("centers", "forms", "disc_looks", "reach"):
            self._textures[name].bind(texture(name))
        self._textures[work].bind(Texture.WORK)
        self._bins.starts.bind(Texture.STARTS)
        self._bins.items.bind(Texture.LISTED)
        self._away_bins.starts.bind(Texture.AWAY_STARTS)
        self._away_bins.items.bind(Texture.AWAY_LISTED)
        if self._rows is not None:
            self._rows.bind(Texture.DRAWN_ROWS)
        self._bind_storage("farthest")
        self._gpu.dispatch_indirect(program, self._buffer(work))

    def bind_forms(self) -> None:
        """Bind the forms of discs for shaders to change them, and which disc each point has."""
        self._bind_storage("forms")
        self._textures["numbers"].bind(Texture.NUMBERS)

    def start_again(self) -> None:
        """Empty, and bind, the list of tiles that are to be shown again."""
        self._buffer("again").write(struct.pack("4I", 0, 0, 1, 0))
        self._gpu.clear(self.farthest, 0)
        self._bind_storage("again")

    def shown_again(self) -> dict[str, int]:
        """How many tiles of those that discs reach were shown again; waits for the GPU."""
        worked, again = (
            int(self._gpu.read(self._buffer(name), np.uint32, 1, 12)[0]) for name in ("work", "again")
        )
        return {"in": worked, "again": again}

    def release(self) -> None:
        """Delete everything."""
        self._gpu.discard(self._bins, self._away_bins, *self._textures.values(), self._large_rows)

    @property
    def defines(self) -> dict[str, object]:
        """Macros for shaders that include surfels/tiles/nearest.glsl."""
        return {"SAMPLED": int(self._rows is not None), **self.grid.defines}

    @property
    def farthest(self) -> moderngl.Buffer:
        """The farthest depth shown in each tile, a word each: what FARTHEST of show.comp writes."""
        return self._buffer("farthest")

    def _reserve(self, points: Points) -> None:
        """Make room for points, and for some more of the same pose, which the next picture may show; give up
        what a much larger pose has left."""
        if self._has_room(points.count):
            return
        most = min(len(points.pose.cloud), self._gpu.max_storage_bytes // DISC_BYTES)
        self._room = count = max(min(points.count + points.count // _MORE, most), points.count, 1)
        self._replace("centers", DISC_BYTES * count, gl.RGBA32F)
        self._replace("forms", DISC_BYTES * count, gl.RGBA32F)
        self._replace("disc_looks", DISC_BYTES * count, gl.RGBA32UI)
        self._replace("numbers", 4 * count, gl.R32UI)
        self._replace("reach", 8 * count, gl.RG32UI)
        self._replace("noted", 4 * count, gl.R32UI)
        self._replace("away", 8 * count, gl.RG32UI)
        self._replace("large", 4 * count, gl.R32UI)
        self._bins.reserve(_ROOM * count)

    def _has_room(self, count: int) -> bool:
        """Whether there is room for so many points, and not much more."""
        return max(count, 1) <= self._room <= _SPARE * max(count, 1)

    def _replace(self, name: str, nbytes: int, texel_format: int) -> None:
        self._gpu.discard(self._textures.pop(name, None))
        self._textures[name] = self._texture(nbytes, texel_format)

    def _texture(self, nbytes: int, texel_format: int) -> gl.BufferTexture:
        return gl.BufferTexture(self._gpu.buffer(reserve=max(nbytes, 16)), texel_format)

    def _buffer(self, name: str) -> moderngl.Buffer:
        return self._textures[name].buffer

    def _bind_storage(self, *names: str) -> None:
        for name in names:
            self._buffer(name).bind_to_storage_buffer(storage(name))


@dataclass(frozen=True)
class TileGrid:
    """How pixels are shared out.

    part: those of an invocation, width and height. parts: of a tile, which has a list, along both. tiles: of
    a work group. masked: whether entries of lists say which parts their disc reaches; else a part is a pixel,
    a tile is a work group, and its invocations share what they read of discs, and count discs together. span:
    pixels along an edge of the largest discs that are listed.
    """

    part: tuple[int, int]
    parts: tuple[int, int]
    tiles: int
    masked: bool
    span: int

    @property
    def tile(self) -> tuple[int, int]:
        """Pixels of a tile, width and height."""
        return self.part[0] * self.parts[0], self.part[1] * self.parts[1]

    @property
    def defines(self) -> dict[str, object]:
        """Macros for shaders that include surfels/tiles/grid.glsl."""
        (width, height), (columns, lines) = self.part, self.parts
        sizes = {
            "PART_WIDTH": width,
            "PART_HEIGHT": height,
            "COLUMNS": columns,
            "LINES": lines,
            "ALL_PARTS": columns * lines,
        }
        return {
            **sizes,
            "MASKED": int(self.masked),
            "SPAN": self.span,
            "LONGEST": _LONGEST,
            "DISC_BITS": DISC_BITS,
        }


# An invocation goes over the tiles of a disc up to twice, and llvmpipe ends its loops after 65 535 turns.
SOFTWARE_GRID = TileGrid((4, 4), (4, 2), 16, masked=True, span=1920)
HARDWARE_GRID = TileGrid((1, 1), (8, 8), 1, masked=False, span=248)


def _grid(gpu: Gpu) -> TileGrid:
    """The grid that suits the device: a processor's eight lanes are the parts of a tile, and each takes
    its discs from the list; on hardware each pixel has its invocation, and a tile fills a work group.
    Software rasterisers take many times as long as lists for large discs; on hardware an invocation would go
    over all tiles of one by itself."""
    return SOFTWARE_GRID if gpu.software else HARDWARE_GRID
