"""Time of the exact operator beside that by sectors, by turns in one run (Table 1).

The exact one is open3d's, which is faster than ours by what that does for far eyes and large radii. Those by
sectors are calls of the library function, with all that it uploads and reads back. Pictures are those of the
backend, by its exact operator and as it is. Each call and picture is for another eye.
Processor time is of all threads, the driver's included: what the work takes where OpenGL is software; wall
time counts where it is a card.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import count

from experiments.machado_2014.verdicts import EXACT, HULL, SCENES, JudgedView, views
from experiments.suite import row_of, subjects
from experiments.tables import Row
from experiments.timing import by_turns
from viewer.backends import backend
from viewer.bench.run import LOOK, Bench
from viewer.drawing.request import Request
from viewer.drawing.timing import draw
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose
from viewer.visibility.search import EXACT as EXACT_MODE
from viewer.visibility.search import MODES, calibrated, chosen_search, visible_points

BACKEND = "hpr"
PICTURE, EXACT_PICTURE = "picture", "exact picture"  # by the backend as it is, and by its exact operator
_STEP = 0.5  # degrees from one picture to the next


def measure_speeds(bench: Bench, scenes: Sequence[str] = SCENES) -> Iterator[Row]:
    """Yield a row for each scene, from the first side, at the automatic radius."""
    for subject in subjects(bench, scenes):
        moment = subject.moment(0)
        (view,) = views(moment, 1)
        yield {**row_of(bench, scene=subject.name, n=moment.pose.count), "views": 1, **speeds(bench, view)}


def speeds(bench: Bench, view: JudgedView) -> Row:
    """Medians of a view: processor and wall time of each method, ms."""
    from open3d import geometry, utility

    positions = view.cloud.positions + view.cloud.origin
    scan = geometry.PointCloud(utility.Vector3dVector(positions))
    gpu, pose = bench.renderer.gpu, Pose(0, 0.0, "", view.cloud)
    found = calibrated(pose, view.eye)
    works_on = (EXACT, *MODES, EXACT_PICTURE, PICTURE)
    eyes = {name: (view.camera.orbited(turn * _STEP, 0) for turn in count()) for name in works_on}
    surfaces = [Surface(gpu, bench.settings.size) for _ in range(2)]

    def picture(name: str, mode: str, surface: Surface) -> None:
        params = backend(BACKEND).params({"mode": mode})
        draw(bench.renderer, Request(pose, next(eyes[name]), BACKEND, params, LOOK), surface)

    def call(mode: str) -> None:
        visible_points(pose, next(eyes[mode]).eye, mode=mode, gpu=gpu)

    works: dict[str, Callable[[], object]] = {
        EXACT: lambda: scan.hidden_point_removal(next(eyes[EXACT]).eye, found.radius),
        **{mode: partial(call, mode) for mode in MODES},
        EXACT_PICTURE: partial(picture, EXACT_PICTURE, EXACT_MODE, surfaces[0]),
        PICTURE: partial(picture, PICTURE, MODES[0], surfaces[1]),
    }
    taken = by_turns(works, bench.settings.repeat, gpu.ctx.finish)
    for surface in surfaces:
        surface.release()
    return {
        "sectors": chosen_search(found, None, None)[0].count,
        "visible": len(visible_points(pose, view.eye, mode=HULL, gpu=gpu)),
        "busy_ms": {name: each.busy for name, each in taken.items()},
        "wall_ms": {name: each.wall for name, each in taken.items()},
    }
