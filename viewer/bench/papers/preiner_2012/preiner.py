"""Search, fits and pictures of splats that are found in each picture, then and now: a page of figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ....resources import resource_path
from ...baselines import PRECOMPUTED
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
from ...report.results import FITS, SEARCHES, Row, read_rows
from . import auto_splats
from .auto_splats import BACKEND, STAGES, K

NAME = "preiner"

_ERRORS = {
    "hole_percent": "holes, %",
    "through_percent": "through, %",
    "wrong_layer_percent": "wrong layer, %",
    "spill_p95": "spill, 95 % px",
    "psnr": "PSNR, dB",
    "normal_median": "normals, median °",
    "normal_p95": "95 %, °",
    "flicker_orbit_normal": "flicker, °",
}
SEARCH = "search"  # the stage
_QUANTILES = ("median", "p95")
_FRAMES = {"first": "first", "later": "camera moved", "still": "nothing changed"}

# --- files ----------------------------------------------------------------------------


def write_preiner(folder: Path) -> Path:
    """Make preiner.json and preiner.md of the results in a folder; gives the page.

    Raises InputError where they are of another suite.
    """
    searches, fits = (rows_if_any(folder / name) for name in (SEARCHES, FITS))
    made = digest(read_rows(folder), searches, fits)
    return write_measurement(folder, NAME, made, page([made]))


def digest(drawn: Sequence[Row], searches: Sequence[Row], fits: Sequence[Row]) -> Measurement:
    """The part of a run that the page needs: of judged pictures, of searches, of fits.

    Raises InputError where the rows are of another suite.
    """
    kept = {
        "rows": [_pictured(row) for row in drawn],
        "searches": [_searched(row) for row in searches],
        "fits": [_fitted(row) for row in fits],
    }
    return measurement.digest([row for row in drawn if row["backend"] == BACKEND], NAME, kept)


def read_measurement(path: Path) -> Measurement:
    """A measurement as it was written. Raises InputError for what is none."""
    return measurement.read_measurement(path, ["rows", "searches", "fits"], NAME)


def _pictured(row: Row) -> dict[str, Any]:
    """Values of a judged scene, drawn one way."""
    kept = {name: row["params"].get(name) for name in ("hidden_neighbors", "cull", "refine")}
    return {
        "scene": row["scene"],
        "n": row["n"],
        "sweep": row["sweep"],
        "drawn": row["backend"],
        **({} if row["backend"] == PRECOMPUTED else kept),
        **rounded_times(row),
        "errors": rounded_errors(row, _ERRORS),
    }


def _searched(row: Row) -> dict[str, Any]:
    names = ("scene", "paper", "n", "visible", "participants", "params", "rounds")
    times = ("trees", *_FRAMES)
    return {
        **{name: row[name] for name in names},
        **{name: {key: round(ms, 2) for key, ms in row[name].items()} for name in times},
    }


def _fitted(row: Row) -> dict[str, Any]:
    angles = {
        name: {key: round(angle, 4) for key, angle in row[name].items()}
        for name in ("found_inside", "found_band", "open3d_inside", "open3d_band")
    }
    kept = ("scene", "noise", "params", "views", "points", "band_points")
    return {
        **{name: row[name] for name in kept},
        **angles,
        **{name: round(row[name], 5) for name in ("turned", "grown")},
    }


# --- the page -------------------------------------------------------------------------


def page(measurements: Sequence[Measurement]) -> str:
    """The page in Markdown: the text of assets/preiner.md with tables. Errors are the first measurement's."""
    text = resource_path("assets", f"{NAME}.md").read_text(encoding="utf-8")
    drawn = [{**row, "ms": _drawing_ms(each, row)} for each in measurements[:1] for row in each["rows"]]
    fits = [row for each in measurements[:1] for row in each["fits"]]
    deep = [row for row in drawn if row["scene"] == auto_splats.DEEP]
    return text.format(
        table=_table_one(measurements),
        frames=_by_frame(measurements),
        passes=_passes(measurements),
        rounds=_rounds(measurements[:1]),
        fits=_fits([row for row in fits if not row["noise"]]),
        noise=_noise([row for row in fits if row["scene"] in {r["scene"] for r in fits if r["noise"]}]),
        pictures=_pictures([row for row in drawn if row not in deep]),
        savings=_savings(deep),
        machines=machines(measurements, BACKEND, auto_splats.paper()),
    )


def _table_one(measurements: Sequence[Measurement]) -> str:
    """Table 1: of each scene the paper's figures, then those of the measurements."""
    head = [
        "scene", "machine", "points", "pixels", "culled", "tree of all, ms", "tree of the visible, ms",
        "search, ms", "times as fast per point", "overall", "against the visible",
    ]  # fmt: skip
    lines = []
    papers = auto_splats.paper()["scenes"]
    rows = [(each["device"], row) for each in measurements for row in each["searches"] if row["trees"]]
    for scene in dict.fromkeys(row["scene"] + str(row["n"]) for _, row in rows):
        own = [(device, row) for device, row in rows if row["scene"] + str(row["n"]) == scene]
        named = own[0][1]["paper"]
        for line in papers:
            if line["name"] == named:
                speeds = [_known(line[name]) for name in ("per_point", "overall")]
                counts = [spaced(line[name]) for name in ("points", "pixels")]
                times = [_known(line["tree_ms"]), "", three_digits(line["search_ms"])]
                lines.append([named, "2012", *counts, _on(line["cull"]), *times, *speeds, ""])
        for device, row in own:
            taken, trees = row["first"][SEARCH], row["trees"]
            overall = trees["all"] / taken
            ratios = (overall * row["visible"] / row["n"], overall, trees["visible"] / taken)
            counts = [spaced(row[name]) for name in ("n", "visible")]
            times = [three_digits(value) for value in (trees["all"], trees["visible"], taken, *ratios)]
            lines.append([f"`{row['scene']}`", device, *counts, _on(row["params"]["cull"]), *times])
    return markdown_table(head, lines, left=("scene", "machine", "culled"))


def _by_frame(measurements: Sequence[Measurement]) -> str:
    """Temporal reuse: search and all passes, of a first picture, one from a little aside, the same again."""
    head = ["scene", "machine", "culled"]
    head += [f"{what}, {name}, ms" for name in _FRAMES.values() for what in ("search", "all")]
    lines = []
    for each in measurements:
        for row in each["searches"]:
            if row["trees"]:
                times = [
                    three_digits(ms)
                    for name in _FRAMES
                    for ms in (row[name][SEARCH], sum(row[name].values()))
                ]
                lines.append([_titled(row), each["device"], _on(row["params"]["cull"]), *times])
    return markdown_table(head, lines, left=("scene", "machine", "culled"))


def _passes(measurements: Sequence[Measurement]) -> str:
    """Fig. 10: milliseconds of each stage by the number of neighbours."""
    head = ["scene", "machine", "k", *(f"{stage}, ms" for stage in STAGES), "all, ms"]
    lines = []
    for each in measurements:
        culled = [row for row in each["searches"] if row["params"]["cull"]]
        for row in sorted(culled, key=lambda row: (_order(each, row), row["params"]["k"])):
            cells = [three_digits(ms) for ms in (*row["first"].values(), sum(row["first"].values()))]
            lines.append([_titled(row), each["device"], str(row["params"]["k"]), *cells])
    return markdown_table(head, lines, left=("scene", "machine"))


def _rounds(measurements: Sequence[Measurement]) -> str:
    """Fig. 11: percent of the points whose neighbourhood is not known yet before each round."""
    rows = [row for each in measurements for row in each["searches"] if row["rounds"]]
    rows = [row for row in rows if row["params"]["k"] == K and not row["params"]["cull"]]
    most = max((len(row["rounds"]) for row in rows), default=0)
    head = ["scene", *(str(number + 1) for number in range(most))]
    lines = []
    for row in rows:
        left = [three_digits(100 * count / row["rounds"][0]) for count in row["rounds"]]
        lines.append([_titled(row), *left, *[""] * (most - len(left))])
    return markdown_table(head, lines, left=("scene",))


def _fits(rows: Sequence[dict[str, Any]]) -> str:
    """Normals without noise: inside and at silhouettes, beside open3d's; what changes from view to view."""
    head = [
        "scene", "hidden neighbours", "k", "median, °", "95 %, °", "open3d's median, °", "95 %, °",
        "at silhouettes, median, °", "95 %, °", "open3d's 95 %, °", "turned in 2°, median °",
        "radius, median %",
    ]  # fmt: skip
    lines = []
    for row in rows:
        shown = [
            *(row[who][of] for who in ("found_inside", "open3d_inside", "found_band") for of in _QUANTILES),
            row["open3d_band"]["p95"],
            row["turned"],
            100 * row["grown"],
        ]
        hidden = _on(row["params"]["hidden_neighbors"])
        lines.append([f"`{row['scene']}`", hidden, _count(row), *map(three_digits, shown)])
    return markdown_table(head, lines, left=("scene", "hidden neighbours"))


def _noise(rows: Sequence[dict[str, Any]]) -> str:
    """Normals under noise by the number of neighbours."""
    head = ["scene", "noise", "k", "median, °", "95 %, °", "open3d's median, °", "turned in 2°, median °"]
    lines = []
    for row in sorted(rows, key=lambda row: row["noise"]):
        if not row["params"]["hidden_neighbors"]:
            continue
        angles = (*row["found_inside"].values(), row["open3d_inside"]["median"], row["turned"])
        lines.append([f"`{row['scene']}`", f"{row['noise']:g}", _count(row), *map(three_digits, angles)])
    return markdown_table(head, lines, left=("scene",))


def _pictures(rows: Sequence[dict[str, Any]]) -> str:
    """Fig. 6: errors of pictures, beside surfels of precomputed planes."""
    head = ["scene", "points", "drawn", *_ERRORS.values(), "ms"]
    lines, above = [], None
    for row in rows:
        named = ["", ""] if row["scene"] == above else [f"`{row['scene']}`", spaced(row["n"])]
        lines.append([*named, _drawn(row), *_errors(row)])
        above = row["scene"]
    return markdown_table(head, lines, left=("scene", "drawn"))


def _savings(rows: Sequence[dict[str, Any]]) -> str:
    """Grid culling and depth refinement (7), each on and off."""
    head = ["scene", "culled", "refined", *_ERRORS.values(), "ms"]
    lines = [
        [f"`{row['scene']}`", _on(row["cull"]), _on(row["refine"]), *_errors(row)]
        for row in rows
        if row["drawn"] == BACKEND
    ]
    return markdown_table(head, lines, left=("scene", "culled", "refined"))


def _errors(row: dict[str, Any]) -> Iterator[str]:
    yield from (three_digits(row["errors"].get(name, np.nan)) for name in _ERRORS)
    yield three_digits(row["ms"])


def _drawing_ms(each: Measurement, row: dict[str, Any]) -> float:
    """Time of a picture; on a software driver what the processors worked, divided by how many there are."""
    if each["timer"] == "finish":
        return float(np.median(row["busy_ms"])) / each["processors"]
    return float(np.median(row["gpu_ms"]))


def _drawn(row: dict[str, Any]) -> str:
    if row["drawn"] == PRECOMPUTED:
        return "planes of all points"
    if row["drawn"] != BACKEND:
        return f"`{row['drawn']}`"
    return f"`{BACKEND}`" if row["hidden_neighbors"] else f"`{BACKEND}`, what is seen alone"


def _titled(row: dict[str, Any]) -> str:
    return f"`{row['scene']}`, {spaced(row['n'])}"


def _order(each: Measurement, row: dict[str, Any]) -> int:
    """The place of a row's scene among those of a measurement."""
    return list(dict.fromkeys(map(_titled, each["searches"]))).index(_titled(row))


def _count(row: dict[str, Any]) -> str:
    """The number of neighbours of a fit."""
    return f"up to {row['params']['k']}" if row["params"]["adaptive"] else str(row["params"]["k"])


def _known(value: float | None) -> str:
    return three_digits(np.nan if value is None else value)


def _on(value: bool) -> str:
    return "yes" if value else "no"
