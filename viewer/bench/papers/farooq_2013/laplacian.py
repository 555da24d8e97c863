"""Views merged band by band, against blends and the truth: the tables of docs/how-it-works/laplacian.md."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...metrics import aggregate
from ...report import measurement
from ...report.measurement import Measurement, markdown_table, rows_if_any, write_measurement
from ...report.page import three_digits
from ...report.results import ALONE, BAND_TIMES, PICTURE_SIZES, SEAMS, Row
from ...seams import SCALES
from .splines import BEST, BY_LEVELS, LEVELS, LINEAR, ZOOMS

NAME, PAGE = "laplacian", "laplacian.md"
_KEPT = {
    "rows": ("scene", "way", "by_view"),
    "alone": ("scene", "way", "by_view"),
    "sizes": ("scene", "way", "zoom", "by_view"),
    "times": ("way", "pods", "wall_ms", "busy_ms", "passes"),
}


# --- files ----------------------------------------------------------------------------


def write_laplacian(folder: Path) -> Path:
    """Make laplacian.json and laplacian.md of the results in a folder; gives the page.

    Raises InputError where they are of another suite.
    """
    made = digest(*(rows_if_any(folder / name) for name in (SEAMS, ALONE, PICTURE_SIZES, BAND_TIMES)))
    return write_measurement(folder, NAME, made, "\n\n".join(tables([made]).values()) + "\n")


def digest(
    seams: Sequence[Row], alone: Sequence[Row], sizes: Sequence[Row], times: Sequence[Row]
) -> Measurement:
    """The part of a run that the page needs. Raises InputError where the rows are of another suite."""
    found = zip(_KEPT.items(), (seams, alone, sizes, times), strict=True)
    return measurement.digest(seams, NAME, {part: _picked(rows, names) for (part, names), rows in found})


def _picked(rows: Iterable[Row], names: Sequence[str]) -> list[dict[str, Any]]:
    return [{name: _rounded(row[name]) for name in names} for row in rows]


def _rounded(value: Any) -> Any:
    """A value with its numbers to four digits after the point, where there are more."""
    if isinstance(value, dict):
        return {name: _rounded(each) for name, each in value.items()}
    if isinstance(value, list):
        return [_rounded(each) for each in value]
    return round(value, 4) if isinstance(value, float) else value


def read_measurement(path: Path) -> Measurement:
    """A measurement as it was written. Raises InputError for what is none."""
    return measurement.read_measurement(path, list(_KEPT), NAME)


# --- tables ---------------------------------------------------------------------------


def tables(measurements: Sequence[Measurement]) -> dict[str, str]:
    """The tables of the page by name; errors are the first measurement's."""
    first = measurements[0]
    return {
        "seams": _seams(first["rows"]),
        "alone": _alone(first["alone"]),
        "sizes": _sizes(first["sizes"]),
        "times": _times(measurements),
        "passes": _passes(measurements),
        "machines": "\n".join(map(_machine, measurements)),
    }


def _seams(rows: Sequence[dict[str, Any]]) -> str:
    """Visibility of seams by way to merge, and how fine detail fares."""
    head = ["scene", "merged", *(f"{scale} px" for scale in SCALES), "visibility", "times under linear",
            "under best", "fine detail, dB", "shown, %"]  # fmt: skip
    lines = []
    for scene, some in _by_scene(rows):
        total = {row["way"]: _mean(row, "seam") for row in some}
        for row in some:
            scales = [three_digits(_mean(row, f"seam_{scale}")) for scale in SCALES]
            less = [three_digits(total[way.name] / total[row["way"]]) for way in (LINEAR, BEST)]
            detail = _mean(row, "detail") - _mean(row, "detail_alone")
            lines.append(
                [f"`{scene}`", row["way"], *scales, three_digits(total[row["way"]]), *less,
                 f"{detail:+.2f}" if np.isfinite(detail) else "", f"{_mean(row, 'shown'):.1f}"]
            )  # fmt: skip
    return markdown_table(head, lines, left=("scene", "merged"))


def _alone(rows: Sequence[dict[str, Any]]) -> str:
    """How far one view alone is from its direct picture."""
    head = ["scene", "drawn", "mean, steps of 255", "largest"]
    lines = [
        [f"`{row['scene']}`", row["way"], three_digits(_mean(row, "mean")),
         three_digits(max(view["worst"] for view in row["by_view"]))]
        for row in rows
    ]  # fmt: skip
    return markdown_table(head, lines, left=("scene", "drawn"))


def _sizes(rows: Sequence[dict[str, Any]]) -> str:
    """PSNR by pixels a sample."""
    head = ["scene", "merged", *(f"{zoom:g}" for zoom in ZOOMS), "from best to worst"]
    lines = []
    for scene, some in _by_scene(rows):
        for way in dict.fromkeys(row["way"] for row in some):
            found = [_psnr(row) for row in some if row["way"] == way]
            lines.append([f"`{scene}`", way, *(f"{psnr:.1f}" for psnr in found), f"{np.ptp(found):.1f}"])
    return markdown_table(head, lines, left=("scene", "merged"))


def _psnr(row: dict[str, Any]) -> float:
    errors = aggregate({name: [view[name] for view in row["by_view"]] for name in row["by_view"][0]})
    return errors["psnr_scanned"]


def _times(measurements: Sequence[Measurement]) -> str:
    """Time of a picture, by number of levels and of views."""
    head = ["machine", "views", "merged", "wall, ms", "processor, ms"]
    lines = [
        [each["device"], str(row["pods"]), row["way"],
         *(three_digits(row[kind]) for kind in ("wall_ms", "busy_ms"))]
        for each in measurements
        for row in each["times"]
    ]  # fmt: skip
    return markdown_table(head, lines, left=("machine", "merged"))


def _passes(measurements: Sequence[Measurement]) -> str:
    """Times of the passes of most levels, by level; those before the bands are of none."""
    levels = range(LEVELS[-1])
    head = ["machine", "pass", "ms", *(f"level {level}" for level in levels)]
    lines = []
    for each in measurements:
        for row in each["times"]:
            if (row["pods"], row["way"]) != (2, BY_LEVELS[-1].name):
                continue
            parts: dict[str, dict[str, float]] = {}
            for name, ms in row["passes"].items():
                told, _, level = name.partition(" level ")
                parts.setdefault(told, {})[level] = ms
            for name, by_level in parts.items():
                cells = (by_level.get(level) for level in ("", *map(str, levels)))
                shown = ("" if ms is None else three_digits(ms) for ms in cells)
                lines.append([each["device"], name, *shown])
    return markdown_table(head, lines, left=("machine", "pass"))


def _by_scene(rows: Sequence[dict[str, Any]]) -> list[tuple[str, list[dict[str, Any]]]]:
    scenes = dict.fromkeys(row["scene"] for row in rows)
    return [(scene, [row for row in rows if row["scene"] == scene]) for scene in scenes]


def _mean(row: dict[str, Any], name: str) -> float:
    """The mean of an error over the pictures of a row."""
    return float(np.mean([view[name] for view in row["by_view"]]))


def _machine(each: Measurement) -> str:
    told = f"* **{each['device']}**: {each['driver']}, {each['processors']} processors; "
    return told + f"Scan4D {each['version']}, {each['date']}" + (f". {each['note']}" if each["note"] else "")
