"""Tables of runs in Markdown: one description, of columns and the rows that they show."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from viewer.bench.report.page import three_digits

Row = dict[str, Any]
StoredRun = dict[str, Any]  # of one machine: where and when, and lists of rows

_SPACE = "\N{NARROW NO-BREAK SPACE}"
_TIMERS = {"query": "GPU timer queries", "finish": "wall times between two `glFinish` calls"}
_NUMBER = re.compile(r"[-+\N{MINUS SIGN}\N{EN DASH}]?\d|[∞\N{EN DASH}]|$")


def spaced(number: float) -> str:
    """A whole number with thin spaces."""
    return f"{number:,.0f}".replace(",", _SPACE)


def shown(value: Any) -> str:
    """A value as a cell: three digits of a float, thin spaces in a count, yes or no, nothing for None."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return spaced(value)
    return value if isinstance(value, str) else three_digits(float(value))


@dataclass(frozen=True)
class Column:
    """A column of a table.

    value: where a row has its value, a key or keys joined by dots (NaN if it lacks them), or a function of
    the row; empty: under the title. form: how a value is written: a format such as "{:.1f}", or a function;
    an empty cell stays empty. left: whether text stands on the left; None: unless all cells begin with a
    digit."""

    title: str
    value: str | Callable[[Row], Any] = ""
    form: str | Callable[[Any], str] = shown
    left: bool | None = None

    def cell(self, row: Row) -> str:
        """The cell of a row."""
        value = self.value(row) if callable(self.value) else look_up(row, self.value or self.title)
        if value is None or value == "":
            return ""
        return self.form(value) if callable(self.form) else self.form.format(value)


def code(title: str, value: str = "") -> Column:
    """A column of names, in backquotes."""
    return Column(title, value, "`{}`", left=True)


def columns(prefix: str, titles: Mapping[str, str]) -> list[Column]:
    """A column for each title, by the key below a prefix that has its value."""
    return [Column(title, f"{prefix}.{name}") for name, title in titles.items()]


def at(*keys: Any) -> Callable[[Row], Any]:
    """A function that gives the value of a row at keys one below the other; None where there is none."""

    def value(row: Row) -> Any:
        found: Any = row
        for key in keys:
            found = found.get(key) if isinstance(found, dict) else None
        return found

    return value


def look_up(row: Row, keys: str) -> Any:
    """The value at keys joined by dots; NaN where there is none."""
    value: Any = row
    for key in keys.split("."):
        value = value.get(key, math.nan) if isinstance(value, dict) else math.nan
    return value


Rows = Callable[[Sequence[StoredRun]], Iterable[Row]]


@dataclass(frozen=True)
class Table:
    """A table of a page, shown between `<!-- NAME -->` and `<!-- /NAME -->`.

    rows: the name of the rows of the first machine that it shows, or a function of all runs. columns: fixed,
    or a function of the rows. empty: what stands there without rows. merged: so many columns at the left are
    empty where they repeat the row above."""

    name: str
    columns: Sequence[Column] | Callable[[Sequence[Row]], Sequence[Column]]
    rows: str | Rows = "rows"
    merged: int = 0
    empty: str = ""

    def text(self, runs: Sequence[StoredRun]) -> str:
        """The table in Markdown."""
        if callable(self.rows):
            rows = list(self.rows(runs))
        else:
            rows = [row for each in runs[:1] for row in each[self.rows]]
        if not rows and self.empty:
            return self.empty
        described = self.columns(rows) if callable(self.columns) else self.columns
        cells, above = [], None
        for row in rows:
            line = [column.cell(row) for column in described]
            head = line[: self.merged]
            cells.append([""] * self.merged + line[self.merged :] if head and head == above else line)
            above = head
        return markdown(described, cells)


@dataclass(frozen=True)
class Machines:
    """The list of the machines that the tables of a page are of. backend: whose parameters it shows. paper:
    the paper's `year`, `gpu`, and what it says of `cpu`, `system` and `timing`."""

    backend: str = ""
    paper: Mapping[str, Any] | None = None
    name: str = "machines"

    def text(self, runs: Sequence[StoredRun]) -> str:
        """A Markdown list."""
        items = [_machine(each, self.backend) for each in runs]
        if self.paper is not None:
            known = (self.paper[part] for part in ("gpu", "cpu", "system", "timing") if part in self.paper)
            items.insert(0, f"**{self.paper['year']}**: {'; '.join(known)}")
        return "\n".join(
            textwrap.fill(
                item, 100, initial_indent="* ", subsequent_indent="  ", break_long_words=False,
                break_on_hyphens=False,
            )
            for item in items
        )  # fmt: skip


def _machine(run: StoredRun, backend: str) -> str:
    """Where, when and how a run was measured."""
    sentences = [
        f"**{run['device']}** ran with {run['processors']} processors and the driver {run['driver']}"
    ]
    views = sorted({len(row["gpu_ms"]) for row in run.get("rows", ()) if "gpu_ms" in row})
    if views:  # fewer of a scan where it was stopped
        count = f"{' or '.join(map(str, views))} view{'' if views == [1] else 's'}"
        sentences.append(f"Times are {_TIMERS[run['timer']]}")
        sentences.append(f"Pictures have {'x'.join(map(str, run['size']))} pixels, and each scan has {count}")
    params = (f"{name}={str(value).lower()}" for name, value in run["params"].items())
    used = f", with `{backend}` and the parameters `{' '.join(params)}`" if backend else ""
    of = f" (commit {run['commit']})" if "commit" in run else ""
    sentences.append(f"We measured version {run['version']} of Scan4D{of} on {run['date']}{used}")
    return " ".join(f"{sentence.rstrip('.')}." for sentence in [*sentences, *filter(None, [run["note"]])])


def of_all(part: str) -> Rows:
    """The rows of all machines, each with the machine's `device`, `timer` and `processors`."""
    return lambda runs: [
        {**row, **{name: each[name] for name in ("device", "timer", "processors")}}
        for each in runs
        for row in each[part]
    ]


def grouped(rows: Iterable[Row], *names: str) -> dict[tuple[Any, ...], list[Row]]:
    """Rows with equal values of some keys, in the order of the first of each."""
    found: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        found.setdefault(tuple(row[name] for name in names), []).append(row)
    return found


def markdown(head: Sequence[Column], cells: Sequence[Sequence[str]]) -> str:
    """A Markdown table of columns and the cells of its lines."""
    lefts = [
        any(not _NUMBER.match(line[number]) for line in cells) if column.left is None else column.left
        for number, column in enumerate(head)
    ]
    rule = ["---" if left else "---:" for left in lefts]
    return "\n".join(f"| {' | '.join(row)} |" for row in ([column.title for column in head], rule, *cells))


def put_tables(text: str, tables: Mapping[str, str]) -> str:
    """A page with its tables: each replaces what stands between `<!-- NAME -->` and `<!-- /NAME -->`.

    Raises ValueError where the page has no such comments.
    """
    for name, table in tables.items():
        start, end = f"<!-- {name} -->\n", f"<!-- /{name} -->"
        before, mark, rest = text.partition(start)
        _, close, after = rest.partition(end)
        if not mark or not close:
            raise ValueError(f"no {start.strip()} and {end} in the page")
        text = f"{before}{start}{table}\n{end}{after}"
    return text
