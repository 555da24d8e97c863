"""Hole filling, hidden points, large views and playing, then and now: a page of figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ....resources import resource_path
from ...baselines import RANGE_MESH
from ...report import measurement
from ...report.measurement import (
    Measurement,
    machines,
    markdown_table,
    rounded_errors,
    rounded_times,
    rows_if_any,
    spaced,
    write_measurement,
)
from ...report.page import three_digits
from ...report.results import LARGE_VIEWS, PLAYING, Row, read_rows
from . import pyramids
from .pyramids import BACKEND, HIDDEN_ZOOM, HIDE, ZOOMS

NAME = "farooq"

_ERRORS = {
    "hole_percent": "holes, %",
    "hole_scanned_percent": "of what was scanned, %",
    "through_percent": "through, %",
    "wrong_layer_percent": "wrong layer, %",
    "psnr": "PSNR, dB",
    "psnr_scanned": "of what was scanned, dB",
    "depth_median_px": "depth, median px",
    "boundary_p95": "outline, 95 % px",
    "spill_p95": "spill, 95 % px",
}
_MEGA = 1e6

# --- files ----------------------------------------------------------------------------


def write_farooq(folder: Path) -> Path:
    """Make farooq.json and farooq.md of the results in a folder; gives the page.

    Raises InputError where they are of another suite.
    """
    large, playing = (rows_if_any(folder / name) for name in (LARGE_VIEWS, PLAYING))
    made = digest(read_rows(folder), large, playing)
    return write_measurement(folder, NAME, made, page([made]))


def digest(drawn: Sequence[Row], large: Sequence[Row], playing: Sequence[Row]) -> Measurement:
    """The part of a run that the page needs: of zoomed pictures, of large views, of playing.

    Raises InputError where the rows are of another suite.
    """
    zoomed = [row for row in drawn if row["sweep"] in ("zoom", HIDE)]
    kept = {
        "rows": [_zoomed(row) for row in zoomed],
        "large": [_large(row) for row in large],
        "playing": [_played(row) for row in playing],
    }
    return measurement.digest([row for row in zoomed if row["backend"] == BACKEND], NAME, kept)


def read_measurement(path: Path) -> Measurement:
    """A measurement as it was written. Raises InputError for what is none."""
    return measurement.read_measurement(path, ["rows", "large", "playing"], NAME)


def _zoomed(row: Row) -> dict[str, Any]:
    """Values of a zoomed scene, drawn one way."""
    params = row["params"]
    own = row["backend"] == BACKEND
    return {
        "scene": row["scene"],
        "zoom": row["zoom"],
        "primitive": params["primitive"] if own else RANGE_MESH,
        "levels": pyramids.levels_of(params) if own else 0,
        HIDE: params[HIDE] if own else None,
        "sweep": row["sweep"],
        **rounded_times(row, ["gpu_ms"]),
        "errors": rounded_errors(row, _ERRORS),
    }


def _large(row: Row) -> dict[str, Any]:
    kept = ("scenario", "levels", "primitive", "samples", "measured")
    times = ("zoom", "ms", "unskipped_ms", "covered", "open_ms", "read_ms", "bytes_per_sample")
    return {**{name: row[name] for name in kept}, **{name: round(row[name], 4) for name in times}}


def _played(row: Row) -> dict[str, Any]:
    kept = ("scene", "poses", "primitive", "size")
    laps = {
        lap: {name: round(value, 2) for name, value in row[lap].items()} for lap in ("reading", "playing")
    }
    return {**{name: row[name] for name in kept}, **laps}


# --- the page -------------------------------------------------------------------------


def page(measurements: Sequence[Measurement]) -> str:
    """The page in Markdown: the text of assets/farooq.md with tables. Errors are the first measurement's."""
    text = resource_path("assets", f"{NAME}.md").read_text(encoding="utf-8")
    zoomed = [row for each in measurements[:1] for row in each["rows"] if row["sweep"] != HIDE]
    hidden = [row for each in measurements[:1] for row in each["rows"] if row["sweep"] == HIDE]
    return text.format(
        holes=_by_zoom(zoomed, "hole_scanned_percent"),
        psnr=_by_zoom(zoomed, "psnr_scanned"),
        errors=_at_zoom(zoomed, HIDDEN_ZOOM),
        near=_at_zoom(zoomed, max(ZOOMS)),
        hidden=_hidden(hidden),
        large=_large_views(measurements),
        memory=_memory(measurements),
        playing=_playing(measurements),
        machines=machines(measurements, BACKEND, pyramids.paper()),
    )


def _by_zoom(rows: Sequence[dict[str, Any]], error: str) -> str:
    """One error by the number of levels, against zoom."""
    head = ["scene", "drawn", *(f"{zoom:g}" for zoom in ZOOMS)]
    found = {(row["scene"], _drawn(row), row["zoom"]): row["errors"].get(error, np.nan) for row in rows}
    lines, above = [], ""
    for scene, drawn in dict.fromkeys((scene, drawn) for scene, drawn, _ in found):
        values = (found.get((scene, drawn, zoom), np.nan) for zoom in ZOOMS)
        lines.append(["" if scene == above else f"`{scene}`", drawn, *map(three_digits, values)])
        above = scene
    return markdown_table(head, lines, left=("scene", "drawn"))


def _at_zoom(rows: Sequence[dict[str, Any]], zoom: float) -> str:
    """All errors at one zoom, and times."""
    head = ["scene", "drawn", *_ERRORS.values(), "ms"]
    lines, above = [], None
    for row in rows:
        if row["zoom"] == zoom:
            errors = [three_digits(row["errors"].get(name, np.nan)) for name in _ERRORS]
            named = "" if row["scene"] == above else f"`{row['scene']}`"
            lines.append([named, _drawn(row), *errors, three_digits(float(np.median(row["gpu_ms"])))])
            above = row["scene"]
    return markdown_table(head, lines, left=("scene", "drawn"))


def _drawn(row: dict[str, Any]) -> str:
    """How a row was drawn, in words."""
    if row["primitive"] == RANGE_MESH:
        return f"`{RANGE_MESH}`"
    levels = "level 0 alone" if row["levels"] == 1 else f"{row['levels']} levels"
    return levels if row["primitive"] == "points" else f"{row['primitive']}, {levels}"


def _hidden(rows: Sequence[dict[str, Any]]) -> str:
    """Errors with and without looking for hidden points."""
    head = [
        "scene", "drawn", "wrong layer without, %", "with, %", "times less", "through without, %", "with, %",
    ]  # fmt: skip
    found: dict[tuple[str, str], dict[bool, dict[str, float]]] = {}
    for row in rows:
        found.setdefault((row["scene"], _drawn(row)), {})[row[HIDE]] = row["errors"]
    lines = []
    for (scene, drawn), errors in found.items():
        wrong, through = (
            [errors[hides][name] for hides in (False, True)]
            for name in ("wrong_layer_percent", "through_percent")
        )
        less = wrong[0] / wrong[1] if wrong[1] else np.inf
        lines.append([f"`{scene}`", drawn, *map(three_digits, (*wrong, less, *through))])
    return markdown_table(head, lines, left=("scene", "drawn"))


def _large_views(measurements: Sequence[Measurement]) -> str:
    """Table 7.2: of each line the thesis', then those of the measurements."""
    head = [
        "scenario", "levels", "machine", "drawn as", "pixels a sample", "covered", "million samples a second",
        "pictures a second", "ms", "without skipping, ms", "times as long",
    ]  # fmt: skip
    lines = []
    for line in pyramids.paper()["scenarios"]:
        speed = [three_digits(line["samples_per_second"] / _MEGA), three_digits(line["frames_per_second"])]
        lines.append([line["scenario"], str(line["levels"]), "2013", "points", "", "", *speed, "", "", ""])
        for each in measurements:
            for row in each["large"]:
                if row["scenario"] == line["scenario"]:
                    lines.append(["", "", each["device"], row["primitive"], *_large_cells(row)])
    return markdown_table(head, lines, left=("scenario", "machine", "drawn as"))


def _large_cells(row: dict[str, Any]) -> Iterator[str]:
    yield three_digits(row["zoom"])
    yield f"{row['covered']:.0f} %"
    ms, unskipped = row["ms"], row["unskipped_ms"]
    values = (row["samples"] / _MEGA / (ms / 1e3), 1e3 / ms, ms, unskipped, unskipped / ms)
    yield from map(three_digits, values)


def _memory(measurements: Sequence[Measurement]) -> str:
    """Bytes a sample on the GPU, and how long it takes to open two large views."""
    head = ["form", "machine", "bytes a sample", "samples", "of them measured", "read, s", "first picture, s"]
    lines = [
        [form, "2013", three_digits(count), "", "", "", ""]
        for form, count in pyramids.paper()["bytes_per_sample"].items()
    ]
    for each in measurements:
        for row in each["large"][:1]:
            counts = [spaced(row["samples"]), spaced(row["measured"])]
            times = [three_digits(row[name] / 1e3) for name in ("read_ms", "open_ms")]
            held = three_digits(row["bytes_per_sample"])
            lines.append(["Scan4D, its pyramid", each["device"], held, *counts, *times])
    return markdown_table(head, lines, left=("form", "machine"))


def _playing(measurements: Sequence[Measurement]) -> str:
    """Frames a second of sequences."""
    head = [
        "machine", "drawn as", "poses", "picture", "while it is read, a second", "from memory, a second",
        "to the GPU, ms a pose", "prepared on the CPU, ms a pose",
    ]  # fmt: skip
    lines = []
    for each in measurements:
        for row in each["playing"]:
            size, lap = "x".join(map(str, row["size"])), row["playing"]
            rates = [three_digits(value) for value in (row["reading"]["fps"], lap["fps"])]
            times = [three_digits(lap[name]) for name in ("upload_ms", "derive_ms")]
            lines.append([each["device"], row["primitive"], str(row["poses"]), size, *rates, *times])
    return markdown_table(head, lines, left=("machine", "drawn as", "picture"))
