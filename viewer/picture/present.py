"""From a Surface's picture to the window."""

from __future__ import annotations

import moderngl

from ..gpu.bindings import Texture
from ..gpu.context import Gpu
from .surface import Surface


class Presenter:
    """Copies shaded pictures to the window's framebuffer, one pixel to one pixel where they are as large."""

    def __init__(self, gpu: Gpu) -> None:
        self.gpu = gpu
        self._program = gpu.program(("present/present.vert", "present/present.frag"))
        self._triangle = gpu.ctx.vertex_array(self._program, [])
        self._texture: moderngl.Texture | None = None

    def present(
        self, surface: Surface, left: int, bottom: int, size: tuple[int, int], light: float = 1.0
    ) -> None:
        """Put the picture's lower left corner there, in pixels from the window's, stretched to that size.
        light: factor on its colours.

        The window's framebuffer is bound afterwards.
        """
        ctx = self.gpu.ctx
        texture = self._texture_of(surface.size)
        texture.write(surface.picture)
        texture.filter = (moderngl.NEAREST,) * 2 if surface.size == size else (moderngl.LINEAR,) * 2
        texture.use(Texture.PICTURE)
        self.gpu.set(self._program, corner=(left, bottom), size=size, light=light)
        ctx.screen.use()
        ctx.viewport = (left, bottom, *size)
        ctx.enable_only(moderngl.NOTHING)
        self._triangle.render(moderngl.TRIANGLES, vertices=3)

    @property
    def image(self) -> int | None:
        """The name of the texture that holds the last picture, its upper row first; None before."""
        return None if self._texture is None else self._texture.glo

    def _texture_of(self, size: tuple[int, int]) -> moderngl.Texture:
        if self._texture is None or self._texture.size != size:
            if self._texture is not None:
                self._texture.release()
            self._texture = self.gpu.ctx.texture(size, 4)
            self._texture.repeat_x = self._texture.repeat_y = False
        return self._texture

    def release(self) -> None:
        """Delete what it holds on the GPU."""
        self._triangle.release()
        if self._texture is not None:
            self._texture.release()
