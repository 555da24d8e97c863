"""The small text files of data sets: lists, poses, calibrations."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...errors import InputError, explained, shortened
from ...files import parsed_json, read_text

_MOST_BYTES = 64 << 20  # of a log of poses, some hours long


def text_of(path: Path) -> str:
    """The text of a file. Raises InputError where there is none."""
    try:
        return read_text(path, _MOST_BYTES)
    except OSError as error:
        what, hint = explained(error)
        raise InputError(f"cannot be read: {what}", path, hint) from error
    except UnicodeDecodeError as error:
        raise InputError("is no text in UTF-8", path) from error


def object_of(path: Path) -> dict[str, Any]:
    """The JSON object in a file. Raises InputError."""
    try:
        stored = parsed_json(text_of(path))
    except ValueError as error:
        raise InputError(f"is no JSON: {shortened(str(error))}", path) from error
    if not isinstance(stored, dict):
        raise InputError("is no JSON object", path)
    return stored
