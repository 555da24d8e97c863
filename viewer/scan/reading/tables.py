"""The head of a text table of points: what stands above the rows, how they are written, and their columns."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise
from pathlib import Path
from typing import NamedTuple

from ...errors import EmptyFrame, InputError, shortened
from ...files import open_plain
from ..admission import MOST_COLUMNS, check_count, whole_number
from ..units import is_length, plain_unit
from . import numbers
from .camera_tables import cameras_in_comment, cameras_in_names, cameras_in_words
from .columns import decide, has_positions
from .corrections import NOTHING_CORRECTED, Corrections
from .numbers import ABSENT, PLAIN, Dialect, dialect_of, is_comment, is_numeral, split_line

MOST_ABOVE = 1 << 16  # lines above the rows
_LOOKED_AT = 100  # lines
_SHOWN = 40  # lines of a preview
_SPARSE = ["POINT3D_ID", "X", "Y", "Z", "R", "G", "B", "ERROR"]  # of COLMAP, before the track
UNREAD = ("-", "label")  # roles of columns that are not read
NAMES_HELP = (
    "If the numbers are points, write a line with the names of the columns above them, such as x y z, or "
    "add --read columns='x y z'"
)
_FIRST_WORDS = {  # of files of another format -> what they are, and their suffix
    "ply": ("a PLY file", ".ply"), "off": ("an OFF mesh", ".off"), "solid": ("an STL mesh", ".stl"),
    "dsaa": ("a grid of heights (Surfer)", ".grd"), "# .pcd": ("a PCD file", ".pcd"),
}  # fmt: skip


@dataclass(frozen=True)
class TableHead:
    """The head of a text table.

    skip:     lines above the first row
    dialect:  how the rows are written
    columns:  indices of those columns of the rows that hold numbers
    names:    of these columns, as the file spells them; None where it names none
    promised: how many rows a line above them promises; None: none does
    remarks:  lines above the rows
    rows:     words of the first rows
    instead:  what the table holds where it is no table of points, such as cameras; None where it may be one
    hint:     what to do in that case
    doubts:   messages about rows that do not fit the names, or each other
    unused:   names of columns of text
    """

    skip: int
    dialect: Dialect
    columns: tuple[int, ...]
    names: tuple[str, ...] | None
    promised: int | None = None
    remarks: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    instead: str | None = None
    hint: str = NAMES_HELP
    doubts: tuple[str, ...] = ()
    unused: tuple[str, ...] = ()


def head_of(lines: Iterable[str], corrections: Corrections = NOTHING_CORRECTED) -> TableHead:
    """The head of a table, from its first lines. Raises InputError where there are no rows of numbers."""
    above = _lines_above(lines, corrections)
    dialect = dialect_of(
        above.numeric_lines,
        corrections.get("separator"),
        corrections.get("decimal"),
    )
    return _Search(above, dialect, corrections).head()


class _Above(NamedTuple):
    """The first lines of a text, with their numbers from 1: those with digits, and those with other text."""

    numeric: list[tuple[int, str]]
    other: deque[tuple[int, str]]

    @property
    def numeric_lines(self) -> list[str]:
        """The lines with digits."""
        return [line for _, line in self.numeric]


def _lines_above(lines: Iterable[str], corrections: Corrections) -> _Above:
    above, size = _Above([], deque(maxlen=_LOOKED_AT)), 0
    skip = corrections.get("skip", 0)
    for number, line in enumerate(islice(lines, MOST_ABOVE + skip), 1):
        if number <= skip or not line.strip(" \t\r\n,;"):
            continue
        if is_comment(line) or not any(map(str.isdigit, line)):
            above.other.append((number, line))
            continue
        above.numeric.append((number, line))
        size += len(line)
        if len(above.numeric) == _LOOKED_AT or size > numbers.HEAD:
            break
    return above


class _Search:
    """The first row of numbers, and what stands above it."""

    def __init__(self, above: _Above, dialect: Dialect, corrections: Corrections) -> None:
        self.dialect = dialect
        self.corrections = corrections
        self.lines = sorted([*above.numeric, *above.other])
        self.names: list[str] | None = None
        self.remark: list[str] = []
        self.unnamed: tuple[int, str, list[str]] | None = None  # the last line that is neither
        self.promised: int | None = None
        self.above: list[str] = []
        self.instead: str | None = None
        self.body = self._body([split_line(line, dialect) for _, line in above.numeric])

    def _body(self, rows: Sequence[Sequence[str]]) -> tuple[int, set[int]]:
        """How many words most lines have, and which of them are numbers in most of these."""
        counts: dict[int, list[set[int]]] = {}
        for words in rows:
            if found := {at for at, word in enumerate(words) if self._is_number(word)}:
                counts.setdefault(len(words), []).append(found)
        if not counts:
            return 0, set()
        width, found_in = max(counts.items(), key=lambda item: (len(item[1]), item[0]))
        return width, {
            at for at in range(width) if 2 * sum(at in found for found in found_in) > len(found_in)
        }

    def _is_number(self, word: str) -> bool:
        return is_numeral(word, self.dialect.decimal)

    def head(self) -> TableHead:
        """The head. Raises InputError where there is no row."""
        for at, (number, line) in enumerate(self.lines):
            words = split_line(line, self.dialect)
            if is_comment(line):
                self._take_comment(line)
            elif self._is_row(words):
                return self._found(at, number, line, words)
            elif len(words) == 1 and words[0].isdecimal() and self.promised is None:
                self.promised = whole_number(words[0], "the count of its points")
            else:
                self._take_text(number, line)
            self.above.append(line.strip())
        if self.unnamed is not None and not self.names:
            raise InputError(_not_names(*self.unnamed), hint=NAMES_HELP)
        what = f"contains no rows of numbers in its first {MOST_ABOVE:,} lines"
        if self.promised:
            raise InputError(f"{what}, but a line states {self.promised:,} points")
        raise EmptyFrame(what)

    def _take_comment(self, line: str) -> None:
        text = line.lstrip("#/%!;* \t")
        self.instead = self.instead or cameras_in_comment(text)
        if "POINT3D_ID" in text:
            self.remark = _SPARSE
        elif has_positions(words := split_names(text)):
            self.remark = words

    def _take_text(self, number: int, line: str) -> None:
        words = split_names(line)
        check_count(len(words), MOST_COLUMNS, "columns")
        units = [plain_unit(word.strip("[](){}<> ")) for word in words]
        if has_positions(words):
            self.names = words
        elif len(units) == len(self.names or ()) and all(not one or is_length(one) for one in units):
            named = zip(self.names or (), units, strict=True)
            self.names = [f"{name} [{one}]" if one else name for name, one in named]
        else:
            self.unnamed = number, line, words

    def _is_row(self, words: Sequence[str]) -> bool:
        """Whether a line is the first row: it begins with a number, or it is like most lines."""
        found = {at for at, word in enumerate(words) if self._is_number(word)}
        width, columns = self.body
        is_alike = len(words) == width and all(at in found or words[at].lower() in ABSENT for at in columns)
        if not found or (len(words) == 1 and self.promised is None and words[0].isdecimal()):
            return False
        if is_alike:
            return len(columns) >= 3 or self.names is not None or 0 in found
        return 0 in found and (len(found) >= 3 or not columns)

    def _found(self, at: int, number: int, line: str, words: list[str]) -> TableHead:
        check_count(len(words), MOST_COLUMNS, "columns")
        rows = [
            split_line(numbers.without_comment(text), self.dialect)
            for _, text in self.lines[at : at + _SHOWN]
            if not is_comment(text)
        ]
        names = self.names
        is_sparse = self.remark is _SPARSE or (names is None and _are_sparse(rows))
        if is_sparse:
            names = _SPARSE
        elif names is None and len(self.remark) == len(words):
            names = self.remark
        self._check_names(names, words)
        doubts = []
        if names is not None and not is_sparse:
            names, doubt = _fitted(names, rows, self.dialect)
            doubts = [doubt] if doubt else []
        elif names is None and (doubt := _uneven_rows(rows)):
            doubts = [doubt]
        if names is None and (doubt := self._skipped(words)):
            doubts.append(doubt)
        columns = self._columns(names, words, rows)
        instead = self.instead or cameras_in_words(rows) or (cameras_in_names(names) if names else None)
        other = next((kind for start, kind in _FIRST_WORDS.items() if self._begins_with(start)), None)
        instead = other[0] if other else instead
        if any(text.lower().startswith("ncols") for text in self.above):
            instead = "a grid of heights (ESRI ASCII)"
        if (stated := self.corrections.get("columns")) is not None:
            names, instead = [*stated], None
        elif names is None and len(columns) < 3 and not instead:
            raise InputError(f"line {number} has fewer than three numbers")
        if self.dialect == Dialect("comma") and "decimal" not in self.corrections and names is None:
            numbers.check_commas(row for row in rows if len(row) > 1)
        return TableHead(
            number - 1,
            self.dialect,
            tuple(columns),
            None if names is None else tuple(names[at] for at in columns),
            self.promised,
            tuple(self.above[-_SHOWN:]),
            tuple(map(tuple, rows)),
            instead,
            NAMES_HELP if other is None else f"Rename the file with the suffix {other[1]}",
            tuple(doubts),
            () if names is None else tuple(name for at, name in enumerate(names) if at not in columns),
        )

    def _begins_with(self, start: str) -> bool:
        first = self.lines[0][1].strip().lower()
        return first == start or first.startswith(f"{start} ")

    def _columns(
        self, names: list[str] | None, words: Sequence[str], rows: Sequence[Sequence[str]]
    ) -> list[int]:
        """The columns to read: those that the user gives a role, or those of numbers."""
        if (stated := self.corrections.get("columns")) is not None:
            if len(stated) != len(words):
                what = f"has {len(words)} columns, but --read columns= names {len(stated)}"
                raise InputError(
                    what, hint="Give a role for each column, and '-' for each column to leave out"
                )
            return [at for at, role in enumerate(stated) if role not in UNREAD]
        width = max(map(len, rows)) if self.dialect.delimiter else len(words)
        width = width if names is None else len(names)
        known = [*words, *[""] * (width - len(words))][:width]
        return [at for at, word in enumerate(known) if self._is_number(word) or self._may_be(at, rows)]

    def _skipped(self, words: Sequence[str]) -> str:
        """A message where the last line above the first row may be a row that cannot be read."""
        if self.unnamed is None or len(self.unnamed[2]) != len(words):
            return ""
        number, line, found = self.unnamed
        if not any(map(self._is_number, found)):
            return ""
        return (
            f"Scan4D does not read line {number}, which is above the first row: {shortened(line.strip())!r}"
        )

    def _check_names(self, names: list[str] | None, words: Sequence[str]) -> None:
        """Raise InputError where the line above the first row names other things than points."""
        if names is not None or self.unnamed is None or "columns" in self.corrections:
            return
        number, line, found = self.unnamed
        if cameras := cameras_in_names(found):
            raise InputError(f"looks like {cameras}, not like points", hint=NAMES_HELP)
        if len(found) == len(words) and self.lines and not any(map(self._is_number, found)):
            raise InputError(_not_names(number, line, found), hint=NAMES_HELP)

    def _may_be(self, at: int, rows: Sequence[Sequence[str]]) -> bool:
        """Whether a column whose first value is absent holds numbers below it."""
        column = [row[at] if at < len(row) else "" for row in rows if len(row) > 1]
        filled = [word for word in column if word.lower() not in ABSENT]
        return (
            bool(column)
            and column[0].lower() in ABSENT
            and bool(filled)
            and all(map(self._is_number, filled))
        )


def _widths(rows: Sequence[Sequence[str]]) -> list[int]:
    """How many values each row has, without empty cells at its end; counts of rows are left out."""
    widths = [max((at for at, word in enumerate(row, 1) if word), default=0) for row in rows]
    return [width for width in widths if width > 1]


def _fitted(names: list[str], rows: Sequence[Sequence[str]], dialect: Dialect) -> tuple[list[str], str]:
    """The names of all columns, and a message where their number is not that of the values.

    R and pandas write no name for the column in front, which numbers the rows or names them.
    """
    widths = _widths(rows) or [len(names)]
    width = max(widths)
    if {*widths} == {len(names) + 1} and _is_unnamed_front([row[0] for row in rows if len(row) > 1], dialect):
        return ["number", *names], ""
    if dialect == Dialect("comma") and width > len(names):
        numbers.check_commas([row for row in rows if len(row) > 1], is_twice=width == 2 * len(names))
    if width in (len(names), 0) or (width < len(names) and not any(names[width:])):
        return names, ""
    which = (
        ("Scan4D reads only the columns with names")
        if width > len(names)
        else "Check which column is missing"
    )
    return names, f"the table names {len(names)} columns, but the rows have {width} values. {which}"


def _is_unnamed_front(front: Sequence[str], dialect: Dialect) -> bool:
    """Whether the first words of rows count up by 1, or are no numbers."""
    if not any(is_numeral(word, dialect.decimal) for word in front):
        return True
    if len(front) < 2 or not all(is_numeral(word, dialect.decimal) for word in front):
        return False
    counts = [numbers.value(word, dialect.decimal) for word in front]
    return all(after - before == 1 for before, after in pairwise(counts))


def _uneven_rows(rows: Sequence[Sequence[str]]) -> str:
    widths = _widths(rows)
    if not widths or min(widths) == max(widths):
        return ""
    return (
        f"the rows have {min(widths)} to {max(widths)} values. Scan4D reads as many values of each row as "
        "the first row has"
    )


def split_names(line: str) -> list[str]:
    """The names of columns in a line, by its own separator; units in brackets belong to names before them."""
    line = line.strip().lstrip("#/%!* \t")
    separator = next((name for name, mark in numbers.SEPARATORS.items() if mark and mark in line), "blank")
    words = split_line(line, Dialect(separator))
    if separator != "blank":
        return words
    joined: list[str] = []
    for word in words:
        if joined and word.startswith(("[", "(")):
            joined[-1] += f" {word}"
        else:
            joined.append(word)
    return joined


def _are_sparse(rows: Sequence[Sequence[str]]) -> bool:
    """Whether rows are points of COLMAP: id, position, colour, error, and then pairs of whole numbers."""
    rows = [words for words in rows if any(words)]
    if len({len(words) for words in rows}) < 2 and not _has_tracks(rows):
        return False
    return all(
        len(words) >= 8
        and len(words) % 2 == 0
        and all(word.isdecimal() for word in (words[0], *words[4:7], *words[8:]))
        and all(int(word) < 256 for word in words[4:7])
        and all(map(is_numeral, words[1:8]))
        for words in rows
    )


def _has_tracks(rows: Sequence[Sequence[str]]) -> bool:
    """Whether rows of one length may have ids that differ, positions with decimals, and pairs behind."""
    if not rows or len(rows[0]) < 10 or len({words[0] for words in rows}) < max(len(rows), 2):
        return False
    return all(any("." in word for word in words[1:4]) and words[7] and "." in words[7] for words in rows)


def _not_names(number: int, line: str, words: Sequence[str]) -> str:
    lower = [word.lower() for word in words]
    twice = next((word for at, word in enumerate(lower) if word in lower[:at]), None)
    if {"x", "y", "z"} & {*lower} and twice:
        return f"line {number} names '{shortened(twice)}' twice, and lacks x, y or z"
    return f"line {number} contains neither numbers nor the names x, y and z: {line.strip()[:60]!r}"


# --- what the dialog of tables shows ------------------------------------------------------------


class TablePreview(NamedTuple):
    """The first lines of a text table, and how Scan4D reads them.

    lines:     at most 40, as they are
    cells:     words of the first rows
    roles:     one for each column of `cells`; empty where there is a problem
    separator: "blank", "tab", "comma", "semicolon" or "bar"
    decimal:   "." or ","
    encoding:  "utf-8", "utf-16", "utf-32" or "latin-1"
    skip:      lines above the first row
    problem:   why it cannot be read, one clause; empty where it can
    row_count: rows among the lines
    """

    lines: tuple[str, ...]
    cells: tuple[tuple[str, ...], ...]
    roles: tuple[str, ...]
    separator: str
    decimal: str
    encoding: str
    skip: int
    problem: str
    row_count: int


def preview(path: Path, corrections: Corrections = NOTHING_CORRECTED) -> TablePreview:
    """The first lines of a text table with the roles of its columns. Raises InputError."""
    try:
        with open_plain(path) as stream:
            data = stream.read(numbers.HEAD)
    except OSError as error:
        raise InputError(f"cannot be read ({error})", path) from error
    encoding = numbers.encoding_decision(data, corrections.get("encoding"))
    lines = data.decode(numbers.codec_of(encoding, data), "replace").removeprefix("\ufeff").splitlines()
    if len(data) == numbers.HEAD:
        lines = lines[:-1]
    shown = tuple(line[:1000] for line in lines[:_SHOWN])
    try:
        head = head_of((f"{line}\n" for line in lines), corrections)
        roles = _roles(head, path.suffix.lower(), corrections)
        problem = ""
    except InputError as error:
        head = TableHead(corrections.get("skip", 0), _likely_dialect(lines, corrections), (), None)
        roles, problem = (), error.what
    if not problem and head.instead:
        problem = f"looks like {head.instead}, not like points"
    dialect = head.dialect
    rows = head.rows or tuple(tuple(split_line(line, dialect)) for line in lines[head.skip : _SHOWN])
    return TablePreview(
        shown, rows, roles, dialect.separator, dialect.decimal, encoding.value, head.skip, problem,
        len(head.rows),
    )  # fmt: skip


def _likely_dialect(lines: Sequence[str], corrections: Corrections) -> Dialect:
    """How the lines of a table are written that cannot be read."""
    stated = corrections.get("separator"), corrections.get("decimal")
    try:
        return dialect_of(_lines_above((f"{line}\n" for line in lines), corrections).numeric_lines, *stated)
    except InputError:
        return Dialect(stated[0] or PLAIN.separator, stated[1] or PLAIN.decimal)


def _roles(head: TableHead, suffix: str, corrections: Corrections) -> tuple[str, ...]:
    """A role for each column of the rows, "-" for those without numbers."""
    if "columns" in corrections:
        return tuple(corrections["columns"])
    roles: Sequence[str] = head.names or ()
    if head.names is None:
        shown = (" ; ".join(row) + "\n" for row in head.rows)
        table = numbers.parse_numbers(shown, head.columns, Dialect("semicolon", head.dialect.decimal))
        roles = decide(table, suffix).value
    by_column = dict(zip(head.columns, roles, strict=False))
    return tuple(by_column.get(at, "-") for at in range(max(map(len, head.rows), default=0)))
