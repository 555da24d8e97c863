"""Auto splats: normals by numbers of neighbours, uneven points, a stream of scanners, and two savings.

It needs the data folder; `stream` does not."""

from __future__ import annotations

import time
from argparse import Namespace
from collections.abc import Iterator
from functools import partial
from itertools import product

import numpy as np

from experiments.pictures import draw, error_cells, errors_of, renderer, request, scene
from experiments.preiner_2012.fits import fit_errors, noisy
from experiments.preiner_2012.stream import Stream
from experiments.script import Script
from experiments.tables import Row, spaced
from experiments.timing import CORES, by_turns
from viewer.analysis.visible_normals import VisibleNormals, read_normals
from viewer.backends.auto_splats.neighborhoods import Neighborhoods
from viewer.bench.report.page import three_digits
from viewer.bench.run import BenchSettings
from viewer.bench.scenes.viewpoints import viewpoints
from viewer.camera import Camera
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

BACKEND = "auto_splats"
VIEWS, SIZE = 2, (880, 450)
ROUNDS = 3
AVERAGES = (0, 8, 16)  # frames
# Azimuths of pictures, one after the other, degrees.
_EYES = {"first": 30, "1° beside": 31, "30° beside": 61, "back": 30, "30° again": 61}


def normals(_: Namespace) -> Iterator[Row]:
    """Angles to the true normals by numbers of neighbours, and of pictures, of two models with noise."""
    settings = BenchSettings(size=SIZE, views=1)
    counts = {f"k = {k}": {"k": k, "adaptive": False} for k in (6, 10, 16, 24, 32)}
    counts |= {f"adaptive, {k}": {"k": k, "adaptive": True} for k in (10, 32)}
    for name in ("bunny", "armadillo"):
        moment = scene(name).moment(0)
        for noise in (0.0, 0.1, 0.2, 0.3, 0.5, 1.0):
            cloud, row = noisy(moment.pose.cloud, noise, 0), {"scene": f"`{name}`", "noise": str(noise)}
            found = {
                column: fit_errors(cloud, moment.mesh, settings, params) for column, params in counts.items()
            }
            found["picture"] = fit_errors(cloud, moment.mesh, settings, {"k": 10}, find=of_picture)
            for column, errors in found.items():
                inside = errors["found_inside"]
                row[column] = f"{inside['median']:.1f}, {inside['p95']:.0f}"
            yield row


def of_picture(pose: Pose, camera: Camera, size: tuple[int, int]) -> VisibleNormals:
    """The normals of the splats of a picture with the default parameters, but of all points that it shows."""
    surface = Surface(renderer().gpu, size)
    draw(request(pose, camera, BACKEND, {"cull": False}), surface)
    return read_normals(renderer().resident(pose).cloud, surface.cached(Neighborhoods))


def uneven(_: Namespace) -> Iterator[Row]:
    """Errors where points lie evenly and where they do not."""
    for name in ("armadillo-bare", "armadillo-ramp-bare", "igea-bare", "igea-ramp-bare"):
        subject = scene(name)
        (errors,) = errors_of(subject, BACKEND, [{}], VIEWS, SIZE)
        yield {"scene": f"`{name}`, {spaced(len(subject.moment(0).pose.cloud))}", **error_cells(errors)}


def stream(_: Namespace) -> Iterator[Row]:
    """Holes and flicker of a stream of noisy scanners, by how many frames are averaged."""
    for head in ("still", "moving"):
        scanned = Stream(head == "moving", max(AVERAGES) - 1)
        for noise in (0.1, 0.25, 0.5):
            frames = scanned.frames(noise)
            found = {average: scanned.judge(frames, average) for average in AVERAGES}
            holes = max(each.holes for each in found.values())
            row = {"head": head, "noise": str(noise), "holes": f"{three_digits(holes)} %"}
            yield row | {_titled(average): f"{each.flicker:.2f}" for average, each in found.items()}


def _titled(average: int) -> str:
    return f"flicker, mean of {average}" if average else "flicker"


def moved(_: Namespace) -> Iterator[Row]:
    """Times of the first picture of a pose, and of later ones from other eyes, which reuse its neighbours."""
    cloud = scene("demo").moment(0).pose.cloud
    rows = np.random.default_rng(0).permutation(len(cloud))
    for count in (20_000, len(cloud)):
        positions = cloud.world()[np.sort(rows[:count])]
        taken: dict[str, list[float]] = {}
        surface = Surface(renderer().gpu, SIZE)
        for number in range(ROUNDS + 1):
            pose = Pose(number, 0.0, "moved", PointCloud.from_arrays(positions))
            for name, azimuth in _EYES.items():
                camera = Camera.orbit(pose.bounds, azimuth, 20, aspect=SIZE[0] / SIZE[1])
                start = time.process_time()
                draw(request(pose, camera, BACKEND, {}), surface)
                renderer().gpu.ctx.finish()
                if number:
                    taken.setdefault(name, []).append(time.process_time() - start)
        first = min(taken["first"])
        kept = surface.stats.counted["neighbourhoods by searches"]()
        yield {
            "points": spaced(count),
            "first picture": f"{1e3 * first / CORES:.0f} ms",
            **{name: f"{min(seconds) / first:.2f}" for name, seconds in taken.items() if name != "first"},
            "kept in the last": f"{100 * kept['kept'] / sum(kept.values()):.1f} %",
        }


def savings(_: Namespace) -> Iterator[Row]:
    """Errors and times with refinement and grid culling, and without."""
    settings = [{"refine": refine, "cull": cull} for refine, cull in product((False, True), repeat=2)]
    for name, count in (("horses", 100_000), ("dragon", None)):
        subject = scene(name, count)
        pose = subject.moment(0).pose
        camera = viewpoints(subject.moment(0).mesh, 1, SIZE, up=subject.up)[0]
        surface = Surface(renderer().gpu, SIZE)
        works = {}
        for number, params in enumerate(settings):
            # From elsewhere, with another k, in between, so that nothing of the pictures before helps.
            works[f"elsewhere {number}"] = partial(
                draw, request(pose, camera.orbited(90, 0), BACKEND, {**params, "k": 9}), surface
            )
            works[f"{number}"] = partial(draw, request(pose, camera, BACKEND, params), surface)
        least = by_turns(works, ROUNDS, renderer().gpu.ctx.finish, of="least")
        found = errors_of(subject, BACKEND, settings, VIEWS, SIZE)
        for number, (params, errors) in enumerate(zip(settings, found, strict=True)):
            switched = " and ".join(f"`{key}`" for key, on in params.items() if on) or "neither"
            named = {"scene": f"{name}, {spaced(len(pose.cloud))}", "with": switched}
            yield {**named, **error_cells(errors), "time": f"{least[str(number)].busy / CORES:.0f} ms"}


EXPERIMENT = Script([normals, uneven, stream, savings, moved], page="auto-splats.md")
