"""Amplify: a feed brings each point to a shape, which makes it a quad or a cube (Slomp 2014, IV)."""

from __future__ import annotations

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
    **uniforms: Any,
) -> None:
    """Draw every point of a pose as a shape, in id order with a strict depth test.

    feed: one of FEEDS. shape: the shader file with `begin_shape` and `corner`. fragment:
    the shape's fragment shader, which writes a row and a depth. use_radii: whether points
    bring their own radius. uniforms: of both.
    """
    gpu, count = pose.gpu, len(pose.cloud)
    target = surface.raster()
    program = gpu.program((*_STAGES[feed], fragment), {"HAS_RADIUS": int(use_radii)}, {"shape": shape})
    gpu.set(program, **uniforms)
    with gpu.timers.measure("splat"):
        target.clear()
        gpu.ctx.enable_only(moderngl.DEPTH_TEST)
        gpu.ctx.depth_func = ">"  # reversed depth: near is 1
        if count:
            attributes = [("positions", "3f", "in_position"), ("normals", "3f", "in_normal")]
            attributes += [("radii", "1f", "in_radius")] if use_radii else []
            content = [(pose.array(name).buffer, form, attribute) for name, form, attribute in attributes]
            vertices = gpu.ctx.vertex_array(program, content)
            vertices.render(moderngl.POINTS, vertices=count)
            vertices.release()
    with gpu.timers.measure("copy"):
        surface.take_raster()
