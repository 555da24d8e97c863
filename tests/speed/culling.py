"""What is gained by leaving out chunks of points that a picture cannot show, in one run. Prints a table.

    python tests/speed/culling.py [--counts 1000000 10000000] [--size 1920x1280] [--rounds 7]

A sphere whole in view, a close-up of it, beside the picture, and five spheres in one another, all in random
order, once the points are in an order of their own; `points` with pixels and with squares that touch. Each
with and without, by turns, on one surface: least processor time of all threads, and in brackets least wall
time, the picture read back. Drawn: the share of the points in chunks that were not left out.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from points import cloud_of

from viewer.backends import backend
from viewer.camera import Camera
from viewer.frame import Request, render_frame
from viewer.gpu import chunks
from viewer.gpu.surface import Surface
from viewer.look import Look
from viewer.renderer import Renderer
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

RADII = (1.0, 0.9, 0.8, 0.7, 0.6)
LEAST = chunks.LEAST


def shells(count: int) -> PointCloud:
    """Five spheres in one another, of as many points each."""
    rng = np.random.default_rng(0)
    points = rng.standard_normal((count, 3), dtype=np.float32)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    points *= rng.permutation(np.resize(np.array(RADII, np.float32), count))[:, None]
    return PointCloud.from_arrays(points, colors=np.clip(points * 0.4 + 0.5, 0, 1), origin=np.zeros(3))


def moved(camera: Camera, distance: float | None) -> Camera:
    """The camera so far from its target; None: it looks the other way."""
    eye, target = np.array(camera.eye), np.array(camera.target)
    if distance is None:
        return replace(camera, target=tuple(2 * eye - target))
    return replace(camera, eye=tuple(target + distance * (eye - target) / np.linalg.norm(eye - target)))


def least(draw: Callable[[bool], None], rounds: int) -> dict[bool, tuple[float, float]]:
    """Processor and wall milliseconds with and without."""
    times: dict[bool, list[tuple[float, float]]] = {True: [], False: []}
    for _ in range(rounds + 1):
        for culled in times:
            processor, wall = time.process_time(), time.perf_counter()
            draw(culled)
            times[culled].append(
                ((time.process_time() - processor) * 1e3, (time.perf_counter() - wall) * 1e3)
            )
    processors, walls = ({c: min(pair[i] for pair in t[1:]) for c, t in times.items()} for i in (0, 1))
    return {culled: (processors[culled], walls[culled]) for culled in times}


def drawn(surface: Surface, count: int) -> float:
    """The share of the points in chunks that were not left out."""
    if "chunks" in surface.stats.counted:
        chunked = surface.stats.counted["chunks"]()
        return chunked["shown"] / sum(chunked.values())
    return 1 - int(surface.stats.skipped["points"].split()[0].replace(",", "")) / count


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--counts", type=int, nargs="+", default=[1_000_000, 10_000_000])
    arguments.add_argument("--size", default="1920x1280")
    arguments.add_argument("--rounds", type=int, default=7)
    options = arguments.parse_args()
    width, height = (int(n) for n in options.size.split("x"))
    renderer = Renderer()
    surface = Surface(renderer.gpu, (width, height))
    print(f"{renderer.gpu.device}, {width}x{height}, least of {options.rounds}, processor (wall) ms")
    print(
        f"{'points':>12} {'scene':18} {'squares':>8} {'without':>16} {'with':>16} {'ratio':>6} {'drawn':>6}"
    )

    def draw(culled: bool) -> None:
        chunks.LEAST = LEAST if culled else 1 << 31
        render_frame(renderer, request, surface)
        surface.image()

    for count in options.counts:
        for name, cloud in (("sphere", cloud_of(count)), ("five shells", shells(count))):
            pose, whole = (
                Pose(0, 0.0, name, cloud),
                Camera.orbit(cloud.bounds(), 20, 15, aspect=width / height),
            )
            views = {"": whole, ", close-up": moved(whole, 1.25), ", beside": moved(whole, None)}
            for view, camera in views.items() if name == "sphere" else [("", whole)]:
                for size, edge in (("1 pixel", 1), ("touching", 0)):
                    params = backend("points").params({"point_size": edge})
                    request = Request(pose, camera, "points", params, Look(light="flat"))
                    end = time.monotonic() + 60
                    while time.monotonic() < end:
                        draw(True)
                        if surface.stats.counted or "points" in surface.stats.skipped:
                            break
                        time.sleep(0.1)
                    taken = least(draw, options.rounds)
                    draw(True)
                    without, culled = (f"{taken[c][0]:7.1f} ({taken[c][1]:.1f})" for c in (False, True))
                    times = f"{without:>16} {culled:>16} {taken[True][0] / taken[False][0]:6.2f}"
                    print(f"{count:12,} {name + view:18} {size:>8} {times} {drawn(surface, count):6.0%}")


if __name__ == "__main__":
    main()
