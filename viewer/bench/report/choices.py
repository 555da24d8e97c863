"""How good automatic choices were: how many kept their bound, and how near they came to the best that did."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from ..choosing import GOALS
from . import measurement
from .measurement import markdown_table, write_measurement
from .page import three_digits
from .results import CHOICES, Row, read_rows

NAME, PAGE = "choice", "automatic.md"
NEAR = 1.2  # times the best, up to which a choice counts as near it
_SMALLEST = 0.1  # pixels: smaller errors are as good as this


def judged(rows: Sequence[Row], kind: str, bound: float, name: str) -> dict[str, Any] | None:
    """Outcome of the choices for one goal, of rows of `measure_choices`; None where there was none.

    views: with a choice. possible: of them, those in which a way keeps the bound. kept: of these, those in
    which the chosen one does. ratio, mean_ratio: median and geometric mean of the chosen one's error, or
    time, in parts of that of the best that keeps the bound. near: how many of the kept are within 1.2 of it.
    """
    bounded, other = ("ms", "error") if kind == "time" else ("error", "ms")
    views, ratios = 0, []
    for ways in _views(rows):
        chosen = next((row for row in ways if name in row["chosen"]), None)
        keeping = [row for row in ways if row[bounded] <= bound]
        views += chosen is not None
        if chosen is not None and keeping:
            best = max(min(row[other] for row in keeping), _SMALLEST)
            ratio = max(chosen[other], _SMALLEST) / best
            ratios.append(ratio if chosen[bounded] <= bound else np.nan)
    if not views:
        return None
    kept = [ratio for ratio in ratios if np.isfinite(ratio)]
    return {
        "goal": name,
        "kind": kind,
        "views": views,
        "possible": len(ratios),
        "kept": len(kept),
        "near": sum(ratio <= NEAR for ratio in kept),
        "ratio": round(float(np.median(kept)), 4) if kept else None,
        "mean_ratio": round(float(np.exp(np.mean(np.log(kept)))), 4) if kept else None,
    }


def _views(rows: Sequence[Row]) -> Iterator[list[Row]]:
    for _, ways in groupby(rows, key=lambda row: (row["scene"], row["seed"], row["view"])):
        yield list(ways)


def write_choices(folder: Path) -> Path:
    """Make choice.json and choice.md of the results in a folder; gives the page."""
    rows = read_rows(folder / CHOICES)
    found = [judged(rows, goal.kind, goal.bound, str(goal)) for goal in GOALS]
    kept = {"rows": [each for each in found if each is not None]}
    made = measurement.digest([{**row, "params": {}} for row in rows], NAME, kept)
    return write_measurement(folder, NAME, made, "\n\n".join(tables([made]).values()) + "\n")


def read_measurement(path: Path) -> measurement.Measurement:
    """A measurement as it was written. Raises InputError for what is none."""
    return measurement.read_measurement(path, ["rows"], NAME)


def tables(measurements: Sequence[measurement.Measurement]) -> dict[str, str]:
    """The part of the page: "choices", a line for each bound on one machine."""
    head = [
        "limit",
        "views",
        "possible",
        "met, %",
        "at most 1.2 times the best, %",
        "median ratio",
    ]
    lines = []
    for row in measurements[0]["rows"]:
        kept = 100 * row["kept"] / row["possible"] if row["possible"] else np.nan
        near = 100 * row["near"] / row["kept"] if row["kept"] else np.nan
        ratio = "" if row["ratio"] is None else three_digits(row["ratio"])
        shares = [f"{kept:.1f}", f"{near:.1f}"] if row["kept"] else ["", ""]
        lines.append([row["goal"], str(row["views"]), str(row["possible"]), *shares, ratio])
    return {"choices": markdown_table(head, lines, left=("limit",))}
