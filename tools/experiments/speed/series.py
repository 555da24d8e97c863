"""How fast a new pose is drawn in each picture, as a scan plays that is in memory.

A dented sphere in the order of a scanner moves: positions and normals are new in each pose, colours and radii
the same in all, or equal and copied for each ("copies"). Pictures are read back. In motion discs are not
blended, as in the window while it plays with nothing left out; at rest they are blended, and each pose is
looked at for gaps. Medians: wall time, processor time of all threads over the cores, and of these parts; and
bytes that came to the GPU."""

from __future__ import annotations

import time
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from experiments.pictures import renderer
from experiments.script import Script
from experiments.speed.clouds import dented_sphere
from experiments.tables import Row
from experiments.timing import CORES
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.request import Request
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

ROWS = (("points", True), ("surfels", True), ("surfels", False))


def moments(count: int, poses: int) -> list[PointCloud]:
    """The poses, which share what is the same in them."""
    cloud = dented_sphere(count)
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


def copied(cloud: PointCloud) -> PointCloud:
    """The same points in arrays of their own."""
    arrays = {name: getattr(cloud, name).copy() for name in ("positions", "normals", "colors", "radii")}
    return replace(cloud, **arrays)


def series(options: Namespace) -> Iterator[Row]:
    """Each renderer in motion and at rest, with arrays that poses share and with copies."""
    surface = Surface(renderer().gpu, options.size)
    for count in options.counts:
        shared = moments(count, options.poses)
        camera = Camera.orbit(shared[0].bounds(), 20, 15, aspect=options.size[0] / options.size[1])
        for backend, moving in ROWS:
            held: list[Pose] = []  # as the window's cache holds them
            times: dict[str, list[tuple[float, ...]]] = {"shared": [], "copies": []}
            for number, cloud in enumerate(shared):
                for name, each in (("shared", cloud), ("copies", copied(cloud))):
                    pose = Pose(number, float(number), name, replace(each))
                    held.append(pose)
                    for measured in (False, True) if moving and not number else (True,):
                        wall, busy = time.perf_counter(), time.process_time()
                        request = Request(pose, camera, backend)
                        render_frame(renderer(), request, surface, moving=moving and measured)
                        surface.image()
                    wall, busy = 1e3 * (time.perf_counter() - wall), 1e3 * (time.process_time() - busy)
                    stats = surface.stats
                    parts = stats.upload_ms, stats.derive_ms, stats.uploaded_bytes / 1e6
                    times[name].append((wall, busy / CORES, *parts))
            titles = ("ms", "processor, ms", "upload, ms", "derive, ms", "MB")
            named = {"points": count, "renderer": backend, "camera": "moving" if moving else "at rest"}
            for name, rows in times.items():
                medians = np.median(rows[2:], axis=0).tolist()
                yield {**named, "arrays": name, **dict(zip(titles, medians, strict=True))}


EXPERIMENT = Script([series], {"counts": [100_000, 1_000_000], "size": (1920, 1280), "poses": 12})
