"""Previews made soft: few pixels, shown on many, without steps and without holes between splats."""

from __future__ import annotations

from . import gl
from .bindings import Storage, Texture
from .context import Gpu
from .surface import Surface

_HOLE = 7  # of the 8 pixels around: two holes side by side count, the line between closed lips does not
_RUN = 16  # pixels that an invocation goes along


def soften(surface: Surface) -> None:
    """Close the holes of a pixel or two in the picture of a shaded surface, through which something far
    behind is seen, then replace the picture by its mean over 3 x 3 pixels. Depths and rows stay."""
    gpu, (width, height) = surface.gpu, surface.size
    room = surface.keep(_Room)
    picture = surface.take_picture()
    with gpu.timers.measure("soften"):
        surface.bind_view()
        surface.bind_textures()
        for step, (source, target) in enumerate(((room.before, room.closed.buffer), (room.closed, picture))):
            if step == 0:
                gpu.ctx.copy_buffer(source.buffer, picture)
            source.bind(Texture.SHADED)
            target.bind_to_storage_buffer(Storage.PICTURE)
            program = gpu.compute("shade/soften.comp", {"STEP": step, "HOLE": _HOLE, "RUN": _RUN})
            gpu.dispatch(program, -(-width // _RUN) * height)


class _Room:
    """Two pictures as texels: as it was, and without its holes."""

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        nbytes = 4 * size[0] * size[1]
        self.before, self.closed = (gl.BufferTexture(gpu.ctx.buffer(reserve=nbytes), gl.R32UI) for _ in "ab")
        self.nbytes = 2 * nbytes

    def release(self) -> None:
        self.before.release()
        self.closed.release()
