"""Whether defaults are the best that the declarations offer: each other value beside them, scene by scene."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from experiments.suite import Part, Suite
from experiments.tables import Column, Machines, Row, StoredRun, Table, code, grouped
from viewer.backends import backend
from viewer.bench.baselines import FLOOR
from viewer.bench.plan import Contender, Group
from viewer.bench.report.page import three_digits
from viewer.bench.report.results import METRICS
from viewer.bench.run import BenchSettings
from viewer.drawing.request import backend_for
from viewer.params import Parameter

# What scans are like: exact, bare, uneven, noisy, thin, with strays, merged, range views.
SCENES = (
    "demo", "bunny", "bunny-bare", "bunny-ramp", "bunny-ramp-bare", "bunny-noise-0.5", "bunny-strays-bare",
    "armadillo-bare", "sheets", "sheets-bare", "bunny-scans", "bunny-scans-merged", "torus-pair",
)  # fmt: skip


def default_groups(settings: BenchSettings, scenes: Sequence[str]) -> list[Group]:
    """Groups of each scene: the backend that is its default, and every other value of each of its parameters.

    Raises InputError for scenes that cannot be had.
    """
    made = []
    for scene in scenes:
        pose = settings.subject(Group(scene, ())).moment(0).pose
        name, params = backend_for(pose)
        made.append(Group(scene, (Contender(FLOOR), Contender(name, params), *_others(name, params))))
    return made


def _others(name: str, params: Any) -> list[Contender]:
    """A contender for each other value of each parameter that matters beside the rest."""
    declared = backend(name)
    values = {parameter.name: getattr(params, parameter.name) for parameter in declared.parameters}
    return [
        Contender(name, declared.params({**values, parameter.name: value}), parameter.name)
        for parameter in declared.parameters
        if parameter.matters(params)
        for value in _offered(parameter)
        if value != values[parameter.name]
    ]


def _offered(parameter: Parameter) -> tuple[Any, ...]:
    """The values that a declaration offers: those of its sweep, else its choices, else on and off."""
    return parameter.sweep or parameter.choices or ((True, False) if parameter.type is bool else ())


# --- rows -----------------------------------------------------------------------------

# Errors, and how little of each tells nothing.
_ERRORS = {
    "open_percent": 0.02, "spill_percent": 0.05, "wrong_layer_percent": 0.02, "depth_median_px": 0.01,
    "depth_p95_px": 0.02, "normal_median": 0.05, "normal_p95": 0.2, "rms": 0.2,
}  # fmt: skip
_BETTER, _SLOWER, _FASTER = 0.05, 1.05, 0.9  # parts of an error; times the time
_PREPARES_SLOWER, _PREPARE_MS = 1.5, 5.0  # times the time by the wall clock, and what tells nothing of it
_SAME = 1e-3  # parts of an error by which values that affect speed alone may differ


def stored(rows: Sequence[Row]) -> Iterator[Row]:
    """Of each value its errors, and times as parts of the default's."""
    usual = {row["scene"]: row for row in rows if row["sweep"] == "" and row["backend"] != FLOOR}
    for row in rows:
        if row["sweep"] and row["sweep"] in row["params"]:
            yield _tried(row, usual[row["scene"]])


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


# --- tables ---------------------------------------------------------------------------


def _beaten(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """A line for each default that a value beats."""
    for row in (row for each in runs for row in each["rows"]):
        if found := beats(row):
            gains = (
                f"{name} {three_digits(was)} → {three_digits(now)}" for name, (was, now) in found.items()
            )
            reason = backend(row["backend"]).default_reasons.get(row["parameter"], "")
            values = {name: f"{row[name]}".lower() for name in ("default", "value")}
            yield {**row, **values, "better": "; ".join(gains), "why the default stays": reason}


def _scenes(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """The scenes, and how many values of how many parameters were tried on each."""
    for each in runs:
        for rows in grouped(each["rows"], "scene").values():
            parameters = {row["parameter"] for row in rows}
            yield {**rows[0], "parameters": len(parameters), "values": len(rows)}


EXPERIMENT = Suite(
    page="defaults.md",
    parts={"rows": Part(stored)},
    tables=[
        Table(
            "beaten",
            [
                code("scene"), code("backend"), code("parameter"), Column("default", left=True),
                Column("value", left=True), Column("better", left=True), Column("time", form="{:.2f}"),
                Column("why the default stays", left=True),
            ],
            _beaten,
            empty="No default is beaten.",
        ),
        Table(
            "tried",
            [
                code("scene"), Column("points", "n"), code("backend"), Column("parameters", form="{}"),
                Column("values", form="{}"),
            ],
            _scenes,
        ),
        Machines(),
    ],
    scenes=SCENES,
    groups=default_groups,
    usual=BenchSettings(size=(384, 256), views=4, frames=0),
)  # fmt: skip
