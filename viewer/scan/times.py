"""When each frame of a scan happens: from a times.csv, a frame rate, or the numbers in the names."""

from __future__ import annotations

import csv
import itertools
import re
from collections.abc import Iterator, Sequence
from decimal import Decimal
from io import TextIOWrapper
from pathlib import Path, PurePath

import numpy as np
from numpy.typing import NDArray

from ..csv_text import text_of_cell
from ..errors import InputError, shortened
from ..files import open_plain

TIMES_FILE = "times.csv"
DEFAULT_FPS = 25.0
FPS_LIMITS = 1e-6, 1e6  # of frame rates
_STEPS = 1 / 300, 10.0  # seconds between frames, at least and at most, where names tell times
_LARGEST_STEP = 1000  # numbers further apart are dates or clock readings, not frame numbers


def frame_in_words(index: int) -> str:
    """A frame as every text tells it, counted from 1; poses, of the command line and Python, count from 0."""
    return f"frame {index + 1}"


def natural_key(name: str) -> tuple[list[str | int], str]:
    """Sorts names as a person would: 2 before 10, capitals beside small letters."""
    return _split(name.casefold()), name


def frame_numbers(labels: Sequence[str]) -> list[int] | None:
    """The number in each label, where the labels differ in that one number only.

    None where they differ in more, where the numbers do not increase, or where a step
    between two is too large for frame numbers.
    """
    rows = [_split(label) for label in labels]
    if len({len(row) for row in rows}) != 1:
        return None
    columns = [column for column in zip(*rows, strict=True) if len(set(column)) > 1]
    if len(columns) != 1 or not isinstance(columns[0][0], int):
        return None
    numbers = [int(number) for number in columns[0]]
    steps = [after - before for before, after in itertools.pairwise(numbers)]
    return numbers if all(0 < step <= _LARGEST_STEP for step in steps) else None


def paced_times(labels: Sequence[str], fps: float = DEFAULT_FPS) -> NDArray[np.float64]:
    """(T,) seconds from the first frame on, at `fps` frame numbers a second.

    A number missing from the labels leaves a gap; labels without frame numbers count 0, 1, 2...
    """
    numbers = frame_numbers(labels) or range(len(labels))
    return np.array([number - numbers[0] for number in numbers], np.float64) / fps


def times_in_names(labels: Sequence[str]) -> NDArray[np.float64] | None:
    """(T,) seconds from the first frame on, as the names tell: these differ in one number, which is seconds
    with decimals, or whole milliseconds, microseconds or nanoseconds, whichever makes steps of a film.

    None where there is no such number, or it does not increase.
    """
    rows = [re.split(r"([0-9]+(?:\.[0-9]+)?)", label) for label in labels]
    if len(rows) < 2 or len({len(row) for row in rows}) != 1:
        return None
    columns = [column for column in zip(*rows, strict=True) if len(set(column)) > 1]
    if len(columns) != 1 or not columns[0][0][:1].isdecimal():
        return None
    stamps = [Decimal(text) for text in columns[0]]
    since = np.array([float(time - stamps[0]) for time in stamps])
    steps = np.diff(since)
    units = (1.0,) if any("." in text for text in columns[0]) else (1e-3, 1e-6, 1e-9)
    shortest, longest = _STEPS
    if not (steps > 0).all():
        return None
    fits = (unit for unit in units if shortest <= float(np.median(steps)) * unit <= longest)
    return next((since * unit for unit in fits), None)


def typical_rate(times: NDArray[np.float64]) -> float:
    """Frames a second, by the median step of (T,) times in seconds; the default for one frame."""
    steps = np.diff(times)
    return 1 / float(np.median(steps)) if len(steps) else DEFAULT_FPS


def read_times_csv(path: Path, labels: Sequence[str]) -> NDArray[np.float64]:
    """(T,) seconds of the frames called `labels`, as the rows of the file give them.

    A row holds a frame (its file name, or its index counted from 0) and a time in seconds.
    A first row of names, `file` or `index` and `time`, is optional and may put the columns in
    another order. Rows for files that are not among the labels are passed over.
    Raises InputError, with the line, where a row cannot be understood, and where a frame has
    no time or two, or not a later one than the frame before it.
    """
    rows = _csv_rows(path)
    frame_column, time_column = 0, 1
    first = list(itertools.islice(rows, 1))
    if first and "time" in (names := [cell.lower() for cell in first[0][1]]):
        frame_column, time_column = _columns(path, first.pop()[0], names)
    times = np.full(len(labels), np.nan)
    lines = [0] * len(labels)
    indices = {label: index for index, label in enumerate(labels)}
    for line, cells in itertools.chain(first, rows):
        if len(cells) <= max(frame_column, time_column):
            raise _bad_row(path, line, "a column is missing")
        time = _number(path, line, cells[time_column])
        index = _frame_index(path, line, cells[frame_column], indices)
        if index is None:
            continue
        if lines[index]:
            raise _bad_row(
                path,
                line,
                (f"has a second time for '{labels[index]}', which line {lines[index]} already has"),
            )
        times[index], lines[index] = time, line
    if np.isnan(times).any():
        missing = labels[int(np.isnan(times).argmax())]
        raise InputError(f"no time for '{missing}'", path, "Add a row for it, or move the frame elsewhere")
    for before, after in itertools.pairwise(range(len(labels))):
        if times[before] >= times[after]:
            raise _bad_row(path, lines[after], f"'{labels[after]}' is not later than '{labels[before]}'")
    return times


def _split(name: str) -> list[str | int]:
    """Text and numbers in turn, text first: "a10.ply" is ["a", 10, ".ply"]."""
    return [int(part) if position % 2 else part for position, part in enumerate(re.split("([0-9]+)", name))]


def _csv_rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """The rows that are not blank, each with the line it ends on."""
    try:
        with open_plain(path) as file:
            reader = csv.reader(TextIOWrapper(file, "utf-8-sig", newline=""))
            for row in reader:
                cells = [text_of_cell(cell.strip()) for cell in row]
                if any(cells):
                    yield reader.line_num, cells
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"cannot be read ({error})", path, "It should be comma-separated text") from error


def _columns(path: Path, line: int, names: list[str]) -> tuple[int, int]:
    """Places of the frames and the times, from the row of names."""
    frame = next((names.index(name) for name in ("file", "index") if name in names), None)
    if frame is None:
        raise _bad_row(path, line, "no column called 'file' or 'index'")
    return frame, names.index("time")


def _number(path: Path, line: int, text: str) -> float:
    try:
        number = float(text)
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
    hint = "A row is a file name or an index, a comma, and seconds that increase"
    return InputError(what, f"{path}, line {line}", hint)
