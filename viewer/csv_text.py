"""Tables as comma separated values, RFC 4180, whose texts no spreadsheet takes for formulas.

A spreadsheet computes what begins with one of =+-@, in full width, too, and what has that behind a tab or a
line break. Names come from files, so such a text gets an apostrophe in front, which spreadsheets take for the
mark of a text. Readers take it off again with `text_of_cell`.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable
from pathlib import Path

from .files import whole_file

_WIDE = "\uff1d\uff0b\uff0d\uff20"  # the same signs as East Asian keyboards have them
# Also a text that begins like one with an apostrophe.
_FORMULA = re.compile(rf"'*[=+\-@\t\r\n{_WIDE}]")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


def cell(value: float) -> float | None:
    """A number as tables have it, empty where it is not known."""
    return float(value) if math.isfinite(value) else None


def to_text(rows: Iterable[Iterable[object]], separator: str = ",") -> str:
    """The rows as RFC 4180 has them; None is an empty cell."""
    text = io.StringIO()
    csv.writer(text, delimiter=separator).writerows(map(_cell, row) for row in rows)
    return text.getvalue()


def _cell(value: object) -> object:
    """A cell as it is written."""
    if value is None or isinstance(value, int | float):
        return value
    text = str(value)
    return f"'{text}" if _FORMULA.match(text) and not _NUMBER.fullmatch(text) else text


def text_of_cell(cell: str) -> str:
    """The text that was written as a cell."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


def save_rows(path: Path, rows: Iterable[Iterable[object]]) -> None:
    """Write the rows as a CSV file, in one step. Raises InputError where it cannot be written."""
    with whole_file(path) as temporary:
        temporary.write_text(to_text(rows), encoding="utf-8", newline="")
