"""How fast a scan turns while it is dragged, and how far off the moving pictures are. Prints a table.

    python tests/speed/turning.py [--counts 100000 1000000 10000000] [--size 1920x1280] [--step 1]
                                  [--pictures 40] [--goal 30] [--cores 2] [--anew]
                                  [--point-size 0] [points surfels]

A viewport without a window draws a dented sphere that turns by so many degrees a picture, as detailed as
the window's own budget finds in time for that rate, and each picture is read back. A picture counts as having
taken its processor time over the number of cores, so that other programs change little. Points and pixels are
shares of all. Then some moving pictures are compared with the one at rest from the same camera, in pixels of
that:

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

import argparse
import resource
import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from points import cloud_of

from viewer.app.scene.viewport import Viewport
from viewer.backends import backend as find_backend
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
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
    shifts: NDArray[np.float64]

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
            placed, _ = surface.view.project(cloud.positions[rows] + (cloud.origin - surface.view.origin))
        else:
            placed = np.column_stack([columns[x], lines[y]]) + 0.5
        shifts = np.linalg.norm(placed * scale - np.column_stack([x, y]) - 0.5, axis=1)
        return cls(depths, shifts)


def distances(of: NDArray[np.floating], among: NDArray[np.floating], apart: float) -> NDArray[np.float64]:
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
    cloud = cloud_of(count)
    normals = cloud.positions / np.linalg.norm(cloud.positions, axis=1, keepdims=True)
    radii = np.full(count, 1.5 * np.sqrt(4 * np.pi / count), np.float32)
    return replace(cloud, normals=normals, radii=radii)


def cpu_ms() -> float:
    """Processor time of all threads."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return (used.ru_utime + used.ru_stime) * 1e3


def main() -> None:
    arguments = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    arguments.add_argument("--counts", type=int, nargs="+", default=[100_000, 1_000_000, 10_000_000])
    arguments.add_argument("--size", default="1920x1280")
    arguments.add_argument("--step", type=float, default=1.0)
    arguments.add_argument("--pictures", type=int, default=40)
    arguments.add_argument("--goal", type=float, default=30.0)
    arguments.add_argument("--cores", type=int, default=2)
    arguments.add_argument("--anew", action="store_true", help="no picture goes on from the one before")
    arguments.add_argument("--point-size", type=int, default=0)
    arguments.add_argument("backends", nargs="*", default=BACKENDS)
    options = arguments.parse_args()
    width, height = (int(n) for n in options.size.split("x"))

    renderer = Renderer(budget_bytes=4 << 30)
    rest = Surface(renderer.gpu, (width, height))
    print(
        f"{renderer.gpu.device}, {width}x{height}, {options.step} degrees a picture, 95 % and largest, pixels"
    )
    print(
        f"{'points':>12} {'renderer':9} {'fps':>6} {'wall ms':>7} {'points':>7} {'pixels':>7} "
        f"{'shift':>12} {'beyond':>12} {'missing':>12} {'shift at rest':>14}"
    )
    for count in options.counts:
        pose = Pose(0, 0.0, "sphere", sphere(count))
        bounds = pose.bounds
        apart = _SHEET * float(np.linalg.norm(bounds.high - bounds.low))
        for backend in options.backends:
            settings = {"point_size": options.point_size} if backend == "points" else {}
            params = find_backend(backend).params(settings)
            viewport = Viewport(renderer, (0, 0, width, height))
            walls, used, errors = [], [], []
            turns = _SETTLING + options.pictures
            for turn in range(turns):
                camera = Camera.orbit(bounds, 20 + options.step * turn, 15, aspect=width / height)
                request = Request(pose, camera, backend, params)
                if options.anew:
                    viewport.clear()
                    viewport.surface = None
                start, cpu = time.perf_counter(), cpu_ms()
                while not viewport.draw(request, held=True):
                    pass
                surface = viewport.surface
                assert surface is not None
                assert viewport.problem is None
                surface.image()
                took = (cpu_ms() - cpu) / options.cores
                viewport.took(took, 1e3 / options.goal)
                if turn >= _SETTLING:
                    walls.append((time.perf_counter() - start) * 1e3)
                    used.append(took)
                if turn >= turns - _COMPARED:
                    moving = Shown.of(surface, pose.cloud, (width, height), backend == "points")
                    while render_frame(renderer, request, rest):
                        pass
                    still = Shown.of(rest, pose.cloud, (width, height), backend == "points")
                    errors.append(
                        [
                            moving.shifts,
                            distances(moving.depths, still.depths, apart),
                            distances(still.depths, moving.depths, apart),
                            still.shifts,
                        ]
                    )
            columns = [np.concatenate(each) for each in zip(*errors, strict=True)]
            shown = " ".join(f"{np.quantile(each, 0.95):6.2f} {each.max():5.2f}" for each in columns)
            share, pixels = surface.stats.share, np.prod(surface.size) / (width * height)
            print(
                f"{count:12,} {backend:9} {1e3 / np.median(used):6.1f} {np.median(walls):7.1f} {share:7.1%} "
                f"{pixels:7.1%} {shown}",
                flush=True,
            )
            viewport.release()


if __name__ == "__main__":
    main()
