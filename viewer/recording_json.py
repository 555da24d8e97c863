"""What recordings hold as JSON: reading it, and which values it may have."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .errors import InputError
from .export import read_description

DAMAGED = "It is damaged, or no recording of Scan4D; record it again"
_MOST_BYTES = 256 * 2**20
_MOST_SECONDS = 86_400.0


def read_json(path: Path) -> Any:
    """The JSON of a file, or of the description in a picture. Raises InputError, which names the file."""
    try:
        if path.suffix.lower() in (".png", ".exr"):
            text = read_description(path)
        elif path.stat().st_size > _MOST_BYTES:
            raise InputError("is too large for a recording", path)
        else:
            text = path.read_text(encoding="utf-8")
        return json.loads(text)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", path, "Check its name") from error
    except (ValueError, RecursionError) as error:  # of the text's encoding as well
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
    return isinstance(value, str) and value != "" and "\0" not in value


_KINDS: dict[str, tuple[Callable[[Any], bool], str]] = {
    "scan": (lambda value: value is None or _word(value), "the name of a scan"),
    "hash": (lambda value: value is None or _word(value), "a hash"),
    "pose": (_whole, "the number of a pose"),
    "time": (_finite, "a time in seconds"),
    "size": (lambda v: isinstance(v, list) and len(v) == 2 and all(map(_whole, v)), "width and height"),
    "camera": (_object, "a camera"),
    "backend": (_word, "the name of a renderer"),
    "params": (_object, "parameters by name"),
    "look": (_object, "a look"),
    "marks": (_object, "marks by name"),
    "unit": (lambda value: value is None or _word(value), "a unit"),
    "anonymous": (lambda value: isinstance(value, bool), "true or false"),
    "at": (_stamp, "a time within a day, in seconds"),
    "seconds": (_stamp, "a time within a day, in seconds"),
}


def checked(name: str, value: Any) -> Any:
    """The value of a field where it is of its kind. Raises InputError where it is not."""
    fits, kind = _KINDS[name]
    if not fits(value):
        raise InputError(f"'{name}' is not {kind} but {value!r:.40}", hint=DAMAGED)
    return value
