"""Measurements that the tables of docs/ are made of: what they keep of results, their files, their machines.

A measurement is one small JSON file; those of several machines make one page, or the tables of one. Another
machine's goes to docs/data/ under a name of its own, with what its numbers do not tell in its `note`; then
`python -m pytest tests/test_docs.py --bless` makes the page. A module of such a page has

    NAME                              of its files: docs/data/NAME-*.json
    read_measurement(path)            one of them
    page(measurements) -> text        all of the page NAME.md; or, of a page that is mostly written by hand,
    PAGE, tables(measurements)        its name, and what stands between <!-- KEY --> and <!-- /KEY --> in it
"""

from __future__ import annotations

import json
import math
import sys
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...files import whole_file
from .results import Row, read_rows

Measurement = dict[str, Any]

_ONCE = ("device", "driver", "processors", "timer", "version", "date", "size", "repeat", "seed")
_SPACE = "\N{NARROW NO-BREAK SPACE}"
_TIMERS = {"query": "GPU timer queries", "finish": "wall times between two `glFinish` calls"}


def circumstances(rows: Sequence[Row]) -> Measurement:
    """Place and manner of measuring rows. params: those that all have in common."""
    first, *others = rows
    shared = set(first["params"]).intersection(*(row["params"] for row in others))
    params = {name: value for name, value in first["params"].items() if name in shared}
    return {
        **{name: first[name] for name in _ONCE},
        "params": {k: v for k, v in params.items() if all(row["params"][k] == v for row in others)},
        "note": "",
    }


def digest(rows: Sequence[Row], suite: str, kept: Mapping[str, list[dict[str, Any]]]) -> Measurement:
    """The part of a run that a page needs. rows: those that it is about. kept: lists of what it keeps.

    Raises InputError where there are no such rows: the results are of another suite.
    """
    if not rows:
        raise InputError("no such rows among the results", hint=f"Run scan4d bench --suite {suite}")
    return {**circumstances(rows), **kept}


def rounded_errors(row: Row, names: Iterable[str]) -> dict[str, float]:
    """Errors of a row by name, without those that it lacks."""
    found = {name: row["errors"].get(name, math.nan) for name in names}
    return {name: round(error, 5) for name, error in found.items() if not math.isnan(error)}


def rounded_times(row: Row, kinds: Iterable[str] = ("gpu_ms", "busy_ms")) -> dict[str, list[float]]:
    """Times of each view, ms."""
    return {kind: [round(ms, 2) for ms in row["times_by_view"][kind]] for kind in kinds}


def rows_if_any(path: Path) -> list[Row]:
    """The rows of a file of results; none where it is not there."""
    return read_rows(path) if path.exists() else []


def write_measurement(folder: Path, name: str, measurement: Measurement, page: str) -> Path:
    """Write NAME.json and NAME.md; gives the page."""
    path = folder / f"{name}.md"
    for file, text in ((folder / f"{name}.json", _to_text(measurement)), (path, page)):
        with whole_file(file) as temporary:
            temporary.write_text(text, encoding="utf-8")
    return path


def read_measurement(path: Path, parts: Sequence[str], suite: str) -> Measurement:
    """A measurement as it was written. parts: the lists that it must have. suite: what makes one.

    Raises InputError for what is none.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {error}", path) from error
    if not isinstance(found, dict) or not {*_ONCE, "params", "note", *parts} <= found.keys():
        raise InputError("is no such measurement", path, f"Run scan4d bench --suite {suite}")
    return found


def _to_text(measurement: Measurement) -> str:
    """JSON with a line for each row of a list."""
    parts = []
    for name, value in measurement.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            rows = ",\n  ".join(json.dumps(row) for row in value)
            parts.append(f' "{name}": [\n  {rows}\n ]')
        else:
            parts.append(f' "{name}": {json.dumps(value, ensure_ascii=False)}')
    return "{\n" + ",\n".join(parts) + "\n}\n"


# --- of a page ------------------------------------------------------------------------


def machines(measurements: Sequence[Measurement], backend: str, paper: Mapping[str, Any]) -> str:
    """A Markdown list of where the paper's and ours were measured, and with what parameters of a backend.

    paper: its `year` and `gpu`, and of `cpu`, `system` and `timing` what it tells.
    """
    known = (paper[part] for part in ("gpu", "cpu", "system", "timing") if part in paper)
    theirs = _item(f"**{paper['year']}**: {'; '.join(known)}")
    return f"{theirs}\n{machines_of_today(measurements, backend)}"


def machines_of_today(measurements: Sequence[Measurement], backend: str = "") -> str:
    """A Markdown list of our machines. backend: gives its parameters, unless empty."""
    return "\n".join(_item(_machine(each, backend)) for each in measurements)


def _item(text: str) -> str:
    """An item of a Markdown list in lines of at most 100 characters."""
    return textwrap.fill(
        text, 100, initial_indent="* ", subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
    )


def _machine(measurement: Measurement, backend: str) -> str:
    """Place and manner of a measurement, in words."""
    views = sorted(
        {len(row["gpu_ms"]) for row in measurement["rows"]}
    )  # fewer of a scan where it was stopped
    params = (f"{name}={str(value).lower()}" for name, value in measurement["params"].items())
    size = "x".join(map(str, measurement["size"]))
    count = f"{' or '.join(map(str, views))} view{'' if views == [1] else 's'}"
    used = f", with `{backend}` and the parameters `{' '.join(params)}`" if backend else ""
    sentences = [
        f"**{measurement['device']}** with {measurement['processors']} processors and the driver "
        f"{measurement['driver']}",
        f"Times are {_TIMERS[measurement['timer']]}",
        f"Pictures have {size} pixels, and each scan has {count}",
        f"Version {measurement['version']} of Scan4D was measured on {measurement['date']}{used}",
    ]
    note = measurement["note"]
    return " ".join(f"{sentence.rstrip('.')}." for sentence in [*sentences, *([note] if note else [])])


def put_tables(text: str, tables: Mapping[str, str]) -> str:
    """A page with its tables: each replaces what stands between `<!-- KEY -->` and `<!-- /KEY -->`.

    Raises ValueError where the page has no such place.
    """
    for key, table in tables.items():
        start, end = f"<!-- {key} -->\n", f"<!-- /{key} -->"
        before, mark, rest = text.partition(start)
        _, close, after = rest.partition(end)
        if not mark or not close:
            raise ValueError(f"no {start.strip()} and {end} in the page")
        text = f"{before}{start}{table}\n{end}{after}"
    return text


def remeasure_tables(page: Path, *tables: Callable[[], str]) -> None:
    """Make the tables that the command line names, or else all, and put each into the page by its name."""
    made_by = {table.__name__: table for table in tables}
    for name in sys.argv[1:] or made_by:
        made = made_by[name]()
        text = put_tables(page.read_text(encoding="utf-8"), {name: made})
        with whole_file(page) as temporary:
            temporary.write_text(text, encoding="utf-8")
        print(f"{name}\n{made}\n", flush=True)


def spaced(number: float) -> str:
    """A whole number with thin spaces."""
    return f"{number:,.0f}".replace(",", _SPACE)


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]], left: Sequence[str]) -> str:
    """A Markdown table. left: the columns of text, the others are of numbers."""
    rule = ["---" if name in left else "---:" for name in head]
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, rule, *rows))
