"""All renderers on a few scenes, beside floor and ceiling: the last table of docs/developing/benchmark.md."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..baselines import FLOOR
from . import measurement
from .measurement import (
    Measurement,
    machines_of_today,
    markdown_table,
    rounded_errors,
    rounded_times,
    spaced,
    write_measurement,
)
from .page import three_digits
from .results import Row, read_rows

NAME, PAGE = "scene-table", "benchmark.md"
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


def write_scene_table(folder: Path) -> Path:
    """Make scene-table.json and scene-table.md of the results in a folder; gives the page."""
    made = digest(read_rows(folder))
    return write_measurement(folder, NAME, made, "\n\n".join(tables([made]).values()) + "\n")


def digest(rows: Sequence[Row]) -> Measurement:
    """The part of a run that the table needs: the defaults of all renderers."""
    defaults = [row for row in rows if row["sweep"] == ""]
    return measurement.digest(defaults, "summary", {"rows": [_default(row) for row in defaults]})


def read_measurement(path: Path) -> Measurement:
    """A measurement as it was written. Raises InputError for what is none."""
    return measurement.read_measurement(path, ["rows"], "summary")


def _default(row: Row) -> dict[str, Any]:
    kept = {name: row[name] for name in ("scene", "n", "backend")}
    return {**kept, **rounded_times(row), "errors": rounded_errors(row, _ERRORS)}


def tables(measurements: Sequence[Measurement]) -> dict[str, str]:
    """The parts of the page: "scenes", a line for each scene and renderer of one machine, and "machines"."""
    head = ["scene", "points", "renderer", "times as long as gl-points", *_ERRORS.values()]
    rows = measurements[0]["rows"]
    floors = {row["scene"]: row for row in rows if row["backend"] == FLOOR}
    lines, above = [], None
    for row in rows:
        named = ["", ""] if row["scene"] == above else [f"`{row['scene']}`", spaced(row["n"])]
        ratio = float(np.median(np.divide(row["busy_ms"], floors[row["scene"]]["busy_ms"])))
        errors = (three_digits(row["errors"].get(name, np.nan)) for name in _ERRORS)
        lines.append([*named, f"`{row['backend']}`", three_digits(ratio), *errors])
        above = row["scene"]
    return {
        "scenes": markdown_table(head, lines, left=("scene", "renderer")),
        "machines": machines_of_today(measurements),
    }
