"""Splat culling: a picture of splats, without the chunks of them that it cannot show.

Which chunks are hidden is known of the last picture. The others in view are drawn, in all passes; then the
depths that these show tell whether any of those left out may be seen after all. Where one may, which is rare
as chunks that a small turn would show are not left out, the picture is drawn anew with it. So what is drawn
last is always whole, and by the same passes, whichever way splats are drawn: the same to the bit.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..gpu import gl
from ..gpu.bindings import Storage, Texture
from ..gpu.chunks import chunk_size
from ..gpu.compact import IndexList, list_flagged
from ..gpu.constants import LAYER_SLOPE
from ..gpu.context import Gpu, Program
from ..gpu.pose import GpuPose
from ..picture.surface import Surface
from ..view import View
from .amplify import ListedRows, Points
from .culling import (
    FACES_AWAY,
    FIND,
    IN_VIEW,
    LAST,
    NOW,
    SLACK,
    START,
    UPLOAD_SECONDS,
    ChunkBoxes,
    Margins,
    SeenChunks,
    counts_of,
    find_farthest,
    may_order,
)
from .splats import Splats

_CHUNKS, _CHUNK = 1 << 15, 1 << 5  # about as many, and points of one at least
# Pixels by which what a chunk covers is larger where it is left out of the next picture at first: so many,
# and where pictures move as far as this one did, at least so far; times up to so much, the more often that
# was not enough.
_SPARE, _LEAST_MOVE, _MOST_SPARE = 2, 8, 64
_WIDEST, _NARROWER = 8.0, 0.95
_NEARLY_ALL = 0.9  # share of the points from which on a list of them is of no use
# Chunks drawn, first and anew, as a share of those in view, from which on drawing twice gains nothing; and
# the most pictures after such a one in which none that may be hidden is left out.
_DEAR, _LONGEST_PAUSE = 0.9, 64


def splat_margins(splats: Splats, largest: float, slack: float, trusts: bool, spare: int) -> Margins:
    """The numbers of the test of chunks with splats. largest: of all radii, scan units. slack, trusts, spare:
    see `Margins`."""
    return Margins(
        box_slack=slack,
        pixel_margin=SLACK,
        radius_scale=splats.radius_scale,
        uniform_radius=splats.uniform_radius,
        least_radius=splats.least_radius,
        behind=max(
            splats.epsilon * splats.radius_scale * max(largest, splats.uniform_radius),
            LAYER_SLOPE * splats.layer,
        ),
        pixels_behind=splats.epsilon * splats.least_radius,
        cull_back=splats.cull_back,
        trusts=trusts,
        spare_pixels=spare,
    )


def may_cull(pose: GpuPose) -> bool:
    """Whether chunks of a pose can be left out, which each call brings nearer."""
    return may_order(pose) and pose.cached(SplatChunks).boxes.upload(time.perf_counter() + UPLOAD_SECONDS)


def draw_unhidden(
    points: Points, surface: Surface, splats: Splats, largest: float, draw: Callable[[Points], bool]
) -> None:
    """Draw those of a pose's points that the picture may show.

    points: all of them. largest: of all radii, scan units. draw: what draws some, up to three times; whether
    it may have drawn them in another way had there been more.
    """
    chunks, before = points.pose.cached(SplatChunks), surface.cached(_Pictures)
    chunks.measure(points)
    boxes, trusts = chunks.boxes, before.pause == 0
    margins = splat_margins(splats, largest, boxes.slack, trusts, before.moved_to(surface))
    chunks.test(surface, START, margins)
    seen = boxes.seen(surface)
    is_late, is_dear = False, draw(chunks.take(points, surface, seen, LAST)) and _leaves_out(seen, LAST)
    if not is_dear and before.pause <= 1:
        find_farthest(surface)
        chunks.test(surface, FIND, margins)
        seen = boxes.seen(surface)
        is_late = bool(((seen & (LAST | NOW)) == NOW).any())
        if is_late:
            surface.restart()
            is_dear = draw(chunks.take(points, surface, seen, NOW)) and _leaves_out(seen, NOW)
    elif not is_dear:
        seen = seen | (seen & np.uint8(LAST)) << np.uint8(1)
    if is_dear:
        surface.restart()
        draw(chunks.take(points, surface, seen, IN_VIEW))
        seen = seen | _may_show(seen) * np.uint8(NOW)
    before.go_on(is_late, is_dear, seen)
    surface.stats.counted["chunks"] = lambda: counts_of(seen)
    if reason := _reason(boxes, seen):
        surface.stats.skipped["points"] = reason


def _may_show(seen: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Tell which chunks are in view and do not face away, (C,)."""
    return (seen & (IN_VIEW | FACES_AWAY)) == IN_VIEW


def _leaves_out(seen: NDArray[np.uint8], bit: int) -> bool:
    """Whether chunks without that bit may be hidden, for all that is known of others."""
    return bool((_may_show(seen) & ((seen & bit) == 0)).any())


def _reason(boxes: ChunkBoxes, seen: NDArray[np.uint8]) -> str:
    """How many points were left out and why; empty where none were."""
    outside = (seen & IN_VIEW) == 0
    away = (seen & FACES_AWAY) != 0
    hidden = ~outside & ~away & ((seen & NOW) == 0)
    causes = {"out of view": outside, "facing away": away, "hidden": hidden}
    counts = {cause: boxes.points_of(chunks) for cause, chunks in causes.items()}
    reason = [f"{cause} {count:,}" for cause, count in counts.items() if count]
    if not reason:
        return ""
    total = f"{sum(counts.values()):,} of {boxes.count:,} are in chunks"
    return (
        f"{total} out of view"
        if sum(counts.values()) == counts["out of view"]
        else f"{total}: {', '.join(reason)}"
    )


class SplatChunks:
    """The chunks of a pose's splats: smaller ones than of points, as each splat takes longer. Made with
    `GpuPose.cached`."""

    def __init__(self, pose: GpuPose) -> None:
        self._gpu = gpu = pose.gpu
        self.boxes = boxes = ChunkBoxes(pose, chunk_size(len(pose.cloud), _CHUNKS, _CHUNK))
        self._cones = gl.BufferTexture(gpu.buffer(reserve=16 * boxes.chunks), gl.RGBA32F)
        self._reaches = gl.BufferTexture(gpu.buffer(reserve=4 * boxes.chunks), gl.R32F)
        self._listed = IndexList(gpu, boxes.chunks, boxes.size)
        self._arranged: gl.BufferTexture | None = None
        self._ascending = _Ascending(gpu, boxes)
        self._measured: tuple[object, ...] = ()

    def measure(self, points: Points) -> None:
        """Put the points in the order of chunks, and find what the splats of each have in common, unless it
        is known. points: all of the pose."""
        of = (*(points.array(name) for name, *_ in points.attributes[1:]), points.use_radii)
        if len(of) == len(self._measured) and all(a is b for a, b in zip(of, self._measured, strict=True)):
            return
        gpu, boxes = self._gpu, self.boxes
        self._arrange(points)
        program = gpu.compute("chunks/bounds.comp", {"CHUNK": boxes.size, **self._defines(points)})
        with gpu.timers.measure("bounds"):
            self._bind(points, program)
            gpu.set(program, point_count=boxes.count)
            boxes.boxes.buffer.bind_to_storage_buffer(Storage.BOXES)
            self._cones.buffer.bind_to_storage_buffer(Storage.CONES)
            self._reaches.buffer.bind_to_storage_buffer(Storage.REACHES)
            gpu.dispatch(program, boxes.chunks)
        self._measured = of

    def _arrange(self, points: Points) -> None:
        """Put points in the order of chunks, unless this is that of the file, or the driver has no room."""
        gpu, boxes = self._gpu, self.boxes
        gpu.discard(self._arranged)
        self._arranged = None
        nbytes = 16 * (2 + points.use_axes + points.use_cells) * boxes.count
        if boxes.rows is None or nbytes > gpu.max_storage_bytes:
            return
        program = gpu.compute("chunks/arrange.comp", self._defines(points))
        arranged = gl.BufferTexture(gpu.buffer(reserve=nbytes), gl.RGBA32UI)
        with gpu.timers.measure("arrange"):
            self._bind(points, program)
            arranged.buffer.bind_to_storage_buffer(Storage.ARRANGED)
            gpu.dispatch(program, boxes.count)
        self._arranged = arranged

    def _defines(self, points: Points) -> dict[str, object]:
        """Macros of chunks/point.glsl."""
        return {
            **points.defines,
            "IN_FILE": int(self.boxes.rows is None),
            "REORDERED": int(self._arranged is not None),
        }

    def _bind(self, points: Points, program: Program) -> None:
        """Bind what chunks/point.glsl reads."""
        points.bind(program)
        self.boxes.bind_rows()
        if self._arranged is not None:
            self._arranged.bind(Texture.ARRANGED)

    def test(self, surface: Surface, step: int, margins: Margins) -> None:
        """Run a step of chunks/cull.comp on all of them."""
        self._cones.bind(Texture.CONES)
        self._reaches.bind(Texture.REACHES)
        self.boxes.test(surface, step, margins, SPLATS=1)

    def take(self, points: Points, surface: Surface, seen: NDArray[np.uint8], bit: int) -> Points:
        """Take the points in chunks with a bit of what is `seen`; all where that is nearly all, unless their
        order is another one."""
        gpu, boxes = self._gpu, self.boxes
        is_taken = (seen & bit) != 0
        count = boxes.points_of(is_taken)
        if boxes.rows is None and count > _NEARLY_ALL * boxes.count:
            return points
        self._listed.write(np.flatnonzero(is_taken).astype(np.uint32))
        rows = gpu.cached(_Rows).reserve(count)
        program = gpu.compute("chunks/rows.comp", {"CHUNK": boxes.size, **self._defines(points)})
        with gpu.timers.measure("rows"):
            self._listed.texels.bind(Texture.LISTED)
            boxes.bind_rows()
            rows.buffer.bind_to_storage_buffer(Storage.DRAWN_ROWS)
            if self._arranged is not None:
                rows.order_indices, rows.arranged = gpu.cached(_Places).reserve(count), self._arranged
                rows.order_indices.buffer.bind_to_storage_buffer(Storage.DRAWN_INDICES)
            gpu.dispatch(program, count)
        if boxes.rows is not None:
            rows.ascending = self._ascending.rows_of(surface.cached(SeenChunks).of(boxes), bit)
        return replace(points, rows=rows, count=count)

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        texels = [texels for texels in (self._cones, self._reaches, self._arranged) if texels is not None]
        own = sum(each.buffer.size for each in texels)
        return own + self.boxes.nbytes + self._listed.nbytes + self._ascending.nbytes

    def release(self) -> None:
        """Delete what it holds on the GPU."""
        lists = (self._listed, self._ascending)
        self._gpu.discard(self.boxes, self._cones, self._reaches, self._arranged, *lists)


class _Rows:
    """Room for the rows of chunks: one list at a time, of all poses."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._rows: ListedRows | None = None

    def reserve(self, count: int) -> ListedRows:
        """Room for so many."""
        nbytes = 4 * max(count, 1)
        if self._rows is None or self._rows.buffer.size < nbytes:
            self._gpu.discard(self._rows)
            self._rows = ListedRows(self._gpu.buffer(reserve=nbytes + nbytes // 8 // 4 * 4), gl.R32UI)
        rows = self._rows
        rows.ascending = rows.order_indices = rows.arranged = None
        return rows


class _Places(_Rows):
    """Room for their indices."""


class _Ascending:
    """The rows of listed chunks in the order of the file, made when they are asked for."""

    def __init__(self, gpu: Gpu, boxes: ChunkBoxes) -> None:
        self._gpu, self._boxes = gpu, boxes
        self._numbers: gl.BufferTexture | None = None
        self._listed: IndexList | None = None

    def rows_of(self, seen: moderngl.Buffer, bit: int) -> Callable[[], gl.BufferTexture]:
        """Make a function that gives the rows of the chunks with a bit of what is `seen`, when called."""
        gpu = self._gpu

        @cache
        def rows() -> gl.BufferTexture:
            boxes, numbers, listed = self._boxes, self._numbers, self._listed
            if numbers is None or listed is None:
                chunks = gpu.buffer(boxes.order.numbers(boxes.size))
                self._numbers = numbers = gl.BufferTexture(chunks, gl.R32UI)
                self._listed = listed = IndexList(gpu, boxes.count)

            def bind(program: Program) -> None:
                numbers.bind(Texture.CHUNK_NUMBERS)
                seen.bind_to_storage_buffer(Storage.SEEN)
                gpu.set(program, listed_bit=bit)

            with gpu.timers.measure("ascending"):
                list_flagged(gpu, "chunks/ascending.glsl", boxes.count, listed, bind)
            return listed.texels

        return rows

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        numbers = self._numbers.buffer.size if self._numbers else 0
        return numbers + (self._listed.nbytes if self._listed else 0)

    def release(self) -> None:
        """Delete what it holds on the GPU."""
        self._gpu.discard(self._numbers, self._listed)


class _Pictures:
    """Pictures of a surface so far. pause: how many are to come in which no chunk counts as hidden, since
    looking for hidden ones did not pay."""

    nbytes = 0

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self.pause, self._next_pause, self._wider = 0, 1, 1.0
        self._view: View | None = None

    def moved_to(self, surface: Surface) -> int:
        """How many pixels the next picture may have moved by, going by how far this one has since the one
        before."""
        view, before = surface.view, self._view
        self._view = view
        if before is None:
            return _SPARE
        if (before.origin != view.origin).any():
            return _MOST_SPARE
        corners = surface.pose.bounds.corners() - view.origin
        with np.errstate(all="ignore"):  # corners in the eye's plane and behind it
            pixels, depths = view.project(corners)
            moved = np.abs(pixels - before.project(corners)[0])[depths > view.near]
            farthest = moved.max(initial=0.0)
        wanted = self._wider * max(farthest, _LEAST_MOVE) if farthest > 0 else 0.0
        return min(_SPARE + math.ceil(wanted), _MOST_SPARE) if wanted < _MOST_SPARE else _MOST_SPARE

    def go_on(self, is_late: bool, is_dear: bool, seen: NDArray[np.uint8]) -> None:
        """Go on after a picture. is_late: whether it was drawn twice; is_dear: whether anew with all, after
        chunks had been left out; seen: bits of chunks, (C,)."""
        if self.pause:
            self.pause -= 1
            return
        in_view, first, shown = (np.count_nonzero(seen & bit) for bit in (IN_VIEW, LAST, NOW))
        is_dear = is_dear or bool(is_late and first + shown > _DEAR * in_view)
        self._wider = min(2 * self._wider, _WIDEST) if is_late else max(_NARROWER * self._wider, 1.0)
        self.pause = self._next_pause if is_dear else 0
        self._next_pause = min(2 * self._next_pause, _LONGEST_PAUSE) if is_dear else 1

    def release(self) -> None:
        """Nothing is on the GPU."""
