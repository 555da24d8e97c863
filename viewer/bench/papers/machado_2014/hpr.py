"""Which points are visible, then and now: the tables of docs/how-it-works/hpr.md."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ....files import output_folder
from ...report import measurement
from ...report.measurement import Measurement, markdown_table, rows_if_any, spaced, write_measurement
from ...report.page import three_digits
from ...report.plots import curves, png
from ...report.results import GROWTH, SPEEDS, VISIBILITY, Row
from . import accuracy
from .pictures import GROWTH_PICTURE
from .speed import PICTURE, paper
from .verdicts import AUTOMATIC, BEST, COMBINED, EXACT, HULL, HULL_AT_4M, KATZ, pooled

NAME, PAGE = "hpr", "hpr.md"
_RADII = (BEST, AUTOMATIC, KATZ)
_METHODS = (EXACT, HULL, HULL_AT_4M, COMBINED)
_PEERS = (accuracy.EXPONENTIAL, accuracy.SHARP, accuracy.IMAGE_SPACE, accuracy.RELAXED)
_MEGA = 1e6


# --- files ----------------------------------------------------------------------------


def write_hpr(folder: Path) -> Path:
    """Make hpr.json and hpr.md of the results in a folder; gives the page.

    Raises InputError where they are of another suite.
    """
    made = digest(*(rows_if_any(folder / name) for name in (VISIBILITY, GROWTH, SPEEDS)))
    _plot_growth(made["growth"], folder / GROWTH_PICTURE)
    return write_measurement(folder, NAME, made, "\n\n".join(tables([made]).values()) + "\n")


def digest(visibility: Sequence[Row], growth: Sequence[Row], speeds: Sequence[Row]) -> Measurement:
    """The part of a run that the page needs. Raises InputError where the rows are of another suite."""
    kept = {
        "rows": _picked(visibility, ("scene", "n", "noise", "method", "radius", "views", "by_view")),
        "growth": _picked(growth, ("scene", "n", "method", "visible", "error", *_GROWN)),
        "speeds": _picked(speeds, ("scene", "n", "sectors", "visible", "busy_ms", "wall_ms")),
    }
    return measurement.digest(visibility, NAME, kept)


_GROWN = ("sectors", "automatic", "steps", "nbytes", "held", "inside")  # which the exact operator has none of


def _picked(rows: Iterable[Row], names: Sequence[str]) -> list[dict[str, Any]]:
    return [{name: row[name] for name in names if name in row} for row in rows]


def read_measurement(path: Path) -> Measurement:
    """A measurement as it was written. Raises InputError for what is none."""
    return measurement.read_measurement(path, ["rows", "growth", "speeds"], NAME)


# --- tables ---------------------------------------------------------------------------


def tables(measurements: Sequence[Measurement]) -> dict[str, str]:
    """The tables of the page by name; errors are the first measurement's."""
    rows = measurements[0]["rows"]
    return {
        "accuracy": _accuracy([row for row in rows if not row["noise"]]),
        "noise": _noise(rows),
        "peers": _peers(rows),
        "growth": _growth(measurements[0]["growth"]),
        "speed": _speed(measurements),
        "machines": "\n".join(map(_machine, measurements)),
    }


def _accuracy(rows: Sequence[dict[str, Any]]) -> str:
    """Counts and errors by radius and method, without noise; the paper's above them."""
    head = ["scene", "points", "R", "method", "missed", "extra", "correct", "error, %"]
    lines = []
    for line in paper()["accuracy"]:
        counts = [spaced(line[name]) if name in line else "" for name in ("missed", "extra", "correct")]
        lines.append(
            [f"{line['model']}, 2014", spaced(line["points"]), line["radius"], line["method"], *counts,
             str(line["percent"])]
        )  # fmt: skip
    for row in rows:
        if row["radius"] in _RADII and row["method"] in _METHODS:
            found, times = pooled(row["by_view"]), [view["radius"] for view in row["by_view"]]
            counts = [spaced(count) for count in (found.missed, found.extra, found.correct)]
            radius = f"{row['radius']}: {spaced(np.median(times))}"
            lines.append(
                [f"`{row['scene']}`", spaced(row["n"]), radius, row["method"], *counts, f"{found.error:.1f}"]
            )
    return markdown_table(head, lines, left=("scene", "R", "method"))


def _noise(rows: Sequence[dict[str, Any]]) -> str:
    """Errors by noise, at both radii."""
    shown = (EXACT, HULL, COMBINED)
    head = [
        "scene",
        "noise, %",
        *(f"{method}, {radius} R" for radius in (BEST, AUTOMATIC) for method in shown),
    ]
    lines = []
    for scene, noise in dict.fromkeys((row["scene"], row["noise"]) for row in rows):
        errors = [
            _error(rows, scene, noise, method, radius) for radius in (BEST, AUTOMATIC) for method in shown
        ]
        lines.append([f"`{scene}`", f"{100 * noise:g}", *errors])
    return markdown_table(head, lines, left=("scene",))


def _peers(rows: Sequence[dict[str, Any]]) -> str:
    """Errors of all methods, each at its best."""
    head = ["scene", "noise, %", EXACT, HULL, COMBINED, *_PEERS]
    lines = []
    for scene, noise in dict.fromkeys((row["scene"], row["noise"]) for row in rows):
        own = [_error(rows, scene, noise, method, BEST) for method in (EXACT, HULL, COMBINED)]
        others = [_error(rows, scene, noise, method) for method in _PEERS]
        lines.append([f"`{scene}`", f"{100 * noise:g}", *own, *others])
    return markdown_table(head, lines, left=("scene",))


def _error(
    rows: Sequence[dict[str, Any]], scene: str, noise: float, method: str, radius: str | None = None
) -> str:
    for row in rows:
        same = (row["scene"], row["noise"], row["method"]) == (scene, noise, method)
        if same and radius in (None, row["radius"]):
            return f"{pooled(row['by_view']).error:.1f}"
    return ""


def _growth(rows: Sequence[dict[str, Any]]) -> str:
    """Visible points, errors and memory by the number of sectors."""
    head = ["scene", "k", "visible", "error, %", "steps", "MB", "hold a point, %", "in the outline, %"]
    lines = []
    for row in sorted(rows, key=lambda row: (_place(rows, row), row.get("sectors", np.inf))):
        told = [spaced(row["visible"]), f"{row['error']:.1f}"]
        if row["method"] == EXACT:
            lines.append([f"`{row['scene']}`", EXACT, *told, *[""] * 4])
            continue
        count = spaced(row["sectors"]) + (", automatic" if row["automatic"] else "")
        shares = [three_digits(100 * row[name]) for name in ("held", "inside")]
        lines.append(
            [f"`{row['scene']}`", count, *told, str(row["steps"]), spaced(row["nbytes"] / _MEGA), *shares]
        )
    return markdown_table(head, lines, left=("scene",))


def _plot_growth(rows: Sequence[dict[str, Any]], path: Path) -> None:
    """Fig. 14 as a picture: visible points by the number of sectors, beside the exact operator's."""
    exact = {row["scene"]: row["visible"] for row in rows if row["method"] == EXACT}
    found = {
        scene: sorted(
            (row["sectors"], row["visible"])
            for row in rows
            if row["scene"] == scene and row["method"] != EXACT
        )
        for scene in exact
    }
    if found:
        output_folder(path.parent)
        png(curves(found, exact, "sectors, k", "visible points", "exact"), path)


def _place(rows: Sequence[dict[str, Any]], row: dict[str, Any]) -> int:
    return list(dict.fromkeys(each["scene"] for each in rows)).index(row["scene"])


def _speed(measurements: Sequence[Measurement]) -> str:
    """Table 1: the paper's pictures a second as milliseconds, and ours."""
    head = [
        "scene", "machine", "points", "k", "visible", "exact, ms", "hull, ms", "times as fast",
        "combined, ms", "times as fast", "a picture, ms",
    ]  # fmt: skip
    lines = []
    for line in paper()["speed"]:
        counts = [spaced(line[name]) for name in ("points", "sectors", "visible")]
        for name, kind in (("cpu_fps", "CPU"), ("shader_fps", "GPU")):
            ms, exact = 1e3 / line[name], 1e3 / line["exact_fps"]
            told = [three_digits(value) for value in (exact, ms, exact / ms)]
            lines.append([f"{line['model']}, 2014", kind, *counts, *told, "", "", ""])
    for each in measurements:
        kind = "busy_ms" if each["timer"] == "finish" else "wall_ms"
        for row in each["speeds"]:
            taken = row[kind]
            exact, hull, combined = (taken.get(name, np.nan) for name in (EXACT, HULL, COMBINED))
            shown = [exact, hull, exact / hull, combined, exact / combined, taken[PICTURE]]
            counts = [spaced(row[name]) for name in ("n", "sectors", "visible")]
            lines.append([f"`{row['scene']}`", each["device"], *counts, *map(three_digits, shown)])
    return markdown_table(head, lines, left=("scene", "machine"))


def _machine(each: Measurement) -> str:
    told = f"* **{each['device']}**: {each['driver']}, {each['processors']} processors; "
    return told + f"Scan4D {each['version']}, {each['date']}" + (f". {each['note']}" if each["note"] else "")
