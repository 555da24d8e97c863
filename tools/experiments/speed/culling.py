"""What is gained by leaving out chunks of points that a picture cannot show.

A sphere whole in view, a close-up that has a twentieth of its points in view, beside the picture, and five
spheres in one another, all in random order, once the points are in an order of their own: as `points`, with
pixels and with squares that touch, or by another backend (--backend), with normals and radii of 1.5 times the
spacing. Or the frames of a scan (--scan FOLDER), all together, seen from where a scanner stood, looking four
ways, and from above. Each with and without, by turns, on one surface, the picture read back: the least times,
or with --turn DEGREES of the camera from one picture to the next medians, as pictures differ. Drawn: the
share of the points in chunks that are not left out."""

from __future__ import annotations

import time
from argparse import Namespace
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import count as numbers

import numpy as np

from experiments.pictures import renderer
from experiments.script import Script
from experiments.speed.clouds import dented_sphere
from experiments.tables import Row
from experiments.timing import by_turns
from viewer.backends import backend
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
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
        one = dented_sphere(count) if name == "points" else spheres(count, (1.0,))
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


def shown_share(surface: Surface, count: int) -> float:
    """The share of the points in chunks that were not left out."""
    if "chunks" in surface.stats.counted:
        chunked = surface.stats.counted["chunks"]()
        return chunked["shown"] / sum(chunked.values())
    if "points" not in surface.stats.skipped:
        return 1.0
    return 1 - int(surface.stats.skipped["points"].split()[0].replace(",", "")) / count


def culling(options: Namespace) -> Iterator[Row]:
    """Processor and wall time with and without culling."""
    name, given = options.backend, dict(setting.split("=", 1) for setting in options.set)
    settings = [{**given, "point_size": edge} for edge in ("1", "0")] if name == "points" else [given]
    surface, look = Surface(renderer().gpu, options.size), Look(light="flat" if name == "points" else "head")
    scenes = (
        scanned_scenes(str(options.scan), options.size)
        if options.scan
        else spherical_scenes(options.counts, name, options.size)
    )
    pose = Pose(0, 0.0, "", PointCloud.from_arrays(np.zeros((1, 3))))
    for title, cloud, camera in scenes:
        pose = pose if pose.cloud is cloud else Pose(0, 0.0, title, cloud)
        for setting in settings:
            request = Request(pose, camera, name, backend(name).params(setting), look)
            wait_for_chunks(partial(picture, request, surface, numbers(), True, 0.0), surface)
            works: dict[str, Callable[[], object]] = {
                word: partial(picture, request, surface, numbers(), culled, options.turn)
                for word, culled in (("with", True), ("without", False))
            }
            taken = by_turns(works, options.rounds, of="median" if options.turn else "least", warm=2)
            picture(request, surface, numbers(), True, 0.0)
            times = {
                f"{word}, {kind} ms": getattr(taken[word], kind)
                for word in taken
                for kind in ("busy", "wall")
            }
            words = " ".join(f"{key}={value}" for key, value in setting.items())
            share = f"{shown_share(surface, len(cloud)):.0%}"
            ratio = taken["with"].busy / taken["without"].busy
            yield {
                "points": len(cloud),
                "scene": title,
                "set": words,
                **times,
                "ratio": ratio,
                "drawn": share,
            }


def picture(request: Request, surface: Surface, turns: Iterator[int], culled: bool, degrees: float) -> None:
    """Draw the next picture of a camera that turns, and read it back."""
    chunks.LEAST = LEAST if culled else 1 << 31
    seen = replace(request, camera=turned(request.camera, degrees * next(turns)))
    render_frame(renderer(), seen, surface)
    surface.image()


def wait_for_chunks(draw: Callable[[], object], surface: Surface) -> None:
    """Draw until the points are in an order of their own."""
    end = time.monotonic() + 20
    while time.monotonic() < end:
        draw()
        if surface.stats.counted.keys() & {"chunks"} or "points" in surface.stats.skipped:
            return
        time.sleep(0.1)


EXPERIMENT = Script(
    [culling],
    {
        "backend": "points",
        "counts": [1_000_000, 10_000_000],
        "scan": None,
        "turn": 0.0,
        "set": [],
        "size": (1920, 1280),
        "rounds": 7,
    },
)
