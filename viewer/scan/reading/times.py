"""When each frame happens: a times.csv, a stated rate, times in the file, or the names of the files."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from io import StringIO
from itertools import pairwise
from pathlib import Path, PurePath
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...csv_text import text_of_cell
from ...errors import InputError, shortened
from ...files import open_plain
from ..times import DEFAULT_FPS
from .corrections import NOTHING_CORRECTED, Corrections
from .names import are_dates, frame_counts, small_stamps, stamped_seconds
from .record import Decision

KEY = "times"
NAMES, INDEX, STORED = "names", "index", "stored"
_COLUMN = "column:"
_FPS = "fps:"


class Times(NamedTuple):
    """Seconds of all frames, (T,) float64, and where they come from. is_measured: whether a table states
    them."""

    seconds: NDArray[np.float64]
    decision: Decision
    is_measured: bool = False


def decide(
    labels: Sequence[str],
    folder: Path | None = None,
    *,
    count: int | None = None,
    table: Path | None = None,
    stored: NDArray[np.float64] | None = None,
    fps: float | None = None,
    corrections: Corrections = NOTHING_CORRECTED,
) -> Times:
    """The times of frames with these names, the first of: what the user states, the table, `fps`, the times
    stored in the file, real times in the names, and 25 frame numbers a second.

    count: of the frames, where they have no names of their own. folder: of files that the user names.
    table: a times.csv. stored: (T,) seconds. Raises InputError where the table or a correction is unusable.
    """
    stated = corrections.get(KEY)
    if stated is not None and not (stated.startswith(_COLUMN) and stored is not None):
        return _as_stated(labels, folder, stated, count)
    if stated is not None:
        return Times(_array(stored), Decision(KEY, stated, "user", "--read"))
    if table is not None:
        seconds = read_times_csv(table, labels)
        return Times(seconds, Decision(KEY, table.name, "neighbour", table.name), is_measured=True)
    if fps is not None:
        return Times(counted_times(labels, fps, count), Decision(KEY, f"{_FPS}{fps:g}", "user", "--fps"))
    if stored is not None:
        return Times(_array(stored), Decision(KEY, STORED, "file"))
    stamps = stamped_seconds(labels)
    if stamps is not None:
        return Times(_array(stamps), Decision(KEY, NAMES, "folder", why="The names of the files are times"))
    return _assumed(labels, count)


def _assumed(labels: Sequence[str], count: int | None) -> Times:
    """25 frame numbers a second, or frames."""
    seconds = counted_times(labels, count=count)
    if len(seconds) < 2:
        return Times(seconds, Decision(KEY, None, "file"))
    counted = "frame numbers" if frame_counts(labels) else "frames"
    why = f"Nothing states the times. Scan4D assumes {DEFAULT_FPS:g} {counted} per second"
    if are_dates(labels):
        why = f"The names are dates. Scan4D assumes {DEFAULT_FPS:g} frames per second"
    others = (NAMES,) if times_in_names(labels) is not None else ()
    others = (*others, INDEX) if counted == "frame numbers" else others
    alternatives = (*others, f"{_FPS}30", f"{_FPS}50")
    return Times(
        seconds,
        Decision(
            KEY, f"{_FPS}{DEFAULT_FPS:g}", "assumed", why=why, alternatives=alternatives, changes_numbers=True
        ),
    )


def _as_stated(labels: Sequence[str], folder: Path | None, stated: str, count: int | None) -> Times:
    decision = Decision(KEY, stated, "user", "--read")
    if stated == NAMES:
        seconds = times_in_names(labels)
        if seconds is None:
            hint = "Give fps:25, index, or a file of times"
            raise InputError("the names of the files give no times that increase", hint=hint)
        return Times(seconds, decision)
    if stated == INDEX:
        return Times(np.arange(len(labels) if count is None else count) / DEFAULT_FPS, decision)
    if stated.startswith(_FPS):
        return Times(counted_times(labels, float(stated.removeprefix(_FPS)), count), decision)
    if stated.startswith(_COLUMN):
        raise InputError(f"there is no column for '{shortened(stated)}'", hint="Use it for a table of frames")
    path = Path(stated) if folder is None or Path(stated).is_absolute() else folder / stated
    return Times(read_times_csv(path, labels), decision, is_measured=True)


def counted_times(
    labels: Sequence[str], fps: float = DEFAULT_FPS, count: int | None = None
) -> NDArray[np.float64]:
    """(T,) seconds from the first frame on, at `fps` frame numbers a second.

    A number missing from the labels leaves a gap; labels without frame numbers count 0, 1, 2... count: of the
    frames, where they have no names of their own.
    """
    if count is not None and len(labels) != count:
        return np.arange(count) / fps
    numbers = frame_counts(labels) or range(len(labels))
    return np.array([number - numbers[0] for number in numbers], np.float64) / fps


def times_in_names(labels: Sequence[str]) -> NDArray[np.float64] | None:
    """(T,) seconds from the first frame on where names are real times, or differ in one number of milli-,
    micro- or nanoseconds, whichever makes steps of a film. None where there is no such number."""
    found = stamped_seconds(labels)
    found = small_stamps(labels) if found is None else found
    return None if found is None else _array(found)


def _array(seconds: object) -> NDArray[np.float64]:
    return np.asarray(seconds, np.float64)


# --- times.csv ------------------------------------------------------------------------------

_SEPARATORS = ";\t,|"
_FILE_WORDS = (
    "file",
    "filename",
    "file name",
    "datei",
    "dateiname",
    "fichier",
    "archivo",
    "bestand",
    "image",
)
_INDEX_WORDS = ("index",)
_TIME_WORDS = (
    "time", "times", "timestamp", "timestamps", "seconds", "t", "zeit", "zeitstempel", "sekunden", "temps",
    "tiempo", "tempo", "tijd",
)  # fmt: skip
_UNITS = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
_UNIT = re.compile(r"(?P<name>.*?)\s*(?:[\[(](?P<a>[a-zµ]+)[\])]|[_ /](?P<b>s|sec|ms|us|µs|ns))")


class _Head(NamedTuple):
    """The columns of the frames and the times, and the seconds of a unit of time."""

    frame: int
    time: int
    scale: float


def read_times_csv(path: Path, labels: Sequence[str]) -> NDArray[np.float64]:
    """(T,) seconds of the frames called `labels`, as the rows of the file give them.

    A row holds a frame (its file name, or its index counted from 0) and a time in seconds. Commas, semicolons
    or tabs separate them, and numbers may have a decimal comma. A first row of names, such as `file` or
    `index` and `time` or `time_ms`, is optional and may put the columns in another order. Rows for files that
    are not among the labels are passed over. Raises InputError, with the line, where a row cannot be
    understood, and where a frame has no time or two, or not a later one than the frame before it.
    """
    rows = list(_csv_rows(path))
    head = _head(path, *rows[0]) if rows else None
    frame_column, time_column, scale = head or _Head(0, 1, 1.0)
    times = np.full(len(labels), np.nan)
    lines = [0] * len(labels)
    indices = {label: index for index, label in enumerate(labels)}
    for line, cells in rows[1:] if head else rows:
        if len(cells) <= max(frame_column, time_column):
            raise _bad_row(path, line, "a column is missing")
        time = _number(path, line, cells[time_column]) * scale
        index = _frame_index(path, line, cells[frame_column], indices)
        if index is None:
            continue
        if lines[index]:
            what = f"has a second time for '{labels[index]}', which line {lines[index]} already has"
            raise _bad_row(path, line, what)
        times[index], lines[index] = time, line
    if np.isnan(times).any():
        missing = labels[int(np.isnan(times).argmax())]
        raise InputError(f"no time for '{missing}'", path, "Add a row for it, or move the frame elsewhere")
    for before, after in pairwise(range(len(labels))):
        if times[before] >= times[after]:
            raise _bad_row(path, lines[after], f"'{labels[after]}' is not later than '{labels[before]}'")
    return times


def _csv_rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """The rows that are not blank, each with the line it ends on."""
    try:
        with open_plain(path) as file:
            data = file.read()
        is_utf_16 = data[:2] in (b"\xff\xfe", b"\xfe\xff")
        text = data.decode("utf-16" if is_utf_16 else "utf-8-sig")
        first = next((line for line in text.splitlines() if line.strip()), "")
        separator = max(_SEPARATORS, key=lambda sign: (sign in first and sign != ",", sign in first))
        reader = csv.reader(StringIO(text, newline=""), delimiter=separator)
        for row in reader:
            cells = [text_of_cell(cell.strip()) for cell in row]
            if any(cells):
                yield reader.line_num, cells
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"cannot be read ({error})", path, "It should be comma-separated text") from error


def _head(path: Path, line: int, names: list[str]) -> _Head | None:
    """The columns that the first row names; None where it names none. Raises InputError where it names a time
    and no frame."""
    plain = [_named_unit(name.casefold().strip("\"' ")) for name in names]
    time = next((place for place, (name, _) in enumerate(plain) if name in _TIME_WORDS), None)
    if time is None:
        return None
    known = (*_FILE_WORDS, *_INDEX_WORDS)
    frame = next((place for place, (name, _) in enumerate(plain) if name in known), None)
    if frame is None:
        raise _bad_row(path, line, "no column called 'file' or 'index'")
    return _Head(frame, time, plain[time][1])


def _named_unit(name: str) -> tuple[str, float]:
    """A name of a column without the unit behind it, and the seconds of that unit."""
    match = _UNIT.fullmatch(name)
    unit = match and (match["a"] or match["b"])
    return (match["name"].strip(), _UNITS[unit]) if match and unit in _UNITS else (name, 1.0)


def _number(path: Path, line: int, text: str) -> float:
    try:
        number = float(text.replace(",", ".") if text.count(",") == 1 and "." not in text else text)
    except ValueError:
        number = np.nan
    if not np.isfinite(number):
        raise _bad_row(path, line, f"time '{shortened(text)}' is not a number")
    return number


def _frame_index(path: Path, line: int, frame: str, indices: dict[str, int]) -> int | None:
    """The frame that a row means; None for a file that is not part of the scan."""
    index = indices.get(frame, indices.get(PurePath(frame).name))
    if index is None and frame.isdecimal():
        if len(frame) > 9 or int(frame) >= len(indices):
            raise _bad_row(path, line, f"index {shortened(frame)} is outside 0..{len(indices) - 1}")
        index = int(frame)
    return index


def _bad_row(path: Path, line: int, what: str) -> InputError:
    hint = "A row is a file name or an index, a comma or semicolon, and seconds that increase"
    return InputError(what, f"{path}, line {line}", hint)
