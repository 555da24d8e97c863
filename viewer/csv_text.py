"""Tables as comma separated values, RFC 4180."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from pathlib import Path

from .files import whole_file


def to_text(rows: Iterable[Iterable[object]], separator: str = ",") -> str:
    """The rows as RFC 4180 has them."""
    text = io.StringIO()
    csv.writer(text, delimiter=separator).writerows(rows)
    return text.getvalue()


def save_rows(path: Path, rows: Iterable[Iterable[object]]) -> None:
    """Write the rows as a CSV file, in one step. Raises InputError where it cannot be written."""
    with whole_file(path) as temporary:
        temporary.write_text(to_text(rows), encoding="utf-8", newline="")
