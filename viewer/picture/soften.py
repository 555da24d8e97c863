"""Previews made soft: few pixels, shown on many, without steps and without holes between splats."""

from __future__ import annotations

from ..gpu import gl
from ..gpu.bindings import Storage, Texture
from ..gpu.context import Gpu
from .surface import Surface

_HOLE = 7  # of the 8 pixels around: two holes side by side count, the line between closed lips does not
_RUN = 16  # pixels that an invocation goes along


def soften(surface: Surface) -> None:
    """Close the holes of a pixel or two in the picture of a shaded surface, through which something far
    behind is seen, then replace the picture by its mean over 3 x 3 pixels. Depths and rows stay."""
    gpu, (width, height) = surface.gpu, surface.size
    before, picture = surface.cached(_Before).texels, surface.take_picture()
    with gpu.timers.measure("soften"):
        surface.bind_view()
        surface.bind_textures()
        before.bind(Texture.SHADED)
        picture.bind_to_storage_buffer(Storage.PICTURE)
        for step in range(2):
            gpu.ctx.copy_buffer(before.buffer, picture)
            program = gpu.compute("shade/soften.comp", {"STEP": step, "HOLE": _HOLE, "RUN": _RUN})
            gpu.dispatch(program, -(-width // _RUN) * height)


class _Before:
    """A picture as it was, as texels."""

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self.nbytes = 4 * size[0] * size[1]
        self.texels = gl.BufferTexture(gpu.buffer(reserve=self.nbytes), gl.R32UI)

    def release(self) -> None:
        self.texels.release()
