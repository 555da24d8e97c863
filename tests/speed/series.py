"""How fast a new pose is drawn in each picture, as a scan plays that is in memory. Prints a table.

    python tests/speed/series.py [--counts 100000 1000000] [--size 1920x1280] [--poses 12] [--cores 2]

A dented sphere in the order of a scanner moves: positions and normals are new in each pose, colours
and radii the same in all, or equal and copied for each ("copies"). Pictures are read back. In motion discs
are not blended, as in the window while it plays with nothing left out; at rest they are blended, and
each pose is looked at for gaps. Medians: wall time, processor time of all threads over the cores, and the
pictures a second that this makes; of these parts, and bytes that came to the GPU.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np
from points import cloud_of
from turning import cpu_ms

from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

ROWS = (("points", True), ("surfels", True), ("surfels", False))


def moments(count: int, poses: int) -> list[PointCloud]:
    """The poses, which share what is the same in them."""
    cloud = cloud_of(count)
    order = np.lexsort((cloud.positions[:, 0], np.round(cloud.positions[:, 2] * np.sqrt(count) / 4)))
    first = cloud.of_rows(order)
    radii = np.full(count, 1.5 * np.sqrt(4 * np.pi / count), np.float32)
    played = []
    for number in range(poses):
        wave = 1 + 0.02 * np.sin(0.3 * number + 3 * first.positions[:, 2:])
        positions = (first.positions * wave).astype(np.float32)
        normals = positions / np.linalg.norm(positions, axis=1, keepdims=True)
        played.append(replace(first, positions=positions, normals=normals, radii=radii, ids=None))
    return played


def main() -> None:
    arguments = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    arguments.add_argument("--counts", type=int, nargs="+", default=[100_000, 1_000_000])
    arguments.add_argument("--size", default="1920x1280")
    arguments.add_argument("--poses", type=int, default=12)
    arguments.add_argument("--cores", type=int, default=2)
    options = arguments.parse_args()
    width, height = (int(n) for n in options.size.split("x"))
    renderer = Renderer(budget_bytes=4 << 30)
    surface = Surface(renderer.gpu, (width, height))
    print(f"{renderer.gpu.device}, {width}x{height}, medians of {options.poses - 2} poses")
    print(
        f"{'points':>10} {'renderer':16} {'arrays':7} {'wall ms':>8} {'cpu ms':>7} {'fps':>6} "
        f"{'upload':>7} {'derive':>7} {'MB':>6}"
    )
    for count in options.counts:
        shared = moments(count, options.poses)
        camera = Camera.orbit(shared[0].bounds(), 20, 15, aspect=width / height)
        for backend, moving in ROWS:
            held: list[Pose] = []  # as the window's cache holds them
            times: dict[str, list[tuple[float, ...]]] = {"shared": [], "copies": []}
            for number, cloud in enumerate(shared):
                assert cloud.colors is not None
                assert cloud.radii is not None
                assert cloud.normals is not None
                own = replace(
                    cloud,
                    positions=cloud.positions.copy(),
                    normals=cloud.normals.copy(),
                    colors=cloud.colors.copy(),
                    radii=cloud.radii.copy(),
                )
                for name, each in (("shared", cloud), ("copies", own)):
                    pose = Pose(number, float(number), name, replace(each))
                    held.append(pose)
                    for measured in (False, True) if moving and not number else (True,):
                        start, cpu = time.perf_counter(), cpu_ms()
                        request = Request(pose, camera, backend)
                        render_frame(renderer, request, surface, moving=moving and measured)
                        surface.image()
                    wall, used = (time.perf_counter() - start) * 1e3, (cpu_ms() - cpu) / options.cores
                    stats = surface.stats
                    megabytes = stats.uploaded_bytes / 1e6
                    times[name].append((wall, used, stats.upload_ms, stats.derive_ms, megabytes))
            for name, rows in times.items():
                wall, used, upload, derive, megabytes = np.median(rows[2:], axis=0)
                label = f"{backend}, {'moving' if moving else 'at rest'}"
                print(
                    f"{count:10,} {label:16} {name:7} {wall:8.1f} {used:7.1f} {1e3 / used:6.1f} "
                    f"{upload:7.1f} {derive:7.1f} {megabytes:6.1f}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
