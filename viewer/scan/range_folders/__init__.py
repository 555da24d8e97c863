"""The kinds of folders of range images: one module a kind, found by scanning this folder.

A module declares

- `TITLE: str`, as messages name it;
- `find(folder, names) -> RangeFrames | None`: its frames, where the folder is of this kind. names: those of
  all that is in the folder, in no order. No frame is read, small text files may be. It raises where the
  folder is of this kind and something is wrong with all of it;
- optional: `lacks(names) -> str`, what is missing in a folder that has other parts of this kind; "" for a
  folder that has none of them;
- optional: `GENERAL = True` if the other kinds are to be tried first.

`find` may have a parameter `decided`: the decisions about the scan, with the user's corrections
(`viewer/scan/reading/sequence.py`).

Modules whose name starts with an underscore are helpers.
"""

from __future__ import annotations

import os
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import ModuleType

from ...errors import InputError, explained
from ...extensions import load_modules, package_of
from ..formats import one_message
from ..reading.record import Decision
from ..reading.sequence import Decided, ask
from ._source import RangeFrames

__all__ = ["RangeFrames", "find_range_frames", "lacking_part"]


def find_range_frames(folder: Path, decided: Decided | None = None) -> RangeFrames | None:
    """The frames of a folder of range images, or None where it is none of a known kind. No frame is read.

    Raises InputError where it is of a known kind and cannot be used.
    """
    try:
        names = [name for name in os.listdir(folder) if not name.startswith(".")]
    except OSError as error:
        raise InputError(f"cannot be listed ({error.strerror})", folder, explained(error)[1]) from error
    for kind in _kinds():
        with one_message(folder, f"cannot be read as {kind.TITLE}"):
            shared = decided or Decided()
            if (frames := ask(kind.find, folder, names, decided=shared)) is not None:
                shared.note(Decision("format", kind.TITLE, "folder"))
                return replace(frames, package=package_of(kind.__name__), decided=shared)
    return None


def lacking_part(folder: Path) -> str:
    """Words on which kind of range images a folder seems to hold and what of it is missing; "" where it looks
    like none of them."""
    names = [name for name in os.listdir(folder) if not name.startswith(".")]
    for kind in _kinds():
        if hasattr(kind, "lacks") and (missing := kind.lacks(names)):
            return f"looks like {kind.TITLE}, but {missing}"
    return ""


@cache
def _kinds() -> tuple[ModuleType, ...]:
    """The kinds of folders, the special ones first."""
    kinds: list[ModuleType] = []

    def add(_: str, module: ModuleType) -> None:
        if hasattr(module, "find"):  # others read files: see viewer/scan/formats
            kinds.append(module)

    load_modules("readers", __name__, __path__, add)
    return tuple(sorted(kinds, key=lambda kind: getattr(kind, "GENERAL", False)))
