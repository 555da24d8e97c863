"""Tables III and IV of Slomp 2014, then and now: a page of its figures beside measurements of today.

Beside them what its figures show: levels of detail, and what octrees take on disk.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ....resources import resource_path
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
from ...report.results import OCTREE_SIZES, OCTREES, Row, read_rows
from . import feeds, octrees
from . import surfels as slomp
from .feeds import FeedTable, of_scan
from .octree_sizes import Sizes
from .octrees import BACKEND, CUBE, LEVEL
from .surfels import Scan

NAME = "octree-tables"

_SUITE = "octrees"
_TIMED = [work for work in octrees.WORKS if work != octrees.SORT]
_PAPERS = {"build": "build_ms", "cut": "traverse_ms"}  # which of them it has
_ERRORS = {
    "hole_percent": "holes, %",
    "through_percent": "through, %",
    "spill_percent": "spill, %",
    "depth_median_px": "depth, median px",
    "depth_p95_px": "depth, 95 % px",
    "normal_mean": "normal, °",
    "psnr": "PSNR, dB",
}

# --- files ----------------------------------------------------------------------------


def write_octree_tables(folder: Path) -> Path:
    """Make octree-tables.json and octree-tables.md of the results in a folder; gives the page.

    Raises InputError where they are of another suite.
    """
    trees, sizes = (rows_if_any(folder / name) for name in (OCTREES, OCTREE_SIZES))
    made = digest(read_rows(folder), trees, sizes)
    return write_measurement(folder, NAME, made, page([made]))


def digest(drawn: Sequence[Row], trees: Sequence[Row], sizes: Sequence[Row]) -> Measurement:
    """The part of a run that the page needs: of pictures, of trees built and cut, of sizes on disk.

    Raises InputError where the rows are of another suite.
    """
    return {
        **feeds.digest(drawn, BACKEND, _SUITE),
        "trees": [_tree(row) for row in trees],
        "levels": [_level(row) for row in drawn if row["sweep"] == LEVEL],
        "sizes": [
            {name: row[name] if name != "bits" else _rounded(row[name]) for name in Sizes.__annotations__}
            for row in sizes
        ],
    }


def read_measurement(path: Path) -> Measurement:
    """A measurement as it was written. Raises InputError for what is none."""
    return measurement.read_measurement(path, ["rows", "trees", "levels", "sizes"], _SUITE)


def _tree(row: Row) -> dict[str, Any]:
    """Values of a scan's trees at one delta."""
    kept = ("scene", "n", "delta", "poses", "depths")
    return {
        **{name: row[name] for name in kept},
        **_rounded({name: row[name] for name in ("loss", "nodes", "leaves")}),
        **{
            name: _rounded({work: row[name][work]["median"] for work in row[name]})
            for name in ("ms", "sorts")
        },
    }


def _level(row: Row) -> dict[str, Any]:
    """Values of a scene down to one level."""
    return {
        "scene": row["scene"],
        "n": row["n"],
        "least": row["params"][CUBE],
        "level": row["params"][LEVEL],
        **rounded_times(row),
        "errors": rounded_errors(row, _ERRORS),
    }


def _rounded(values: dict[str, float]) -> dict[str, float]:
    return {name: round(value, 5) for name, value in values.items()}


# --- the page -------------------------------------------------------------------------


def page(measurements: Sequence[Measurement]) -> str:
    """The page in Markdown: the text of assets/octree-tables.md with tables."""
    text = resource_path("assets", f"{NAME}.md").read_text(encoding="utf-8")
    fed = FeedTable("voxels_ms", lambda scan: f"{feeds.scan_title(scan)}, level {octrees.depth_of(scan)}")
    sizes = [Sizes(**row) for row in next((each["sizes"] for each in measurements if each["sizes"]), [])]
    return text.format(
        trees=_trees(measurements),
        milliseconds=fed.milliseconds(measurements),
        ratios=fed.ratios(measurements),
        levels=_levels(measurements),
        sizes=_sizes(sizes) if sizes else "",
        machines=machines(measurements, BACKEND, slomp.paper()),
    )


def _sizes(rows: Sequence[Sizes]) -> str:
    """Bits a point by each method."""
    methods = list(rows[0].bits)
    head = ["scene", "points", "stop", "depth", "leaves", "loss", "D1, dB", *methods]
    lines = [
        [
            row.scene, spaced(row.points), row.stop, str(row.depth), spaced(row.leaves),
            f"{100 * row.loss:.1f} %", f"{row.psnr:.1f}", *(f"{row.bits[method]:.2f}" for method in methods),
        ]
        for row in rows
    ]  # fmt: skip
    return markdown_table(head, lines, left=["scene"])


def _trees(measurements: Sequence[Measurement]) -> str:
    """Table III: of each scan and delta the paper's line, then those of the measurements."""
    head = [
        "scan", "points", "δ", "machine", "loss", "depth", "nodes", "leaves",
        "build", "with attributes", "cut", "cut to leaves", "`numpy.sort`",
    ]  # fmt: skip
    rows, above = [], None
    for scan in slomp.scans():
        for delta in octrees.DELTAS:
            for points, line in _tree_lines(scan, delta, measurements):
                named = ["", ""] if scan == above else [feeds.scan_title(scan), spaced(points)]
                rows.append([*named, f"{delta} %", *line])
                above = scan
    return markdown_table(head, rows, left=("scan", "machine"))


def _tree_lines(
    scan: Scan, delta: int, measurements: Sequence[Measurement]
) -> Iterator[tuple[int, list[str]]]:
    """Points, and the cells from the machine on."""
    for theirs in slomp.paper()["octrees"].get(scan.name, []):
        if theirs["delta_percent"] == delta:
            shape = [str(theirs["depth"]), spaced(theirs["nodes"]), spaced(theirs["leaves"])]
            times = [f"{theirs[_PAPERS[work]]:#.4g}" if work in _PAPERS else "" for work in _TIMED]
            loss = theirs["loss_percent"]
            yield scan.points or 0, ["2014", f"{loss:.{2 if loss < 10 else 1}f} %", *shape, *times, ""]
    for each in measurements:
        for row in of_scan(each["trees"], scan):
            if row["delta"] == delta:
                yield row["n"], [each["device"], *_tree_cells(row)]


def _tree_cells(row: dict[str, Any]) -> list[str]:
    depths = " to ".join(map(str, dict.fromkeys((min(row["depths"]), max(row["depths"])))))
    shape = [f"{three_digits(100 * row['loss'])} %", depths, spaced(row["nodes"]), spaced(row["leaves"])]
    ms, sorts = row["ms"], row["sorts"]
    times = [f"{three_digits(ms[work])} ({sorts[work]:.2f})" for work in _TIMED]
    return [*shape, *times, three_digits(ms[octrees.SORT])]


def _levels(measurements: Sequence[Measurement]) -> str:
    """Time against error, level by level."""
    head = [
        "scene", "cubes", "machine", "level", "ms", "its processors, ms", *_ERRORS.values(),
    ]  # fmt: skip
    rows, above = [], None
    for each in measurements:
        for row in each["levels"]:
            cubes = "closed" if row["least"] else "octants"
            named = [f"`{row['scene']}`", cubes, each["device"]]
            busy = np.median(row["busy_ms"]) / each["processors"]
            times = [
                three_digits(np.median(row["gpu_ms"])),
                three_digits(busy) if each["timer"] == "finish" else "",
            ]
            errors = [three_digits(row["errors"].get(name, np.nan)) for name in _ERRORS]
            rows.append([*(["", "", ""] if named == above else named), str(row["level"]), *times, *errors])
            above = named
    return markdown_table(head, rows, left=("scene", "cubes", "machine"))
