"""Backs: splats that face away are drawn where they are seen between those that face the eye.

On a closed surface nothing that faces away is seen, but at the outline, where discs of the far side stick
out: drawn there, they widen it, and hide what lies beside it. Through a hole, from inside, or where normals
face the wrong way they are all that is seen. So what faces the eye is drawn first. Where the centre of a
splat that faces away lies before that, the splats around are drawn as well, no others. That goes by the view
alone, not by what is known of the scan: nothing has to be closed, or found for each pose.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ...gpu import gl
from ...gpu.amplify import Points, amplify
from ...gpu.bindings import Storage, Texture
from ...gpu.compact import IndexList
from ...gpu.context import Gpu
from ...gpu.surface import Surface
from .splats import FRAGMENT, SURFEL, Splats

_CELL = 8  # pixels along the edges of cells that are marked
_MOST_CELLS = 32  # marked to each side of a centre
_LITTLE = -0.1  # cosine of the angle to the eye, above which a splat may be part of the outline
_NEAR_BY = 40.0  # radii: depths of one outline, as the surface bends away


class _Backs:
    """The backs that are seen in a picture, the cells that are marked round them, and the points' normals, of
    which some are turned."""

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self._gpu = gpu
        width, height = (-(-edge // _CELL) for edge in size)
        self.marks = gl.BufferTexture(gpu.ctx.buffer(reserve=4 * width * height), gl.R32UI)
        self.seen = IndexList(gpu, 1)
        self._normals: gl.BufferTexture | None = None

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        normals = self._normals.buffer.size if self._normals else 0
        return self.marks.buffer.size + self.seen.nbytes + normals

    def start(self, count: int) -> None:
        """Nothing is seen or marked of so many."""
        if self.seen.capacity != max(count, 1):
            self._gpu.discard(self.seen)
            self.seen = IndexList(self._gpu, max(count, 1))
        self.seen.clear()
        gl.clear_words(self.marks.buffer, 0)

    def normals(self, count: int) -> gl.BufferTexture:
        """Room for the normals of so many rows."""
        if self._normals is None or self._normals.buffer.size != 12 * count:
            self._gpu.discard(self._normals)
            self._normals = gl.BufferTexture(self._gpu.ctx.buffer(reserve=12 * count), gl.RGB32F)
        return self._normals

    def release(self) -> None:
        """Delete everything."""
        self._gpu.discard(self.marks, self.seen, self._normals)


def leave_out_unseen(points: Points, surface: Surface, splats: Splats, bind: Callable[[], None]) -> None:
    """Have the lists of tiles forget the discs that face away and are not to be drawn. `surface` holds what
    faces the eye; bind: binds what the lists know, as shaders/surfels/backs/ read and change it."""
    bind()
    _mark(points, surface, splats, tiled=True)
    bind()
    _choose(points, surface, splats, tiled=True)


def seen(points: Points, surface: Surface, feed: str, splats: Splats) -> tuple[Points, Splats]:
    """The points, and how they are drawn, such that the rasteriser leaves out what `Splats.trims` asks for;
    draws what faces the eye for that."""
    if not splats.trims:
        return points, splats
    culled = replace(splats, trims=False, cull_back=True)
    amplify(points, surface, feed, SURFEL, FRAGMENT, culled)
    _mark(points, surface, splats, tiled=False)
    normals = surface.keep(_Backs).normals(len(points.pose.cloud))
    normals.buffer.bind_to_storage_buffer(Storage.TURNED)
    _choose(points, surface, splats, tiled=False)
    return replace(points, buffers={**points.buffers, "normals": normals}), culled


def _mark(points: Points, surface: Surface, splats: Splats, tiled: bool) -> None:
    """Find the backs that are seen, and mark the cells round them."""
    gpu, backs = surface.gpu, surface.keep(_Backs)
    backs.start(points.count)
    defines = {"CELL": _CELL, "TILED": int(tiled), **points.defines}
    with gpu.timers.measure("backs"):
        program = gpu.compute("surfels/backs/find.comp", defines, params=splats)
        points.bind(program)
        surface.depths.bind(Texture.DEPTHS)
        backs.seen.bind()
        gpu.dispatch(program, points.count)
        limits = {"MOST_CELLS": _MOST_CELLS, "LITTLE": _LITTLE, "NEAR_BY": _NEAR_BY}
        program = gpu.compute("surfels/backs/mark.comp", {**defines, **limits}, params=splats)
        points.bind(program)
        backs.marks.buffer.bind_to_storage_buffer(Storage.MARKS)
        backs.seen.run(program)


def _choose(points: Points, surface: Surface, splats: Splats, tiled: bool) -> None:
    gpu = surface.gpu
    with gpu.timers.measure("backs"):
        defines = {"CELL": _CELL, "TILED": int(tiled), **points.defines}
        program = gpu.compute("surfels/backs/choose.comp", defines, params=splats)
        points.bind(program)
        surface.keep(_Backs).marks.bind(Texture.MARKS)
        gpu.dispatch(program, points.count)
