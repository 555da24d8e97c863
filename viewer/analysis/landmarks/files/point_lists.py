"""Lists of points as text (`.pts`, `.lm`): there are several dialects.

A place is a line with its name, if any, and its coordinates, or a line with the name and below it one with
the coordinates. Before them may stand a version ("Version 1.0" of IDAV Landmark, "Landmarks-1.0" of LDDMM), a
count of the places by itself or with a word ("22 landmarks:", "n_points: 68"), and braces around (ibug).
Landmark and Checkpoint have 9999 for the coordinates of what is missing.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from ....errors import shortened
from ....scan.reading.numbers import PLAIN, Dialect, dialect_of, point_form, split_line
from ..landmark_set import LandmarkNotes, LandmarkSet
from ._text import at_line, count_of, is_number, number_of, numbered_lines

TITLE = "list of points"
SUFFIXES = (".pts", ".lm", ".lm3", ".lmk")

_VERSION = re.compile(r"(version|file\s*:|landmarks-|landmarkswithvariability).*", re.IGNORECASE)
_COUNT = re.compile(r"(?:n_points\s*[:=]\s*)?(\d+)(?:\s*(?:landmarks?|points?)\s*:?)?", re.IGNORECASE)
_MISSING = 9999.0


def owns(head: str) -> bool:
    """Whether a text tells itself from the points of a scan: a version, or names."""
    lines = [line.strip() for line in head.splitlines() if line.strip() and not line.startswith("#")]
    if not lines:
        return False
    if _VERSION.fullmatch(lines[0]) or re.match(r"\d+\s+(landmarks|points)", lines[0], re.IGNORECASE):
        return True
    return any(not is_number(word) for line in lines[:2] for word in _words(line)[:1])


def _words(text: str, dialect: Dialect = PLAIN) -> list[str]:
    """The words of a line; numbers have a decimal point."""
    if dialect.decimal == ",":
        return [point_form(word, ",") or word for word in split_line(text, dialect) if word]
    return [word for word in re.split(r"[\s,;]+", text) if word]


def read(path: Path) -> LandmarkSet:
    """The places of the list. Raises InputError."""
    promised: tuple[int, int] | None = None
    has_flags = False
    names: list[str] = []
    rows: list[list[float]] = []
    waiting: tuple[int, str] | None = None  # a name whose coordinates come in the next line
    lines = numbered_lines(path)
    dialect = dialect_of(text for _, text in lines)
    for line, text in lines:
        if text.startswith(("#", "//", "{", "}")):
            continue
        if not rows and _VERSION.fullmatch(text):
            has_flags = has_flags or text.lower().startswith("landmarks")
            continue
        count = _COUNT.fullmatch(text)
        if count and not rows and promised is None and waiting is None:
            promised = count_of(count[1], line, "the count"), line
            continue
        words = _words(text, dialect)
        first = _place_in(words)
        if waiting is not None and first != 0:
            raise at_line(f"the landmark '{shortened(waiting[1])}' has no coordinates", waiting[0])
        if first is None:
            waiting = line, text
            continue
        rows.append([number_of(word, line) for word in words[first:]])
        names.append(" ".join(words[:first]) if first else waiting[1] if waiting else "")
        waiting = None
    if waiting is not None:
        raise at_line(f"the landmark '{shortened(waiting[1])}' has no coordinates", waiting[0])
    if promised is not None and promised[0] != len(rows):
        raise at_line(f"announces {promised[0]} landmarks, but the file contains {len(rows)}", promised[1])
    if not any(names):
        names = [str(number) for number in range(1, len(rows) + 1)]
        if _are_numbered(rows):
            names, rows = [str(int(row[0])) for row in rows], [row[1:] for row in rows]
    flat = sum(len(row) == 2 for row in rows)
    remarks = [f"{flat} landmarks have only two coordinates: Scan4D sets z to 0"] if flat else []
    places = [_place(row, has_flags) for row in rows]
    return LandmarkSet.of(names, np.array([places]), notes=LandmarkNotes(remarks=remarks))


def _place(row: list[float], has_flag: bool) -> list[float]:
    """The three coordinates of a row. has_flag: whether a fourth number says that they are valid."""
    is_missing = row[:3].count(_MISSING) >= 2 or (has_flag and len(row) > 3 and row[3] == 0)
    return [math.nan] * 3 if is_missing else [*row[:3], 0.0][:3]


def _are_numbered(rows: list[list[float]]) -> bool:
    """Whether each row begins with its number, from 0 or 1, before three coordinates."""
    if len(rows) < 2 or any(len(row) != 4 for row in rows):
        return False
    start = rows[0][0]
    return start in (0, 1) and all(row[0] == start + number for number, row in enumerate(rows))


def _place_in(words: list[str]) -> int | None:
    """The first of the numbers, two or more, that words end with; None where they do not."""
    first = len(words)
    while first and is_number(words[first - 1]):
        first -= 1
    return first if len(words) - first >= 2 else None
