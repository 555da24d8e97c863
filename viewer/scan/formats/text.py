"""Text tables of points: XYZ, CSV, TXT, ASC and PTS.

A row a point; `reading/tables.py` finds what stands above the rows, and how they are written. A column of
frames or times makes several moments of one table.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from io import TextIOWrapper
from itertools import islice
from pathlib import Path
from threading import Lock
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, shortened
from ..admission import MOST_FRAMES, check_count, opened
from ..contents import PointContents, Stated, TextHead
from ..points import PointCloud
from ..reading import colors, columns, numbers
from ..reading.camera_tables import cameras_in_table
from ..reading.cloud import assemble, stored_colors
from ..reading.record import Decision
from ..reading.sequence import Decided
from ..reading.tables import NAMES_HELP, TableHead, head_of
from ..times import DEFAULT_FPS
from ._columns import bounded_lines, named

_SOME_ROWS = 1 << 8  # which tell the scale of colours, in a small part of the time of a table

TITLE = "a text table"
SUFFIXES = (".xyz", ".csv", ".txt", ".pts", ".asc", ".xyzn", ".xyzrgb", ".xyznrgb", ".xyzi")


def contents(path: Path, frame: int, decided: Decided) -> PointContents | PointCloud:
    """The columns of a table, parsed as float64; of one that holds several moments the points of one.

    Raises InputError.
    """
    several = _moments(path, decided)
    return _whole(path, decided) if several is None else Frames(path, decided).read(frame)


def _whole(path: Path, decided: Decided) -> PointContents:
    """The columns of a table, all moments of it."""
    with _text_of(path, decided) as (text, encoding):
        head = head_of(bounded_lines(text), decided.corrections)
        _check_points(head.instead, head.hint)
        text.seek(0)
        lines = islice(bounded_lines(text), head.skip, None)
        loose = numbers.LooseLines()
        table = numbers.parse_numbers(lines, head.columns, head.dialect, loose=loose)
    if head.names is None:
        _check_points(cameras_in_table(table))
    _note_writing(head, encoding, decided)
    _report_doubts(head, path, decided)
    promised = None if head.promised is None else head.promised + sum(loose.counts)
    if promised not in (None, len(table)):
        what = f"the line above the rows states {promised:,} points, but there are {len(table):,} rows"
        decided.report("contradiction", f"{path.name}: {what}. Scan4D reads all rows")
    if loose.behind:
        what = f"{path.name}: Scan4D does not read {len(loose.behind)} lines of text below the rows, such as"
        decided.report("contradiction", f"{what} '{shortened(loose.behind[0][0].strip())}'")
    names = _names(head, table, path, decided)
    return PointContents(
        columns=named(zip(names, table.T, strict=True)),
        is_named=head.names is not None,
        has_roles="columns" in decided.corrections,
        stated=Stated(unit=columns.unit_in_names(head.names or ()), promised=promised),
        remarks=head.remarks,
        head=TextHead(encoding.value, head.remarks),
    )


def read_colors(path: Path, frame: int, decided: Decided) -> NDArray | None:
    """The colours of the first rows of a table as stored, (N, C), or None. Raises InputError."""
    with _text_of(path, decided) as (text, _):
        head = head_of(bounded_lines(text), decided.corrections)
        text.seek(0)
        lines = islice(bounded_lines(text), head.skip, None)
        loose = numbers.LooseLines()
        table = numbers.parse_numbers(lines, head.columns, head.dialect, rows=_SOME_ROWS, loose=loose)
    names = _names(head, table, path, decided)
    return stored_colors(PointContents(columns=named(zip(names, table.T, strict=True))))


def frame_count(path: Path, decided: Decided) -> int:
    """How many moments a table holds, by its columns of frames, times and ids; 1 where it cannot be read."""
    try:
        moments = _moments(path, decided)
    except InputError:  # reading the points says why
        return 1
    return 1 if moments is None else len(moments.numbers)


def read_times(path: Path, decided: Decided) -> NDArray[np.float64] | None:
    """The times of the moments, (T,) seconds, from their column or the numbers of the frames."""
    moments = _moments(path, decided)
    if moments is None:
        return None
    if moments.times is not None:
        return moments.times
    return (moments.numbers - moments.numbers[0]) / DEFAULT_FPS


def read_unit(path: Path, decided: Decided) -> str | None:
    """The unit of length that the names of x, y and z state, as `x [mm]` does."""
    return columns.unit_in_names(_head(path, decided).names or ())


class Frames:
    """The moments of one table, which is parsed once. Any thread may read."""

    def __init__(self, path: Path, decided: Decided) -> None:
        """Raises InputError where the file holds no table."""
        self._path = path
        self._decided = decided
        self._moments = _moments(path, decided)
        self._columns: PointContents | None = None
        self._reading = Lock()

    def read(self, frame: int) -> PointCloud:
        """All finite points of one moment. Raises InputError."""
        if self._moments is None:
            return assemble(_whole(self._path, self._decided), self._decided)
        with self._reading:
            if self._columns is None:
                self._columns = _whole(self._path, self._decided)
                copy = replace(self._columns, columns={**self._columns.columns})
                if (found := stored_colors(copy)) is not None:  # of all moments
                    colors.settled_scale(found, self._decided)
            whole = self._columns
        start, end = self._moments.starts[frame : frame + 2]
        rows = self._moments.order[start:end]
        parts = {name: np.asarray(column)[rows] for name, column in whole.columns.items()}
        cloud = assemble(replace(whole, columns=parts), self._decided)
        if self._moments.ids is None:
            return cloud
        ids = self._moments.ids[start:end]
        return replace(cloud, ids=ids if cloud.ids is None else ids[cloud.ids])


# --- head ---------------------------------------------------------------------------------------


@contextmanager
def _text_of(path: Path, decided: Decided) -> Iterator[tuple[TextIO, Decision]]:
    """A file as text, and its encoding. Bytes that the encoding does not have become U+FFFD."""
    with opened(path) as stream:
        start = stream.read(numbers.HEAD)
        stream.seek(0)
        encoding = numbers.encoding_decision(start, decided.corrections.get("encoding"))
        text = TextIOWrapper(stream, numbers.codec_of(encoding, start), errors="replace")
        yield text, encoding
        text.detach()  # else it would close the stream


def _head(path: Path, decided: Decided) -> TableHead:
    with _text_of(path, decided) as (text, _):
        return head_of(bounded_lines(text), decided.corrections)


def _check_points(instead: str | None, hint: str = NAMES_HELP) -> None:
    """Raise InputError where a table holds something else than points."""
    if instead is not None:
        raise InputError(f"looks like {instead}, not like points", hint=hint)


def _note_writing(head: TableHead, encoding: Decision, decided: Decided) -> None:
    """Put into the record how the rows are written."""
    skip = decided.corrections.decision("skip") or Decision("skip", head.skip)
    separator, decimal = head.dialect.decisions(decided.corrections)
    decided.note(encoding, separator, decimal, skip)
    for name in head.unused:
        if name:
            decided.note_unused(f"the column '{shortened(name)}', which contains text")
            if columns.moment_columns([name]).can_split:
                what = (
                    f"Scan4D does not read frames or times from the column '{shortened(name)}', because it "
                    "contains text"
                )
                decided.report("times", f"{what}. To play the rows as frames, write numbers into this column")


def _report_doubts(head: TableHead, path: Path, decided: Decided) -> None:
    """Report what does not fit together in the head of a table."""
    for doubt in head.doubts:
        decided.report("contradiction", f"{path.name}: {doubt}")
    units = columns.units_in_names(head.names or ())
    if len(units) > 1:
        listed = ", ".join(sorted(unit or "none" for unit in units))
        what = f"{path.name}: the names of the columns x, y and z contain different units ({listed})"
        decided.report("unit", f"{what}. Scan4D does not convert the numbers, and their unit stays unknown")


def _names(head: TableHead, table: NDArray[np.float64], path: Path, decided: Decided) -> list[str]:
    """The names of the columns that are read, and a decision about them."""
    if (stated := decided.corrections.decision(columns.KEY)) is not None:
        decided.note(stated)
        return [*(head.names or ())]
    if head.names is not None:
        decided.note(columns.decide_named(head.names))
        return columns.canonical_names(head.names)
    suffix = path.suffix.lower()
    decision = decided.settle(columns.KEY, lambda: columns.decide(table, suffix))
    if len(decision.value) != table.shape[1]:
        had, has = len(decision.value), table.shape[1]
        decided.contradict(columns.KEY, f"{path.name} has {has} columns, but earlier frames have {had}")
        decision = columns.decide(table, suffix)
    return columns.names_of(decision.value)


# --- moments ------------------------------------------------------------------------------------


def _moments(path: Path, decided: Decided) -> columns.Moments | None:
    """The moments of a table, by those of its columns that tell them; None where it is one."""
    with _text_of(path, decided) as (text, _):
        head = head_of(bounded_lines(text), decided.corrections)
        found = columns.moment_columns(head.names or ())
        if not found.can_split or decided.corrections.get("frames") == "cloud" or head.instead:
            return None
        text.seek(0)
        lines = islice(bounded_lines(text), head.skip, None)
        chosen = [at for at in found[:3] if at is not None]
        table = numbers.parse_numbers(
            lines, [head.columns[at] for at in chosen], head.dialect, loose=numbers.LooseLines()
        )
    by_index = dict(zip(chosen, table.T, strict=True))
    frame, time, id = (None if at is None else by_index[at] for at in found[:3])
    moments = columns.moments_of(frame, time, id, found.seconds)
    if moments is None:
        return None
    check_count(len(moments.numbers), MOST_FRAMES, "frames")
    decided.note(Decision("frames", f"by the column {(head.names or ())[chosen[0]]}", why=moments.why))
    return moments
