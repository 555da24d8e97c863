"""Kept: the points that a picture shows are drawn again in the next one that moves, with some others in turn.

Schütz, Mandlburger, Otepka and Wimmer 2020, "Progressive Real-Time Rendering of One Billion Points Without
Hierarchical Acceleration Structures": what was seen is drawn at its exact new position, and what comes into
view is found by a part of all points that is another one each time. Where the camera rests, the picture is
the one of all points, to the bit, once each was in its turn, but for gaps that are closed.
"""

from __future__ import annotations

from ..gpu import gl
from ..gpu.bindings import Texture
from ..gpu.compact import IndexList
from ..gpu.context import Gpu
from ..gpu.pose import GpuPose
from ..picture.target import RenderTarget

_RUN = 8  # pixels that an invocation of points/kept.comp looks at


class ClosedGaps:
    """Room for the depths and rows of a picture as they were before its gaps are closed."""

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self._copies = [
            gl.BufferTexture(gpu.buffer(reserve=4 * size[0] * size[1]), gl.R32UI) for _ in range(2)
        ]
        self.nbytes = 8 * size[0] * size[1]

    def close(self, target: RenderTarget, step_depth: float) -> None:
        """Close gaps of one pixel between points: where three of the four pixels around are nearer by more
        than that, scan units, the nearest of them is shown."""
        gpu = target.gpu
        program = gpu.compute("points/gaps.comp")
        gpu.set(program, step_depth=step_depth)
        with gpu.timers.measure("gaps"):
            for copy, unit, texels in zip(
                self._copies, (Texture.DEPTHS, Texture.ROWS), (target.depths, target.rows), strict=True
            ):
                gpu.ctx.copy_buffer(copy.buffer, texels.buffer)
                copy.bind(unit)
            target.bind_storage()
            gpu.dispatch(program, target.size[0] * target.size[1])

    def release(self) -> None:
        """Delete it."""
        for copy in self._copies:
            copy.release()


class KeptPoints:
    """The points of a pose that a picture showed, and whose turn it is of the others. Made with
    `GpuPose.cached`."""

    def __init__(self, pose: GpuPose) -> None:
        self._gpu = pose.gpu
        self._listed: IndexList | None = None
        self._turn = 0

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return 0 if self._listed is None else self._listed.nbytes

    def release(self) -> None:
        """Delete the list."""
        if self._listed is not None:
            self._listed.release()

    def list_shown(self, target: RenderTarget) -> IndexList:
        """The rows that a picture shows, most of them once, in the order of its pixels as far as the driver
        keeps it."""
        gpu, (width, height) = self._gpu, target.size
        if self._listed is None or self._listed.capacity < width * height:
            self.release()
            self._listed = IndexList(gpu, width * height)
        listed = self._listed
        program = gpu.compute("points/kept.comp", {"RUN": _RUN})
        gpu.set(program, width=width, pixel_count=width * height)
        with gpu.timers.measure("kept"):
            listed.clear()
            listed.bind()
            target.rows.bind(Texture.ROWS)
            gpu.dispatch(program, -(-width * height // _RUN))
        return listed

    def next_turn(self) -> int:
        """The number of the part whose turn it is, another one at each call."""
        self._turn = (self._turn + 1) & 0xFFFFFF
        return self._turn


def stride_of(share: float) -> int:
    """How many parts points are in, one of which is about such a share of them."""
    return max(round(1 / share), 2)
