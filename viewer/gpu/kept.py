"""Kept: the points that a picture shows are drawn again in the next one that moves, with some others in turn.

Schütz, Mandlburger, Otepka and Wimmer 2020, "Progressive Real-Time Rendering of One Billion Points Without
Hierarchical Acceleration Structures": what was seen is drawn at its exact new place, and what comes into view
is found by a part of all points that is another one each time. Where the camera rests, the picture is the one
of all points, to the bit, once each was in its turn.
"""

from __future__ import annotations

from typing import NamedTuple

from .bindings import Texture
from .compact import IndexList
from .pose import GpuPose
from .target import RenderTarget

_RUN = 8  # pixels that an invocation of points/kept.comp looks at


class Before(NamedTuple):
    """A picture whose points are drawn again. known: see `Stats`."""

    target: RenderTarget
    known: float


class KeptPoints:
    """The points of a pose that a picture showed, and whose turn it is of the others. Made with
    `GpuPose.keep`."""

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
