"""Code words, then and now: the tables of docs/how-it-works/codeword.md."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from ...report import measurement
from ...report.measurement import Measurement, markdown_table, rows_if_any, spaced, write_measurement
from ...report.page import three_digits
from ...report.results import WORD_PIXELS, WORD_TABLES, WORD_TIMES, Row

NAME, PAGE = "codeword", "codeword.md"
_KEPT = {
    "times": ("scene", "n", "size", "busy_ms", "wall_ms"),
    "pixels": ("scene", "projection", "quality", "ids", "nearest", "covered", "depth", "normal"),
    "tables": ("steps", "sizes", "normals", "busy_ms", "nbytes", "bitmap_bytes"),
}


def write_codeword(folder: Path) -> Path:
    """Make codeword.json and codeword.md of the results in a folder; gives the page.

    Raises InputError where they are of another suite.
    """
    made = digest(*(rows_if_any(folder / name) for name in (WORD_TIMES, WORD_PIXELS, WORD_TABLES)))
    return write_measurement(folder, NAME, made, "\n\n".join(tables([made]).values()) + "\n")


def digest(times: Sequence[Row], pixels: Sequence[Row], built: Sequence[Row]) -> Measurement:
    """The part of a run that the page needs. Raises InputError where the rows are of another suite."""
    found = zip(_KEPT.items(), (times, pixels, built), strict=True)
    return measurement.digest(times, NAME, {part: _picked(rows, names) for (part, names), rows in found})


def _picked(rows: Iterable[Row], names: Sequence[str]) -> list[dict[str, Any]]:
    return [{name: row[name] for name in names} for row in rows]


def read_measurement(path: Path) -> Measurement:
    """A measurement as it was written. Raises InputError for what is none."""
    return measurement.read_measurement(path, list(_KEPT), NAME)


def tables(measurements: Sequence[Measurement]) -> dict[str, str]:
    """The tables of the page by name; pixels are the first measurement's."""
    first = measurements[0]
    return {
        "times": _times(measurements),
        "pixels": _pixels(first["pixels"]),
        "tables": _tables(first["tables"]),
        "machines": "\n".join(map(_machine, measurements)),
    }


def _times(measurements: Sequence[Measurement]) -> str:
    """Milliseconds, pictures and elements a second of each way."""
    head = [
        "scene",
        "picture",
        "drawn by",
        "processor, ms",
        "wall, ms",
        "pictures a second",
        "elements a second, M",
    ]
    lines = []
    for row in (row for each in measurements for row in each["times"]):
        size = "{} x {}".format(*row["size"])
        for way, busy in row["busy_ms"].items():
            wall = row["wall_ms"][way]
            rates = 1e3 / wall, 1e-3 * row["n"] / wall
            lines.append([f"`{row['scene']}`", size, way, *map(three_digits, (busy, wall, *rates))])
    return markdown_table(head, lines, left=("scene", "picture", "drawn by"))


def _pixels(rows: Sequence[dict[str, Any]]) -> str:
    """How pictures differ from those of surfels."""
    head = [
        "scene",
        "projection",
        "quality",
        "other points, %",
        "nearest to a step of Z, %",
        "other pixels, %",
        "depths, of the radius",
        "normals, degrees",
    ]
    lines = [
        [f"`{row['scene']}`", row["projection"], row["quality"], f"{row['ids']:.2f}", f"{row['nearest']:.2f}",
         f"{row['covered']:.2f}", f"{row['depth']:.1g}", f"{row['normal']:.2f}"]
        for row in rows
    ]  # fmt: skip
    return markdown_table(head, lines, left=("scene", "projection", "quality"))


def _tables(rows: Sequence[dict[str, Any]]) -> str:
    """Time and bytes of tables of shapes."""
    head = ["steps", "sizes", "normals", "processor, ms", "bytes", "as bitmaps"]
    lines = [
        [row["steps"], str(row["sizes"]), f"{row['normals']} x {row['normals']}",
         three_digits(row["busy_ms"]["table"]), spaced(row["nbytes"]), spaced(row["bitmap_bytes"])]
        for row in rows
    ]  # fmt: skip
    return markdown_table(head, lines, left=("steps",))


def _machine(each: Measurement) -> str:
    told = f"* **{each['device']}**: {each['driver']}, {each['processors']} processors; "
    return told + f"Scan4D {each['version']}, {each['date']}" + (f". {each['note']}" if each["note"] else "")
