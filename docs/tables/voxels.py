"""The tables of docs/how-it-works/voxels.md, measured anew.

    python docs/tables/voxels.py [NAME ...]

`errors` gives the same figures on any machine with the same driver, but for its times. Scenes but the demo
need the data folder.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

import numpy as np
from pictures import DATA, DOCS, draw, processor_ms, renderer, request

from viewer.backends.voxels import sight_of
from viewer.bench.judge import Judge
from viewer.bench.report.measurement import markdown_table, remeasure_tables, spaced
from viewer.bench.scenes.catalog import subject
from viewer.bench.scenes.subjects import Moment
from viewer.camera import Camera
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.octree.build import build
from viewer.scan.octree.traverse import Traversal
from viewer.scan.spacing import typical_spacing
from viewer.view import View

PAGE = DOCS / "how-it-works" / "voxels.md"
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


@cache
def moment(name: str) -> Moment:
    """The first of a scene."""
    return subject(name, DATA if DATA.is_dir() else None).moment(0)


def cameras(name: str) -> list[Camera]:
    """Three around a scene."""
    bounds = moment(name).pose.bounds
    return [Camera.orbit(bounds, *angles, aspect=SIZE[0] / SIZE[1]) for angles in AROUND]


def errors() -> str:
    """Against the true surface, means over the views."""
    lines = []
    for name in SCENES:
        here = moment(name)
        spacing = typical_spacing(here.pose.cloud)
        views = cameras(name)
        judges = [
            Judge.of(renderer().gpu, here.truth, view, SIZE, LOOK, here.pose.cloud, None) for view in views
        ]
        for number, (drawn_by, setting) in enumerate(SETTINGS):
            found, times = [], []
            surface = Surface(renderer().gpu, SIZE)
            for camera, judge in zip(views, judges, strict=True):
                asked = request(here.pose, camera, drawn_by, setting, LOOK)
                times.append(_ms(partial(draw, asked, surface), rounds=2))
                found.append(judge.errors(surface))
            means = {key: float(np.mean([each[key] for each in found])) for key in ERRORS}
            means["depth_median"] /= spacing
            told = " ".join(f"{key}={value}" for key, value in setting.items())
            cells = [
                f"{value:.3g}" if key != "closed_percent" else f"{value:.2f}" for key, value in means.items()
            ]
            lines.append(["" if number else name, f"`{told or drawn_by}`", *cells, f"{np.mean(times):.0f}"])
    return markdown_table(["scene", "", *ERRORS.values(), "processor, ms"], lines, left=["scene", ""])


def costs() -> str:
    """Processor time of each step, the least of some rounds, ms."""
    lines = []
    for name in ("demo", "bunny", "armadillo", "dragon"):
        pose = moment(name).pose
        cloud, camera = pose.cloud, cameras(name)[0]
        tree = build(cloud)
        sight = sight_of(View.of(camera, SIZE, cloud.origin, pose.bounds))
        traversal = Traversal(tree, sight, cull_cones=False)

        def cut(traversal=traversal, sight=sight) -> None:
            traversal.look(sight)
            traversal.advance()

        surface = Surface(renderer().gpu, SIZE)
        views = [camera.orbited(step, 0.0) for step in range(ROUNDS + 1)]
        requests = iter([request(pose, view, "voxels", {}, LOOK) for view in views])
        draw(next(requests), surface)
        moved = _ms(lambda requests=requests, surface=surface: draw(next(requests), surface))
        still = request(pose, views[-1], "voxels", {}, LOOK)
        again = _ms(partial(draw, still, surface))
        works = (partial(build, cloud, attributes=False), partial(build, cloud), cut)
        lines.append(
            [
                name,
                spaced(len(cloud)),
                *(f"{_ms(work):.1f}" for work in works),
                f"{again:.1f}",
                f"{moved:.1f}",
            ]
        )
    head = ["scene", "points", "octree alone", "with attributes", "cut", "picture", "picture of a new view"]
    return markdown_table(head, lines, left=["scene"])


def _ms(work: Callable[[], object], rounds: int = ROUNDS) -> float:
    """The least processor time of some rounds."""
    return min(processor_ms(work) for _ in range(rounds))


if __name__ == "__main__":
    remeasure_tables(PAGE, costs, errors)
