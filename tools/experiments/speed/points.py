"""How fast the points backend is beside plain GL_POINTS.

All draw the same cloud for the same camera, in its own colours, with the picture read back. Medians, and how
many times as long GL_POINTS takes."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Iterator
from functools import partial

import moderngl
import numpy as np
from numpy.typing import NDArray

from experiments.pictures import renderer
from experiments.script import Script
from experiments.speed.clouds import dented_sphere
from experiments.tables import Row
from experiments.timing import by_turns
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.request import Request
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.view import View

VERTEX = """#version 430
layout(location = 0) in vec3 position; layout(location = 1) in vec4 color;
uniform mat4 to_clip; out vec4 point_color;
void main() { gl_Position = to_clip * vec4(position, 1.0); point_color = color; }"""
FRAGMENT = """#version 430
in vec4 point_color; out vec4 color;
void main() { color = point_color; }"""
PLAIN = "GL_POINTS"
_FRESH = 1_000_000  # points up to which a new pose for each picture is measured


def clip_of(view: View) -> NDArray[np.float64]:
    """The matrix from positions to clip space, (4, 4), of a view in perspective; depth is reversed."""
    clip, world = np.zeros((4, 4)), np.eye(4)
    clip[0, 0], clip[1, 1] = 2 * view.scale / view.size[0], 2 * view.scale / view.size[1]
    clip[2, 3], clip[3, 2] = view.near, -1
    world[:3, :3], world[:3, 3] = view.rotation, view.translation
    return clip @ world


class PlainPoints:
    """What a viewer does without Scan4D: GL_POINTS from two vertex buffers."""

    def __init__(self, ctx: moderngl.Context, cloud: PointCloud, view: View) -> None:
        self.ctx, self.count = ctx, len(cloud)
        self.program = ctx.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        self.vertices = ctx.vertex_array(
            self.program,
            [(ctx.buffer(cloud.positions), "3f", "position"), (ctx.buffer(cloud.colors), "4f1", "color")],
        )
        self.aim(view)
        self.target = ctx.framebuffer([ctx.texture(view.size, 4)], ctx.depth_texture(view.size))
        self.picture = bytearray(4 * view.size[0] * view.size[1])

    def aim(self, view: View) -> None:
        """Draw from this view from now on."""
        self.program["to_clip"].write(  # type: ignore[union-attr]
            clip_of(view).T.astype(np.float32).tobytes()
        )

    def draw(self) -> None:
        """Draw and read the picture."""
        self.render()
        self.read()

    def render(self) -> None:
        """Draw, without waiting."""
        self.target.use()
        self.ctx.enable_only(moderngl.DEPTH_TEST)
        self.ctx.depth_func = ">"
        self.target.clear(depth=0.0)
        self.vertices.render(moderngl.POINTS, vertices=self.count)

    def read(self) -> None:
        """Read the picture."""
        self.target.read_into(self.picture, components=4)


def _next(fresh: Iterator[Pose], frame: Callable[[Pose, Look], None], look: Look) -> None:
    """Draw the next pose."""
    frame(next(fresh), look)


def points(options: Namespace) -> Iterator[Row]:
    """The backend without light, with its default look, and with another pose in each picture."""
    surface, flat = Surface(renderer().gpu, options.size), Look(light="flat")
    for count in options.counts:
        cloud = dented_sphere(count)
        pose = Pose(0, 0.0, "sphere", cloud)
        camera = Camera.orbit(cloud.bounds(), 20, 15, aspect=options.size[0] / options.size[1])
        view = View.of(camera, surface.size, cloud.origin, cloud.bounds())

        def frame(pose: Pose, look: Look, camera: Camera = camera) -> None:
            render_frame(renderer(), Request(pose, camera, "points", None, look), surface)
            surface.image()

        methods: dict[str, Callable[[], None]] = {
            PLAIN: PlainPoints(renderer().gpu.ctx, cloud, view).draw,
            "points, flat": partial(frame, pose, flat),
            "points, eye-dome": partial(frame, pose, Look()),
        }
        if count <= _FRESH:
            fresh = iter([Pose(i, 0.0, "new", dented_sphere(count, i)) for i in range(options.rounds + 1)])
            methods["points, flat, new pose"] = partial(_next, fresh, frame, flat)
        taken = by_turns(methods, options.rounds)
        for name, (wall, busy) in taken.items():
            times = {"ms": wall, "processor, ms": busy, f"{PLAIN} : it": taken[PLAIN].wall / wall}
            yield {"points": count, "method": name, **times}


EXPERIMENT = Script([points], {"counts": [100_000, 1_000_000, 10_000_000], "size": (1920, 1280), "rounds": 7})
