"""How good automatic choices are: how many meet their limit, and how near they come to the best that does.

The choice uses the model of this device (`scan4d bench --calibrate`); measure other views than it is fitted
to."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from experiments.suite import Part, Suite
from experiments.tables import Column, Row, StoredRun, Table
from viewer.bench.calibrating import SCENES, configuration_of, measure_ways
from viewer.bench.run import Bench, BenchSettings
from viewer.choice.choose import best
from viewer.choice.goal import PIXELS, Goal
from viewer.choice.known import model_of
from viewer.choice.model import Model
from viewer.choice.seen import ScanInView

GOALS = (
    *(Goal("time", ms) for ms in (20.0, 50.0, 100.0)),
    *(Goal("error", error, PIXELS) for error in (0.5, 1.0, 2.0)),
)
NEAR = 1.2  # times the best, up to which a choice counts as near it
_SMALLEST = 0.1  # pixels: smaller errors are as good as this


def judged(rows: Sequence[Row], kind: str, bound: float, name: str) -> dict[str, Any] | None:
    """Outcome of the choices for one goal, of rows of `measure_choices`; None where there was none.

    views: with a choice. possible: of them, those in which a configuration meets the limit. met: of these,
    those in which the chosen one does. ratio, mean_ratio: median and geometric mean of the chosen one's
    error, or time, in parts of that of the best that keeps the bound. near: how many of the met are within
    1.2 of it."""
    bounded, other = ("ms", "error") if kind == "time" else ("error", "ms")
    views, ratios = 0, []
    for configurations in _views(rows):
        chosen = next((row for row in configurations if name in row["chosen"]), None)
        keeping = [row for row in configurations if row[bounded] <= bound]
        views += chosen is not None
        if chosen is not None and keeping:
            best = max(min(row[other] for row in keeping), _SMALLEST)
            ratio = max(chosen[other], _SMALLEST) / best
            ratios.append(ratio if chosen[bounded] <= bound else np.nan)
    if not views:
        return None
    met = [ratio for ratio in ratios if np.isfinite(ratio)]
    return {
        "goal": name,
        "kind": kind,
        "views": views,
        "possible": len(ratios),
        "kept": len(met),
        "near": sum(ratio <= NEAR for ratio in met),
        "ratio": round(float(np.median(met)), 4) if met else None,
        "mean_ratio": round(float(np.exp(np.mean(np.log(met)))), 4) if met else None,
    }


def _views(rows: Sequence[Row]) -> Iterator[list[Row]]:
    for _, configurations in groupby(rows, key=lambda row: (row["scene"], row["seed"], row["view"])):
        yield list(configurations)


def measure_choices(bench: Bench, scenes: Sequence[str] = SCENES) -> Iterator[Row]:
    """Yield the rows of `measure_ways`, with what the device's model chooses. Raises InputError where it has
    none."""
    model = model_of(bench.renderer.gpu)
    for _, rows in groupby(measure_ways(bench, scenes), key=lambda row: (row["scene"], row["view"])):
        yield from with_choices(list(rows), model)


def with_choices(rows: Sequence[Row], model: Model) -> list[Row]:
    """The rows of one view, with the names of the goals that each configuration is chosen for."""
    seen = ScanInView(**rows[0]["seen"])
    known = [configuration_of(row) for row in rows if row["key"] in model]
    chosen = {str(goal): best(known, seen, goal, model).configuration for goal in GOALS} if known else {}
    return [
        {**row, "chosen": [name for name, taken in chosen.items() if taken == configuration_of(row)]}
        for row in rows
    ]


def _stored(rows: Sequence[Row]) -> Iterator[Row]:
    """The outcome of each goal."""
    for goal in GOALS:
        found = judged(rows, goal.kind, goal.bound, str(goal))
        if found is not None:
            yield found


def _choices(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """A line for each limit on one machine."""
    for row in runs[0]["rows"]:
        met = 100 * row["kept"] / row["possible"] if row["possible"] else None
        near = 100 * row["near"] / row["kept"] if row["kept"] else None
        yield {**row, "share": met if row["kept"] else None, "near": near}


EXPERIMENT = Suite(
    page="automatic.md",
    parts={"rows": Part(_stored, measure_choices, by_scene=True)},
    tables=[
        Table(
            "choices",
            [
                Column("limit", "goal", left=True), Column("views", form="{}"), Column("possible", form="{}"),
                Column("met, %", "share", "{:.1f}"),
                Column("share of views within 1.2 times the best, %", "near", "{:.1f}"),
                Column("median ratio", "ratio"),
            ],
            _choices,
        )
    ],
    scenes=SCENES,
    usual=BenchSettings(views=10, repeat=2, frames=0, seed=1),  # other views than models are fitted to
    quick=(("torus", "sheets-bare"), 2),
)  # fmt: skip
