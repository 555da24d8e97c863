"""Scripts: experiments that measure anew each time, and print tables whose rows come one by one."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from experiments.pictures import renderer
from experiments.suite import DOCS, page_named, write_run
from experiments.tables import Column, Row, Table, markdown, put_tables, shown
from viewer.bench.run import Bench, BenchSettings, slug
from viewer.errors import InputError
from viewer.files import whole_file

_WIDTH = 12  # letters of a printed column, at least


class Failed(Exception):
    """A measurement is outside of its bound. The rows are printed nevertheless."""


@dataclass(frozen=True)
class Script:
    """An experiment that stores nothing.

    tables: functions of the options that yield rows, as cells by title; their names are those of the tables.
    Each may raise Failed in the end. options: the default of each; a list takes several values, a pair of
    numbers is a size, None stands for a path. page: of docs/, whose tables the run replaces; empty: none.
    described: tables of `described_page`, made of the runs in docs/data/ as those of a suite. needs_card:
    whether a run is stored on graphics cards alone."""

    tables: Sequence[Callable[[Namespace], Iterator[Row]]]
    options: Mapping[str, Any] = field(default_factory=dict)
    page: str = ""
    described: Sequence[Table] = ()
    described_page: str = ""
    needs_card: bool = False

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the options, and the names of tables where there are several."""
        for name, default in self.options.items():
            flag = f"--{name.replace('_', '-')}"
            if isinstance(default, bool):
                parser.add_argument(flag, action="store_true")
            elif isinstance(default, tuple):
                parser.add_argument(flag, type=size_of, default=default, metavar="WxH")
            elif isinstance(default, list):
                kind = type(default[0]) if default else str
                parser.add_argument(flag, type=kind, nargs="*", default=default)
            else:
                parser.add_argument(flag, type=Path if default is None else type(default), default=default)
        names = [table.__name__ for table in self.tables]
        parser.add_argument(
            "--table", nargs="+", choices=names, default=names, dest="tables", help="make only these tables"
        )
        parser.add_argument(
            "--store", type=Path, metavar="DIR", help="write NAME-MACHINE.json into this folder"
        )
        parser.add_argument("--json", action="store_true", help="print a line of JSON for each row")

    def run(self, name: str, args: Namespace) -> None:
        """Measure and print; put the tables into the page, store them where `--store` says. Raises Failed."""
        if args.store and self.needs_card and renderer().gpu.software:
            raise InputError(
                f"{renderer().gpu.device} is no graphics card", "--store", "Leave it out to print the rows"
            )
        failures, made = [], {}
        for table in self.tables:
            if table.__name__ in args.tables:
                rows: list[Row] = []
                try:
                    for row in table(args):
                        _print_row(table.__name__, row, not rows, args.json)
                        rows.append(row)
                except Failed as failure:
                    failures.append(str(failure))
                made[table.__name__] = rows
                if self.page and rows:
                    self._put(table.__name__, rows)
        if args.store:
            _store(args.store, name, args, made)
        if failures:
            raise Failed("\n".join(failures))

    def _put(self, name: str, rows: Sequence[Row]) -> None:
        page = page_named(self.page)
        titles = [Column(title) for title in rows[0]]
        made = markdown(titles, [[shown(cell) for cell in row.values()] for row in rows])
        text = put_tables(page.read_text(encoding="utf-8"), {name: made})
        with whole_file(page) as temporary:
            temporary.write_text(text, encoding="utf-8")


def described_text(name: str, script: Script) -> str:
    """The described page with the tables of the stored runs of a script."""
    files = sorted((DOCS / "data").glob(f"{name}-*.json"))
    runs = [json.loads(path.read_text(encoding="utf-8")) for path in files]
    page = page_named(script.described_page)
    made = {table.name: table.text(runs) for table in script.described}
    return put_tables(page.read_text(encoding="utf-8"), made)


def _store(folder: Path, name: str, args: Namespace, made: Mapping[str, list[Row]]) -> None:
    """Write all rows, and where and how they were measured."""
    bench = Bench(renderer(), BenchSettings(size=(32, 32)))
    options = {
        key: value for key, value in vars(args).items() if isinstance(value, int | float | list | tuple)
    }
    folder.mkdir(parents=True, exist_ok=True)
    machine = slug(renderer().gpu.device)
    write_run(folder / f"{name}-{machine}.json", {**bench.where(), "options": options, **made})


def _print_row(table: str, row: Row, is_first: bool, as_json: bool) -> None:
    """Print a row, below the titles if it is the first."""
    if as_json:
        print(json.dumps({"table": table, "row": row}, default=float), flush=True)
        return
    widths = [max(_WIDTH, len(title)) for title in row]
    if is_first:
        print(
            f"\n{table}",
            "  ".join(title.ljust(width) for title, width in zip(row, widths, strict=True)),
            sep="\n",
        )
    cells = (shown(cell).ljust(width) for cell, width in zip(row.values(), widths, strict=True))
    print("  ".join(cells).rstrip(), flush=True)


def size_of(text: str) -> tuple[int, int]:
    """Width and height of WxH."""
    width, height = text.split("x")
    return int(width), int(height)
