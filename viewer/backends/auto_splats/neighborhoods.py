"""Neighborhoods: the k nearest of each point that is seen, and the splat through them, found in the picture.

Preiner 2012, 4 to 6. The paper narrows radii down in rounds of splats that count what they cover. Here points
are listed by small cells of the picture, and those cells are searched that a ball round a point may reach in
the image, so that what is found is exact, whatever the view; 23 in 24 points need one search, nearly all
others two.
"""

from __future__ import annotations

import math
import weakref
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, cast

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...gpu import gl
from ...gpu.bindings import Storage, Texture, UniformBlock
from ...gpu.bins import Bins
from ...gpu.blocks import BlockBuffer
from ...gpu.compact import IndexList, list_covered, list_flagged
from ...gpu.constants import GROUP, NO_DEPTH, UNKNOWN
from ...gpu.context import Fill, Gpu, Program
from ...gpu.pose import GpuPose
from ...gpu.scatter import Visits, scatter
from ...gpu.view import ViewBlock
from ...picture.surface import Surface
from ...scan.points import PointCloud
from ...scan.range_points import RangePoints
from ...scan.spacing import spacing_quantile
from ...view import View
from .grids import COARSEST, FINEST_COARSE, Grids, foresee_border
from .kept import KeptNeighbors

# Bytes of a pose's row, of a participant, of a point that is seen.
_SPLAT, _LOOK, _EXTENT, _PLACE, _SLOT, _FOUND = 12, 8, 12, 12, 16, 16
_FIRST_BALL = 0.56  # that is searched, in usual radii: most neighborhoods are within
_DIRECTIONS = 24  # in which the cells of points are measured
_LANES = 32  # that search together for one point, of the few that are left
_ENOUGH = 10  # points of a region that tell how dense they are
# Participants at most, with those that others hide: 84 MB. And of a coarse cell: llvmpipe ends all loops of
# an invocation after 65 535 turns.
MOST_NEIGHBORS = 32  # loops over more are not unrolled, and take far longer
MOST_PARTICIPANTS, _LARGEST_CROWD = 1 << 22, 6000
_BLOCK = 8  # pixels along an edge, of which the farthest is known where points may be late
_SPARSE, _WIDEST = 0.9, 1.5  # quantile that tells sparse parts; their radii from which on splats grow no more
_SPARE = 4  # times the room that is needed, beyond which it is given up


_Sample = tuple[gl.BufferTexture | None, int]  # rows, None for all, and how many


@dataclass(frozen=True)
class Search:
    """Rules of what belongs to a neighborhood.

    k: points of one, the point itself among them. hidden_neighbors: whether points that others hide take
    part. culls: whether points far behind the nearest of their part of the picture wait for `find_late`.
    growth: of the area of a ball within which another point must follow; alone: the radius within which the
    second point must lie, in usual ones; others are outliers. drops: whether these have no splat. by_scanner:
    whether normals point to the side that a range view saw, not to the eye. adaptive: whether planes go
    through as few of the nearest as noise allows. elliptical: whether splats are longer where neighbors are
    farther apart; else only those of lines of points are no discs. widening: radius of the ball
    whose points determine a plane, in radii of the neighborhood; up to 1: the neighborhood determines it.
    noise: standard deviation of the points along the normals, scan units. raises: whether splats move from
    their points onto the surface that neighborhoods tell, where widening is up to 1.
    """

    k: int = 10
    hidden_neighbors: bool = True
    culls: bool = False
    growth: float = 4.0
    alone: float = UNKNOWN
    drops: bool = True
    by_scanner: bool = False
    adaptive: bool = False
    elliptical: bool = False
    widening: float = 1.0
    noise: float = 0.0
    raises: bool = False

    @property
    def moves(self) -> bool:
        """Whether it tells other places of splats than their points."""
        return self.raises or self.widening > 1

    @property
    def cuts(self) -> bool:
        """Whether splats end where the picture of the surface ends; they become ellipses, whose middles lie
        beside their points."""
        return self.raises and not self.elliptical and not self.by_scanner


@dataclass(frozen=True)
class _Pixels:
    """How points are projected: what points/cells.glsl reads."""

    point_size: int = 1


class Neighborhoods:
    """The neighborhoods of points that a picture shows, and their splats.

    Buffers by name, as texels. By the pose's row: "splats" and "looks", as `Points.buffers` has them;
    "extents", the radius of the neighborhood in the last picture that found one, 0: none, how far the mean
    of its points lies above the point, and how far the splat's middle lies beside it; "places", where the
    centres of splats lie that move. Of those whose neighborhoods were searched, one after the other:
    "drawn", their rows; "found": radius, scan units, 0 where it is alone; number of points, negative of an
    outlier; curvature; usual radius. "slots": the participants, positions and rows.
    """

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self._gpu = gpu
        self._resize(size)
        self._view = BlockBuffer(gpu.ctx, ViewBlock, UniformBlock.VIEW)
        self._texels: dict[str, gl.BufferTexture] = {}
        self._totals = gpu.buffer(reserve=8)
        self._has_hidden = False  # whether points that others hide take part
        self._bins = Bins(gpu, 1)
        self._grids = Grids.of(size, FINEST_COARSE, Search())
        self.participants = 0
        self.count = 0  # of those searched
        self.is_whole = False  # whether none that is seen is left to be searched
        self.kept = KeptNeighbors(gpu)
        self._made_of: tuple[object, ...] | None = None
        self._pose: weakref.ref[GpuPose] | None = None

    def _resize(self, size: tuple[int, int]) -> None:
        """Make lists for a picture of a size, its border included."""
        gpu, self._size, pixels = self._gpu, size, math.prod(size)
        self._pixels = IndexList(gpu, pixels)  # that show a point; then what one search left
        self._rest = IndexList(gpu, pixels, GROUP)  # what two left
        self._searched = IndexList(gpu, pixels)  # slots
        self._lines = IndexList(gpu, pixels)  # whose neighborhoods are of points on a line

    @property
    def _lists(self) -> tuple[IndexList, ...]:
        return self._pixels, self._rest, self._searched, self._lines

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        texels = sum(texels.buffer.size for texels in self._texels.values())
        return sum(each.nbytes for each in self._lists) + self._bins.nbytes + self.kept.nbytes + texels

    def release(self) -> None:
        """Delete everything."""
        self._gpu.discard(
            *self._lists, self._bins, self.kept, self._totals, self._view, *self._texels.values()
        )

    def __getitem__(self, name: str) -> gl.BufferTexture:
        return self._texels[name]

    def read(self, name: str, dtype: type, words: int) -> NDArray:
        """A buffer as an array of a number of words each, (N, words); waits for the GPU."""
        if name not in self._texels:  # nothing was seen yet
            return np.empty((0, words), dtype)
        content = self._gpu.read(self[name].buffer, np.uint32)
        return content[: len(content) // words * words].reshape(-1, words).view(dtype)

    def find(
        self,
        pose: GpuPose,
        surface: Surface,
        view: View,
        search: Search,
        share: float = 1.0,
        anew: bool = True,
        border: int = 0,
    ) -> None:
        """Find the neighborhoods of the points that are seen, or of the near ones, unless they are known from
        the last call. anew: even so. border: pixels round the picture whose points are seen, too, as their
        splats may reach into it."""
        made_of = (view.key, search, share, border)
        if not anew and self._pose is not None and self._pose() is pose and self._made_of == made_of:
            surface.stats.skipped["neighborhoods"] = (
                "the points, the camera and the settings of the search are the same as for the last picture"
            )
            return
        self._made_of, self._pose = None, weakref.ref(pose)
        self.count, self.is_whole = 0, not search.culls
        size = (view.size[0] + 2 * border, view.size[1] + 2 * border)
        if size != self._size:
            self._gpu.discard(*self._lists)
            self._resize(size)
        self._view.write(ViewBlock.of(replace(view, size=size)))
        with self._bordered(surface):
            self._find_seen(pose, surface, search, share, border)
        self._made_of = made_of

    def find_late(self, pose: GpuPose, surface: Surface, search: Search) -> None:
        """Find the neighborhoods of the points too that are not near, but whose splats may be seen
        beside what the surface shows by now (Preiner 2012, 7)."""
        self.is_whole = True
        if not self.count:
            return
        with self._gpu.timers.measure("late"):
            self._find_blocks(surface)
            with self._bordered(surface):
                self["slots"].bind(Texture.SLOTS)
                self["usual"].bind(Texture.USUAL)
                self["blocks"].bind(Texture.FARTHEST)
                self._list_seen("auto_splats/late.comp", pose)
        with self._bordered(surface):
            self._search(pose, search)

    def _find_seen(self, pose: GpuPose, surface: Surface, search: Search, share: float, border: int) -> None:
        # No point takes part that is farther beside the picture: none in chunks there is looked at.
        sample = surface.take_sample(share, border + (1 << COARSEST))
        visible = self._project(pose, sample)
        if visible:
            self._divide(search, visible, pose, border)
            self._reserve("splats", _SPLAT * len(pose.cloud), gl.RGB32UI)
            if self._reserve("extents", _EXTENT * len(pose.cloud), gl.R32F):
                self._gpu.clear(self["extents"].buffer, 0)
            self._reserve("looks", _LOOK * len(pose.cloud), gl.RG32UI)
            if search.moves:
                self._reserve("places", _PLACE * len(pose.cloud), gl.RGB32F)
            for name, nbytes, texel in (
                ("drawn", 4, gl.R32UI),
                ("found", _FOUND, gl.RGBA32F),
                ("next", 4, gl.R32F),
            ):
                self._reserve(name, nbytes * visible, texel)
            self._gather(pose, surface, search, sample)
            self.kept.begin(pose, search.k, self._has_hidden and share == 1)
            self._search(pose, search)

    @contextmanager
    def _bordered(self, surface: Surface) -> Iterator[None]:
        """Have shaders see the picture with its border."""
        self._view.bind()
        try:
            yield
        finally:
            surface.bind_view()

    def _project(self, pose: GpuPose, sample: _Sample) -> int:
        """Find the nearest point of each pixel; how many pixels have one."""
        self._reserve("depths", 4 * self._size[0] * self._size[1], gl.R32UI)
        self._reserve("rows", 4 * self._size[0] * self._size[1], gl.R32UI)
        visits = self._visits("points/cells.glsl", pose, sample, {"SINGLE": 1}, _Pixels())
        scatter(self._gpu, visits, self["depths"], self["rows"])
        self["depths"].bind(Texture.DEPTHS)
        list_covered(self._gpu, self._size[0] * self._size[1], self._pixels)
        return len(self._pixels)

    def _visits(
        self,
        cells: str,
        pose: GpuPose,
        sample: _Sample,
        defines: Mapping[str, object],
        params: Any,
    ) -> Visits:
        """The visits of a sample of the points to cells."""
        rows, count = sample

        def bind(_: Program) -> None:
            pose.array("positions").bind(Texture.POSITIONS)
            if rows is not None:
                rows.bind(Texture.DRAWN_ROWS)
            if params is self._grids:
                self["rows"].bind(Texture.ROWS)
                self["farthest"].bind(Texture.FARTHEST)
                self._bind_storage(copied=Storage.COPIED)

        return Visits(cells, count, bind, {"SAMPLED": int(rows is not None), **defines}, params)

    def _divide(self, search: Search, visible: int, pose: GpuPose, border: int) -> None:
        """Divide the picture into cells as large as neighborhoods usually are, and tell how near each
        sees."""
        shift = FINEST_COARSE
        while True:
            grids = Grids.of(self._size, shift, search, _unit(pose), border)
            occupied = self._measure_depths(grids)
            radius = math.sqrt(occupied * 4**shift / visible * search.k / math.pi)
            wanted = min(max(math.ceil(math.log2(radius)), shift), COARSEST)
            if wanted == shift:
                break
            shift = wanted
        in_space = _typical_radius(pose, search.k)
        self._grids = grids = grids.refined(self._size, radius, in_space, _widest_radius(pose, search.k))
        for name in ("near to", "farthest"):
            self._reserve(name, 4 * grids.coarse_cells, gl.R32F)
        with self._gpu.timers.measure("planes"):
            program = self._gpu.compute("auto_splats/planes.comp", params=grids)
            self["nearest"].bind(Texture.KEYS)
            self["near to"].buffer.bind_to_storage_buffer(Storage.NEAR_TO)
            self._bind_storage(farthest=Storage.FARTHEST)
            self._gpu.dispatch(program, grids.coarse_cells)

    def _measure_depths(self, grids: Grids) -> int:
        """Find how near each coarse cell sees anything; how many see any."""
        self._reserve("nearest", 4 * grids.coarse_cells, gl.R32UI)
        with self._gpu.timers.measure("nearest"):
            self._gpu.fill(Fill(self["nearest"].buffer, NO_DEPTH), Fill(self._totals, 0))
            program = self._gpu.compute("auto_splats/nearest.comp", params=grids)
            self["depths"].bind(Texture.DEPTHS)
            self._bind_storage(nearest=Storage.KEYS)
            self._totals.bind_to_storage_buffer(Storage.TOTALS)
            self._pixels.run(program)
            return self._read_totals()[0]

    def _gather(self, pose: GpuPose, surface: Surface, search: Search, sample: _Sample) -> None:
        """List the participants by cells, and those of them that are active. Where too many would take part
        that others hide, none of these does."""
        grids = self._grids
        if self._bins.cells != grids.fine_cells:
            self._gpu.discard(self._bins)
            self._bins = Bins(self._gpu, grids.fine_cells)
        self._reserve("copied", 4 * grids.coarse_cells, gl.R32UI)
        self._gpu.clear(self["copied"].buffer, 0)
        for hidden in (True, False) if search.hidden_neighbors else (False,):
            defines = {"HIDDEN_NEIGHBORS": int(hidden)}
            visits = self._visits("auto_splats/participants.glsl", pose, sample, defines, grids)
            self._bins.count(visits)
            self.participants = self._bins.length()
            if hidden and self.participants > MOST_PARTICIPANTS:
                continue
            self._bins.fill(visits, self.participants)
            self._arrange(pose)
            if self._find_usual(search) <= _LARGEST_CROWD:
                break
        self._has_hidden = hidden
        if search.hidden_neighbors and not hidden:
            surface.stats.skipped["hidden neighbours"] = "the search for neighbours would use too many points"
        if self.participants < search.k:  # an outlier is far from others, of which there are none
            self._grids = replace(grids, alone=UNKNOWN)

    def _arrange(self, pose: GpuPose) -> None:
        """Put participants in the order of their cells, count how many each coarse cell has, and list those
        to be searched."""
        self._reserve("slots", _SLOT * self.participants, gl.RGBA32UI)
        self._reserve("counts", 4 * self._grids.coarse_cells, gl.R32UI)
        with self._gpu.timers.measure("arrange"):
            self._gpu.clear(self["counts"].buffer, 0)
            self._searched.clear()
            self._bins.items.bind(Texture.LISTED)
            self._bind_storage(slots=Storage.SLOTS, counts=Storage.COUNTS)
            self._list_seen("auto_splats/arrange.comp", pose)

    def _find_usual(self, search: Search) -> int:
        """Find the usual radius in each coarse cell; how many participants the fullest one has."""
        self._reserve("usual", 4 * self._grids.coarse_cells, gl.R32F)
        with self._gpu.timers.measure("usual"):
            self._gpu.clear(self._totals, 0)
            defines = {"K": search.k, "ENOUGH": f"{_ENOUGH}u"}
            program = self._gpu.compute("auto_splats/usual.comp", defines, params=self._grids)
            self["counts"].bind(Texture.COUNTS)
            self._bind_storage(usual=Storage.USUAL)
            self._totals.bind_to_storage_buffer(Storage.TOTALS)
            self._gpu.dispatch(program, self._grids.coarse_cells)
            return self._read_totals()[1]

    def _find_blocks(self, surface: Surface) -> None:
        """Find the farthest depth that the surface shows in each block of pixels."""
        blocks = math.prod(-(-pixels // _BLOCK) for pixels in surface.size)
        self._reserve("blocks", 4 * blocks, gl.R32UI)
        surface.depths.bind(Texture.DEPTHS)
        self._bind_storage(blocks=Storage.FARTHEST)
        self._gpu.dispatch(self._gpu.compute("auto_splats/blocks.comp", {"BLOCK": _BLOCK}), blocks)

    def _list_seen(self, name: str, pose: GpuPose) -> None:
        """Run a program that includes auto_splats/seen.glsl on all participants: it adds to those
        searched."""
        program = self._gpu.compute(name, {"BLOCK": _BLOCK}, params=self._grids)
        self._searched.bind()
        pose.array("positions").bind(Texture.POSITIONS)
        self["rows"].bind(Texture.ROWS)
        self["near to"].bind(Texture.NEAR_TO)
        self._bind_storage(drawn=Storage.DRAWN_ROWS)
        self._gpu.dispatch(program, self.participants)

    def _search(self, pose: GpuPose, search: Search) -> None:
        """Search the neighborhoods of those listed since the last call."""
        first, self.count = self.count, len(self._searched)
        if self.count == first:
            return
        if self.kept.is_filled:
            self._run_search(pose, search, first, None, from_kept=True)
        for listed in (self._pixels if self.kept.is_filled else None, self._pixels, self._rest):
            if listed is not None:
                with self._gpu.timers.measure("unknown"):
                    list_flagged(self._gpu, "auto_splats/unknown.glsl", self.count, listed, self._bind_next)
            self._run_search(pose, search, first, listed)
        if search.moves:
            self._move_splats(pose, search, first)
        self._join_lines(pose, search)

    def read_rounds(self) -> dict[str, int]:
        """How many neighborhoods were kept from an earlier picture, and how many were known after one search,
        two, and more, in the last picture."""
        kept, after_one, after_two = self.kept.read_count(), len(self._pixels), len(self._rest) // GROUP
        one = self.count - kept - after_one
        return {"kept": kept, "one": one, "two": after_one - after_two, "more": after_two}

    def _run_search(
        self, pose: GpuPose, search: Search, first: int, listed: IndexList | None, from_kept: bool = False
    ) -> None:
        """Search with a ball that most neighborhoods are within; one that nearly all others are within; as
        far as it takes. listed: those not known yet, but at first. from_kept: take those that are kept, in
        place of a search."""
        together = listed is self._rest
        defines = {
            "K": search.k,
            "FIRST_BALL": _FIRST_BALL,
            "LANES": _LANES if together else 1,
            "HAS_COLORS": int(pose.cloud.colors is not None),
            "ADAPTIVE": int(search.adaptive and search.widening <= 1),
            "ELLIPTICAL": str(search.elliptical).lower(),
            "CUT": int(search.cuts),
            "BENDS": int(search.cuts and search.widening <= 1),
            "DIRECTIONS": _DIRECTIONS,
            "KEEPS": int(self.kept.is_open),
            "FROM_KEPT": int(from_kept),
        }
        with self._gpu.timers.measure("search"):
            program = self._searching("auto_splats/search.comp", pose, search, defines)
            if pose.cloud.colors is not None:
                pose.array("colors").bind(Texture.COLORS)
            self["usual"].bind(Texture.USUAL)
            self._bind_storage(found=Storage.FOUND)
            if self.kept.is_open:
                self["rows"].bind(Texture.ROWS)
                self["farthest"].bind(Texture.FARTHEST)
                self["copied"].bind(Texture.COPIED)
                self.kept.bind(program)
            if not together:
                self._gpu.set(program, first=first, again=listed is not None)
            if listed is None:
                self._pixels.bind()  # which the program declares
                self._gpu.dispatch(program, self.count - first)
            else:
                listed.run(program)

    def _move_splats(self, pose: GpuPose, search: Search, first: int) -> None:
        """Move splats listed from `first` on onto the surface that their neighborhoods tell. Where points are
        noisy, wider balls tell it, and the planes too."""
        steadies = search.widening > 1
        with self._gpu.timers.measure("steady" if steadies else "raise"):
            if steadies:
                defines = {
                    "LANES": 1,
                    "ELLIPTICAL": str(search.elliptical).lower(),
                    "CUT": int(search.cuts),
                }
                program = self._searching("auto_splats/steady.comp", pose, search, defines)
                self._gpu.set(program, widening=search.widening)
            else:
                program = self._gpu.compute("auto_splats/raise.comp")
                pose.array("positions").bind(Texture.POSITIONS)
                self["drawn"].bind(Texture.DRAWN_ROWS)
                self._bind_storage(splats=Storage.SPLATS, extents=Storage.EXTENTS)
            self._bind_storage(places=Storage.PLACES)
            self._gpu.set(program, first=first)
            self._gpu.dispatch(program, self.count - first)

    def _join_lines(self, pose: GpuPose, search: Search) -> None:
        """Have splats of points on a line reach halfway to the lines beside."""
        with self._gpu.timers.measure("lines"):
            list_flagged(self._gpu, "auto_splats/lines.glsl", self.count, self._lines, self._bind_next)
            self._lines.run(self._searching("auto_splats/lines.comp", pose, search, {"LANES": 1}))

    def _searching(
        self, name: str, pose: GpuPose, search: Search, defines: Mapping[str, object]
    ) -> moderngl.ComputeShader:
        """A program that takes participants from cells and makes splats, with what it reads."""
        views = {"BY_SCANNER": int(search.by_scanner), "SCANNERS": len(pose.views) * search.by_scanner}
        program = self._gpu.compute(name, {**views, **defines}, params=self._grids)
        pose.array("positions").bind(Texture.POSITIONS)
        if search.by_scanner:
            pose.packed(_scanners, pose.pose.range_points, texel_format=gl.RGBA32F).bind(Texture.RANGE_VIEWS)
        self["slots"].bind(Texture.SLOTS)
        self._searched.texels.bind(Texture.LISTED)
        self._bins.starts.bind(Texture.STARTS)
        self._bind_storage(splats=Storage.SPLATS, looks=Storage.LOOKS, extents=Storage.EXTENTS)
        self._bind_next(program)
        return program

    def _bind_next(self, _: Program) -> None:
        self._bind_storage(next=Storage.NEXT)

    def _bind_storage(self, **bindings: Storage) -> None:
        for name, binding in bindings.items():
            self[name].buffer.bind_to_storage_buffer(binding)

    def _read_totals(self) -> tuple[int, int]:
        return tuple(self._gpu.read(self._totals, np.uint32, 2).tolist())

    def _reserve(self, name: str, nbytes: int, texel_format: int) -> bool:
        """Make room for so many bytes, and give up what something much larger has left; whether it is new."""
        old, nbytes = self._texels.get(name), max(nbytes, 16)
        if old is not None and nbytes <= old.buffer.size <= _SPARE * nbytes:
            return False
        self._gpu.discard(self._texels.pop(name, None))
        self._texels[name] = gl.BufferTexture(self._gpu.buffer(reserve=nbytes), texel_format)
        return True


def _unit(pose: GpuPose) -> float:
    """A power of two with which the scan's size is about 1, so that squares of distances are numbers."""
    size = 2 * pose.bounds.radius
    return 2.0 ** -round(math.log2(size)) if size > 0 else 1.0


def _typical_radius(pose: GpuPose, k: int) -> float:
    """The radius of neighborhoods of k if points lay evenly on a ball of the scan's size, scan units."""
    return 2 * pose.bounds.radius * math.sqrt(k / max(len(pose.cloud), 1))


def foresee_neighborhoods(cloud: PointCloud) -> None:
    """Find the facts that searches for neighborhoods read (`Backend.foresee`)."""
    foresee_border(cloud)
    cloud.remember(spacing_quantile, _SPARSE)


def _widest_radius(pose: GpuPose, k: int) -> float:
    """The radius of neighborhoods of k where points are sparser than nearly everywhere, scan units: what is
    farther apart, as returns of a lidar from far away, is no surface that splats could close."""
    sparse = pose.cloud.remember(spacing_quantile, _SPARSE)
    return _WIDEST * sparse * math.sqrt(k / math.pi)


def _scanners(cloud: PointCloud, points: RangePoints) -> NDArray[np.float32]:
    """Position of each range view's eye, relative to the origin, and the bits of its first row, (V, 4)."""
    scanners = np.zeros((len(points.views), 4), np.float32)
    scanners[:, :3] = np.array([view.eye for view in points.views]) - cloud.origin
    first_rows = np.searchsorted(cast(NDArray, cloud.ids), points.firsts[:-1])
    scanners.view(np.uint32)[:, 3] = first_rows
    return scanners
