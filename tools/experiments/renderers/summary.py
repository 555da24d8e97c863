"""All renderers with their defaults on a few scenes, beside floor and ceiling."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from experiments.suite import Suite, pictures
from experiments.tables import Column, Machines, Row, StoredRun, Table, code, columns
from viewer.backends import backends
from viewer.bench.baselines import FLOOR
from viewer.bench.plan import plan
from viewer.bench.run import BenchSettings

_ERRORS = {
    "hole_percent": "holes, %",
    "through_percent": "through, %",
    "spill_percent": "spill, %",
    "depth_median_px": "depth, median px",
    "wrong_layer_percent": "wrong layer, %",
    "normal_median": "normals, median °",
    "psnr": "PSNR, dB",
    "flip": "ꟻLIP",
    "visibility_error_percent": "points' visibility, %",
}


def _scenes(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """The pictures of one machine, with times as parts of those of plain points."""
    rows = runs[0]["rows"]
    floors = {row["scene"]: row["busy_ms"] for row in rows if row["backend"] == FLOOR}
    for row in rows:
        yield {**row, "ratio": float(np.median(np.divide(row["busy_ms"], floors[row["scene"]])))}


EXPERIMENT = Suite(
    page="benchmark.md",
    parts={"rows": pictures(_ERRORS)},
    tables=[
        Table(
            "scenes",
            [
                code("scene"), Column("points", "n"), code("renderer", "backend"),
                Column("times as long as gl-points", "ratio"), *columns("errors", _ERRORS),
            ],
            _scenes,
            merged=2,
        ),
        Machines(),
    ],
    scenes=("bunny", "bunny-bare", "bunny-ramp-bare", "dragon-scans", "bunny-scans", "truedepth-head",
    "demo"),
    groups=lambda _, scenes: plan(scenes, list(backends()), counts=(), noises=(), swept_scenes=0),
    usual=BenchSettings(size=(960, 640), frames=0),
)  # fmt: skip
