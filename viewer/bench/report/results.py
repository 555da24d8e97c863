"""Rows of a benchmark: how they are written, read and compared, and what their numbers mean."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from ...errors import InputError
from ..baselines import CEILING, FLOOR

Row = dict[str, Any]

RESULTS, NUMERICS, NOTES = "results.jsonl", "numerics.jsonl", "notes.txt"
WAYS, SURFACE = "ways.jsonl", "surface.jsonl"
SPREADS = ("gpu_ms", "cpu_ms", "busy_ms", "same_ms", "first_ms", "derive_ms", "upload_ms")

_SCENE = "scene_hash"
_IDENTITY = ("backend", "scene", _SCENE, "n", "noise", "zoom", "params", "size", "seed", "views")
_NEEDED: dict[str, dict[str, Any]] = {
    RESULTS: {
        "backend": str, "scene": str, _SCENE: str, "n": int, "noise": int | float, "params": dict,
        "size": list, "seed": int, "views": int, "sweep": str, "gpu_ms": dict, "errors": dict,
    },
    NUMERICS: {"row": str, "backend": str, "held": bool},
    SURFACE: {"scene": str, "condition": str, "backend": str, "errors": dict},
    WAYS: {"scene": str, "key": str, "scale": int | float, "ms": int | float, "seen": dict},
}  # fmt: skip

# --- what is measured -----------------------------------------------------------------


@dataclass(frozen=True)
class Metric:
    """A number of a row. best: "low" or "high", which is good; "zero" for what has a sign."""

    name: str
    unit: str
    help: str
    best: str = "low"

    def of(self, row: Row) -> float:
        """Value of the metric in a row, the median of a spread; NaN where the row has none."""
        if self.name == "prepare_ms":
            return sum(_number(row.get(part)) for part in ("derive_ms", "upload_ms"))
        return _number(row[self.name] if self.name in row else row["errors"].get(self.name))

    def loss(self, value: float) -> float:
        """The value so that less is better."""
        return {"low": value, "high": -value, "zero": abs(value)}[self.best]

    @property
    def label(self) -> str:
        """Name and unit, as it stands at an axis."""
        name = f"|{self.name}|" if self.best == "zero" else self.name
        return f"{name} [{self.unit}]" if self.unit else name


_NEW_VIEW = "a new view of a pose that was drawn before, median over the views"
COSTS = [
    Metric("gpu_ms", "ms", f"time on the GPU of {_NEW_VIEW}"),
    Metric("cpu_ms", "ms", f"wall time of the call that draws {_NEW_VIEW}"),
    Metric("busy_ms", "ms", f"processor time of all threads to draw {_NEW_VIEW}"),
    Metric("same_ms", "ms", "wall time to draw the same view again, median over the views"),
    Metric("first_ms", "ms", "wall time of the first picture of a pose, with its preparation"),
    Metric(
        "prepare_ms", "ms", "derive_ms + upload_ms: time to prepare a pose once, before its first picture"
    ),
    Metric("derive_ms", "ms", "time to derive data from a pose on the CPU"),
    Metric("upload_ms", "ms", "time to upload a pose and its derived data to the GPU"),
    Metric("bytes_gpu", "bytes", "memory on the GPU for one pose and its picture"),
    Metric("peak_rss", "bytes", "peak memory of the process"),
]
_ERRORS = [
    Metric("hole_percent", "%", "share of the true silhouette in which the picture is empty"),
    Metric("through_percent", "%", "share of the true silhouette in which the picture shows a farther layer"),
    Metric(
        "closed_percent",
        "%",
        "share of the true silhouette in which the picture is neither empty nor shows a farther layer",
        "high",
    ),
    Metric(
        "hole_scanned_percent", "%", "share of the visible, scanned surface in which the picture is empty"
    ),
    Metric(
        "spill_percent",
        "%",
        "area of drawn pixels outside the true silhouette, relative to the area of the silhouette",
    ),
    Metric(
        "spill_p95",
        "px",
        "distance of drawn pixels outside the true silhouette from the silhouette, 95th percentile",
    ),
    Metric("boundary_mean", "px", "distance between drawn and true outline, mean"),
    Metric("boundary_p95", "px", "distance between drawn and true outline, 95th percentile"),
    *(
        Metric(f"depth_{name}{suffix}", unit, f"{text}, {units}", best)
        for suffix, unit, units in (("_px", "px", "pixel footprints"), ("", "units", "scan units"))
        for name, text, best in (
            ("bias", "mean depth error; positive: too far away", "zero"),
            ("rmse", "root mean square of the depth error", "low"),
            ("median", "median of the absolute depth error", "low"),
            ("p95", "95th percentile of the absolute depth error", "low"),
        )
    ),
    Metric(
        "wrong_layer_percent",
        "%",
        "share of the pixels whose depth is wrong by more than four point spacings",
    ),
    *(
        Metric(f"normal{suffix}_{name}", "°", f"angle to the true normal, {text}{sign}")
        for suffix, sign in (("", ", sign ignored"), ("_signed", ""))
        for name, text in (("mean", "mean"), ("median", "median"), ("p95", "95th percentile"))
    ),
    *(
        Metric(f"{name}{suffix}", unit, f"{text}, {where}", best)
        for suffix, where in (("", "inside the true silhouette"), ("_frame", "whole frame"))
        for name, unit, text, best in (
            ("psnr", "dB", "peak signal-to-noise ratio of the shaded picture", "high"),
            ("ssim", "", "structural similarity of the shaded picture; 1: identical", "high"),
            ("flip", "", "visible difference (FLIP) from the true picture, 0 to 1", "low"),
        )
    ),
    Metric(
        "psnr_scanned", "dB", "PSNR of the shaded picture where the scan measured the visible surface", "high"
    ),
    Metric("false_positives", "points", "hidden points that the renderer treats as visible"),
    Metric("false_negatives", "points", "visible points that the renderer treats as hidden"),
    Metric("correct", "points", "points whose visibility the renderer finds correctly", "high"),
    Metric(
        "visibility_error_percent",
        "%",
        "false positives and negatives, divided by the number of correct points",
    ),
    *(
        Metric(
            f"flicker_{kind}_{name}",
            unit,
            f"change of {text} {between}, beyond the change in the true pictures",
            "zero",
        )
        for kind, between in (("orbit", "along a camera orbit"), ("pose", "from pose to pose"))
        for name, unit, text in (("color", "", "colour"), ("normal", "°", "normal"))
    ),
]
METRICS = {metric.name: metric for metric in [*COSTS, *_ERRORS]}


def error_metrics(rows: Iterable[Row]) -> list[Metric]:
    """The errors that any of the rows has, known ones first, in the order of docs/developing/benchmark.md."""
    found = {name for row in rows for name in row["errors"]}
    return [metric for metric in _ERRORS if metric.name in found] + [
        Metric(name, "", "") for name in sorted(found - METRICS.keys())
    ]


def rank(backend: str) -> tuple[bool, bool, str]:
    """The key that sorts backends: by name, between floor and ceiling."""
    return backend == CEILING, backend != FLOOR, backend


def spread(values: Sequence[float]) -> dict[str, float]:
    """Median, 5th and 95th percentile; NaN where there is no value."""
    if not len(values):
        return dict.fromkeys(("median", "p5", "p95"), math.nan)
    p5, median, p95 = (float(value) for value in np.quantile(values, (0.05, 0.5, 0.95)))
    return {"median": median, "p5": p5, "p95": p95}


def _number(value: Any) -> float:
    """The number of a number, of a spread (its median) or of None (NaN)."""
    if isinstance(value, dict):
        value = value.get("median")
    return math.nan if value is None else float(value)


# --- files ----------------------------------------------------------------------------


def write_row(stream: TextIO, row: Row) -> None:
    """Append a row as one line of JSON, at once. NaN becomes null, infinity the string "Infinity"."""
    stream.write(json.dumps(_to_json(row), allow_nan=False, ensure_ascii=False) + "\n")
    stream.flush()


def read_rows(path: Path, needed: dict[str, Any] | None = None) -> list[Row]:
    """The rows of a file of JSON lines, or of the results in a folder; null becomes NaN.

    needed: the fields of a row with their types; None: those that the file's name says.
    A last line without its end, as a crash leaves it, is left out.
    Raises InputError, with the line, for what is no row.
    """
    if path.is_dir():
        path = path / RESULTS
    try:
        lines = path.read_text(encoding="utf-8").split("\n")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"cannot be read: {error}", path, "Give the path of a results.jsonl, or of its folder"
        ) from error
    if needed is None:
        needed = _NEEDED.get(path.name, _NEEDED[RESULTS])
    rows = []
    for number, line in enumerate(lines, start=1):
        if line.strip():
            try:
                rows.append(_parsed(line, needed))
            except ValueError as error:
                if number < len(lines):
                    hint = "Delete the line, or run the benchmark again"
                    raise InputError(
                        f"is not a row of data: {error}", f"{path}, line {number}", hint
                    ) from error
    return rows


def _parsed(line: str, needed: dict[str, Any]) -> Row:
    """One row; raises ValueError for what is none."""
    row = json.loads(line)
    if not isinstance(row, dict):
        raise ValueError("not a JSON object")
    if missing := [name for name, kind in needed.items() if not isinstance(row.get(name), kind)]:
        raise ValueError(f"the row has no usable value for {', '.join(missing)}")
    return _from_json(row)


def _to_json(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _to_json(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_to_json(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else _INFINITIES[value]
    return value


def _from_json(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _from_json(item) for name, item in value.items()}
    if isinstance(value, list):
        return [_from_json(item) for item in value]
    if isinstance(value, str):
        return _FROM_TEXT.get(value, value)
    return math.nan if value is None else value


_INFINITIES = {math.inf: "Infinity", -math.inf: "-Infinity"}
_FROM_TEXT = {text: value for value, text in _INFINITIES.items()}

# --- comparison -----------------------------------------------------------------------

# Errors this near each other are the same: drivers round differently.
_SAME_RELATIVE, _SAME_ABSOLUTE = 0.01, 1e-6
_SAME_TIME, _SAME_MS = 1.1, 0.1  # ratio and difference of times that are the same


def row_title(row: Row) -> str:
    """A row in words: backend, scene, points, noise, zoom, and the parameter that it varies."""
    words = [f"{row['backend']}, {row['scene']}, {row['n']} points"]
    if row["noise"]:
        words.append(f"noise {row['noise']:g}")
    if row.get("sweep") == "zoom":
        words.append(f"zoom {row['zoom']:g}")
    if row.get("sweep") in row["params"]:
        words.append(f"{row['sweep']}={row['params'][row['sweep']]}")
    return ", ".join(words)


def compare(old: Iterable[Row], new: Iterable[Row]) -> list[str]:
    """Lines on what got slower or worse, then faster or better, then on what cannot be compared.

    Slower: by 10 % in the median of the views, and in 95 % of them. Preparations, which are not the views',
    are slower where each median is outside the other's 5th to 95th percentile. Worse: an error that grew by
    more than 1 %. Times are compared only where device, driver and timer are the same.
    """
    unhashed = tuple(name for name in _IDENTITY if name != _SCENE)
    before, after = ({_identity(row, unhashed): row for row in rows} for rows in (old, new))
    losses: list[str] = []
    gains: list[str] = []
    notes: list[str] = []
    for identity in [*before, *(identity for identity in after if identity not in before)]:
        was, now = before.get(identity), after.get(identity)
        if was is None or now is None:
            notes.append(
                f"the {'old' if was is None else 'new'} results do not contain: {row_title(was or now or {})}"
            )
            continue
        if was[_SCENE] != now[_SCENE]:
            notes.append(f"not compared, because the scene changed ({_SCENE}): {row_title(now)}")
            continue
        if _machine(was) == _machine(now):
            losses += (f"slower: {row_title(now)}: {change}" for change in _slower(was, now))
            gains += (f"faster: {row_title(now)}: {change}" for change in _slower(was, now, back=True))
        else:
            notes.append(
                f"times not compared, because the machine changed: {_machine(was)} is now {_machine(now)}"
            )
        losses += (f"worse: {row_title(now)}: {change}" for change in _worse(was, now))
        gains += (f"better: {row_title(now)}: {change}" for change in _worse(was, now, back=True))
    return [*losses, *gains, *dict.fromkeys(notes)]


def _identity(row: Row, names: Iterable[str]) -> str:
    return json.dumps([_to_json(row.get(name)) for name in names], sort_keys=True)


def _machine(row: Row) -> str:
    return ", ".join(str(row.get(name, "unknown")) for name in ("device", "driver", "timer"))


def _slower(was: Row, now: Row, back: bool = False) -> Iterator[str]:
    """The times that got slower; back: faster."""
    for name in SPREADS:
        if not (isinstance(was.get(name), dict) and isinstance(now.get(name), dict)):
            continue
        quick, slow = (now, was) if back else (was, now)
        if _is_slower(name, quick, slow):
            before, after = was[name]["median"], now[name]["median"]
            ratio = f" (x{after / before:.2f})" if before > 0 else ""
            yield f"{name} {before:.4g} -> {after:.4g}{ratio}"


def _is_slower(name: str, quick: Row, slow: Row) -> bool:
    """Whether a time of one row is beyond the spread of the other's."""
    before, after = quick[name]["median"], slow[name]["median"]
    if after - before < _SAME_MS or after < _SAME_TIME * before:
        return False
    pairs = [row.get("times_by_view", {}).get(name, []) for row in (quick, slow)]
    if pairs[0] and len(pairs[0]) == len(pairs[1]):
        ratios = spread([after / before for before, after in zip(*pairs, strict=True) if before > 0])
        return ratios["median"] > _SAME_TIME and ratios["p5"] > 1
    return after > quick[name]["p95"] and before < slow[name]["p5"]


def _worse(was: Row, now: Row, back: bool = False) -> Iterator[str]:
    """The errors that got worse; back: better. From a number to none is worse."""
    for metric in error_metrics([was, now]):
        before, after = metric.of(was), metric.of(now)
        good, bad = (metric.loss(value) for value in ((after, before) if back else (before, after)))
        if math.isnan(good) or good == bad:
            continue
        same = max(_SAME_RELATIVE * max(abs(good), abs(bad)), _SAME_ABSOLUTE)
        if math.isnan(bad) or (math.isinf(same) and bad > good) or bad - good > same:
            yield f"{metric.name} {before:.4g} -> {after:.4g}"
