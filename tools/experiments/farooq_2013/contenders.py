"""Renderers that Farooq 2013 compares with (7.1), drawn on the same scan; and one method on CPU and GPU."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from experiments.farooq_2013.deferred_blending import deferred_blending
from experiments.farooq_2013.farooq import ERRORS, drawn_as, stored_pictures
from experiments.farooq_2013.pull_push import (
    CellsBackend,
    Reconstruction,
    differences,
    points_of,
    pull_push,
    pull_push_on_cpu,
    reconstructed,
)
from experiments.farooq_2013.pyramids import BACKEND, MOST_LEVELS, PRIMITIVES, with_levels
from experiments.suite import Part, Suite, row_of
from experiments.tables import Column, Machines, Row, StoredRun, Table, columns, of_all
from experiments.timing import by_turns
from viewer.backends import backend
from viewer.bench.baselines import RANGE_MESH
from viewer.bench.plan import Contender, Group
from viewer.bench.run import Bench, BenchSettings
from viewer.camera import Camera
from viewer.drawing.request import Request, view_of
from viewer.scan.estimate import with_estimates
from viewer.scan.points import PointCloud

SCENE = "demo-pair"
ZOOMS = (2.0, 4.0)
_SURFELS = "surfels"


def _contender(drawn: CellsBackend) -> Contender:
    def given(cloud: PointCloud, camera: Camera) -> tuple[PointCloud, CellsBackend]:
        return cloud, drawn

    return Contender(drawn.name, drawn=given)


def groups() -> list[Group]:
    """All contenders at each zoom."""
    contenders = (
        *(_contender(make()) for make in (pull_push, pull_push_on_cpu, deferred_blending)),
        *(Contender(BACKEND, with_levels(MOST_LEVELS, primitive)) for primitive in PRIMITIVES),
        Contender(_SURFELS, backend(_SURFELS).params()),
        Contender(RANGE_MESH),
    )
    return [Group(SCENE, contenders, noise=0.0, zoom=zoom, sweep="zoom") for zoom in ZOOMS]


# --- CPU and GPU ----------------------------------------------------------------------


def measure_twins(bench: Bench) -> Iterator[Row]:
    """Yield a row for each zoom: times of pull and push on both, ms, and how far their cells differ."""
    subject = bench.subject(Group(SCENE, (), noise=0.0))
    gpu, settings = bench.renderer.gpu, bench.settings
    pose = with_estimates(subject.moment(0).pose, ("normals", "radii"))
    for zoom in ZOOMS:
        _, camera = bench.seen(subject, 0, zoom)
        view = view_of(Request(pose, camera), settings.size)
        points = points_of(pose.cloud.centered(view.origin))
        drawn = Reconstruction(gpu, points, settings.size)
        works: dict[str, Callable[[], object]] = {
            "gpu": partial(drawn.draw, view),
            "cpu": partial(reconstructed, points, view),
        }
        taken = by_turns(works, settings.repeat, gpu.ctx.finish)
        yield row_of(
            bench,
            scene=SCENE,
            n=len(points),
            zoom=zoom,
            busy_ms={name: each.busy for name, each in taken.items()},
            wall_ms={name: each.wall for name, each in taken.items()},
            **differences(drawn.read(), reconstructed(points, view)),
        )
        drawn.release()


# --- tables ---------------------------------------------------------------------------


def _rows(runs: Sequence[StoredRun]) -> Iterator[Row]:
    for row in of_all("rows")(runs):
        known = drawn_as(row) if row["backend"] == BACKEND else f"`{row['backend']}`"
        yield {**row, "drawn": f"`{BACKEND}`, {known}" if row["backend"] == BACKEND else known}


def _median(name: str) -> Column:
    title = {"gpu_ms": "ms", "busy_ms": "processor, ms"}[name]
    return Column(title, lambda row: float(np.median(row[name])))


EXPERIMENT = Suite(
    page="farooq.md",
    parts={
        "rows": Part(stored_pictures, sweeps=["zoom"]),
        "twins": Part(
            ("scene", "n", "zoom", "busy_ms", "wall_ms", "pixels", "covered", "depth", "color", "normal"),
            measure_twins,
        ),
    },
    tables=[
        Table(
            "contenders",
            [
                Column("pixels a sample", "zoom", "{:g}"), Column("drawn"), *columns("errors", ERRORS),
                _median("gpu_ms"), _median("busy_ms"),
            ],
            _rows,
            merged=1,
        ),
        Table(
            "twins",
            [
                Column("machine", "device"), Column("pixels a sample", "zoom", "{:g}"), Column("points", "n"),
                Column("GPU, processor ms", "busy_ms.gpu"), Column("wall, ms", "wall_ms.gpu"),
                Column("CPU, processor ms", "busy_ms.cpu"), Column("wall, ms", "wall_ms.cpu"),
                Column("pixels that differ, %", "pixels"), Column("covered by one alone, %", "covered"),
                Column("depth", "depth", "{:.1g}"), Column("colour", "color", "{:.1g}"),
                Column("normal", "normal", "{:.1g}"),
            ],
            of_all("twins"),
        ),
        Machines(name="contender_machines"),
    ],
    groups=lambda *_: groups(),
    usual=BenchSettings(size=(480, 360), views=4, frames=0),
)  # fmt: skip
