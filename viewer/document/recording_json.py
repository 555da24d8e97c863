"""What recordings hold as JSON: reading it, and which values it may have."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..errors import InputError, explained, shortened
from ..files import parsed_json, read_text
from ..output.export import read_description
from ..scan.units import checked_unit

DAMAGED = "It is damaged, or no recording of Scan4D; record it again"
_MOST_BYTES = 256 * 2**20
_MOST_SECONDS = 86_400.0
_LATEST = 1e12  # seconds, of a scan
_LONGEST_WORD = 200


def read_json(path: Path) -> Any:
    """The JSON of a file, or of the description in a picture. Raises InputError, which names the file."""
    try:
        is_picture = path.suffix.lower() in (".png", ".exr")
        return parsed_json(read_description(path) if is_picture else read_text(path, _MOST_BYTES))
    except OSError as error:
        what, hint = explained(error)
        raise InputError(f"cannot be read: {what}", path, hint) from error
    except ValueError as error:  # of the text's encoding as well
        raise InputError(f"is not JSON ({error})", path, DAMAGED) from error


def placed(read: Callable[[], Any], where: object) -> Any:
    """What a function reads; its InputError says where."""
    try:
        return read()
    except InputError as error:
        inner = "" if error.where is None else f"{error.where}: "
        raise InputError(inner + error.what, where, error.hint) from error
    except OverflowError as error:  # a number of hundreds of digits
        raise InputError(f"holds a number that is too large ({error})", where, DAMAGED) from error


def _whole(value: Any) -> bool:
    return type(value) is int and 0 <= value < 2**31


def _finite(value: Any) -> bool:
    return type(value) in (int, float) and math.isfinite(value)


def _stamp(value: Any) -> bool:
    return _finite(value) and 0 <= value <= _MOST_SECONDS


def _object(value: Any) -> bool:
    return isinstance(value, dict)


def _word(value: Any) -> bool:
    return isinstance(value, str) and value.isprintable() and 0 < len(value) <= _LONGEST_WORD


def _unit(value: Any) -> bool:
    return _word(value) and checked_unit(value) == value


def _name(value: Any) -> bool:
    """Of a file: whatever the system takes for one."""
    try:
        return isinstance(value, str) and value != "" and b"\0" not in os.fsencode(value)
    except UnicodeEncodeError:
        return False


_KINDS: dict[str, tuple[Callable[[Any], bool], str]] = {
    "scan": (lambda value: value is None or _name(value), "the name of a scan"),
    "hash": (lambda value: value is None or _word(value), "a hash"),
    "pose": (_whole, "the number of a pose"),
    "time": (lambda value: _finite(value) and abs(value) <= _LATEST, "a time in seconds"),
    "size": (lambda v: isinstance(v, list) and len(v) == 2 and all(map(_whole, v)), "width and height"),
    "camera": (_object, "a camera"),
    "backend": (_word, "the name of a renderer"),
    "params": (_object, "parameters by name"),
    "look": (_object, "a look"),
    "marks": (_object, "marks by name"),
    "unit": (lambda value: value is None or _unit(value), "a unit"),
    "anonymous": (lambda value: isinstance(value, bool), "true or false"),
    "at": (_stamp, "a time within a day, in seconds"),
    "seconds": (_stamp, "a time within a day, in seconds"),
}


def checked(name: str, value: Any) -> Any:
    """The value of a field where it is of its kind. Raises InputError where it is not."""
    fits, kind = _KINDS[name]
    if not fits(value):
        raise InputError(f"'{name}' is not {kind} but {shortened(value)}", hint=DAMAGED)
    return value
