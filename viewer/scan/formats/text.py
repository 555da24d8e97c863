"""Text tables of points: XYZ, CSV, TXT and PTS.

A row a point, values between blanks, tabs, commas or semicolons; `#` and `//` start comments. A line
of names may stand above the rows, also as a comment, and the count of the points (PTS).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from io import TextIOWrapper
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..admission import MOST_COLUMNS, check_count, opened, whole_number
from ..contents import PointContents
from ..points import PointCloud
from ..reading.cloud import assemble
from ..reading.sequence import Decided
from ._columns import bounded_lines, first_repeated, named, parse_table
from ._matrices import camera_matrices

TITLE = "a text table"
SUFFIXES = (".xyz", ".csv", ".txt", ".pts")

_ENCODING = "utf-8-sig"
_MOST_ABOVE = 1 << 16  # lines above the rows
_NAMES_HELP = "If the numbers are points, put a line of names above them, such as: x y z"


@dataclass(frozen=True)
class _Layout:
    """The head of a file: what stands above the rows and how they are written."""

    skip: int  # lines above the first row
    columns: list[int]  # that are numbers
    names: list[str] | None  # of those columns
    delimiter: str | None
    promised: int | None  # rows


def read(path: Path, frame: int, decided: Decided) -> PointCloud:
    """All finite points of a text table, parsed as float64. Raises InputError."""
    with opened(path) as stream:
        text = TextIOWrapper(stream, _ENCODING, errors="replace")
        layout = _look(bounded_lines(text))
        text.seek(0)
        lines = islice(bounded_lines(text), layout.skip, None)
        table = parse_table(lines, layout.columns, layout.delimiter, layout.promised)
    if layout.promised is not None and len(table) < layout.promised:
        raise InputError(f"holds {len(table)} of the {layout.promised} points that it promises")
    if layout.names is None and (matrices := camera_matrices(table)):
        raise InputError(f"looks like {matrices}, not like points", hint=_NAMES_HELP)
    names = layout.names or guess_names(table, intensity_first=path.suffix.lower() == ".pts")
    columns = named(zip(names, table.T, strict=True))
    return assemble(PointContents(columns=columns, is_named=layout.names is not None), decided)


def guess_names(table: NDArray[np.float64], intensity_first: bool = False) -> list[str]:
    """Names for the columns of a table without any, (N, C).

    After x, y and z, from left to right: three columns of colours (whole numbers in 0..255, or all in
    0..1), three of normals (all in -1..1; any other three, where the table has six columns), a column
    behind the colours that is full everywhere (alpha), `intensity`, and then `column_8` for the eighth.
    intensity_first: the fourth column is the intensity, as in PTS files.
    """
    finite = np.isfinite(table).all(axis=1)
    table = table if finite.all() else table[finite]
    width = table.shape[1]
    names = ["x", "y", "z", *["intensity"][: intensity_first and width > 3]]
    missing = {"red", "nx", "intensity"} - {*names}
    while (at := len(names)) < width:
        three = table[:, at : at + 3]
        if "red" in missing and three.shape[1] == 3 and _are_colors(three):
            names += ["red", "green", "blue"]
        elif "nx" in missing and three.shape[1] == 3 and (width == 6 or (np.abs(three) <= 1.001).all()):
            names += ["nx", "ny", "nz"]
        elif names[-1] == "blue" and any((three[:, 0] == full).all() for full in (1, 255)):
            names.append("alpha")
        else:
            names.append("intensity" if "intensity" in missing else f"column_{at + 1}")
        missing -= {*names[at:]}
    return names


def _are_colors(block: NDArray[np.float64]) -> bool:
    in_bytes = (block >= 0).all() and (block <= 255).all() and (block == np.rint(block)).all()
    return bool(in_bytes or ((block >= 0).all() and (block <= 1).all()))


def _look(lines: Iterable[str]) -> _Layout:
    """Read down to the first row of numbers. Raises InputError where there is none."""
    names: list[str] | None = None
    remark: list[str] = []
    promised = None
    for number, line in enumerate(islice(lines, _MOST_ABOVE)):
        if line.isspace():
            continue
        comment = line.lstrip().startswith(("#", "//"))
        words, delimiter = _split(line.lstrip("#/ \t") if comment else line)
        check_count(0 if comment else len(words), MOST_COLUMNS, "columns")
        if comment:
            remark = words if _are_names(words) else remark
        elif not any(words):
            continue
        elif not _is_number(words[0]):
            if not _are_names(words):
                raise InputError(_not_names(number + 1, line, words))
            names = words
        elif len(words) == 1 and words[0].isdecimal() and promised is None:
            promised = whole_number(words[0], "the count of its points")
        else:
            if names is None and len(remark) == len(words):
                names = remark
            columns = [i for i, word in enumerate(words[: len(names or words)]) if _is_number(word)]
            if names is None and len(columns) < 3:
                raise InputError(f"line {number + 1} has fewer than three numbers")
            chosen = None if names is None else [names[i] for i in columns]
            return _Layout(number, columns, chosen, delimiter, promised)
    raise InputError(f"holds no rows of numbers in its first {_MOST_ABOVE:,} lines")


def _split(line: str) -> tuple[list[str], str | None]:
    """The words of a line and the delimiter between them (None: blanks)."""
    line = line.strip()
    delimiter = next((mark for mark in (";", ",", "\t") if mark in line), None)
    return [word.strip().strip("\"'") for word in line.split(delimiter)], delimiter


def _are_names(words: list[str]) -> bool:
    return {"x", "y", "z"} <= {word.lower() for word in words}


def _not_names(number: int, line: str, words: Sequence[str]) -> str:
    twice = first_repeated(word.lower() for word in words)
    if {"x", "y", "z"} & {word.lower() for word in words} and twice:
        return f"line {number} names '{twice}' twice, and lacks x, y or z"
    return f"line {number} is neither numbers nor names with x, y, z: {line[:60]!r}"


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
