"""How long each way from points to splats takes, in one run. Prints a table.

    python tests/speed/splats.py [--counts 100000 1000000] [--size 1920x1280] [--rounds 5] [--away 1]
                                 [--ways tiles ...] [--set key=value]

A sphere that fills half of the picture (--away 1) with radii of 1.5 times the spacing, in random order and
in that of a scanner; ways take turns, so that a change of the machine's speed hits all alike. Least wall
time, and least processor time of the process (all threads) over 2: what two free cores would take if the work
splits evenly, whoever else uses the machine. Drawing alone, without shading and reading back.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from viewer.backends import FrameView, backend
from viewer.camera import Camera
from viewer.drawing.renderer import Renderer
from viewer.gpu.pose import GpuPose
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.view import View

SURFELS = backend("surfels")
WAYS = next(p.choices for p in SURFELS.parameters if p.name == "instancing")
ORDERS = ("random", "scan")


def sphere(count: int, order: str) -> PointCloud:
    """Even points of a unit sphere. order: random, or columns of equal azimuth, top to bottom."""
    i = np.arange(count) + 0.5
    polar, turn = np.arccos(1 - 2 * i / count), np.pi * (1 + 5**0.5) * i
    points = np.stack([np.cos(turn) * np.sin(polar), np.cos(polar), np.sin(turn) * np.sin(polar)], axis=1)
    spacing = (4 * np.pi / count) ** 0.5
    if order == "scan":
        column = np.floor(np.arctan2(points[:, 2], points[:, 0]) / spacing)
        points = points[np.lexsort((points[:, 1], column))]
    else:
        points = np.random.default_rng(1).permutation(points)
    return PointCloud.from_arrays(points, normals=points, radii=np.full(count, 1.5 * spacing))


def turns(
    pose: GpuPose, surface: Surface, ways: list[str], settings: dict[str, str], rounds: int
) -> dict[str, list[float]]:
    """(wall, processor / 2) milliseconds of each way, the least of some rounds after a warm-up."""
    gpu = surface.gpu
    times: dict[str, list[list[float]]] = {way: [] for way in ways}
    for turn in range(rounds + 1):
        for way in ways:
            frame = FrameView(surface.view, SURFELS.params({**settings, "instancing": way}))
            gpu.ctx.finish()
            wall, cpu = time.perf_counter(), time.process_time()
            SURFELS.draw(pose, frame, surface)
            gpu.ctx.finish()
            if turn:
                times[way].append([(time.perf_counter() - wall) * 1e3, (time.process_time() - cpu) * 500])
    return {way: np.min(values, axis=0).tolist() for way, values in times.items()}


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--counts", type=int, nargs="+", default=[100_000, 1_000_000])
    arguments.add_argument("--size", default="1920x1280")
    arguments.add_argument("--rounds", type=int, default=5)
    arguments.add_argument("--away", type=float, default=1.0, help="factor on the camera's distance")
    arguments.add_argument("--ways", nargs="+", default=list(WAYS), choices=WAYS)
    arguments.add_argument("--set", action="append", default=[], metavar="key=value")
    options = arguments.parse_args()
    width, height = (int(n) for n in options.size.split("x"))
    settings = dict(setting.split("=", 1) for setting in options.set)

    gpu = Renderer().gpu
    surface = Surface(gpu, (width, height))
    print(f"{gpu.device}, {width}x{height}, least of {options.rounds}: wall ms (processor ms / 2)")
    print(f"{'points':>10} {'order':8}" + "".join(f"{way:>16}" for way in options.ways))
    for count in options.counts:
        for order in ORDERS:
            pose = GpuPose(gpu, Pose(0, 0.0, "sphere", sphere(count, order)))
            eye = options.away * np.array([0.3, 0.5, 2.6])
            camera = Camera(eye=tuple(eye), target=(0, 0, 0), fov_y=46)
            surface.start(pose, View.of(camera, surface.size, pose.cloud.origin, pose.bounds))
            result = turns(pose, surface, options.ways, settings, options.rounds)
            cells = (f"{wall:9.0f} ({cpu:4.0f})" for wall, cpu in result.values())
            print(f"{count:10,} {order:8}" + "".join(cells), flush=True)


if __name__ == "__main__":
    main()
