"""What comes back at the next start: one JSON file of the user's, with an object for each part of the window.

Each part declares its values as a dataclass, its `Settings`. Each value is read by itself, by the type of its
field, so that a wrong one costs no other.
"""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import parsed_json, read_text, whole_file

FORMAT = 1
FILE = "settings.json"
_MOST_BYTES = 32 * 2**20  # of the file


def load(path: Path) -> tuple[dict[str, Any], list[str]]:
    """The values of a file by the names of parts, none where there is no file, and what the user should know.

    A file that is damaged or of another version is put aside, and all starts anew.
    """
    try:
        data = parsed_json(read_text(path, _MOST_BYTES))
    except FileNotFoundError:
        return {}, []
    except OSError as error:
        if error.errno == errno.EINVAL:  # too long, or no plain file
            return {}, [_put_aside(path, error.strerror or str(error))]
        return {}, [
            str(InputError(f"cannot be read ({error.strerror})", path, "Scan4D starts with the defaults"))
        ]
    except ValueError:  # of encoding as well
        return {}, [_put_aside(path, "is damaged")]
    if not isinstance(data, dict) or data.pop("format", None) != FORMAT:
        return {}, [_put_aside(path, "was written by another version of Scan4D")]
    return data, []


def save(values: Mapping[str, Any], path: Path) -> None:
    """Write the file. Raises InputError where it cannot be written."""
    text = json.dumps({"format": FORMAT, **values}, indent=1)
    with whole_file(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def _put_aside(path: Path, what: str) -> str:
    kept = path.with_name(f"{path.stem}.old{path.suffix}")
    try:
        os.replace(path, kept)
    except OSError as error:
        what = f"{what}, and cannot be moved ({error.strerror})"
        return str(InputError(what, path, "Scan4D starts with the defaults"))
    return str(InputError(what, path, f"Scan4D renamed the file to {kept.name} and starts with the defaults"))
