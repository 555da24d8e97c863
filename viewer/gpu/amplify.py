"""Amplify: a feed brings each point to a shape, which makes it a quad or a cube (Slomp 2014, IV)."""

from __future__ import annotations

import math
from typing import Any

import moderngl

from .pose import GpuPose
from .surface import Surface

# Feed -> the stages that bring points to a shape; the fragment stage is the shape's own.
_STAGES = {"gs": ("amplify/gs.vert", "amplify/gs.geom")}
FEEDS = tuple(_STAGES)


def amplify(
    pose: GpuPose,
    surface: Surface,
    feed: str,
    shape: str,
    fragment: str,
    use_radii: bool,
    share: float = 1.0,
    **uniforms: Any,
) -> bool:
    """Draw the points of a pose as shapes, in id order with a strict depth test.

    feed: one of FEEDS. shape: the shader file with `begin_shape` and `corner`. fragment:
    the shape's fragment shader, which writes a row and a depth. use_radii: whether points
    bring their own radius. share: of the points that are drawn, enlarged (the shape multiplies
    by the uniform `enlarged`) so that together they cover what all do; 1: all. uniforms: of
    both. Returns whether points were left out.
    """
    gpu, count = pose.gpu, len(pose.cloud)
    target = surface.raster()
    rows, drawn = surface.take_sample(share)
    program = gpu.program((*_STAGES[feed], fragment), {"HAS_RADIUS": int(use_radii)}, {"shape": shape})
    gpu.set(program, enlarged=math.sqrt(count / drawn) if drawn else 1.0, **uniforms)
    with gpu.timers.measure("splat"):
        target.clear()
        gpu.ctx.enable_only(moderngl.DEPTH_TEST)
        gpu.ctx.depth_func = ">"  # reversed depth: near is 1
        if drawn:
            attributes = [("positions", "3f", "in_position"), ("normals", "3f", "in_normal")]
            attributes += [("radii", "1f", "in_radius")] if use_radii else []
            content = [(pose.array(name).buffer, form, attribute) for name, form, attribute in attributes]
            vertices = gpu.ctx.vertex_array(program, content, index_buffer=rows and rows.buffer)
            vertices.render(moderngl.POINTS, vertices=drawn)
            vertices.release()
    with gpu.timers.measure("copy"):
        surface.take_raster()
    return drawn < count
