"""Which defaults another value beats, and why they stay: the tables of docs/developing/defaults.md."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...backends import backend
from ...errors import InputError
from ..baselines import FLOOR
from . import measurement
from .measurement import Measurement, machines_of_today, markdown_table, spaced, write_measurement
from .page import three_digits
from .results import METRICS, Row, read_rows

NAME, PAGE = "defaults", "defaults.md"
# Errors, and how little of each tells nothing.
_ERRORS = {
    "open_percent": 0.02, "spill_percent": 0.05, "wrong_layer_percent": 0.02, "depth_median_px": 0.01,
    "depth_p95_px": 0.02, "normal_median": 0.05, "normal_p95": 0.2, "rms": 0.2,
}  # fmt: skip
_BETTER, _SLOWER, _FASTER = 0.05, 1.05, 0.9  # parts of an error; times the time
_PREPARES_SLOWER, _PREPARE_MS = 1.5, 5.0  # times the time by the wall clock, and what tells nothing of it
_SAME = 1e-3  # parts of an error by which values that affect speed alone may differ

# --- files ----------------------------------------------------------------------------


def write_defaults(folder: Path) -> Path:
    """Make defaults.json and defaults.md of the results in a folder; gives the page. Raises InputError."""
    made = digest(read_rows(folder))
    return write_measurement(folder, NAME, made, "\n\n".join(tables([made]).values()) + "\n")


def digest(rows: Sequence[Row]) -> Measurement:
    """The part of a run that the page needs: of each value its errors, and times as parts of the default's.

    Raises InputError where the rows are of another suite.
    """
    usual = {row["scene"]: row for row in rows if row["sweep"] == "" and row["backend"] != FLOOR}
    tried = [row for row in rows if row["sweep"] and row["sweep"] in row["params"]]
    if not tried:
        raise InputError("no such rows among the results", hint=f"Run scan4d bench --suite {NAME}")
    kept = [_tried(row, usual[row["scene"]]) for row in tried]
    return {**measurement.digest(list(usual.values()), NAME, {"rows": kept}), "params": {}}


def read_measurement(path: Path) -> Measurement:
    """A measurement as it was written. Raises InputError for what is none."""
    return measurement.read_measurement(path, ["rows"], NAME)


def _tried(row: Row, usual: Row) -> dict[str, Any]:
    """A value beside the default: on each view all took turns."""
    kind = "gpu_ms" if row["timer"] == "query" else "busy_ms"
    times = [each["times_by_view"][kind] for each in (row, usual)]
    ratios = [now / was for now, was in zip(*times, strict=True) if was > 0]
    parameter = row["sweep"]
    return {
        "scene": row["scene"],
        "n": row["n"],
        "backend": row["backend"],
        "parameter": parameter,
        "default": usual["params"][parameter],
        "value": row["params"][parameter],
        "time": round(float(np.median(ratios)), 3),
        "prepare": [round(METRICS["prepare_ms"].of(r), 1) for r in (usual, row)],
        "errors": {name: [_error(r, name) for r in (usual, row)] for name in _ERRORS},
        "gpu_ms": [round(ms, 2) for ms in row["times_by_view"]["gpu_ms"]],
    }


def _error(row: Row, name: str) -> float | None:
    """An error, less is better: closed as what is open, PSNR as the rms difference; None: undefined."""
    errors = row["errors"]
    if name == "open_percent":
        value = 100 - errors["closed_percent"]
    elif name == "rms":
        value = 255 * 10 ** (-errors["psnr"] / 20)
    else:
        value = errors[name]
    return round(value, 5) if math.isfinite(value) else None


# --- what beats a default -------------------------------------------------------------


def beats(row: dict[str, Any]) -> dict[str, tuple[float, float]]:
    """The errors in which a value beats the default, from and to; none where it does not.

    It does where one error is less by more than 5 %, none is more by more than 5 %, a picture takes at most
    1.05 times as long, and its preparation, which the wall clock tells, at most 1.5 times. A value that
    affects speed alone beats it with the same errors in less than 0.9 times the time, and then by "time".
    """
    before, after = row["prepare"]
    if row["time"] > _SLOWER or after > max(_PREPARES_SLOWER * before, before + _PREPARE_MS):
        return {}
    known = {name: pair for name, pair in row["errors"].items() if None not in pair}
    if _affects(row) == "speed":
        same = all(abs(was - now) <= max(_SAME * was, _ERRORS[name]) for name, (was, now) in known.items())
        return {"time": (1.0, row["time"])} if same and row["time"] < _FASTER else {}
    better = {name: pair for name, pair in known.items() if _is_less(name, pair[1], pair[0])}
    worse = any(_is_less(name, was, now) for name, (was, now) in known.items())
    return {} if worse else better


def _is_less(name: str, one: float, other: float) -> bool:
    return other - one > max(_BETTER * other, _ERRORS[name])


def _affects(row: dict[str, Any]) -> str:
    found = (p.affects for p in backend(row["backend"]).parameters if p.name == row["parameter"])
    return next(found, "draw")


# --- the page -------------------------------------------------------------------------


def tables(measurements: Sequence[Measurement]) -> dict[str, str]:
    """The parts of the page: "beaten", a line for each default that a value beats; "tried"; "machines"."""
    return {
        "beaten": _beaten(measurements),
        "tried": _tried_scenes(measurements),
        "machines": machines_of_today(measurements),
    }


def _beaten(measurements: Sequence[Measurement]) -> str:
    head = ["scene", "backend", "parameter", "default", "value", "better", "time", "why the default stays"]
    lines = [line for each in measurements for row in each["rows"] for line in _line(row)]
    if not lines:
        return "No default is beaten."
    return markdown_table(head, lines, left=[name for name in head if name != "time"])


def _line(row: dict[str, Any]) -> Iterator[list[str]]:
    if not (found := beats(row)):
        return
    gains = (f"{name} {three_digits(was)} → {three_digits(now)}" for name, (was, now) in found.items())
    reason = backend(row["backend"]).default_reasons.get(row["parameter"], "")
    values = [f"{row[name]}".lower() for name in ("default", "value")]
    named = [f"`{row['scene']}`", f"`{row['backend']}`", f"`{row['parameter']}`"]
    yield [*named, *values, "; ".join(gains), f"{row['time']:.2f}", reason]


def _tried_scenes(measurements: Sequence[Measurement]) -> str:
    """The scenes, and how many values of how many parameters were tried on each."""
    head = ["scene", "points", "backend", "parameters", "values"]
    lines = []
    for each in measurements:
        for scene in dict.fromkeys(row["scene"] for row in each["rows"]):
            own = [row for row in each["rows"] if row["scene"] == scene]
            parameters = {row["parameter"] for row in own}
            counts = [str(len(parameters)), str(len(own))]
            lines.append([f"`{scene}`", spaced(own[0]["n"]), f"`{own[0]['backend']}`", *counts])
    return markdown_table(head, lines, left=("scene", "backend"))
