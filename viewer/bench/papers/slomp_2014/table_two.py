"""Table II of Slomp 2014, then and now: a page of its figures beside measurements of today."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ....resources import resource_path
from ...report import measurement
from ...report.measurement import Measurement, machines, write_measurement
from ...report.results import read_rows
from . import feeds, literal
from . import surfels as slomp
from .feeds import FeedTable

NAME = "table-two"

_SUITE = "slomp"
_TABLE = FeedTable("surfels_ms", feeds.scan_title)


def write_table_two(folder: Path) -> Path:
    """Make table-two.json and table-two.md of the results in a folder; gives the page. Raises InputError."""
    made = feeds.digest(read_rows(folder), slomp.BACKEND, _SUITE, {literal.NAME: "as printed"})
    return write_measurement(folder, NAME, made, page([made]))


def read_measurement(path: Path) -> Measurement:
    """A measurement as it was written. Raises InputError for what is none."""
    return measurement.read_measurement(path, ["rows"], _SUITE)


def page(measurements: Sequence[Measurement]) -> str:
    """The page in Markdown: the text of assets/table-two.md with tables."""
    text = resource_path("assets", f"{NAME}.md").read_text(encoding="utf-8")
    return text.format(
        milliseconds=_TABLE.milliseconds(measurements),
        ratios=_TABLE.ratios(measurements),
        machines=machines(measurements, slomp.BACKEND, slomp.paper()),
    )
