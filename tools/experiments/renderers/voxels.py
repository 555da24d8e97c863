"""Voxels: errors of levels of detail against the true surface, and the time of each step."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from experiments.pictures import draw, renderer, request, scene
from experiments.script import Script
from experiments.tables import Row
from experiments.timing import by_turns
from viewer.backends.voxels.cuts import sight_of
from viewer.bench.judge import Judge
from viewer.bench.scenes.subjects import Moment
from viewer.camera import Camera
from viewer.drawing.request import Request
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.octree.build import build
from viewer.scan.octree.traverse import Sight, Traversal
from viewer.scan.spacing import typical_spacing
from viewer.view import View

SIZE = (480, 360)
AROUND = ((140, 20), (20, 10), (260, 30))  # degrees
LOOK = Look(light="head")
SCENES = ("demo", "bunny", "armadillo", "owlii")
SETTINGS: list[tuple[str, dict[str, object]]] = [
    ("surfels", {}),
    ("voxels", {}),
    ("voxels", {"radius_scale": 0.8}),
    ("voxels", {"max_depth": 7}),
    ("voxels", {"max_depth": 6}),
    ("voxels", {"shape": "cubes"}),
    ("voxels", {"shape": "cubes", "least": 0}),
]
ERRORS = {
    "closed_percent": "closed, %",
    "through_percent": "through, %",
    "spill_percent": "spill, %",
    "wrong_layer_percent": "wrong layer, %",
    "depth_median": "depth, spacings",
    "normal_median": "normals, °",
    "psnr": "PSNR, dB",
}
ROUNDS = 7


def cameras(moment: Moment) -> list[Camera]:
    """Three around a scene."""
    return [Camera.orbit(moment.pose.bounds, *angles, aspect=SIZE[0] / SIZE[1]) for angles in AROUND]


def errors(_: Namespace) -> Iterator[Row]:
    """Against the true surface, means over the views."""
    for name in SCENES:
        here = scene(name).moment(0)
        spacing, views, gpu = typical_spacing(here.pose.cloud), cameras(here), renderer().gpu
        judges = [Judge.of(gpu, here.truth, view, SIZE, LOOK, here.pose.cloud, None) for view in views]
        for number, (drawn_by, setting) in enumerate(SETTINGS):
            found, times = [], []
            surface = Surface(gpu, SIZE)
            for camera, judge in zip(views, judges, strict=True):
                times.append(
                    _ms(partial(draw, request(here.pose, camera, drawn_by, setting, LOOK), surface), 2)
                )
                found.append(judge.errors(surface))
            means = {key: float(np.mean([each[key] for each in found])) for key in ERRORS}
            means["depth_median"] /= spacing
            words = " ".join(f"{key}={value}" for key, value in setting.items())
            cells = {ERRORS[key]: f"{value:.3g}" for key, value in means.items()}
            cells["closed, %"] = f"{means['closed_percent']:.2f}"
            named = {"scene": "" if number else name, "": f"`{words or drawn_by}`"}
            yield {**named, **cells, "processor, ms": f"{np.mean(times):.0f}"}


def costs(_: Namespace) -> Iterator[Row]:
    """Processor time of each step, the least of some rounds, ms."""
    for name in ("demo", "bunny", "armadillo", "dragon"):
        moment = scene(name).moment(0)
        cloud, camera = moment.pose.cloud, cameras(moment)[0]
        sight = sight_of(View.of(camera, SIZE, cloud.origin, moment.pose.bounds))
        traversal = Traversal(build(cloud), sight, cull_cones=False)

        def cut(traversal: Traversal = traversal, sight: Sight = sight) -> None:
            traversal.look(sight)
            traversal.advance()

        surface = Surface(renderer().gpu, SIZE)
        views = [camera.orbited(step, 0.0) for step in range(ROUNDS + 2)]
        requests = iter([request(moment.pose, view, "voxels", {}, LOOK) for view in views])
        moved = _ms(partial(_next, requests, surface))
        again = _ms(partial(draw, request(moment.pose, views[-1], "voxels", {}, LOOK), surface))
        steps = {
            "octree alone": _ms(partial(build, cloud, attributes=False)),
            "with attributes": _ms(partial(build, cloud)),
            "cut": _ms(cut),
            "picture": again,
            "picture of a new view": moved,
        }
        yield {"scene": name, "points": len(cloud), **{step: f"{ms:.1f}" for step, ms in steps.items()}}


def _next(requests: Iterator[Request], surface: Surface) -> None:
    """Draw the next request."""
    draw(next(requests), surface)


def _ms(work: Callable[[], object], rounds: int = ROUNDS) -> float:
    """The least processor time of some rounds."""
    return by_turns({"": work}, rounds, renderer().gpu.ctx.finish, of="least")[""].busy


EXPERIMENT = Script([costs, errors], page="voxels.md")
