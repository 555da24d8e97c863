"""Tables of landmarks: what the long one and the wide one share, and the reading of either."""

from __future__ import annotations

import csv
import math
import re
from array import array
from collections.abc import Iterator, Sequence
from io import StringIO
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....csv_text import text_of_cell
from ....errors import InputError, shortened
from ....scan.reading.columns import canonical_names, plain_name
from ....scan.reading.missing import SENTINELS
from ....scan.reading.numbers import dialect_of, point_form
from ....scan.units import conversion, plain_unit, usable_unit
from ...track import STATES, Known
from ..landmark_set import LandmarkNotes, LandmarkSet, check_cells
from ._text import at_line, count_of, is_number, number_of, read_all

LONG_COLUMNS = ("kind", "frame", "time", "name", "x", "y", "z", "state", "value", "sigma", "unit")
_KNOWN = {word: known for known, word in STATES.items()}
_NAMES = (
    "name", "label", "landmark", "landmark name", "landmark_name", "point", "point name", "point_name",
    "marker", "punkt", "bezeichnung", "landmarke", "nom", "nombre", "id",
)  # fmt: skip
_SPACES = (
    ("xyz", None),
    ("lps", "LPS"),
    ("ras", "RAS"),
)  # columns of coordinates, and the axes that they state
_SLICER = {"selected", "visible", "locked"}  # columns of 3D Slicer, whose lengths are millimetres
_AXES = (  # names of the columns of a landmark: nose_x, x_nose and noseX
    re.compile(r"(?P<name>.+)[ _.:](?P<axis>[xyz])", re.IGNORECASE | re.DOTALL),
    re.compile(r"(?P<axis>[xyz])[ _.:](?P<name>.+)", re.IGNORECASE | re.DOTALL),
    re.compile(r"(?P<name>.*[a-z0-9])(?P<axis>[XYZ])", re.DOTALL),
)
_UNIT = re.compile(r"\s*[\[(]\s*([^\W\d]+)\s*[\])]$")  # behind a name
_SEPARATORS = ";\t|,"
_FRAMES = ("frame", "frames", "bild", "bildnummer", "image", "trame")
_TIMES = ("time", "seconds", "t", "zeit")
_UNDEFINED = {"0", "false"}
_HINT = "Write a value for each column of the first line into each row"


def has_columns(head: str) -> bool:
    """Whether the first line of a text names the columns of landmarks."""
    head = _without_remarks(head)[1]
    names = _plain(_cells(head.split("\n", 1)[0]))
    named = set(names) & {*_NAMES, "kind"}
    return bool(_space_of(names) and named) or len(_wide_columns(names)) > 0


def _without_remarks(text: str) -> tuple[int, str]:
    """How many lines stand above the first row (blank lines, comments and `sep=;`), and the text below."""
    lines = text.splitlines(keepends=True)
    above = 0
    for line in lines:
        if line.strip() and not line.startswith(("#", "//")) and not line.lower().startswith("sep="):
            break
        above += 1
    return above, "".join(lines[above:])


def _cells(line: str) -> list[str]:
    try:
        return next(csv.reader([line], **_form(_separator(line))), [])
    except csv.Error:
        return []


def _separator(line: str) -> str:
    best = max(_SEPARATORS, key=line.count)
    return best if best in line else " "


def _form(separator: str) -> dict[str, Any]:
    """How csv.reader splits lines: several blanks count as one."""
    return {"delimiter": separator, "skipinitialspace": separator == " "}


def _plain(names: Sequence[str]) -> list[str]:
    """Names of columns in lower case, without units; x, y and z for what programs call so beside names."""
    plain = [plain_name(name).name for name in names]
    if _first(plain, _NAMES) is not None:
        found = canonical_names(names)
        plain = [one if one in ("x", "y", "z") else name for one, name in zip(found, plain, strict=True)]
    return plain


def _space_of(names: Sequence[str]) -> tuple[str, str | None] | None:
    """The columns of coordinates, "xyz", "lps" or "ras", and the axes that they state; None without any."""
    return next((space for space in _SPACES if {*space[0]} <= {*names}), None)


def read_table(path: Path) -> LandmarkSet:
    """The landmarks of either table, also of one with decimal commas. Raises InputError."""
    above, text = _without_remarks(read_all(path))
    rows = _rows(text, _separator(text.split("\n", 1)[0]), above)
    first = next(rows, None)
    line, head = first or (above + 1, [])
    if dialect_of(text.splitlines(keepends=True)).decimal == ",":
        rows = ((line, [point_form(cell.strip(), ",") or cell for cell in row]) for line, row in rows)
    if first is not None and _is_unnamed(head):
        rows, head = chain([(line, _with_points(head))], rows), ["name", "x", "y", "z"]
    second = next(rows, None)
    if second is not None:
        rows = chain([second], rows)
        head = [""] * (len(second[1]) == len(head) + 1) + head  # R writes no name for the first column
    names, columns = _plain(head), _wide_columns(head)
    # The x of a landmark whose name is only marks, such as '_x, has the plain name x.
    only_marks = any(not plain_name(name).name for name in columns)
    if not only_marks and (space := _space_of(names)):
        if _first(names, _NAMES) is None and second is not None:
            row = enumerate(second[1][: len(head)])
            texts = (at for at, cell in row if not _is_value(cell) and names[at] not in space[0])
            if (at := next(texts, None)) is not None:
                names[at] = "name"
        stated = {unit for name, own in zip(names, head, strict=True)
                  if name in space[0] and (unit := plain_name(own).unit)}  # fmt: skip
        return _long(rows, names, *space, unit=stated.pop() if len(stated) == 1 else None)
    if columns:
        return _wide(rows, names, columns, _unit_of(head))
    raise at_line(
        "the table has neither the columns x, y and z, nor three columns NAME_x, NAME_y and NAME_z for "
        "each landmark",
        line,
        "The first line must name the columns, such as x, y and z, or l, p and s, or r, a and s",
    )


def _is_value(cell: str) -> bool:
    return is_number(cell.strip()) or not cell.strip()


def _with_points(row: Sequence[str]) -> list[str]:
    """A row whose numbers have decimal points where they have commas."""
    return [point_form(cell.strip(), ",") if "," in cell else cell for cell in row]


def _is_unnamed(row: Sequence[str]) -> bool:
    """Whether the first row is a landmark already: a name and three numbers."""
    return (
        len(row) == 4
        and not _is_value(row[0])
        and all(is_number(cell) and cell for cell in map(str.strip, _with_points(row[1:])))
    )


def _unit_of(head: Sequence[str]) -> str | None:
    """The unit that the names of a table with columns for each landmark state, as `nose_x [mm]` does."""
    units = {plain_unit(match[1]) for name in head if (match := _UNIT.search(name))} - {"s", "ms"}
    return units.pop() if len(units) == 1 else None


def _rows(text: str, separator: str, above: int) -> Iterator[tuple[int, list[str]]]:
    """The rows that are not blank, each after the number of its last line. above: lines above the text."""
    reader = csv.reader(StringIO(text, newline=""), strict=True, **_form(separator))
    try:
        for row in reader:
            if any(cell.strip() for cell in row):
                yield above + reader.line_num, row
    except csv.Error as error:
        raise at_line(
            f"Scan4D cannot read this row of the table: {error}", above + reader.line_num
        ) from error


def _first(names: Sequence[str], wanted: Sequence[str]) -> int | None:
    return next((names.index(name) for name in wanted if name in names), None)


class _Units:
    """The one unit of a table, to which the lengths of all rows are brought."""

    def __init__(self, unit: str | None = None) -> None:
        self.unit = unit

    def factor(self, word: str, line: int) -> float:
        """Factor of the lengths of a row. Raises InputError for units that do not go together."""
        word = word.strip()
        if not word or word == self.unit:
            return 1.0
        if self.unit is None:
            if usable_unit(word) is None:
                raise at_line(f"'{shortened(word)}' is not a unit of length", line)
            self.unit = word
        factor = conversion(word, self.unit)
        if factor is None:
            raise at_line(
                f"lengths in this row are in '{shortened(word)}', but lengths in the rows above are in "
                f"'{self.unit}'",
                line,
            )
        return factor


def _frame(word: str, line: int) -> int:
    """The index of a frame that counts from 1; -1 for frame 0."""
    word = word.strip()
    return count_of(word[:-2] if word.endswith(".0") else word, line, "the frame") - 1


def _from_zero(frames: NDArray[np.int64]) -> tuple[NDArray[np.int64], list[str]]:
    """Indices of frames, and a remark where the file counts them from 0."""
    if not len(frames) or frames.min() >= 0:
        return frames, []
    return frames + 1, ["The file counts frames from 0"]


def _long(
    rows: Iterator[tuple[int, list[str]]],
    columns: Sequence[str],
    coordinates: str,
    space: str | None,
    unit: str | None,
) -> LandmarkSet:
    """The landmarks of a table with a row each. coordinates: names of their columns. space: their axes. unit:
    that the names state."""
    name_at, kind_at = _first(columns, _NAMES), _first(columns, ("kind",))
    frame_at, time_at = _first(columns, _FRAMES), _first(columns, _TIMES)
    state_at, sigma_at, unit_at = (_first(columns, (name,)) for name in ("state", "sigma", "unit"))
    defined_at, about_at = _first(columns, ("defined",)), _first(columns, ("description",))
    axes = [columns.index(axis) for axis in coordinates]
    units = _Units("mm" if space and {*columns} >= _SLICER else unit)
    abouts: dict[str, str] = {}
    times: dict[int, float] = {}
    numbers: dict[str, int] = {}
    cells, numerals = array("q"), array("d")  # frame, number, line and state; x, y, z and sigma of each row
    for line, row in rows:
        if len(row) != len(columns):
            raise at_line(f"has {len(row)} values for {len(columns)} columns", line, _HINT)
        if kind_at is not None and row[kind_at].strip().lower() != "landmark":
            continue
        frame = 0 if frame_at is None else _frame(row[frame_at], line)
        if frame < 0 and kind_at is not None:
            raise at_line("names frame 0, but tables of Scan4D count frames from 1", line)
        name = str(len(numbers) + 1) if name_at is None else text_of_cell(row[name_at].strip())
        factor = 1.0 if unit_at is None else units.factor(row[unit_at], line)
        place = [number_of(row[axis], line) * factor for axis in axes]
        if place[0] in SENTINELS and place.count(place[0]) == 3:
            place = [math.nan] * 3
        if defined_at is not None and row[defined_at].strip().lower() in _UNDEFINED:
            place = [math.nan] * 3
        if about_at is not None:
            abouts.setdefault(name, text_of_cell(row[about_at].strip()))
        state = _state(None if state_at is None else row[state_at], place, line)
        sigma = math.nan if sigma_at is None else number_of(row[sigma_at], line) * factor
        cells.extend((frame, numbers.setdefault(name, len(numbers)), line, state))
        numerals.extend((*place, sigma))
        if time_at is not None:
            times.setdefault(frame, number_of(row[time_at], line))
    if not cells:
        raise InputError("holds no landmarks")
    frames_of, number_of_row, lines, states = np.array(cells).reshape(-1, 4).T
    frames_of, remarks = _from_zero(frames_of)
    times = {frame + bool(remarks): time for frame, time in times.items()}
    frames, rows_of = np.unique(frames_of, return_inverse=True)
    check_cells(len(frames), len(numbers))
    at = rows_of * len(numbers) + number_of_row
    _, first = np.unique(at, return_index=True)
    if len(first) < len(at):
        again = np.setdiff1d(np.arange(len(at)), first)[0]
        name = list(numbers)[number_of_row[again]]
        what = f"the landmark '{shortened(name)}' appears twice in one frame"
        raise at_line(what, int(lines[again]), "Give each landmark its own name")
    values, known = np.full((len(frames) * len(numbers), 4), np.nan), np.zeros(len(frames) * len(numbers))
    values[at], known[at] = np.array(numerals).reshape(-1, 4), states
    shape = len(frames), len(numbers)
    return LandmarkSet.of(
        list(numbers),
        values[:, :3].reshape(*shape, 3),
        known=known.astype(np.uint8).reshape(shape),
        sigmas=values[:, 3].reshape(shape),
        times=np.array([times.get(frame, math.nan) for frame in frames.tolist()]),
        frames=None if frame_at is None else frames,
        notes=LandmarkNotes(
            units.unit, [abouts.get(name, "") for name in numbers] if abouts else (), space, remarks
        ),
    )


def _state(word: str | None, place: Sequence[float], line: int) -> int:
    """State that a row tells; a place without a word was set."""
    if word is None:
        return Known.PLACED if all(map(math.isfinite, place)) else Known.PENDING
    if (word := word.strip().lower()) not in _KNOWN:
        known = ", ".join(filter(None, _KNOWN))
        raise at_line(f"unknown state '{shortened(word)}'", line, f"Known: {known}")
    return _KNOWN[word]


def _wide_columns(names: Sequence[str]) -> dict[str, list[int]]:
    """Landmark -> its columns of x, y and z, for those that have all three."""
    for form in _AXES:
        found: dict[str, dict[str, int]] = {}
        for number, name in enumerate(names):
            if match := form.fullmatch(_UNIT.sub("", name.strip())):
                found.setdefault(text_of_cell(match["name"]), {}).setdefault(match["axis"].lower(), number)
        if complete := {name: axes for name, axes in found.items() if len(axes) == 3}:
            return {name: [axes[axis] for axis in "xyz"] for name, axes in complete.items()}
    return {}


def _wide(
    rows: Iterator[tuple[int, list[str]]],
    columns: Sequence[str],
    landmarks: dict[str, list[int]],
    unit: str | None,
) -> LandmarkSet:
    frame_at, time_at, unit_at = (_first(columns, words) for words in (_FRAMES, _TIMES, ("unit",)))
    units = _Units(unit)
    frames: list[int] = []
    times: list[float] = []
    positions: list[list[list[float]]] = []
    for line, row in rows:
        if len(row) != len(columns):
            raise at_line(f"has {len(row)} values for {len(columns)} columns", line, _HINT)
        frames.append(len(frames) if frame_at is None else _frame(row[frame_at], line))
        if len(frames) > 1 and frames[-1] <= frames[-2]:
            raise at_line(
                f"the frame of this row is {frames[-1] + 1}, but the frame of the row above is "
                f"{frames[-2] + 1}",
                line,
                "Sort the rows by frame",
            )
        check_cells(len(frames), len(landmarks))
        times.append(math.nan if time_at is None else number_of(row[time_at], line))
        factor = 1.0 if unit_at is None else units.factor(row[unit_at], line)
        positions.append(
            [[number_of(row[axis], line) * factor for axis in axes] for axes in landmarks.values()]
        )
    if not positions:
        raise InputError("holds no landmarks")
    indices, remarks = _from_zero(np.array(frames))
    places = np.array(positions)
    known = np.where(np.isfinite(places).all(axis=2), Known.PLACED, Known.GAP)
    return LandmarkSet.of(
        list(landmarks),
        places,
        known=known,
        times=np.array(times),
        frames=None if frame_at is None else indices,
        notes=LandmarkNotes(units.unit, remarks=remarks),
    )
