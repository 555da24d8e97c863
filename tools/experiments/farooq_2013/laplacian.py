"""Views merged band by band, against blends and the truth (Farooq 2013, 6.2)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from experiments.farooq_2013 import splines
from experiments.farooq_2013.seams import SCALES
from experiments.farooq_2013.splines import BEST, BY_LEVELS, LEVELS, LINEAR, PICTURE, SCENES, ZOOMS
from experiments.suite import Part, Suite
from experiments.tables import Column, Machines, Row, StoredRun, Table, at, code, grouped, of_all
from viewer.bench.metrics import aggregate
from viewer.bench.run import BenchSettings


def _means(row: Row) -> dict[str, float]:
    """The means of all errors over the pictures of a row."""
    return {name: float(np.mean([view[name] for view in row["by_view"]])) for name in row["by_view"][0]}


def _seams(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """Visibility of seams by how views are merged, and how fine detail fares."""
    for rows in grouped(runs[0]["rows"], "scene").values():
        total = {row["merging"]: _means(row)["seam"] for row in rows}
        for row in rows:
            means = _means(row)
            detail = means["detail"] - means["detail_alone"]
            yield {
                **row,
                **means,
                "linear": total[LINEAR.name] / means["seam"],
                "best": total[BEST.name] / means["seam"],
                "gain": f"{detail:+.2f}" if np.isfinite(detail) else "",
            }


def _sizes(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """PSNR by pixels a sample."""
    for (scene, merging), rows in grouped(runs[0]["sizes"], "scene", "merging").items():
        found = {}
        for row in rows:
            by_name = {name: [view[name] for view in row["by_view"]] for name in row["by_view"][0]}
            found[f"{row['zoom']:g}"] = aggregate(by_name)["psnr_scanned"]
        yield {"scene": scene, "merging": merging, **found, "range": float(np.ptp(list(found.values())))}


def _passes(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """Times of the passes of most levels, by level; those before the bands are of none."""
    for row in of_all("times")(runs):
        if (row["pods"], row["merging"]) != (2, BY_LEVELS[-1].name):
            continue
        parts: dict[str, dict[str, float]] = {}
        for name, ms in row["passes"].items():
            stage, _, level = name.partition(" level ")
            parts.setdefault(stage, {})[level] = ms
        for stage, by_level in parts.items():
            yield {"device": row["device"], "pass": stage, "at": by_level}


_MERGED = Column("merged", "merging", left=True)
_MACHINE = Column("machine", "device")

EXPERIMENT = Suite(
    page="laplacian.md",
    parts={
        "rows": Part(("scene", "merging", "by_view"), splines.measure_seams),
        "alone": Part(("scene", "merging", "by_view"), splines.measure_alone, by_scene=True),
        "sizes": Part(("scene", "merging", "zoom", "by_view"), splines.measure_sizes),
        "times": Part(("merging", "pods", "wall_ms", "busy_ms", "passes"), splines.measure_bands),
    },
    tables=[
        Table(
            "seams",
            [
                code("scene"), _MERGED, *(Column(f"{scale} px", f"seam_{scale}") for scale in SCALES),
                Column("visibility", "seam"), Column("times under linear", "linear"), Column("under best",
                "best"),
                Column("fine detail, dB", "gain"), Column("shown, %", "shown", "{:.1f}"),
            ],
            _seams,
        ),
        Table(
            "alone",
            [
                code("scene"), Column("drawn", "merging", left=True),
                Column("mean, steps of 255", lambda row: _means(row)["mean"]),
                Column("largest", lambda row: max(view["worst"] for view in row["by_view"])),
            ],
            "alone",
        ),
        Table(
            "sizes",
            [
                code("scene"), _MERGED, *(Column(f"{zoom:g}", at(f"{zoom:g}"), "{:.1f}") for zoom in ZOOMS),
                Column("from best to worst", "range", "{:.1f}"),
            ],
            _sizes,
        ),
        Table(
            "times",
            [
                _MACHINE, Column("views", "pods"), _MERGED, Column("wall, ms", "wall_ms"),
                Column("processor, ms", "busy_ms"),
            ],
            of_all("times"),
        ),
        Table(
            "passes",
            [
                _MACHINE, Column("pass"), Column("ms", at("at", "")),
                *(Column(f"level {level}", at("at", str(level))) for level in range(LEVELS[-1])),
            ],
            _passes,
        ),
        Machines(),
    ],
    scenes=SCENES,
    pictures={PICTURE: None},
    usual=BenchSettings(size=(640, 480), views=3, frames=0),
    quick=(SCENES[:1], 1),
)  # fmt: skip
