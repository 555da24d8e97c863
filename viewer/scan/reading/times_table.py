"""A table of times beside frames, such as times.csv: which column holds the times, and which row is of which
frame."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from datetime import datetime
from io import StringIO
from itertools import pairwise
from pathlib import Path, PurePosixPath
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...csv_text import text_of_cell
from ...errors import InputError, shortened
from ...files import open_plain
from .names import frame_counts
from .numbers import decoded, is_comment, is_numeral, value

_SEPARATORS = ";\t|,"
_FILE_WORDS = {
    "file",
    "files",
    "datei",
    "dateiname",
    "fichier",
    "archivo",
    "bestand",
    "image",
    "bild",
    "name",
}
_FILE_WORDS |= {f"{word}{end}" for word in ("file", "image") for end in ("name", "_name", " name")}
_INDEX_WORDS = {"index", "idx"}
_FRAME_WORDS = {
    "frame", "frames", "nr", "no", "number", "nummer", "num", "bildnummer", "trame", "cuadro", "n",
}  # fmt: skip
_TIME_WORDS = {
    "time", "times", "timestamp", "timestamps", "stamp", "t", "zeit", "zeitstempel", "zeitpunkt", "temps",
    "tiempo", "tempo", "tijd", "uhrzeit", "elapsed",
}  # fmt: skip
_UNITS = {
    "s": 1.0, "sec": 1.0, "secs": 1.0, "second": 1.0, "seconds": 1.0, "sekunde": 1.0, "sekunden": 1.0,
    "ms": 1e-3, "msec": 1e-3, "millisecond": 1e-3, "milliseconds": 1e-3, "millisekunden": 1e-3,
    "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "usec": 1e-6, "microseconds": 1e-6, "mikrosekunden": 1e-6,
    "ns": 1e-9, "nsec": 1e-9, "nanoseconds": 1e-9, "nanosekunden": 1e-9,
}  # fmt: skip
_CAMEL = re.compile(r"(?<=[a-zäöü])(?=[A-Z])")
_WITH_UNIT = re.compile(r"(.*?\d[.,]?)\s*([a-zµμ]+)")
_CLOCK = re.compile(
    r"(?:(?P<year>\d{4})[-./](?P<month>\d\d?)[-./](?P<day>\d\d?)"
    r"|(?P<day2>\d\d?)\.(?P<month2>\d\d?)\.(?P<year2>\d{4}))?"
    r"[ T_]*(?:(?P<hour>\d\d?):)?(?P<minute>\d\d?):(?P<second>\d\d?)(?:[.,](?P<part>\d{1,9}))?"
    r" ?(?:Z|[+-]\d\d:?\d\d)?",
    re.ASCII,
)
_EPOCHS = ((1e8, 1e11, 1.0), (1e11, 1e14, 1e-3), (1e14, 1e17, 1e-6), (1e17, 1e20, 1e-9))
_LONG_STEP = 10.0  # seconds between frames, beyond which another unit is as likely
_HINT = (
    "Each row needs a frame (a file name, or an index from 0) and a time. Times increase, and are in "
    "seconds or in the unit of the column's name, such as time_ms"
)


class StatedTimes(NamedTuple):
    """Times of frames as a table states them.

    seconds: (T,) float64. why: a sentence about the columns. doubt: why the unit may be another one; empty
    where it is clear.
    """

    seconds: NDArray[np.float64]
    why: str = ""
    doubt: str = ""


class _Row(NamedTuple):
    """A row of the table, with the line on which it ends."""

    line: int
    cells: list[str]


class _Columns(NamedTuple):
    """The columns of frames and times, by index.

    frame: None where each row is the next frame. unit: seconds of a unit of time; None where none is stated.
    has_numbers: whether the name of the first states frame numbers, not an index from 0. why: one sentence.
    """

    frame: int | None
    time: int
    unit: float | None = None
    has_numbers: bool = False
    why: str = ""


def read_times_csv(path: Path, labels: Sequence[str]) -> StatedTimes:
    """The times of the frames called `labels`, as the rows of a table give them.

    A row holds a frame and a time. The frame is a file name, perhaps without its folder or suffix, an index
    from 0, or the number in the file name. Without such a column each row is the next frame. The time is a
    number in the unit that its name states, else in seconds; or a clock time, perhaps with a date, and then
    the first frame is at 0. Semicolons, tabs, bars, commas or blanks separate them. Numbers may have a
    decimal comma. The first row, or a comment above it, may name the columns. Rows for files that are not
    among the labels are passed over.

    Raises InputError, with the line, where a row cannot be understood, and where a frame has no time or two,
    or not a later one than the frame before it.
    """
    rows, separator = _rows_of(path)
    columns, rows = _columns_of(path, rows, labels)
    for row in rows:
        if len(row.cells) <= max(columns.time, columns.frame or 0):
            raise _bad_row(path, row.line, "a column is missing")
    if separator == "," and not columns.why:
        _check_decimals(path, rows, columns.time + 1)
    frames = _frames_of(path, rows, columns, labels)
    found = _numbers_of(path, rows, columns)
    times, lines = np.full(len(labels), np.nan), [0] * len(labels)
    for row, frame, number in zip(rows, frames, found.seconds, strict=True):
        if frame is None:
            continue
        if lines[frame]:
            what = f"states a second time for '{labels[frame]}', after line {lines[frame]}"
            raise _bad_row(path, row.line, what)
        times[frame], lines[frame] = number, row.line
    if np.isnan(times).any():
        missing = labels[int(np.isnan(times).argmax())]
        raise InputError(
            f"contains no time for '{missing}'",
            path,
            "Add a row for the frame, or move the frame to another folder",
        )
    for before, after in pairwise(range(len(labels))):
        if times[before] >= times[after]:
            raise _bad_row(path, lines[after], f"'{labels[after]}' is not later than '{labels[before]}'")
    if found.is_clock and len(times):
        times -= times[0]
    return StatedTimes(times, columns.why, doubt_of(times, "column") if found.is_doubtful else "")


def doubt_of(times: NDArray[np.float64], what: str) -> str:
    """Why times without a stated unit may be no seconds; empty where they likely are. what: holds them."""
    step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    if step <= _LONG_STEP:
        return ""
    return (
        f"The times have no unit, and {step:g} seconds between frames are long. If the times are "
        f"milliseconds, rename the {what} to time_ms"
    )


# --- rows and columns ---------------------------------------------------------------------------


def _rows_of(path: Path) -> tuple[list[_Row], str | None]:
    """The rows that are not blank, and their separator. A comment just above them that names a time is the
    first of them."""
    try:
        with open_plain(path) as file:
            text = decoded(file.read())
        lines = text.splitlines()
        at = next((at for at, line in enumerate(lines) if line.strip() and not is_comment(line)), len(lines))
        separator = _separator("".join(lines[at : at + 1]))
        rows = []
        if at and is_comment(lines[at - 1]):
            names = _cells(lines[at - 1].lstrip("#/% \t"), separator)
            rows += [_Row(at, names)] if _times_among(names) else []
        if separator is None:
            rows += [_Row(number, [line.strip()]) for number, line in enumerate(lines, 1) if line.strip()]
        else:
            reader = csv.reader(StringIO(text, newline=""), delimiter=separator, skipinitialspace=True)
            for cells in reader:
                row = [text_of_cell(cell.strip()) for cell in cells]
                rows += [_Row(reader.line_num, row)] if any(row) else []
        return [row for row in rows if not is_comment(row.cells[0])], separator
    except (OSError, csv.Error) as error:
        raise InputError(
            f"cannot be read ({error})", path, "Write the table of times as comma-separated text"
        ) from error


def _separator(line: str) -> str | None:
    """The character between the cells of a line; None where it is one cell."""
    if (sign := next((sign for sign in _SEPARATORS if sign in line), None)) is not None:
        return sign
    return " " if len(line.split()) > 1 and not _CLOCK.fullmatch(line.strip()) else None


def _cells(line: str, separator: str | None) -> list[str]:
    words = line.split() if separator == " " else line.split(separator) if separator else [line]
    return [word.strip() for word in words]


def _words(name: str) -> list[str]:
    """The words of a column's name in lower case: "elapsed", "time" and "ms" of `elapsedTime_ms`."""
    return [word for word in re.split(r"[\W_]+", re.sub(_CAMEL, " ", name).casefold()) if word]


def _times_among(names: Sequence[str]) -> list[int]:
    """The columns that names call times, those first that are called nothing else."""
    words = [_words(name) for name in names]
    plain = [at for at, found in enumerate(words) if found and {*found} <= {*_TIME_WORDS, *_UNITS, "in"}]
    return plain + [at for at, found in enumerate(words) if {*found} & _TIME_WORDS and at not in plain]


def _columns_of(path: Path, rows: list[_Row], labels: Sequence[str]) -> tuple[_Columns, list[_Row]]:
    """The columns of frames and times, and the rows below their names. Raises InputError."""
    if not rows:
        return _Columns(0, 1), rows
    names = rows[0].cells
    times = _times_among(names)
    if not times:
        frame = _named_frames(rows, labels)
        if frame is None and len(names) == 1:
            return _Columns(None, 0, why="Scan4D assigns the rows to the frames in order."), rows
        frame = frame or 0
        return _Columns(frame, 0 if frame else 1), rows
    unit = next((_UNITS[word] for word in reversed(_words(names[times[0]])) if word in _UNITS), None)
    rows, why = rows[1:], f"The times are in column '{shortened(names[times[0]])}'."
    if (frame := _named_frames(rows, labels)) is not None:
        return _Columns(frame, times[0], unit, why=why), rows
    for words, has_numbers in ((_FILE_WORDS, False), (_INDEX_WORDS, False), (_FRAME_WORDS, True)):
        for at, name in enumerate(names):
            if at not in times and {*_words(name)} & words:
                return _Columns(at, times[0], unit, has_numbers, why), rows
    return _Columns(None, times[0], unit, why=f"{why} Scan4D assigns the rows to the frames in order."), rows


def _named_frames(rows: Sequence[_Row], labels: Sequence[str]) -> int | None:
    """The column that holds names of the frames; None where none does."""
    known = _names_of(labels)
    width = max((len(row.cells) for row in rows), default=0)
    columns = [[row.cells[at] for row in rows if at < len(row.cells)] for at in range(width)]
    counts = [sum(_of_name(cell, known) is not None for cell in cells) for cells in columns]
    return int(np.argmax(counts)) if any(counts) else None


# --- frames -------------------------------------------------------------------------------------


def _plain_file(cell: str) -> str:
    return cell.replace("\\", "/").casefold()


def _names_of(labels: Sequence[str]) -> dict[str, int]:
    """The index of each frame by what a table may call it: its label, its file, or that without suffix."""
    found: dict[str, int] = {}
    for make in (str, _file_name, _stem):
        names = [make(_plain_file(label)) for label in labels]
        if len({*names}) == len(names):
            found |= {name: at for at, name in enumerate(names) if name not in found and not name.isdecimal()}
    return found


def _file_name(text: str) -> str:
    return PurePosixPath(text).name


def _stem(text: str) -> str:
    return PurePosixPath(text).stem


def _frames_of(
    path: Path, rows: Sequence[_Row], columns: _Columns, labels: Sequence[str]
) -> list[int | None]:
    """The frame of each row; None for a file that is not part of the scan."""
    if columns.frame is None:
        if len(rows) != len(labels):
            what = f"has {len(rows)} times for {len(labels)} frames"
            raise InputError(what, path, "Add a column 'file' with the file name of each frame")
        return [*range(len(rows))]
    cells = [row.cells[columns.frame] for row in rows]
    named = _names_of(labels)
    frames = [_of_name(cell, named) for cell in cells]
    numbers = {
        at: int(cell.removesuffix(".0"))
        for at, cell in enumerate(cells)
        if frames[at] is None and cell.removesuffix(".0").isdecimal()
    }
    chosen = _numbering({*numbers.values()}, columns.has_numbers, labels)
    for at, number in numbers.items():
        frames[at] = chosen.get(number)
        if frames[at] is None and chosen.keys() == {*range(len(labels))}:
            what = f"index {shortened(cells[at])} is outside 0..{len(labels) - 1}"
            raise _bad_row(path, rows[at].line, what)
    return frames


def _of_name(cell: str, named: Mapping[str, int]) -> int | None:
    text = _plain_file(cell)
    return next((named[name] for name in (text, _file_name(text), _stem(text)) if name in named), None)


def _numbering(numbers: set[int], has_numbers: bool, labels: Sequence[str]) -> dict[int, int]:
    """The frame that each number means: an index from 0, the number in the file name, or a count from 1.

    The first of these counts of which no number is missing.
    """
    from_zero = {at: at for at in range(len(labels))}
    in_names = {number: at for at, number in enumerate(frame_counts(labels) or [])}
    from_one = {at + 1: at for at in range(len(labels))}
    first = [in_names, from_zero] if has_numbers else [from_zero, in_names]
    fitting = (one for one in (*first, from_one) if one and one.keys() <= numbers)
    return next(fitting, from_zero)


# --- times --------------------------------------------------------------------------------------


class _Numbers(NamedTuple):
    """Seconds of each row. is_clock: whether they are clock times. is_doubtful: whether nothing states their
    unit."""

    seconds: list[float]
    is_clock: bool = False
    is_doubtful: bool = False


def _numbers_of(path: Path, rows: Sequence[_Row], columns: _Columns) -> _Numbers:
    """The times of all rows. Raises InputError where one is no time."""
    cells = [row.cells[columns.time] for row in rows]
    clocks = [_clock_seconds_of(cell) for cell in cells]
    if any(clock is not None for clock in clocks):
        for row, cell, clock in zip(rows, cells, clocks, strict=True):
            if clock is None:
                raise _bad_row(path, row.line, f"time '{shortened(cell)}' is not a clock time")
        return _Numbers([clock or 0.0 for clock in clocks], is_clock=True)
    decimal = "," if any("," in cell for cell in cells) else "."
    stated = columns.unit or 1.0
    numbers, is_stated = [], columns.unit is not None
    for row, cell in zip(rows, cells, strict=True):
        number, unit = _number_and_unit(cell, decimal)
        if not np.isfinite(number):
            raise _bad_row(path, row.line, f"time '{shortened(cell)}' is not a number")
        numbers.append(number * (unit or stated))
        is_stated = is_stated or unit is not None
    if not is_stated and numbers:
        for low, high, unit in _EPOCHS:
            if all(low <= number < high for number in numbers):
                return _Numbers([number * unit for number in numbers])
    return _Numbers(numbers, is_doubtful=not is_stated)


def _number_and_unit(cell: str, decimal: str) -> tuple[float, float | None]:
    """The number of a cell, NaN where it is none, and the seconds of a unit behind it."""
    match = _WITH_UNIT.fullmatch(cell.casefold())
    word, unit = (match[1], _UNITS[match[2]]) if match and match[2] in _UNITS else (cell, None)
    for mark in (decimal, "."):
        if is_numeral(word, mark):
            return value(word, mark), unit
    return np.nan, unit


def _clock_seconds_of(cell: str) -> float | None:
    """Seconds of a clock time, with a date since 1970, else since midnight; None where it is none."""
    match = _CLOCK.fullmatch(cell)
    if match is None or (match["hour"] is None and match["part"] is None):
        return None
    found = match.groupdict()
    year, month, day = (
        int(found[key] or found[f"{key}2"] or start)
        for key, start in (("year", 1970), ("month", 1), ("day", 1))
    )
    try:
        minute, second = int(found["minute"]), int(found["second"])
        moment = datetime(year, month, day, int(found["hour"] or 0), minute, second)
    except ValueError:
        return None
    part = float(f"0.{found['part']}") if found["part"] else 0.0
    return (moment - datetime(1970, 1, 1)).total_seconds() + part


def _check_decimals(path: Path, rows: Sequence[_Row], behind: int) -> None:
    """Raise InputError where commas separate cells, and seem to be decimal marks too: "f1.ply,0,04".

    behind: the column behind that of the times.
    """
    cells = [row.cells[behind - 1 :] for row in rows]
    if rows and all(len(pair) == 2 and all(map(str.isdecimal, pair)) for pair in cells):
        raise _bad_row(path, rows[0].line, "seems to use commas both as separators and as decimal marks")


def _bad_row(path: Path, line: int, what: str) -> InputError:
    return InputError(what, f"{path}, line {line}", _HINT)
