"""From a Surface's picture to the window."""

from __future__ import annotations

import moderngl

from .surface import Surface


def present(surface: Surface, left: int, bottom: int) -> None:
    """Copy the shaded picture to the window, pixel by pixel.

    left, bottom: where its lower left corner goes, pixels from the window's lower left.
    The window's framebuffer is bound afterwards.
    """
    gpu = surface.gpu
    program = gpu.program(("present/present.vert", "present/present.frag"))
    triangle = gpu.keep("present", lambda: gpu.ctx.vertex_array(program, []))
    gpu.set(program, corner=(left, bottom), size=surface.size)
    surface.picture.bind_to_storage_buffer(0)
    gpu.ctx.screen.use()
    gpu.ctx.viewport = (left, bottom, *surface.size)
    gpu.ctx.enable_only(moderngl.NOTHING)
    triangle.render(moderngl.TRIANGLES, vertices=3)
