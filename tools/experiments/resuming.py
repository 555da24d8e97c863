"""Stopped suites go on: beside the rows, a journal says which pieces of a run are measured.

A piece is a group of pictures, or a part of other kind. `journal.jsonl` in the folder of the run has a line
with the options and the commit, one for each piece as it begins, one for each time that the run goes on, and
one at the end. All pieces before the last that began are complete."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path

from experiments.stale import commit
from experiments.tables import Row
from viewer.bench.plan import Group
from viewer.bench.report.results import RESULTS, read_rows, write_row
from viewer.bench.run import Bench, BenchSettings
from viewer.drawing.renderer import Renderer
from viewer.errors import InputError
from viewer.files import whole_file

JOURNAL = "journal.jsonl"


class Journal:
    """How far the run in a folder has come. lines: what was written; the first has `options` and `commit`,
    which is empty where git knows none."""

    def __init__(self, folder: Path, lines: Sequence[Row]) -> None:
        self.folder, self._lines = folder, list(lines)

    @classmethod
    def of_new(cls, folder: Path, options: Row) -> Journal:
        """Of a run that begins. It is written with the first piece, so until then an earlier one stays."""
        return cls(folder, [{"options": options, "commit": commit() or ""}])

    @classmethod
    def read(cls, folder: Path) -> Journal | None:
        """The journal of a folder; None where it has none. Raises InputError for a damaged one."""
        path = folder / JOURNAL
        if not path.exists():
            return None
        lines = read_rows(path, {})
        if not lines or not {"options", "commit"} <= lines[0].keys():
            raise InputError("is no journal of a run", path, "Measure into another folder")
        return cls(folder, lines)

    @classmethod
    def resumed(cls, folder: Path, options: Row) -> Journal:
        """The journal of a stopped run that goes on, with the same options and commit.

        Raises InputError where there is none, where the run came to its end, and for all that differs."""
        journal = cls.read(folder)
        if journal is None:
            hint = "Leave out --resume to measure from the start"
            raise InputError("contains no run that could go on", folder, hint)
        was = {**journal._lines[0]["options"], "commit": journal._lines[0]["commit"]}
        now = {**options, "commit": commit() or ""}
        differing = [
            f"{name} was {was.get(name)}, now {now.get(name)}"
            for name in {**was, **now}
            if was.get(name) != now.get(name)
        ]
        if differing:
            hint = "Go on with the same options and commit, or measure into another folder"
            raise InputError(f"contains a run that differs: {'; '.join(differing)}", folder, hint)
        if any("finished" in line for line in journal._lines):
            raise InputError("contains a finished run", folder, "Use --report to write its report again")
        journal.add(resumed=now["commit"])
        return journal

    def add(self, **line: object) -> None:
        """Append a line."""
        self._lines.append(line)
        with whole_file(self.folder / JOURNAL) as path, open(path, "w", encoding="utf-8") as stream:
            for each in self._lines:
                write_row(stream, each)

    @property
    def _marks(self) -> list[Row]:
        """What was written as each piece began, of the last time that it did."""
        return list({line["piece"]: line for line in self._lines if "piece" in line}.values())

    @property
    def notes(self) -> list[str]:
        """What was noted before the last piece began."""
        return [note for mark in self._marks[-1:] for note in mark["notes"]]

    def pieces(self) -> list[list[Row]]:
        """The rows of each complete piece. Raises InputError where a file has lost some."""
        marks, found = self._marks, []
        for mark, following in pairwise(marks):
            start, count, path = mark["start"], following["before"], self.folder / mark["file"]
            rows = read_rows(path, {})[start : start + count] if count else []
            if len(rows) < count:
                what = f"has fewer rows than {start + count}, which were measured"
                raise InputError(what, path, f"Look for them in old-{path.name}")
            found.append(rows)
        return found

    @property
    def provenance(self) -> Row:
        """What a stored run says of its code: `commit`; and `resumed`, that of each time that it went on."""
        commits = [line["resumed"] for line in self._lines if "resumed" in line]
        known = self._lines[0]["commit"]
        return ({"commit": known} if known else {}) | ({"resumed": commits} if commits else {})


class JournaledBench(Bench):
    """A bench whose run goes on after the pieces that its journal has. All pieces come in the same order."""

    def __init__(self, renderer: Renderer, settings: BenchSettings, journal: Journal) -> None:
        super().__init__(renderer, settings, journal.folder)
        self.journal, self._stored = journal, journal.pieces()
        self.notes += journal.notes
        self._begun, self._counts, self._before = 0, Counter[str](), 0

    @property
    def stored(self) -> int:
        """How many pieces are complete from before."""
        return len(self._stored)

    def measure(self, group: Group) -> list[Row]:
        """The rows of a group of pictures: those that are stored, or measured now."""
        return list(self.rows(RESULTS, partial(self._measured, group)))

    def _measured(self, group: Group, bench: Bench) -> Iterator[Row]:
        yield from super().measure(group)

    def rows(self, file: str, measure: Callable[[Bench], Iterator[Row]]) -> Iterator[Row]:
        """Yield the rows of the next piece, which go into a file: those that are stored, or measured now."""
        stored = self._stored[self._begun] if self._begun < len(self._stored) else None
        if stored is None:
            start = self._counts[file]
            self.journal.add(
                piece=self._begun, file=file, start=start, before=self._before, notes=list(self.notes)
            )
        self._begun, self._before = self._begun + 1, 0
        for row in measure(self) if stored is None else stored:
            self._counts[file] += 1
            self._before += 1
            yield row

    def finish(self) -> None:
        """Say in the journal that the run came to its end, unless Ctrl-C stopped it."""
        if not self.stopped:
            self.journal.add(finished=True)
