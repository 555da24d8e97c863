"""Table II of Slomp 2014, then and now: a page of its figures beside measurements of today.

A measurement is one small JSON file, made of a benchmark's results; files of several machines make one page.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...files import whole_file
from ...resources import resource_path
from .. import slomp
from ..baselines import FLOOR
from ..slomp import BACKEND, FEED, Scan
from .page import number
from .results import Row, read_rows

MEASUREMENT, PAGE = "table-two.json", "table-two.md"

Measurement = dict[str, Any]
Values = NDArray[np.float64]  # ms, of each view

_ONCE = ("device", "driver", "processors", "timer", "version", "date", "size", "repeat", "seed")
_COVERED = (25, 85)  # percent of the paper's pictures
_FIRST = "gs"  # what the others are compared with
_SPACE = "\N{NARROW NO-BREAK SPACE}"
_TIMERS = {"query": "timer queries", "finish": "wall time between finishes"}


@dataclass(frozen=True)
class Line:
    """A line of the tables. points: of the scan. covered: from and to which percent of the pictures are.

    times: of each feed. text: how a time is written.
    """

    points: int
    covered: tuple[float, float]
    machine: str
    times: dict[str, Values]
    text: Callable[[float], str] = number


# --- files ----------------------------------------------------------------------------


def write_table_two(folder: Path) -> Path:
    """Make table-two.json and table-two.md of the results in a folder; gives the page. Raises InputError."""
    measurement = digest(read_rows(folder))
    for name, text in ((MEASUREMENT, _to_text(measurement)), (PAGE, page([measurement]))):
        with whole_file(folder / name) as path:
            path.write_text(text, encoding="utf-8")
    return folder / PAGE


def digest(rows: Sequence[Row]) -> Measurement:
    """What the page needs of a run: how it was measured, and the times of each view.

    Raises InputError where the rows are of another suite.
    """
    own = [row for row in rows if row["sweep"] == FEED]
    surfels = [row for row in own if row["backend"] == BACKEND]
    if not surfels:
        raise InputError("no feeds among the results", hint="Run scan4d bench --suite slomp")
    first = surfels[0]
    return {
        **{name: first[name] for name in _ONCE},
        "params": {name: value for name, value in first["params"].items() if name != FEED},
        "note": "",
        "rows": [
            {
                "scene": row["scene"],
                "n": row["n"],
                "feed": row["params"].get(FEED, FLOOR),
                "covered": [round(percent, 1) for percent in row["covered_by_view"]],
                **{
                    kind: [round(ms, 2) for ms in row["times_by_view"][kind]]
                    for kind in ("gpu_ms", "busy_ms")
                },
            }
            for row in own
        ],
    }


def read_measurement(path: Path) -> Measurement:
    """A measurement as it was written. Raises InputError for what is none."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {error}", path) from error
    if not isinstance(found, dict) or not {*_ONCE, "params", "note", "rows"} <= found.keys():
        raise InputError("is no measurement of Table II", path, "Run scan4d bench --suite slomp")
    return found


def _to_text(measurement: Measurement) -> str:
    """JSON with a line for each row."""
    rows = ",\n  ".join(json.dumps(row) for row in measurement["rows"])
    head = json.dumps({**measurement, "rows": []}, indent=1, ensure_ascii=False)
    return head.removesuffix('"rows": []\n}') + f'"rows": [\n  {rows}\n ]\n}}\n'


# --- the page -------------------------------------------------------------------------


def page(measurements: Sequence[Measurement]) -> str:
    """The page in Markdown: the text of assets/table-two.md with tables."""
    text = resource_path("assets", PAGE).read_text(encoding="utf-8")
    return text.format(
        milliseconds=_table(measurements, lambda line, feed: line.text(line.times[feed].mean())),
        ratios=_table(measurements, _ratio),
        machines="\n".join(f"* {line}" for line in (_paper(), *map(_machine, measurements))),
    )


def _paper() -> str:
    paper = slomp.paper()
    return f"**2014**: {paper['gpu']}; {paper['cpu']}; {paper['system']}; {_TIMERS['query']}"


def _machine(measurement: Measurement) -> str:
    """Where and how a measurement was made."""
    views = sorted(
        {len(row["gpu_ms"]) for row in measurement["rows"]}
    )  # fewer of a scan where it was stopped
    params = (f"{name} {str(value).lower()}" for name, value in measurement["params"].items())
    parts = (
        f"**{measurement['device']}**: {measurement['driver']}, {measurement['processors']} processors",
        _TIMERS[measurement["timer"]],
        f"{'x'.join(map(str, measurement['size']))}, {' or '.join(map(str, views))} views a scan",
        f"Scan4D {measurement['version']}, {measurement['date']}, `{BACKEND}` with {', '.join(params)}",
    )
    return "; ".join(parts) + (f". {measurement['note']}" if measurement["note"] else "")


def _ratio(line: Line, feed: str) -> str:
    if _FIRST not in line.times:  # a driver without it
        return ""
    return f"{np.median(line.times[feed] / line.times[_FIRST]):.2f}"


def _table(measurements: Sequence[Measurement], cell: Callable[[Line, str], str]) -> str:
    """A Markdown table: of each scan the paper's line, then those of the measurements. cell: of a feed."""
    lines = [(scan, line) for scan in slomp.scans() for line in _lines(scan, measurements)]
    feeds = list(dict.fromkeys(feed for _, line in lines for feed in line.times))
    feeds.sort(key=lambda feed: feed == FLOOR)
    rows = [
        ["scan", "points", "covered", "machine", *(f"`{feed}`" for feed in feeds)],
        ["---", "---:", "---:", "---", *("---:" for _ in feeds)],
    ]
    above = None
    for scan, line in lines:
        name = f"{scan.name}, `{scan.scene}`" if scan.name else f"`{scan.scene}`"
        head = ["", ""] if scan == above else [name, f"{line.points:,}".replace(",", _SPACE)]
        covered = "{:.0f} to {:.0f} %".format(*line.covered)
        rows.append(
            [*head, covered, line.machine, *(cell(line, f) if f in line.times else "" for f in feeds)]
        )
        above = scan
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _lines(scan: Scan, measurements: Sequence[Measurement]) -> Iterator[Line]:
    """The times of one scan: the paper's, and what each measurement has of it."""
    if scan.points is not None:
        theirs = slomp.paper()["surfels_ms"][scan.name]
        times = {feed: np.array([ms]) for feed, ms in theirs.items()}
        yield Line(scan.points, _COVERED, "2014", times, "{:#.4g}".format)
    for measurement in measurements:
        rows = [
            row
            for row in measurement["rows"]
            if row["scene"] == scan.scene and scan.points in (None, row["n"])
        ]
        if not rows:
            continue
        points = rows[0]["n"]
        covered = [percent for row in rows if row["feed"] != FLOOR for percent in row["covered"]]
        seen = (min(covered), max(covered))
        yield Line(points, seen, measurement["device"], {r["feed"]: np.array(r["gpu_ms"]) for r in rows})
        if measurement["timer"] == "finish":
            busy = {r["feed"]: np.array(r["busy_ms"]) / measurement["processors"] for r in rows}
            yield Line(points, seen, "its processors", busy)
