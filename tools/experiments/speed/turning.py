"""How fast a scan turns while it is dragged, and how far off the moving pictures are.

A viewport without a window draws a dented sphere that turns by --step degrees a picture, as detailed as the
window's own budget finds in time for --goal pictures a second, and each picture is read back. A picture
counts as having taken its processor time over the number of cores, so that other programs change little.
Points and pixels are shares of all. Then some moving pictures are compared with the one at rest from the same
camera, in pixels of that:

shift   how far the middle of a pixel, as it is shown, lies from where the surface that it shows is in the
        picture: the point of its row, or for splats the middle of the pixel that was drawn, whose ray they
        are cut by. At rest up to 0.71, half a pixel's diagonal, for points, and 0 for splats.
beyond  of a pixel that shows something, how far the nearest one is that shows the same sheet of the surface
        in the picture at rest: what is shown where it is not, as past outlines and through gaps.
missing the same of pixels at rest and the moving picture: what it lacks.

Two pixels show the same sheet where their depths differ by less than 1 % of the diagonal of the scan's box.
Each as the 95 % quantile and the largest; what is not found within 8 pixels counts as 9.
"""

from __future__ import annotations

import time
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from experiments.pictures import draw, renderer
from experiments.script import Script
from experiments.speed.clouds import dented_sphere
from experiments.tables import Row
from experiments.timing import CORES
from viewer.app.scene.viewport import Viewport
from viewer.backends import backend as find_backend
from viewer.camera import Camera
from viewer.drawing.request import Request
from viewer.picture.surface import Surface
from viewer.scan.points import NOTHING, PointCloud
from viewer.scan.pose import Pose

BACKENDS = ("points", "surfels")
_SETTLING = 40  # pictures until the budget has settled
_COMPARED = 3  # pictures whose error is found
_REACH = 8  # pixels around one that are looked at
_SHEET = 0.01  # of the diagonal of the scan's box


@dataclass(frozen=True)
class Shown:
    """What a picture shows on the pixels of the window: depths (H, W), +inf where nothing, and how far from
    each covered pixel's middle the surface lies that it shows, (n,)."""

    depths: NDArray[np.floating]
    shifts: NDArray[np.floating]

    @classmethod
    def of(cls, surface: Surface, cloud: PointCloud, size: tuple[int, int], by_rows: bool) -> Shown:
        """What a surface shows, enlarged to a size. by_rows: whether a pixel shows its row's point, rather
        than what its own ray meets."""
        columns, lines = (
            (np.arange(many) * 2 + 1) * few // (2 * many)
            for few, many in zip(surface.size, size, strict=True)
        )
        depths = surface.depth.take(columns, axis=1).take(lines, axis=0)
        y, x = np.nonzero(np.isfinite(depths))
        scale = np.array(size) / surface.size
        if by_rows:
            rows = surface.row[lines[y], columns[x]]
            assert not (rows == NOTHING).any()
            placed: NDArray[np.floating]
            placed, _ = surface.view.project(cloud.positions[rows] + (cloud.origin - surface.view.origin))
        else:
            placed = np.column_stack([columns[x], lines[y]]) + 0.5
        shifts = np.linalg.norm(placed * scale - np.column_stack([x, y]) - 0.5, axis=1)
        return cls(depths, shifts)


def distances(of: NDArray[np.floating], among: NDArray[np.floating], apart: float) -> NDArray[np.floating]:
    """For each pixel that shows something, (n,), how far the nearest one of another picture is whose depth is
    as much at most: pixels. of, among: depths (H, W)."""
    reach = range(-_REACH, _REACH + 1)
    steps = sorted((float(np.hypot(x, y)), x, y) for x in reach for y in reach if np.hypot(x, y) <= _REACH)
    padded = np.pad(among, _REACH, constant_values=np.inf)
    y, x = np.nonzero(np.isfinite(of))
    depths, found = of[y, x], np.full(len(y), _REACH + 1.0)
    left = np.arange(len(y))
    for distance, right, down in steps:
        other = padded[y[left] + (down + _REACH), x[left] + (right + _REACH)]
        near = np.abs(other - depths[left]) <= apart
        found[left[near]] = distance
        left = left[~near]
    return found


def sphere(count: int) -> PointCloud:
    """The dented sphere with normals, and radii of 1.5 spacings."""
    cloud = dented_sphere(count)
    normals = cloud.positions / np.linalg.norm(cloud.positions, axis=1, keepdims=True)
    radii = np.full(count, 1.5 * np.sqrt(4 * np.pi / count), np.float32)
    return replace(cloud, normals=normals, radii=radii)


def turning(options: Namespace) -> Iterator[Row]:
    """Times and errors of each renderer and number of points; --anew: no picture goes on from the one
    before."""
    rest = Surface(renderer().gpu, options.size)
    for count in options.counts:
        pose = Pose(0, 0.0, "sphere", sphere(count))
        for backend in options.backends or BACKENDS:
            settings = {"point_size": options.point_size} if backend == "points" else {}
            request = Request(pose, Camera(), backend, find_backend(backend).params(settings))
            yield {"points": count, "renderer": backend, **turned(request, rest, options)}


def turned(request: Request, rest: Surface, options: Namespace) -> Row:
    """The figures of one renderer. rest: for the pictures at rest."""
    bounds, size = request.pose.bounds, options.size
    apart = _SHEET * float(np.linalg.norm(bounds.high - bounds.low))
    by_rows = request.backend == "points"
    viewport = Viewport(renderer(), (0, 0, *size))
    walls, used, errors = [], [], []
    turns, surface = _SETTLING + options.pictures, viewport.surface
    for turn in range(turns):
        camera = Camera.orbit(bounds, 20 + options.step * turn, 15, aspect=size[0] / size[1])
        seen = replace(request, camera=camera)
        if options.anew:
            viewport.clear()
            viewport.surface = None
        wall, busy = time.perf_counter(), time.process_time()
        while not viewport.draw(seen, held=True):
            pass
        surface = viewport.surface
        assert surface is not None
        assert viewport.problem is None
        surface.image()
        taken = 1e3 * (time.process_time() - busy) / CORES
        viewport.took(taken, 1e3 / options.goal)
        if turn >= _SETTLING:
            walls.append(1e3 * (time.perf_counter() - wall))
            used.append(taken)
        if turn >= turns - _COMPARED:
            moving = Shown.of(surface, request.pose.cloud, size, by_rows)
            draw(seen, rest)
            still = Shown.of(rest, request.pose.cloud, size, by_rows)
            beyond, missing = (
                distances(first.depths, second.depths, apart)
                for first, second in ((moving, still), (still, moving))
            )
            errors.append([moving.shifts, beyond, missing, still.shifts])
    assert surface is not None
    columns = [np.concatenate(each) for each in zip(*errors, strict=True)]
    titles = ("shift", "beyond", "missing", "shift at rest")
    shown = {
        title: f"{np.quantile(each, 0.95):.2f}, {each.max():.2f}"
        for title, each in zip(titles, columns, strict=True)
    }
    shares = {"share": f"{surface.stats.share:.1%}", "pixels": f"{np.prod(surface.size) / np.prod(size):.1%}"}
    viewport.release()
    return {"ms": float(np.median(walls)), "processor, ms": float(np.median(used)), **shares, **shown}


EXPERIMENT = Script(
    [turning],
    {
        "counts": [100_000, 1_000_000, 10_000_000],
        "size": (1920, 1280),
        "step": 1.0,
        "pictures": 40,
        "goal": 30.0,
        "anew": False,
        "point_size": 0,
        "backends": [],
    },
)
