"""How fast the points backend is beside plain GL_POINTS, in one run. Prints a table.

    python tests/speed/points.py [--counts 100000 1000000 10000000] [--size 1920x1280] [--rounds 7]

Every row is the same cloud, in the same context, seen by the same camera, drawn in its own
colours, with the picture read back; methods take turns, so that a change of the machine's
speed hits all alike. Medians, and ratios of medians.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable

import moderngl
import numpy as np

from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
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


def cloud_of(count: int, seed: int = 0) -> PointCloud:
    """A dented sphere, `count` points in random order, coloured by position."""
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((count, 3), dtype=np.float32)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    points *= 1 + 0.15 * np.sin(7 * points[:, :1]) * np.cos(5 * points[:, 1:2])
    return PointCloud.from_arrays(points, colors=np.clip(points * 0.4 + 0.5, 0, 1), origin=np.zeros(3))


class PlainPoints:
    """What a viewer does without Scan4D: GL_POINTS from two vertex buffers."""

    def __init__(self, ctx: moderngl.Context, cloud: PointCloud, view: View) -> None:
        self.ctx, self.count = ctx, len(cloud)
        self.program = ctx.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        self.vertices = ctx.vertex_array(
            self.program,
            [(ctx.buffer(cloud.positions), "3f", "position"), (ctx.buffer(cloud.colors), "4f1", "color")],
        )
        width, height = view.size
        clip = np.zeros((4, 4))
        clip[0, 0], clip[1, 1] = 2 * view.scale / width, 2 * view.scale / height
        clip[2, 3], clip[3, 2] = view.near, -1
        world = np.eye(4)
        world[:3, :3], world[:3, 3] = view.rotation, view.translation
        self.program["to_clip"].write((clip @ world).T.astype(np.float32).tobytes())
        self.target = ctx.framebuffer([ctx.texture(view.size, 4)], ctx.depth_texture(view.size))
        self.picture = bytearray(4 * width * height)

    def draw(self) -> None:
        self.target.use()
        self.ctx.enable_only(moderngl.DEPTH_TEST)
        self.ctx.depth_func = ">"
        self.target.clear(depth=0.0)
        self.vertices.render(moderngl.POINTS, vertices=self.count)
        self.target.read_into(self.picture, components=4)


def medians(methods: dict[str, Callable[[], None]], rounds: int) -> dict[str, float]:
    """Milliseconds of each method, taking turns after one warm-up."""
    times: dict[str, list[float]] = {name: [] for name in methods}
    for turn in range(rounds + 1):
        for name, draw in methods.items():
            start = time.perf_counter()
            draw()
            if turn:
                times[name].append((time.perf_counter() - start) * 1e3)
    return {name: float(np.median(values)) for name, values in times.items()}


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--counts", type=int, nargs="+", default=[100_000, 1_000_000, 10_000_000])
    arguments.add_argument("--size", default="1920x1280")
    arguments.add_argument("--rounds", type=int, default=7)
    options = arguments.parse_args()
    width, height = (int(n) for n in options.size.split("x"))

    renderer = Renderer()
    surface = Surface(renderer.gpu, (width, height))
    looks = {"flat": Look(light="flat"), "eye-dome": Look()}
    print(f"{renderer.gpu.device}, {width}x{height}, median of {options.rounds} frames, ms")
    print(f"{'points':>12} {'method':24} {'ms':>9} {'GL_POINTS / it':>15}")
    for count in options.counts:
        cloud = cloud_of(count)
        pose = Pose(0, 0.0, "sphere", cloud)
        camera = Camera.orbit(cloud.bounds(), 20, 15, aspect=width / height)
        plain = PlainPoints(
            renderer.gpu.ctx, cloud, View.of(camera, surface.size, cloud.origin, cloud.bounds())
        )

        def frame(pose: Pose, look: Look) -> None:
            render_frame(renderer, Request(pose, camera, "points", None, look), surface)  # noqa: B023
            surface.image()

        methods = {"GL_POINTS": plain.draw}
        for name, look in looks.items():
            methods[f"points, {name}"] = lambda pose=pose, look=look: frame(pose, look)
        if count <= 1_000_000:
            fresh = iter([Pose(i, 0.0, "new", cloud_of(count, i)) for i in range(options.rounds + 1)])
            methods["points, flat, new pose"] = lambda fresh=fresh: frame(next(fresh), looks["flat"])
        result = medians(methods, options.rounds)
        for name, ms in result.items():
            print(f"{count:12,} {name:24} {ms:9.2f} {result['GL_POINTS'] / ms:14.1f}x")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"peak memory of the process: {peak:.0f} MiB")


if __name__ == "__main__":
    main()
