"""Culling: which chunks of a pose's points a picture may show, found while it is drawn.

Hierarchical z in two phases (Greene, Kass and Miller 1993): the chunks that the last picture showed are drawn
first; of the others only those that this depth leaves room for. What is left out has farther depths than all
pixels that it could cover, so the picture is the same to the bit. Here for points as squares of pixels; for
splats in `splat_culling.py`.
"""

from __future__ import annotations

import time
import weakref
from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..gpu import gl
from ..gpu.arrays import GpuArray
from ..gpu.bindings import Storage, Texture
from ..gpu.chunks import Chunks
from ..gpu.compact import IndexList
from ..gpu.context import Gpu
from ..gpu.pose import GpuPose
from ..picture.target import RenderTarget

_TILE = 16  # pixels along an edge, whose farthest depth hides chunks
_MOST_TILES = 1024  # that are looked at for one chunk; one that is larger in the picture counts as shown
SLACK = 1.0  # pixels, for what float32 rounds
_ROUNDING = 1e-5  # of the pose's size, by which boxes are larger for the same reason
START, FIND, _GIVE, VIEW = range(4)  # steps of chunks/cull.comp
UPLOAD_SECONDS = 0.004  # that one picture spends on uploading what is in order
_SLICES = 4  # of an array that one picture uploads at most
_RUN, _RUNS = 1 << 16, 64  # points that are put in order at a time, and how often in one picture at most
_MOST_PICTURES = 15  # until the chunks in view are counted again
# Share of the chunks in view that must be hidden for a graphics card to gain by looking for them. Pictures
# that do without otherwise, and pictures that look before the share is read.
_PAYS, _PAUSE, _LOOKS = 0.65, 64, 2
LAST, NOW, IN_VIEW, FACES_AWAY = 1, 2, 4, 8  # bits of what is seen, as it has them


@dataclass(frozen=True)
class Margins:
    """Numbers that chunks/cull.comp reads. box_slack: scan units by which boxes are larger. pixel_margin:
    pixels around a point that it may cover.

    Of splats: radius_scale: factor on radii. uniform_radius: scan units, of those without one of their own.
    least_radius: pixels. behind, pixels_behind: how far behind what is shown others still count, scan units,
    and as large as so many pixels are there. cull_back: whether those that face away are left out. trusts:
    whether chunks that were hidden wait until it is known that they are not. spare_pixels: pixels around a
    chunk that must hide it, too, for it to be left out of the next picture at first.
    """

    box_slack: float
    pixel_margin: float
    radius_scale: float = 0.0
    uniform_radius: float = 0.0
    least_radius: float = 0.0
    behind: float = 0.0
    pixels_behind: float = 0.0
    cull_back: bool = False
    trusts: bool = False
    spare_pixels: int = 0


def culled_chunks(pose: GpuPose) -> CulledChunks | None:
    """The chunks of a pose whose points are in an order of use; None where they are not, or few."""
    if not may_order(pose):
        return None
    chunks = pose.cached(CulledChunks)
    return chunks if chunks.prepare(pose, time.perf_counter() + UPLOAD_SECONDS) else None


def may_order(pose: GpuPose) -> bool:
    """Whether chunks of a pose are of use: it has many points, in an order in which chunks are small."""
    return is_centered(pose) and pose.cached(Chunks).take_order() is not None


def is_centered(pose: GpuPose) -> bool:
    """Whether positions on the GPU are relative to the cloud's own origin, as chunks are."""
    return bool((pose.origin == pose.cloud.origin).all())


class ChunkBoxes:
    """The boxes of a pose's chunks on the GPU.

    order: of the points. count: of these. size: points of a chunk. chunks: how many. boxes: two RGB32F texels
    a chunk, its corners.
    """

    def __init__(self, pose: GpuPose, size: int | None = None) -> None:
        self._gpu = gpu = pose.gpu
        self.order = order = pose.cached(Chunks).known
        self.count, self.size = len(pose.cloud), size or order.chunk
        self.chunks = -(-self.count // self.size)
        self.boxes = gl.BufferTexture(gpu.buffer(reserve=24 * self.chunks), gl.RGB32F)
        corners = np.stack([order.low, order.high], axis=1)
        if size is None:
            self.boxes.buffer.write(corners)
        self._rows = None if order.rows is None else GpuArray(gpu, order.rows, gl.R32UI)
        self.slack = _ROUNDING * float(np.abs(corners).max())

    @property
    def rows(self) -> gl.BufferTexture | None:
        """The row of each point in this order; None if that is the order of the file."""
        return None if self._rows is None else self._rows.texels

    def upload(self, end: float) -> bool:
        """Upload rows until that time of the performance counter, but no more than a picture may; whether all
        are there."""
        return self._rows is None or self._rows.write(end, _SLICES)

    def test(self, surface: RenderTarget, step: int, margins: Margins, **defines: object) -> None:
        """Run a step of chunks/cull.comp on all of them. defines: of its variants."""
        gpu = self._gpu
        given = {"STEP": step, "TILE": _TILE, "MOST_TILES": _MOST_TILES, "LISTS": 0, "SPLATS": 0, **defines}
        program = gpu.compute("chunks/cull.comp", given, params=margins)
        with gpu.timers.measure("cull"):
            self.boxes.bind(Texture.BOXES)
            surface.cached(SeenChunks).of(self).bind_to_storage_buffer(Storage.SEEN)
            if step == FIND:
                surface.cached(_Farthest).texels.bind(Texture.FARTHEST_TILES)
            gpu.dispatch(program, self.chunks)

    def bind_rows(self) -> None:
        """Bind `rows`, where there are any."""
        if self.rows is not None:
            self.rows.bind(Texture.CHUNK_ROWS)

    def points_of(self, are_meant: NDArray[np.bool_]) -> int:
        """How many points some chunks have, (C,) of all."""
        lacking = self.chunks * self.size - self.count  # in the last one
        return int(np.count_nonzero(are_meant)) * self.size - lacking * bool(are_meant[-1:].any())

    def seen(self, surface: RenderTarget) -> NDArray[np.uint8]:
        """Read what the last step told of each, bits, (C,); waits for the GPU."""
        return self._gpu.read(surface.cached(SeenChunks).of(self), np.uint32).astype(np.uint8)

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return self.boxes.buffer.size + (self._rows.nbytes if self._rows else 0)

    def release(self) -> None:
        """Delete what it holds on the GPU."""
        self._gpu.discard(self.boxes)
        self._rows = None


class SeenChunks:
    """Words of bits, what the last picture of a surface told of each of a pose's chunks. Made with
    `Surface.keep`."""

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self._gpu = gpu
        self._buffer: moderngl.Buffer | None = None
        self._of: weakref.ref[ChunkBoxes] | None = None
        self.nbytes = 0

    def of(self, boxes: ChunkBoxes) -> moderngl.Buffer:
        """The words; 0 where the last chunks that were asked for were others."""
        if self._buffer is None or self._of is None or self._of() is not boxes:
            self.release()
            self._of, self.nbytes = weakref.ref(boxes), 4 * boxes.chunks
            self._buffer = self._gpu.buffer(bytes(self.nbytes))
        return self._buffer

    def release(self) -> None:
        """Delete them."""
        self._gpu.discard(self._buffer)
        self._buffer = None


class CulledChunks:
    """The points of a pose as squares: in the order of its chunks, and lists of those that pictures show."""

    def __init__(self, pose: GpuPose) -> None:
        self._gpu = gpu = pose.gpu
        self._boxes = boxes = ChunkBoxes(pose)
        self.count, self._size = boxes.count, boxes.size
        self._lists = [IndexList(gpu, boxes.chunks, self._size) for _ in range(4)]
        self._reordered: _Reordered | None = None
        self._looks_again_in = 0  # pictures, until the chunks in view are counted again
        self._pause = self._looked = 0  # pictures that do not look for hidden chunks, and those that did

    def prepare(self, pose: GpuPose, end: float) -> bool:
        """Upload rows, then put the positions in their order, until that time of the performance counter, but
        no more than a picture may; whether all is there."""
        rows = self._boxes.rows
        if not self._boxes.upload(end):
            return False
        if rows is None:
            return True
        if self._reordered is None:  # in a picture of its own, as drivers take long to give much memory
            self._reordered = _Reordered(self._gpu, self.count)
            return False
        return self._reordered.go_on(pose, rows, end)

    @property
    def defines(self) -> dict[str, object]:
        """Macros of points/cells.glsl."""
        return {"CHUNKED": 1, "CHUNK": self._size, "SAMPLED": int(self._boxes.rows is not None)}

    def bind(self, pose: GpuPose) -> None:
        """Bind the positions and rows of the pose's points, in the order of chunks."""
        positions = pose.array("positions") if self._reordered is None else self._reordered.texels
        positions.bind(Texture.POSITIONS)
        if self._boxes.rows is not None:
            self._boxes.rows.bind(Texture.DRAWN_ROWS)

    def few(self, surface: RenderTarget, margin: float, most: float) -> tuple[IndexList, int] | None:
        """The chunks in view, and how many points they have, the last chunk counted as a whole one, if these
        are at most so many: so few that looking for hidden ones would take longer. margin: as in `start`.

        The GPU lists the chunks, and the CPU waits for their number. After many, some pictures do without.
        """
        view = surface.view
        if view.holds(surface.pose.bounds.corners() - view.origin):
            return None
        if self._looks_again_in:
            self._looks_again_in -= 1
            return None
        listed = self.in_view(surface, margin)
        if (points := len(listed)) > most:
            self._looks_again_in = min(int(points / most), _MOST_PICTURES)
            return None
        return listed, points

    def looks_for_hidden(self, surface: RenderTarget) -> bool:
        """Whether this picture looks for hidden chunks: always on software drivers. On graphics cards, the
        counts of the last picture that looked decide now and then whether the next ones do."""
        if self._gpu.software:
            return True
        if self._pause == 0 and self._looked >= _LOOKS:
            counts, self._looked = counts_of(self._boxes.seen(surface)), _LOOKS - _PAUSE
            if counts["hidden"] < _PAYS * (counts["hidden"] + counts["shown"]):
                self._pause, self._looked = _PAUSE, 0
        if self._pause:
            self._pause -= 1
            return False
        self._looked += 1
        return True

    def in_view(self, surface: RenderTarget, margin: float) -> IndexList:
        """All chunks in view. margin: as in `start`."""
        self._margins = Margins(self._boxes.slack, margin + SLACK)
        return self._list(surface, VIEW)

    def start(self, surface: RenderTarget, margin: float) -> IndexList:
        """The chunks to draw first. margin: pixels around a point that it may cover."""
        self._margins = Margins(self._boxes.slack, margin + SLACK)
        return self._list(surface, START)

    def late(self, surface: RenderTarget) -> IndexList:
        """The chunks to draw beside these, when they are."""
        find_farthest(surface)
        return self._list(surface, FIND)

    def shown(self, surface: RenderTarget) -> IndexList:
        """All chunks that the picture may show."""
        return self._list(surface, _GIVE)

    def note_counts(self, surface: RenderTarget) -> None:
        """Let the statistics tell how many chunks the picture shows."""
        surface.stats.counted["chunks"] = lambda: counts_of(self._boxes.seen(surface))

    def _list(self, surface: RenderTarget, step: int) -> IndexList:
        listed = self._lists[step]
        listed.clear()
        listed.bind()
        self._boxes.test(surface, step, self._margins, LISTS=1, CHUNK=self._size)
        return listed

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        own = 0 if self._reordered is None else self._reordered.texels.buffer.size
        return own + self._boxes.nbytes + sum(listed.nbytes for listed in self._lists)

    def release(self) -> None:
        """Delete what it holds on the GPU."""
        self._gpu.discard(self._boxes, *self._lists)
        if self._reordered is not None:
            self._gpu.discard(self._reordered.texels)


class _Reordered:
    """Positions in the order of chunks, which the GPU puts there run by run. texels: RGB32F, all points."""

    def __init__(self, gpu: Gpu, count: int) -> None:
        self._gpu, self._count = gpu, count
        self._done = 0
        self.texels = gl.BufferTexture(gpu.buffer(reserve=12 * count), gl.RGB32F)

    def go_on(self, pose: GpuPose, rows: gl.BufferTexture, end: float) -> bool:
        """Go on until that time of the performance counter, a run at least, and at most so far as a picture
        may; whether all are in order."""
        if self._done == self._count:
            return True
        gpu, program = self._gpu, self._gpu.compute("chunks/reorder.comp")
        with gpu.timers.measure("reorder"):
            pose.array("positions").bind(Texture.POSITIONS)
            rows.bind(Texture.CHUNK_ROWS)
            for _ in range(_RUNS):
                run = min(_RUN, self._count - self._done)
                self.texels.buffer.bind_to_storage_buffer(
                    Storage.ARRANGED, offset=12 * self._done, size=12 * run
                )
                gpu.set(program, first=self._done)
                gpu.dispatch(program, run)
                self._done += run
                if self._done == self._count or time.perf_counter() > end:
                    break
        return self._done == self._count


def counts_of(seen: NDArray[np.uint8]) -> dict[str, int]:
    """How many chunks were shown, hidden by what is before them, or out of view, and how many face away where
    any does. seen: bits of each, (C,)."""
    shown, in_view, away = (int(np.count_nonzero(seen & bit)) for bit in (NOW, IN_VIEW, FACES_AWAY))
    counts = {"shown": shown, "hidden": in_view - shown - away, "outside": len(seen) - in_view}
    return {**counts, "away": away} if away else counts


def find_farthest(surface: RenderTarget) -> None:
    """Find the farthest depth of each tile of what was drawn so far."""
    surface.cached(_Farthest).find(surface)


class _Farthest:
    """The farthest depth of each tile of a picture."""

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self._tiles = -(-size[0] // _TILE) * -(-size[1] // _TILE)
        self._buffer: moderngl.Buffer = gpu.buffer(reserve=4 * self._tiles)
        self.texels = gl.BufferTexture(self._buffer, gl.R32UI)
        self.nbytes = self._buffer.size

    def find(self, surface: RenderTarget) -> None:
        """Find it of the depths that were drawn so far."""
        gpu = surface.gpu
        program = gpu.compute("chunks/farthest.comp", {"TILE": _TILE})
        with gpu.timers.measure("farthest"):
            surface.depths.bind(Texture.DEPTHS)
            self._buffer.bind_to_storage_buffer(Storage.FARTHEST_TILES)
            gpu.dispatch(program, self._tiles)

    def release(self) -> None:
        """Delete it."""
        self.texels.release()
