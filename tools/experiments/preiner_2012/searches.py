"""Times of the neighbourhood search beside those of a k-d tree, and of every other pass (Table 1, Fig. 10,
Fig. 11).

The paper's scenes, but for the bunny, are not published: several laser scans in one cloud, galloping horses
and ten million points of a mesh stand in for them. Search and trees take turns, in one run.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.preiner_2012.fits import bare
from experiments.suite import row_of
from experiments.tables import Row
from viewer.analysis.visible_normals import NormalSearch, estimate_normals
from viewer.backends import backend
from viewer.bench.plan import Group
from viewer.bench.run import LOOK, Bench, undisturbed
from viewer.camera import Camera
from viewer.drawing.request import Request
from viewer.drawing.timing import draw
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose

BACKEND = "auto_splats"
K = 10
SEARCH = "search"  # the stage
STAGES = ("projection", "search", "splats", "shading")
# The stage of each pass that has a name of its own; lists and counts before one are of its stage.
_STAGE_OF = {
    "depth": "projection",
    "id": "projection",
    **dict.fromkeys(
        ("nearest", "planes", "arrange", "usual", "active", "search", "unknown", "late"), "search"
    ),
    **dict.fromkeys(("work", "show", "shrink", "again", "limit", "limits", "visibility", "blend"), "splats"),
    **dict.fromkeys(("splat", "normals", "copy", "resolve", "values"), "splats"),
    "shade": "shading",
}
_DENSE = 10_000_000
_ELEVATION = 10.0
_ELSEWHERE = 90.0  # degrees aside that the picture before is from, where nothing of it shall help
_STEP = 0.5  # degrees from one picture to the next while the camera moves
_WORKERS = 2  # of the k-d tree
KS = (K, 5, 20, 30)  # the first is the paper's


@dataclass(frozen=True)
class Searched:
    """A scene whose search is timed. paper: the one of Table 1 that it stands for, or empty.

    count: points; None: as many as it has. zoom: how much nearer the camera is than shows all of it.
    """

    scene: str
    zoom: float
    paper: str = ""
    count: int | None = None


SCENES = (
    Searched("bunny", 1.0, "Bunny"),
    Searched("igea", 1.0),
    Searched("dragon", 1.6),
    Searched("dragon-scans", 1.6, "Imperia"),
    Searched("horses", 1.6, "Horses"),
    Searched("dragon", 1.6, "Cathedral", _DENSE),
)


def rounds_of(surface: Surface) -> list[int]:
    """How many points were left before each round of the search for a surface's last picture."""
    _, *known = surface.stats.counted["neighbourhoods by searches"]().values()  # none is kept
    return [sum(known[number:]) for number in range(len(known))]


def by_stage(passes: Sequence[tuple[str, float]]) -> dict[str, float]:
    """Milliseconds of each stage, of the passes of a picture in their order.

    The search is all from the list of what is seen to radii and planes.
    """
    taken, stage = dict.fromkeys(STAGES, 0.0), STAGES[-1]
    for name, ms in reversed(passes):
        stage = _STAGE_OF.get(name, stage)
        taken[stage] += ms
    return taken


def measure_searches(bench: Bench) -> Iterator[Row]:
    """Yield a row for each scene, number of neighbours, and with grid culling and without."""
    size = bench.settings.size
    for searched in SCENES:
        subject = bench.subject(Group(searched.scene, (), count=searched.count))
        moment = subject.moment(0)
        pose = Pose(0, 0.0, "bare", bare(moment.pose.cloud))
        camera = Camera.orbit(moment.mesh.bounds, 0, _ELEVATION, aspect=size[0] / size[1], up=subject.up)
        yield from search_rows(bench, pose, camera.zoomed(searched.zoom), searched)


def search_rows(bench: Bench, pose: Pose, camera: Camera, searched: Searched) -> Iterator[Row]:
    """Rows of one scene: the paper's number of neighbours with and without culling beside trees; others."""
    found = estimate_normals(pose, camera, size=bench.settings.size, search=NormalSearch(K))
    rows = found.rows
    settings = [{"k": K, "cull": cull} for cull in (False, True)]
    settings += [{"k": k, "cull": True} for k in KS[1:]]
    repeat = bench.settings.repeat
    with undisturbed():
        trees: list[dict[str, float]] = []
        for params in settings:
            compared = params["k"] == K
            taken: list[dict[str, dict[str, float]]] = []
            rounds: list[int] = []
            for _ in range(repeat):
                times, rounds = _pictures(bench, pose, camera, params)
                taken.append(times)
                if compared and len(trees) < repeat:
                    trees.append(_trees(pose, rows, K))
            yield row_of(
                bench,
                scene=searched.scene,
                paper=searched.paper,
                n=len(pose.cloud),
                visible=len(rows),
                participants=len(found.neighbors),
                params=params,
                trees=_medians(trees) if compared else {},
                rounds=rounds,
                **{frame: _medians([each[frame] for each in taken]) for frame in taken[0]},
            )


def _pictures(
    bench: Bench, pose: Pose, camera: Camera, params: dict[str, Any]
) -> tuple[dict[str, dict[str, float]], list[int]]:
    """(milliseconds of each stage of a picture that has nothing to do with the one before, of one from a
    little aside, and of the same again; how many points were left before each round of the first one's
    search)."""
    surface, timers = Surface(bench.renderer.gpu, bench.settings.size), bench.renderer.gpu.timers
    elsewhere, aside = camera.orbited(_ELSEWHERE, 0), camera.orbited(_STEP, 0)
    taken: dict[str, dict[str, float]] = {}
    rounds: list[int] = []
    other = {**params, "k": params["k"] - 1}  # whose picture keeps no neighbors for the next one
    untimed = [("", camera, params), ("", elsewhere, other)]
    timed = [("first", camera, params), ("later", aside, params), ("still", aside, params)]
    for name, seen_from, asked in (*untimed, *timed):
        timers.enabled = bool(name)
        try:
            request = Request(pose, seen_from, BACKEND, backend(BACKEND).params(asked), LOOK)
            draw(bench.renderer, request, surface)
        finally:
            timers.enabled = False
        if name:
            taken[name] = by_stage(surface.stats.passes)
        if name == "first":
            rounds = rounds_of(surface)
    surface.release()
    return taken, rounds


def _trees(pose: Pose, rows: np.ndarray, k: int) -> dict[str, float]:
    """Milliseconds that a k-d tree takes to be built and asked, of the visible points and of all."""
    from scipy.spatial import cKDTree

    taken: dict[str, float] = {}
    for name, points in (("visible", pose.cloud.positions[rows]), ("all", pose.cloud.positions)):
        points = points.astype(np.float64)
        start = time.perf_counter()
        tree = cKDTree(points)
        built = time.perf_counter()
        tree.query(points, min(k, len(points)), workers=_WORKERS)
        done = time.perf_counter()
        taken |= {f"{name}_build": 1e3 * (built - start), name: 1e3 * (done - start)}
    return taken


def _medians(runs: list[dict[str, float]]) -> dict[str, float]:
    return {name: float(np.median([run[name] for run in runs])) for name in runs[0]}
