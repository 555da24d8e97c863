"""The small text files of data sets: lists, poses, calibrations."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError, explained, shortened
from ...files import parsed_json, read_text
from ..admission import admit
from ..formats import one_message

_MOST_BYTES = 64 << 20  # of a log of poses, some hours long
_WORD_BYTES, _ROW_BYTES = 64, 200  # of memory for a word, and beside the words for a line
_JSON_BYTES = 30  # of memory for a letter of JSON, at most
_SPACE, _NEWLINE = 32, 10
_MARK = "\ufeff"  # of the order of bytes, which some editors write in front


def text_of(path: Path) -> str:
    """The text of a file. Raises InputError where there is none."""
    try:
        return read_text(path, _MOST_BYTES).removeprefix(_MARK)
    except OSError as error:
        what, hint = explained(error)
        raise InputError(f"cannot be read: {what}", path, hint) from error
    except UnicodeDecodeError as error:
        raise InputError("is not a UTF-8 text", path) from error


def rows_of(path: Path, row_bytes: int = 0) -> list[tuple[int, list[str]]]:
    """Number and words of each line of a file, but for empty lines and those that begin with #.

    row_bytes: of memory that the caller takes for each. Raises InputError where there is no text, or it would
    take too much.
    """
    text = text_of(path)
    letters = np.frombuffer(text.encode(), np.uint8)
    words = int(np.count_nonzero((letters[1:] > _SPACE) & (letters[:-1] <= _SPACE))) + 1
    lines = int(np.count_nonzero(letters == _NEWLINE)) + 1
    with one_message(path, "cannot be read"):
        admit(len(letters), 4 * len(letters) + words * _WORD_BYTES + lines * (_ROW_BYTES + row_bytes))
    rows = ((number, line.split()) for number, line in enumerate(text.splitlines(), start=1))
    return [(number, words) for number, words in rows if words and not words[0].startswith("#")]


def object_of(path: Path) -> dict[str, Any]:
    """The JSON object in a file. Raises InputError."""
    stored = json_of(path)
    if not isinstance(stored, dict):
        raise InputError("is not a JSON object", path)
    return stored


def json_of(path: Path) -> Any:
    """The JSON value in a file. Raises InputError."""
    text = text_of(path)
    with one_message(path, "cannot be read"):
        admit(len(text), len(text) * _JSON_BYTES)
    try:
        return parsed_json(text)
    except ValueError as error:
        raise InputError(f"is not JSON: {shortened(str(error))}", path) from error
