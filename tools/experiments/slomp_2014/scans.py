"""The scans of Slomp 2014, and the tables of its feeds: a column for each, a line for each scan and machine.

The paper's scans were never published. Other sequences stand in for them, with exactly as many points a pose
(Table I); size, coverage and method are the paper's (VII).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.papers import figures
from experiments.tables import Column, Row, StoredRun, Table
from viewer.backends import backend
from viewer.bench.baselines import FLOOR
from viewer.bench.plan import Contender, Group
from viewer.bench.report.page import three_digits

PAPER = figures("slomp_2014")
FEED = "instancing"  # the parameter of every backend that has feeds
_STAND_INS = {
    "baseball": "crane",
    "basketball": "owlii",
    "kick": "crane",
    "soccer (juggle)": "owlii",
    "soccer (shoot)": "horse-gallop",
}
_COVERED = (25, 85)  # percent of the paper's pictures
_FIRST = "gs"  # the feed that the others are compared with


@dataclass(frozen=True)
class Scan:
    """A scan of the tables. name: the paper's, empty for ours. scene: what is drawn here.

    points: a pose; None: as many as the scene has.
    """

    name: str
    scene: str
    points: int | None

    @property
    def title(self) -> str:
        """The paper's name, and that of the scene that replaces it."""
        return f"{self.name}, `{self.scene}`" if self.name else f"`{self.scene}`"

    def rows(self, run: StoredRun, part: str = "rows") -> list[Row]:
        """The rows of a run that are of this scan."""
        rows = run[part]
        return [row for row in rows if row["scene"] == self.scene and self.points in (None, row["n"])]


def scans() -> list[Scan]:
    """The paper's five, in the order of its tables, and the demo."""
    theirs = (Scan(name, _STAND_INS[name], scan["points"]) for name, scan in PAPER["datasets"].items())
    return [*theirs, Scan("", "demo", None)]


def feeds_of(name: str) -> list[str]:
    """Every feed that a backend has, in the order of their declaration."""
    (declared,) = (parameter for parameter in backend(name).parameters if parameter.name == FEED)
    return [feed for feed in declared.choices if feed != "auto"]


def by_feed(scan: Scan, name: str, method: Mapping[str, Any], beside: Sequence[Contender] = ()) -> Group:
    """All feeds of a backend, which take turns on a scan, and plain GL_POINTS as everywhere; timed alone.

    method: the backend's other parameters. beside: what else takes turns with them.
    """
    params = (backend(name).params({**method, FEED: feed}) for feed in feeds_of(name))
    drawn = (Contender(FLOOR), *(Contender(name, each, FEED) for each in params), *beside)
    return Group(scan.scene, drawn, count=scan.points, sweep=FEED, judged=False)


def feed_tables(
    theirs: str, title: Callable[[Scan], str], forms: Mapping[str, str] | None = None
) -> list[Table]:
    """Two tables of feeds: milliseconds, means over the views; and times of each feed as a part of the first
    feed's, medians over the views.

    theirs: the name of the table in the paper's figures. forms: how lines of other passes are called.
    """

    def rows(runs: Sequence[StoredRun]) -> Iterator[Row]:
        for scan in scans():
            for line in _lines(scan, theirs, runs, forms or {}):
                yield {"scan": title(scan), **line}

    def described(cell: Callable[[str], Callable[[Row], str]]) -> Callable[[Sequence[Row]], list[Column]]:
        def of(lines: Sequence[Row]) -> list[Column]:
            feeds = list(dict.fromkeys(feed for line in lines for feed in line["times"]))
            feeds.sort(key=lambda feed: feed == FLOOR)
            return [
                Column("scan", left=True),
                Column("points"),
                Column("covered", lambda row: "{:.0f} to {:.0f} %".format(*row["covered"])),
                Column("machine", left=True),
                *(Column(f"`{feed}`", cell(feed)) for feed in feeds),
            ]

        return of

    return [
        Table("milliseconds", described(_mean), rows, merged=2),
        Table("ratios", described(_ratio), rows, merged=2),
    ]


def _lines(scan: Scan, theirs: str, runs: Sequence[StoredRun], forms: Mapping[str, str]) -> Iterator[Row]:
    """The lines of one scan: the paper's, and what each run has of it. times: of each view by feed."""
    if scan.points is not None:
        times = {feed: np.array([ms]) for feed, ms in PAPER[theirs][scan.name].items() if feed != "depth"}
        yield {"points": scan.points, "covered": _COVERED, "machine": "2014", "times": times, "printed": True}
    for each in runs:
        by_form: dict[str, list[Row]] = {}
        for row in scan.rows(each):
            by_form.setdefault(forms.get(row.get("passes", ""), ""), []).append(row)
        for form, rows in by_form.items():
            covered = [percent for row in rows if row.get("feed") for percent in row["covered"]]
            line = {"points": rows[0]["n"], "covered": (min(covered), max(covered))}
            suffix = f", {form}" if form else ""
            yield {**line, "machine": each["device"] + suffix, "times": _times(rows, "gpu_ms")}
            if each["timer"] == "finish":
                busy = _times(rows, "busy_ms", each["processors"])
                yield {**line, "machine": "its processors" + suffix, "times": busy}


def _times(rows: Sequence[Row], kind: str, processors: int = 1) -> dict[str, np.ndarray]:
    return {row.get("feed", FLOOR): np.array(row[kind]) / processors for row in rows}


def _mean(feed: str) -> Callable[[Row], str]:
    def cell(row: Row) -> str:
        if feed not in row["times"]:
            return ""
        ms = float(row["times"][feed].mean())
        return f"{ms:#.4g}" if row.get("printed") else three_digits(ms)

    return cell


def _ratio(feed: str) -> Callable[[Row], str]:
    def cell(row: Row) -> str:
        if feed not in row["times"] or _FIRST not in row["times"]:  # a driver without it
            return ""
        return f"{np.median(row['times'][feed] / row['times'][_FIRST]):.2f}"

    return cell
