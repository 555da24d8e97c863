"""The files that a scan is read from, which nothing that is written may replace."""

from __future__ import annotations

import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from ..errors import InputError
from .sources import FACES_FILE
from .timeline import Timeline
from .times import OTHER_TIMES_FILES, TIMES_FILE


def scan_inputs(timeline: Timeline) -> list[Path]:
    """The files that a scan may be read from: its frames, and what may stand beside them or their folder."""
    folders = {file.parent for file in timeline.files}
    folders |= {folder.parent for folder in folders if folder.name == "frames"}
    names = (TIMES_FILE, *OTHER_TIMES_FILES, FACES_FILE)
    return [*timeline.files, *(folder / name for folder in folders for name in names)]


def found_among(paths: Iterable[Path], inputs: Iterable[Path]) -> list[Path]:
    """The paths among these that lead to one of the inputs, under whatever name: links as well."""
    there = [(path, identity) for path in paths if (identity := _identity(path)) is not None]
    read = {_identity(path) for path in inputs} if there else set()
    return [path for path, identity in there if identity in read]


def refuse_input(path: Path, timeline: Timeline) -> None:
    """Raise InputError where a path leads to one of the files that a scan may be read from."""
    if found_among([path], scan_inputs(timeline)):
        raise InputError("is a file of the scan: Scan4D does not replace it", path, "Use another name")


def _identity(path: Path) -> tuple[int, int] | None:
    """Device and number that tell a file from all others; None where there is none."""
    with suppress(OSError):
        status = os.stat(path)
        return status.st_dev, status.st_ino
    return None
