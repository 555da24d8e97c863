"""Culling: which chunks of a pose's points a picture may show, found while it is drawn.

Hierarchical z in two phases (Greene, Kass and Miller 1993): the chunks that the last picture showed are drawn
first; of the others only those that this depth leaves room for. What is left out has farther depths than all
pixels that it could cover, so the picture is the same to the bit.
"""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np

from ..view import View
from . import gl
from .bindings import Storage, Texture
from .chunks import Chunks
from .compact import IndexList
from .context import Gpu
from .pose import GpuPose
from .target import RenderTarget

_TILE = 16  # pixels along an edge, whose farthest depth hides chunks
_MOST_TILES = 1024  # that are looked at for one chunk; one that is larger in the picture counts as shown
_SLACK = 1.0  # pixels, for what float32 rounds
_ROUNDING = 1e-5  # of the pose's size, by which boxes are larger for the same reason
_NOW, _IN_VIEW = 2, 4  # bits of what is seen


@dataclass(frozen=True)
class _Culling:
    """Numbers that points/cull.comp reads. box_slack: scan units by which boxes are larger. pixel_margin:
    pixels around a point that it may cover."""

    box_slack: float
    pixel_margin: float


def culled_chunks(pose: GpuPose) -> CulledChunks | None:
    """The chunks of a pose whose points are in an order of use; None where they are not, or few."""
    counted_alike = (pose.origin == pose.cloud.origin).all()
    is_of_use = counted_alike and pose.keep(Chunks).take_order() is not None
    return pose.keep(CulledChunks) if is_of_use else None


class CulledChunks:
    """The chunks of a pose on the GPU: its points in their order, and which chunks pictures show.

    rows: the row of each point, in that order; None where they are in that of the file.
    """

    def __init__(self, pose: GpuPose) -> None:
        self._gpu = gpu = pose.gpu
        self._order = order = pose.keep(Chunks).known
        self.count, self._size = len(pose.cloud), order.chunk
        self._chunks = len(order.low)
        boxes = np.stack([order.low, order.high], axis=1)
        self._boxes = gl.BufferTexture(gpu.ctx.buffer(boxes), gl.RGB32F)
        self._seen = gpu.ctx.buffer(bytes(4 * self._chunks))
        self._lists = [IndexList(gpu, self._chunks, self._size) for _ in range(3)]
        self.rows = self._positions = None
        if order.rows is not None:
            self.rows = gl.BufferTexture(gpu.ctx.buffer(order.rows), gl.R32UI)
            in_order = pose.cloud.positions.take(order.rows, axis=0)
            self._positions = gl.BufferTexture(gpu.ctx.buffer(in_order), gl.RGB32F)
        self._slack = _ROUNDING * float(np.abs(boxes).max())

    @property
    def defines(self) -> dict[str, object]:
        """Macros of points/cells.glsl."""
        return {"CHUNKED": 1, "CHUNK": self._size, "SAMPLED": int(self.rows is not None)}

    def bind(self, pose: GpuPose) -> None:
        """Bind the positions and rows of the pose's points, in the order of chunks."""
        (self._positions or pose.array("positions")).bind(Texture.POSITIONS)
        if self.rows is not None:
            self.rows.bind(Texture.DRAWN_ROWS)

    def few(self, pose: GpuPose, view: View, margin: float, most: float) -> tuple[IndexList, int] | None:
        """The chunks that a view may show, and how many points that are, where these are at most so many: so
        few that looking for hidden ones would take longer. margin: as in `start`."""
        if view.holds(pose.bounds.corners() - view.origin):
            return None
        found = pose.keep(Chunks).shown_in(self._order, view, margin)
        if (points := min(len(found) * self._size, self.count)) > most:
            return None
        listed = self._lists[0]
        listed.write(found.astype(np.uint32))
        return listed, points

    def start(self, surface: RenderTarget, margin: float) -> IndexList:
        """The chunks to draw first. margin: pixels around a point that it may cover."""
        self._culling = _Culling(self._slack, margin + _SLACK)
        return self._list(surface, 0)

    def late(self, surface: RenderTarget) -> IndexList:
        """The chunks to draw beside these, when they are."""
        surface.keep(_Farthest).find(surface)
        return self._list(surface, 1)

    def shown(self, surface: RenderTarget) -> IndexList:
        """All chunks that the picture may show."""
        surface.stats.counted["chunks"] = self._counts
        return self._list(surface, 2)

    def _list(self, surface: RenderTarget, step: int) -> IndexList:
        gpu, listed = self._gpu, self._lists[step]
        defines = {"STEP": step, "CHUNK": self._size, "TILE": _TILE, "MOST_TILES": _MOST_TILES}
        program = gpu.compute("points/cull.comp", defines, params=self._culling)
        with gpu.timers.measure("cull"):
            listed.clear()
            listed.bind()
            self._boxes.bind(Texture.BOXES)
            self._seen.bind_to_storage_buffer(Storage.SEEN)
            surface.keep(_Farthest).texels.bind(Texture.FARTHEST_TILES)
            gpu.dispatch(program, self._chunks)
        return listed

    def _counts(self) -> dict[str, int]:
        """How many chunks were shown, hidden by what is before them, or out of view."""
        seen = np.frombuffer(self._seen.read(), np.uint32)
        shown, in_view = (int(np.count_nonzero(seen & bit)) for bit in (_NOW, _IN_VIEW))
        return {"shown": shown, "hidden": in_view - shown, "outside": self._chunks - in_view}

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        own = sum(texels.buffer.size for texels in self._texels)
        return own + self._seen.size + sum(listed.nbytes for listed in self._lists)

    @property
    def _texels(self) -> list[gl.BufferTexture]:
        return [texels for texels in (self._boxes, self._positions, self.rows) if texels is not None]

    def release(self) -> None:
        """Delete what it holds on the GPU."""
        self._seen.release()
        for listed in self._lists:
            listed.release()
        for texels in self._texels:
            texels.release()


class _Farthest:
    """The farthest depth of each tile of a picture."""

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self._tiles = -(-size[0] // _TILE) * -(-size[1] // _TILE)
        self._buffer: moderngl.Buffer = gpu.ctx.buffer(reserve=4 * self._tiles)
        self.texels = gl.BufferTexture(self._buffer, gl.R32UI)
        self.nbytes = self._buffer.size

    def find(self, surface: RenderTarget) -> None:
        """Find it of the depths that were drawn so far."""
        gpu = surface.gpu
        program = gpu.compute("points/farthest.comp", {"TILE": _TILE})
        with gpu.timers.measure("farthest"):
            surface.depths.bind(Texture.DEPTHS)
            self._buffer.bind_to_storage_buffer(Storage.FARTHEST_TILES)
            gpu.dispatch(program, self._tiles)

    def release(self) -> None:
        """Delete it."""
        self.texels.release()
