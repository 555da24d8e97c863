"""Tables of feeds (Tables II and IV of Slomp 2014): a column for each, a line for each scan and machine."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...baselines import FLOOR
from ...report import measurement
from ...report.measurement import Measurement, markdown_table, rounded_times, spaced
from ...report.page import three_digits
from ...report.results import Row
from . import surfels as slomp
from .surfels import FEED, Scan

Values = NDArray[np.float64]  # ms, of each view

_COVERED = (25, 85)  # percent of the paper's pictures
_FIRST = "gs"  # what the others are compared with


@dataclass(frozen=True)
class FeedTable:
    """A table of feeds. theirs: its name in the paper's figures. about: what to say of a scan."""

    theirs: str
    about: Callable[[Scan], str]

    def milliseconds(self, measurements: Sequence[Measurement]) -> str:
        """A Markdown table of the mean over the views of the time that each feed takes."""
        return self._table(measurements, lambda line, feed: line.text(line.times[feed].mean()))

    def ratios(self, measurements: Sequence[Measurement]) -> str:
        """A Markdown table of each feed's time in times of the first feed's, the median over the views."""
        return self._table(measurements, _ratio)

    def _table(self, measurements: Sequence[Measurement], cell: Callable[[_Line, str], str]) -> str:
        lines = [(scan, line) for scan in slomp.scans() for line in self._lines(scan, measurements)]
        feeds = list(dict.fromkeys(feed for _, line in lines for feed in line.times))
        feeds.sort(key=lambda feed: feed == FLOOR)
        rows, above = [], None
        for scan, line in lines:
            head = ["", ""] if scan == above else [self.about(scan), spaced(line.points)]
            covered = "{:.0f} to {:.0f} %".format(*line.covered)
            cells = (cell(line, feed) if feed in line.times else "" for feed in feeds)
            rows.append([*head, covered, line.machine, *cells])
            above = scan
        head = ["scan", "points", "covered", "machine", *(f"`{feed}`" for feed in feeds)]
        return markdown_table(head, rows, left=("scan", "machine"))

    def _lines(self, scan: Scan, measurements: Sequence[Measurement]) -> Iterator[_Line]:
        """The times of one scan: the paper's, and what each measurement has of it."""
        if scan.points is not None:
            theirs = slomp.paper()[self.theirs][scan.name]
            times = {feed: np.array([ms]) for feed, ms in theirs.items() if feed != "depth"}
            yield _Line(scan.points, _COVERED, "2014", times, "{:#.4g}".format)
        for each in measurements:
            found = of_scan(each["rows"], scan)
            for form in dict.fromkeys(row.get("form", "") for row in found):
                rows = [row for row in found if row.get("form", "") == form]
                points = rows[0]["n"]
                covered = [percent for row in rows if row["feed"] != FLOOR for percent in row["covered"]]
                seen, suffix = (min(covered), max(covered)), f", {form}" if form else ""
                times = {row["feed"]: np.array(row["gpu_ms"]) for row in rows}
                yield _Line(points, seen, each["device"] + suffix, times)
                if each["timer"] == "finish":
                    busy = {row["feed"]: np.array(row["busy_ms"]) / each["processors"] for row in rows}
                    yield _Line(points, seen, "its processors" + suffix, busy)


@dataclass(frozen=True)
class _Line:
    """A line of the tables. points: of the scan. covered: from and to which percent of the pictures are.

    times: of each feed. text: how a time is written.
    """

    points: int
    covered: tuple[float, float]
    machine: str
    times: dict[str, Values]
    text: Callable[[float], str] = three_digits


def scan_title(scan: Scan) -> str:
    """The paper's name of a scan, and of what stands in for it."""
    return f"{scan.name}, `{scan.scene}`" if scan.name else f"`{scan.scene}`"


def of_scan(rows: Sequence[dict[str, Any]], scan: Scan) -> list[dict[str, Any]]:
    """The rows of a measurement that are of a scan."""
    return [row for row in rows if row["scene"] == scan.scene and scan.points in (None, row["n"])]


def digest(
    rows: Sequence[Row], backend: str, suite: str, forms: Mapping[str, str] | None = None
) -> Measurement:
    """The part of a run that the tables need: how it was measured, and the times of each view.

    forms: what lines of other backends are called, by their names. Raises InputError where the rows are of
    another suite.
    """
    own = [row for row in rows if row["sweep"] == FEED]
    timed = [
        {
            "scene": row["scene"],
            "n": row["n"],
            "feed": row["params"].get(FEED, FLOOR),
            **({"form": forms[row["backend"]]} if forms and row["backend"] in forms else {}),
            "covered": [round(percent, 1) for percent in row["covered_by_view"]],
            **rounded_times(row),
        }
        for row in own
    ]
    return measurement.digest([row for row in own if row["backend"] == backend], suite, {"rows": timed})


def _ratio(line: _Line, feed: str) -> str:
    if _FIRST not in line.times:  # a driver without it
        return ""
    return f"{np.median(line.times[feed] / line.times[_FIRST]):.2f}"
