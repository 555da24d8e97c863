"""What is gained by leaving out chunks of points that a picture cannot show, in one run. Prints a table.

    python tests/speed/culling.py [--backend points] [--counts 1000000 10000000] [--scan FOLDER]
                                  [--turn DEGREES] [--set key=value] [--size 1920x1280] [--rounds 7]

A sphere whole in view, a close-up that has a twentieth of its points in view, beside the picture, and five
spheres in one another, all in random order, once the points are in an order of their own: as `points`, with
pixels and with squares that touch, or by another backend, with normals and radii of 1.5 times the spacing. Or
the frames of a scan, all together, seen from where a scanner stood, looking four ways, and from above. Each
with and without, by turns, on one surface: least processor time of all threads, and in brackets least wall
time, the picture read back. Drawn: the share of the points in chunks that were not left out. turn: of the
camera from one picture to the next; then medians, as pictures differ.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from points import cloud_of

from viewer.backends import backend
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.gpu import chunks
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.view import View

RADII = (1.0, 0.9, 0.8, 0.7, 0.6)
CLOSE = 0.05  # of the points, in view in a close-up
LEAST = chunks.LEAST


def spheres(count: int, radii: tuple[float, ...]) -> PointCloud:
    """Spheres in one another, of as many points each."""
    rng = np.random.default_rng(0)
    normals = rng.standard_normal((count, 3), dtype=np.float32)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    sizes = rng.permutation(np.resize(np.array(radii, np.float32), count))
    spacing = 1.5 * (4 * np.pi * len(radii) / count) ** 0.5
    return PointCloud.from_arrays(
        normals * sizes[:, None],
        normals=normals,
        radii=sizes * spacing,
        colors=np.clip(normals * 0.4 + 0.5, 0, 1),
        origin=np.zeros(3),
    )


def moved(camera: Camera, distance: float | None) -> Camera:
    """The camera so far from its target; None: it looks the other way."""
    eye, target = np.array(camera.eye), np.array(camera.target)
    if distance is None:
        return replace(camera, target=tuple(2 * eye - target))
    return replace(camera, eye=tuple(target + distance * (eye - target) / np.linalg.norm(eye - target)))


def close_up(cloud: PointCloud, camera: Camera, size: tuple[int, int]) -> Camera:
    """The camera zoomed in until so many of the points are in view."""
    some = cloud.positions[::97]
    low, high = 0.5, camera.fov_y
    for _ in range(20):
        middle = (low + high) / 2
        view = View.of(replace(camera, fov_y=middle), size, cloud.origin, cloud.bounds())
        low, high = (low, middle) if view.contains(some).mean() > CLOSE else (middle, high)
    return replace(camera, fov_y=low)


def turned(camera: Camera, degrees: float) -> Camera:
    """The camera turned round its target, about the y-axis."""
    eye, target = np.array(camera.eye), np.array(camera.target)
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x, y, z = eye - target
    return replace(camera, eye=tuple(target + np.array([cos * x + sin * z, y, cos * z - sin * x])))


def spherical_scenes(
    counts: list[int], name: str, size: tuple[int, int]
) -> Iterator[tuple[str, PointCloud, Camera]]:
    """Clouds and cameras, by what they show."""
    for count in counts:
        one = cloud_of(count) if name == "points" else spheres(count, (1.0,))
        whole = Camera.orbit(one.bounds(), 20, 15, aspect=size[0] / size[1])
        yield "sphere", one, whole
        yield "close-up", one, close_up(one, whole, size)
        yield "beside", one, moved(whole, None)
        five = spheres(count, RADII)
        yield "five shells", five, Camera.orbit(five.bounds(), 20, 15, aspect=size[0] / size[1])


def scanned_scenes(path: str, size: tuple[int, int]) -> Iterator[tuple[str, PointCloud, Camera]]:
    """All frames of a scan as one cloud, seen from its origin, about which a lidar turns, and from above."""
    scan = open_scan(path)
    frames = [pose.cloud for pose in scan]
    points = np.concatenate([frame.positions + frame.origin for frame in frames])
    cloud = PointCloud.from_arrays(points)
    for azimuth in (0, 90, 180, 270):
        turn = np.radians(azimuth)
        ahead = (10 * np.cos(turn), 10 * np.sin(turn), 0.0)
        yield f"inside, {azimuth}°", cloud, Camera((0, 0, 0), ahead, (0, 0, 1), fov_y=50)
    yield "above", cloud, Camera.orbit(cloud.bounds(), 20, 60, aspect=size[0] / size[1])


def drawn(surface: Surface, count: int) -> float:
    """The share of the points in chunks that were not left out."""
    if "chunks" in surface.stats.counted:
        chunked = surface.stats.counted["chunks"]()
        return chunked["shown"] / sum(chunked.values())
    if "points" not in surface.stats.skipped:
        return 1.0
    return 1 - int(surface.stats.skipped["points"].split()[0].replace(",", "")) / count


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--backend", default="points")
    arguments.add_argument("--counts", type=int, nargs="+", default=[1_000_000, 10_000_000])
    arguments.add_argument("--scan")
    arguments.add_argument("--turn", type=float, default=0.0)
    arguments.add_argument("--set", action="append", default=[], metavar="key=value")
    arguments.add_argument("--size", default="1920x1280")
    arguments.add_argument("--rounds", type=int, default=7)
    options = arguments.parse_args()
    width, height = (int(n) for n in options.size.split("x"))
    given = dict(setting.split("=", 1) for setting in options.set)
    settings = (
        [{**given, "point_size": edge} for edge in ("1", "0")] if options.backend == "points" else [given]
    )
    renderer = Renderer()
    surface = Surface(renderer.gpu, (width, height))
    how = "medians" if options.turn else "least"
    print(f"{renderer.gpu.device}, {width}x{height}, {how} of {options.rounds}, processor (wall) ms")
    print(f"{'points':>12} {'scene':14} {'':14} {'without':>16} {'with':>16} {'ratio':>6} {'drawn':>6}")
    scenes = (
        scanned_scenes(options.scan, (width, height))
        if options.scan
        else spherical_scenes(options.counts, options.backend, (width, height))
    )

    def draw(camera: Camera, culled: bool) -> tuple[float, float]:
        """Processor and wall milliseconds of a picture."""
        chunks.LEAST = LEAST if culled else 1 << 31
        processor, wall = time.process_time(), time.perf_counter()
        render_frame(renderer, Request(pose, camera, options.backend, params, Look(light=light)), surface)
        surface.image()
        return (time.process_time() - processor) * 1e3, (time.perf_counter() - wall) * 1e3

    pose = Pose(0, 0.0, "", PointCloud.from_arrays(np.zeros((1, 3))))
    for name, cloud, first in scenes:
        pose = pose if pose.cloud is cloud else Pose(0, 0.0, name, cloud)
        light = "flat" if options.backend == "points" else "head"
        for setting in settings:
            params = backend(options.backend).params(setting)
            end = time.monotonic() + 20
            while time.monotonic() < end:
                draw(first, True)
                if surface.stats.counted.keys() & {"chunks"} or "points" in surface.stats.skipped:
                    break
                time.sleep(0.1)
            times: dict[bool, list[tuple[float, float]]] = {True: [], False: []}
            for turn in range(options.rounds + 2):
                camera = turned(first, options.turn * turn)
                for culled in times:
                    times[culled].append(draw(camera, culled))
            of = np.median if options.turn else np.min
            taken = {culled: of(np.array(pairs[2:]), axis=0) for culled, pairs in times.items()}
            draw(camera, True)
            without, within = (f"{taken[c][0]:7.1f} ({taken[c][1]:.1f})" for c in (False, True))
            ratio = f"{taken[True][0] / taken[False][0]:6.2f} {drawn(surface, len(cloud)):6.0%}"
            told = " ".join(f"{key}={value}" for key, value in setting.items())
            print(f"{len(cloud):12,} {name:14} {told:14} {without:>16} {within:>16} {ratio}", flush=True)


if __name__ == "__main__":
    main()
