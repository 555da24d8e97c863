"""Machado e Silva 2014: which points are visible; accuracy, noise, numbers of sectors, other methods,
time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from experiments.machado_2014 import accuracy, growth, speed, verdicts
from experiments.machado_2014.shown import ERROR_PICTURE, GROWTH_PICTURE, SECTOR_PICTURE
from experiments.machado_2014.verdicts import (
    AUTOMATIC,
    BEST,
    COMBINED,
    EXACT,
    HULL,
    HULL_AT_4M,
    KATZ,
    OF_PAPER,
    OF_PAPER_AT_4M,
    pooled,
)
from experiments.suite import Part, Suite
from experiments.tables import Column, Machines, Row, StoredRun, Table, at, code, grouped, of_all, spaced
from viewer.bench.run import Bench, BenchSettings
from viewer.files import output_folder, whole_file

_RADII = (BEST, AUTOMATIC, KATZ)
_METHODS = (EXACT, HULL, HULL_AT_4M, OF_PAPER, OF_PAPER_AT_4M, COMBINED)
_SHOWN = (EXACT, HULL, COMBINED)
_PEERS = (accuracy.EXPONENTIAL, accuracy.SHARP, accuracy.IMAGE_SPACE, accuracy.RELAXED)
_GROWN = ("sectors", "automatic", "steps", "nbytes", "held", "inside")  # which the exact operator has none of


def _accuracy(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """Counts and errors by radius and method, without noise; the paper's above them."""
    for line in verdicts.PAPER["accuracy"]:
        yield {
            **dict.fromkeys(("missed", "extra", "correct")), **line, "scene": f"{line['model']}, 2014",
            "error": str(line["percent"]),
        }  # fmt: skip
    for row in runs[0]["rows"]:
        if not row["noise"] and row["radius"] in _RADII and row["method"] in _METHODS:
            found, times = pooled(row["by_view"]), [view["radius"] for view in row["by_view"]]
            counts = {"missed": found.missed, "extra": found.extra, "correct": found.correct}
            radius = f"{row['radius']}: {spaced(float(np.median(times)))}"
            named = {
                "scene": f"`{row['scene']}`",
                "points": row["n"],
                "radius": radius,
                "method": row["method"],
            }
            yield {**named, **counts, "error": f"{found.error:.1f}"}


def _by_noise(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """The errors by noise: of each method and radius, and of each method at its best."""
    for (scene, noise), rows in grouped(runs[0]["rows"], "scene", "noise").items():
        errors: dict[str, float] = {}
        for row in rows:
            error = pooled(row["by_view"]).error
            errors.setdefault(f"{row['method']}, {row['radius']} R", error)
            errors.setdefault(row["method"] if row["radius"] in (BEST, "") else "", error)
        yield {"scene": scene, "noise": 100 * noise, "errors": errors}


def _noise_table(name: str, titles: Sequence[str]) -> Table:
    errors = (Column(title, at("errors", title), "{:.1f}") for title in titles)
    return Table(name, [code("scene"), Column("noise, %", "noise", "{:g}"), *errors], _by_noise)


def _growth(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """Visible points, errors and memory by the number of sectors."""
    for rows in grouped(runs[0]["growth"], "scene").values():
        for row in sorted(rows, key=lambda row: row.get("sectors", np.inf)):
            if row["method"] == EXACT:
                yield {**row, **dict.fromkeys(("steps", "MB", "held", "inside")), "k": EXACT}
                continue
            shares = {name: 100.0 * row[name] for name in ("held", "inside")}
            count = spaced(row["sectors"]) + (", automatic" if row["automatic"] else "")
            yield {**row, **shares, "k": count, "MB": round(row["nbytes"] / 1e6)}


def _speed(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """Table 1: the paper's pictures a second as milliseconds, and ours."""
    for line in verdicts.PAPER["speed"]:
        for name, kind in (("cpu_fps", "CPU"), ("shader_fps", "GPU")):
            taken = {EXACT: 1e3 / line["exact_fps"], HULL: 1e3 / line[name]}
            others = (COMBINED, "combined faster", speed.EXACT_PICTURE, speed.PICTURE, "picture faster")
            empty = dict.fromkeys(others)
            yield {
                **line, **taken, **empty, "scene": f"{line['model']}, 2014", "device": kind,
                "n": line["points"],
                "hull faster": taken[EXACT] / taken[HULL],
            }  # fmt: skip
    for row in of_all("speeds")(runs):
        taken = row["busy_ms" if row["timer"] == "finish" else "wall_ms"]
        faster = {f"{mode} faster": taken[EXACT] / taken[mode] for mode in (HULL, COMBINED)}
        faster["picture faster"] = taken[speed.EXACT_PICTURE] / taken[speed.PICTURE]
        yield {**row, **taken, **faster, "scene": f"`{row['scene']}`"}


def plot_growth(bench: Bench, run: StoredRun) -> None:
    """Fig. 14 as a picture: visible points by the number of sectors, beside the exact operator's."""
    from matplotlib.figure import Figure

    assert bench.folder is not None
    scenes = grouped(run["growth"], "scene")
    figure = Figure((4.2 * max(1, len(scenes)), 3.2), layout="constrained")
    for number, ((scene,), rows) in enumerate(scenes.items()):
        axes = figure.add_subplot(1, len(scenes), number + 1)
        found = sorted((row["sectors"], row["visible"]) for row in rows if row["method"] != EXACT)
        axes.plot(*zip(*found, strict=True), marker="o", markersize=4)
        (exact,) = (row["visible"] for row in rows if row["method"] == EXACT)
        axes.axhline(exact, color="C1", linestyle="--", label="exact")
        axes.set(title=scene, xlabel="sectors, k", ylabel="visible points", xscale="log")
        axes.set_ylim(bottom=0)
        axes.legend(loc="lower right")
    path = Path(bench.folder) / GROWTH_PICTURE
    output_folder(path.parent)
    with whole_file(path) as temporary:
        figure.savefig(temporary, format="png", dpi=110)


_VISIBLE = Column("visible")

EXPERIMENT = Suite(
    page="hpr.md",
    parts={
        "rows": Part(
            ("scene", "n", "noise", "method", "radius", "views", "by_view"), accuracy.measure_visibility
        ),
        "growth": Part(("scene", "n", "method", "visible", "error", *_GROWN), growth.measure_growth),
        "speeds": Part(
            ("scene", "n", "sectors", "visible", "busy_ms", "wall_ms"), speed.measure_speeds, by_scene=True
        ),
    },
    tables=[
        Table(
            "accuracy",
            [
                Column("scene", left=True), Column("points"), Column("R", "radius", left=True),
                Column("method"),
                Column("missed"), Column("extra"), Column("correct"), Column("error, %", "error"),
            ],
            _accuracy,
        ),
        _noise_table("noise", [f"{method}, {radius} R" for radius in (BEST, AUTOMATIC) for method in _SHOWN]),
        _noise_table("peers", [*_SHOWN, *_PEERS]),
        Table(
            "growth",
            [
                code("scene"), Column("k", left=False), _VISIBLE, Column("error, %", "error", "{:.1f}"),
                Column("steps", form="{}"), Column("MB"), Column("hold a point, %", "held"),
                Column("in the outline, %", "inside"),
            ],
            _growth,
        ),
        Table(
            "speed",
            [
                Column("scene", left=True), Column("machine", "device", left=True), Column("points", "n"),
                Column("k", "sectors"), _VISIBLE, Column("exact, ms", EXACT), Column("hull, ms", HULL),
                Column("times as fast", "hull faster"), Column("combined, ms", COMBINED),
                Column("times as fast", "combined faster"),
                Column("a picture, exact, ms", speed.EXACT_PICTURE),
                Column("a picture, combined, ms", speed.PICTURE), Column("times as fast", "picture faster"),
            ],
            _speed,
        ),
        Machines(),
    ],
    scenes=verdicts.SCENES,
    pictures={ERROR_PICTURE: None, SECTOR_PICTURE: None, GROWTH_PICTURE: plot_growth},
    usual=BenchSettings(size=(400, 300), views=2, frames=0),
    quick=(verdicts.SCENES[:1], 1),
)  # fmt: skip
