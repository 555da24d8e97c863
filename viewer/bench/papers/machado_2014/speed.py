"""Time of the exact operator beside that by sectors, by turns in one run (Table 1).

The exact one is open3d's, which is faster than ours by what that does for far eyes and large radii. Those by
sectors are calls of the library function from one eye and another, with all that it uploads and reads back.
Processor time is of all threads, the driver's included: what the work takes where OpenGL is software; wall
time counts where it is a card.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from typing import Any

import numpy as np

from ....backends import backend
from ....drawing.request import Request
from ....drawing.timing import draw
from ....picture.surface import Surface
from ....resources import resource_path
from ....scan.pose import Pose
from ....visibility.search import MODES, calibrated, chosen_search, visible_points
from ...report.results import Row
from ...run import LOOK, Bench, undisturbed
from .verdicts import EXACT, HULL, SCENES, JudgedView, moments, row_of, views

BACKEND = "hpr"
PICTURE = "picture"  # by the backend as it is
_STEP = 0.5  # degrees from one picture to the next


@cache
def paper() -> dict[str, Any]:
    """The paper's counts and Table 1, as assets/machado-2014.json has them."""
    return json.loads(resource_path("assets", "machado-2014.json").read_text(encoding="utf-8"))


def measure_speeds(bench: Bench, scenes: Sequence[str] = SCENES) -> Iterator[Row]:
    """Yield a row for each scene, from the first side, at the automatic radius."""
    for scene in scenes:
        for moment in moments(bench, scene):
            (view,) = views(moment, 1)
            yield {**row_of(bench, scene, moment), "views": 1, **speeds(bench, view)}


def speeds(bench: Bench, view: JudgedView) -> Row:
    """Medians of a view: what each way takes, processor and wall time, ms, the first of each left out."""
    from open3d import geometry, utility

    positions = view.cloud.positions + view.cloud.origin
    scan = geometry.PointCloud(utility.Vector3dVector(positions))
    gpu, pose = bench.renderer.gpu, Pose(0, 0.0, "", view.cloud)
    found = calibrated(pose, view.eye)
    eyes = [view.camera, view.camera.orbited(_STEP, 0)]
    surface = Surface(gpu, bench.settings.size)

    def picture(turn: int) -> None:
        params = backend(BACKEND).params({})
        draw(bench.renderer, Request(pose, eyes[turn % 2], BACKEND, params, LOOK), surface)
        gpu.ctx.finish()

    def call(mode: str, turn: int) -> None:
        visible_points(pose, eyes[turn % 2].eye, mode=mode, gpu=gpu)

    ways: dict[str, Callable[[int], object]] = {
        EXACT: lambda turn: scan.hidden_point_removal(eyes[turn % 2].eye, found.radius),
        **{mode: partial(call, mode) for mode in MODES},
        PICTURE: picture,
    }
    taken: dict[str, list[tuple[float, float]]] = {name: [] for name in ways}
    with undisturbed():
        for turn in range(1 + bench.settings.repeat):
            for name, way in ways.items():
                busy, wall = time.process_time(), time.perf_counter()
                way(turn)
                taken[name].append((time.process_time() - busy, time.perf_counter() - wall))
    surface.release()
    medians = {name: 1e3 * np.median(times[1:], axis=0) for name, times in taken.items()}
    return {
        "sectors": chosen_search(found, None, None)[0].count,
        "visible": len(visible_points(pose, view.eye, mode=HULL, gpu=gpu)),
        "busy_ms": {name: round(float(busy), 2) for name, (busy, _) in medians.items()},
        "wall_ms": {name: round(float(wall), 2) for name, (_, wall) in medians.items()},
    }
