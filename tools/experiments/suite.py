"""Suites: experiments whose rows are stored for each machine, and whose tables stand in a page of docs/.

A run writes the rows into a folder, NAME.json with what the page needs of them, and the page with their
tables. docs/data/NAME-MACHINE.json of several machines make the page: `python -m pytest tests/test_docs.py
--bless`."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from experiments.tables import Machines, Row, StoredRun, Table, look_up, put_tables
from viewer.bench.plan import Group
from viewer.bench.report.results import RESULTS, read_rows
from viewer.bench.run import Bench, BenchSettings
from viewer.bench.scenes.subjects import Subject
from viewer.errors import InputError
from viewer.files import whole_file

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
_WHERE = ("device", "driver", "processors", "timer", "version", "date", "size", "repeat", "seed")
_DIGITS = 9  # that a stored run has of a number


def page_named(name: str) -> Path:
    """The only page of this name in docs/. The name may begin with the folder."""
    (page,) = DOCS.rglob(name)
    return page


@dataclass(frozen=True)
class Part:
    """Rows of one kind. measure: yields them, given the bench, and the scenes if the suite has any; None:
    they are those of the drawn pictures. sweeps: only rows with these; empty: all.

    stored: the keys of a row that a stored run has, or a function from all rows to those that it has.
    by_scene: whether the rows of a scene are the same without the other scenes; then a stopped run goes on
    with the scene that it was stopped at.
    """

    stored: Sequence[str] | Callable[[Sequence[Row]], Iterable[Row]]
    measure: Callable[..., Iterator[Row]] | None = None
    sweeps: Sequence[str] = ()
    by_scene: bool = False

    def own(self, rows: Sequence[Row]) -> list[Row]:
        """The rows that are of this part."""
        return [row for row in rows if not self.sweeps or row["sweep"] in self.sweeps]

    def digest(self, rows: Sequence[Row]) -> list[Row]:
        """The part of the rows that a stored run has."""
        if callable(self.stored):
            return [rounded(row) for row in self.stored(self.own(rows))]
        return [rounded({name: row[name] for name in self.stored if name in row}) for row in self.own(rows)]


@dataclass(frozen=True)
class Suite:
    """An experiment with a page of its own.

    page: of docs/. parts: its rows, by name. tables: what the page shows of them. scenes: which, unless
    others are named; None: it has its own. groups: the pictures that are drawn of scenes. pictures: what it
    draws beside, by name. own: the backend whose parameters the page names; empty: none. usual: the settings,
    unless others are stated. quick: scenes and views of the quick form, where it has one of its own.
    libraries: which it needs."""

    page: str
    parts: Mapping[str, Part]
    tables: Sequence[Table | Machines]
    scenes: Sequence[str] | None = None
    groups: Callable[[BenchSettings, Sequence[str]], list[Group]] | None = None
    pictures: Mapping[str, Callable[[Bench, StoredRun], object] | None] = field(default_factory=dict)
    own: str = ""
    usual: BenchSettings = field(default_factory=lambda: BenchSettings(frames=0))
    quick: tuple[Sequence[str], int] | None = None
    libraries: Sequence[str] = ()

    def digest(self, rows: Mapping[str, Sequence[Row]]) -> StoredRun:
        """What the page needs of a run. rows: of each part. Raises InputError where there are none."""
        found = {name: part.digest(rows[name]) for name, part in self.parts.items()}
        if not any(found.values()):
            raise InputError("no such rows among the results", hint="Run the experiment that the page names")
        name, part = next(iter(self.parts.items()))
        first = [*part.own(rows[name]), *(row for each in rows.values() for row in each)]
        where, drawn = first[0], [row for row in part.own(rows[name]) if row.get("backend") == self.own]
        params = [row["params"] for row in drawn]
        shared = {
            name: value
            for name, value in (params[0] if params else {}).items()
            if all(name in each and each[name] == value for each in params)
        }
        return {
            **{name: where[name] for name in _WHERE if name in where},
            "params": shared,
            "note": "",
            **found,
        }

    def read(self, folder: Path) -> StoredRun:
        """The digest of the rows in a folder of results. Raises InputError."""
        files = {
            name: folder / (RESULTS if part.measure is None else f"{name}.jsonl")
            for name, part in self.parts.items()
        }
        return self.digest(
            {
                name: read_rows(file, None if file.name == RESULTS else {}) if file.exists() else []
                for name, file in files.items()
            }
        )

    def read_run(self, path: Path) -> StoredRun:
        """A run as `write_run` wrote it. Raises InputError for what is none."""
        try:
            found = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise InputError(f"cannot be read: {error}", path) from error
        if not isinstance(found, dict) or not {*_WHERE[:6], "params", "note", *self.parts} <= found.keys():
            raise InputError("is no stored run of this experiment", path)
        return found

    def made(self, runs: Sequence[StoredRun]) -> dict[str, str]:
        """The tables of the page by name, of runs on several machines. Errors are the first one's."""
        return {table.name: table.text(runs) for table in self.tables}

    def filled(self, runs: Sequence[StoredRun]) -> str:
        """The page with these tables."""
        page = page_named(self.page)
        return put_tables(page.read_text(encoding="utf-8"), self.made(runs))


def stored_runs(suite: Suite, name: str) -> list[StoredRun]:
    """The runs of a suite in docs/data/, of all machines."""
    return [suite.read_run(path) for path in sorted((DOCS / "data").glob(f"{name}-*.json"))]


def pictures(
    errors: Iterable[str] = (), params: Mapping[str, str] | None = None, sweeps: Sequence[str] = ()
) -> Part:
    """The part of drawn pictures: of each its scene, backend, times of the views, and some errors.

    params: parameters of the backend that it stores, under other names. sweeps: only of rows with these.
    """

    def stored(rows: Sequence[Row]) -> Iterator[Row]:
        for row in rows:
            values = {new: row["params"].get(name) for name, new in (params or {}).items()}
            found = {name: look_up(row["errors"], name) for name in errors}
            yield {
                **{name: row[name] for name in ("scene", "n", "backend", "sweep")},
                **({} if row.get("zoom") is None else {"zoom": row["zoom"]}),
                **{name: value for name, value in values.items() if value is not None},
                "covered": row.get("covered_by_view", []),
                **{kind: row["times_by_view"][kind] for kind in ("gpu_ms", "busy_ms")},
                "errors": {name: float(error) for name, error in found.items() if not math.isnan(error)},
            }

    return Part(stored, sweeps=sweeps)


def rounded(value: Any) -> Any:
    """A value with its numbers to nine digits."""
    if isinstance(value, dict):
        return {name: rounded(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(each) for each in value]
    return float(f"{value:.{_DIGITS}g}") if isinstance(value, float) else value


def write_run(path: Path, run: StoredRun) -> None:
    """Write JSON with a line for each row of a list."""
    parts = []
    for name, value in run.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            rows = ",\n  ".join(json.dumps(row) for row in value)
            parts.append(f' "{name}": [\n  {rows}\n ]')
        else:
            parts.append(f' "{name}": {json.dumps(value, ensure_ascii=False)}')
    with whole_file(path) as temporary:
        temporary.write_text("{\n" + ",\n".join(parts) + "\n}\n", encoding="utf-8")


def row_of(bench: Bench, **values: object) -> Row:
    """A row with its values, and how, where and when it was measured."""
    settings = bench.settings
    how = {name: getattr(settings, name) for name in ("views", "repeat", "seed")}
    return {"params": {}, "size": list(settings.size), **how, **bench.where(), **values}


def subjects(bench: Bench, scenes: Iterable[str], count: int | None = None) -> Iterator[Subject]:
    """The subjects of scenes, by name or files of meshes; what cannot be had is noted and left out."""
    for scene in scenes:
        try:
            subject = bench.subject(Group(scene, (), count=count))
            subject.moment(0)
        except InputError as error:
            bench.note(f"the benchmark leaves out {scene}: {error}")
            continue
        yield subject
