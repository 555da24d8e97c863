"""Landmarks in text: lines with their numbers, coordinates, and what a format has no field for."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....errors import InputError, shortened
from ....files import open_plain, parsed_json
from ....scan.reading.numbers import ABSENT, HEAD, decoded, encoding_of, is_not_finite
from ...track import Known
from ..landmark_set import LandmarkSet

MOST_BYTES = 64 * 2**20  # of a file of landmarks
MISSING = "NA"  # in place of a coordinate, as geomorph reads it
_LARGEST = 1e150  # so that numbers times a scale or a unit's factor stay finite
_ABSENT = {"na", "nan", "-nan", "none", "null", ""}
_REAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?", re.ASCII)
_OWN = "scan4d "


def read_bytes(path: Path, most: int = MOST_BYTES) -> bytes:
    """The bytes of a file. Raises InputError where they are more than so many."""
    with open_plain(path) as stream:
        held = os.fstat(stream.fileno()).st_size  # Python takes memory for all that it is asked for
        data = stream.read(min(held, most) + 1)
    if len(data) > most:
        raise InputError(f"is longer than {most:,} bytes, the limit for a file of landmarks")
    return data


def read_all(path: Path) -> str:
    """The text of a file in UTF-8 or UTF-16, or else in Latin-1. Raises InputError for what is no text."""
    data = read_bytes(path)
    if b"\0" in data:
        if not encoding_of(data[:HEAD]).startswith(("utf-16", "utf-32")):
            raise InputError("is not text")
        return decoded(data)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def numbered_lines(path: Path) -> list[tuple[int, str]]:
    """The lines of a file that are not blank, without blanks around, each after its number from 1."""
    text = read_all(path)
    lines = text.replace("\r", "").split("\n") if "\n" in text else text.split("\r")
    return [(number, text.strip()) for number, text in enumerate(lines, 1) if text.strip()]


def at_line(what: str, line: int, hint: str | None = None) -> InputError:
    """The error for something in a line; the front puts the name of the file before it."""
    return InputError(what, f"line {line}", hint)


def is_number(word: str) -> bool:
    """Whether a word is a coordinate, or stands for one that is missing."""
    return word.lower() in _ABSENT or _REAL.fullmatch(word) is not None


def number_of(word: str, line: int) -> float:
    """The number of a word; NaN where it says that there is none. Raises InputError for what is no number,
    and for one beyond 1e150."""
    word = word.strip()
    if word.lower() in ABSENT or is_not_finite(word):
        return math.nan
    if _REAL.fullmatch(word) is None:
        hint = "Use a decimal point" if re.fullmatch(r"-?\d+,\d+", word) else None
        raise at_line(f"'{shortened(word)}' is not a number", line, hint)
    value = float(word.replace("d", "e").replace("D", "e"))
    if abs(value) > _LARGEST:
        raise at_line(f"'{shortened(word)}' is larger than {_LARGEST:g}", line)
    return value


def count_of(word: str, line: int, what: str) -> int:
    """A whole number that counts something, below 10^9. Raises InputError."""
    if not re.fullmatch(r"\+?\d{1,9}", word.strip(), re.ASCII):
        raise at_line(f"{what} is '{shortened(word.strip())}', which is not a whole number", line)
    return int(word)


def three_numbers(words: Sequence[str], line: int) -> list[float]:
    """The three coordinates of a line. Raises InputError where it has not so many."""
    if len(words) < 3:
        raise at_line(f"has {len(words)} coordinates instead of three: '{shortened(' '.join(words))}'", line)
    return [number_of(word, line) for word in words[:3]]


def digits_of(value: float) -> str:
    """A number with all its digits, or the word for none."""
    return repr(float(value)) if math.isfinite(value) else MISSING


def own_text(values: Mapping[str, Any]) -> str:
    """A comment of one line with what a format has no field for."""
    return _OWN + json.dumps({key: value for key, value in values.items() if value is not None})


def own_values(comment: str) -> dict[str, Any]:
    """Values of such a comment where it was written here; none of others."""
    if not comment.startswith(_OWN):
        return {}
    try:
        found = parsed_json(comment.removeprefix(_OWN))
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def own_names(values: Mapping[str, Any], count: int) -> list[str] | None:
    """The names that a comment tells, where they are as many as there are landmarks."""
    names = values.get("names")
    if isinstance(names, list) and len(names) == count and all(isinstance(name, str) for name in names):
        return names
    return None


def own_number(values: Mapping[str, Any], key: str) -> float:
    """A finite number that a comment tells, NaN for none."""
    value = values.get(key)
    fits = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300
    return float(value) if fits else math.nan  # type: ignore[arg-type]


def own_frames(frames: Sequence[float]) -> NDArray[np.int64] | None:
    """Indices of frames that comments tell, which count from 1: whole numbers that increase, below 2^31; None
    for others."""
    listed = np.array(frames, np.float64)
    fits = (listed >= 1) & (listed < 2**31) & (listed == np.floor(listed))
    return listed.astype(np.int64) - 1 if fits.all() and (np.diff(listed) > 0).all() else None


def own_unit(values: Mapping[str, Any]) -> str | None:
    """The unit that a comment tells."""
    unit = values.get("unit")
    return unit if isinstance(unit, str) else None


def without_states(landmarks: LandmarkSet, title: str) -> str | None:
    """The remark of a format that has no states, where the landmarks have some."""
    if (landmarks.is_defined & (landmarks.known < Known.PLACED)).any() or np.isfinite(landmarks.sigmas).any():
        return (
            f"{title} files do not store uncertainties, nor which landmarks Scan4D tracked. If you import "
            "the file, Scan4D treats all its landmarks as placed"
        )
    return None
