"""The files that a scan is read from, which nothing that the window writes may replace."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

from ...scan.sources import FACES_FILE
from ...scan.timeline import Timeline
from ...scan.times import TIMES_FILE


def inputs_among(paths: Iterable[Path], timeline: Timeline) -> list[Path]:
    """Those of the paths that lead to a file of the scan, by whatever name."""
    there = {path: found for path in paths for found in _identities([path])}
    if not there:
        return []
    inputs = set(_identities([*timeline.files, *_beside(timeline)]))
    return [path for path, found in there.items() if found in inputs]


def _beside(timeline: Timeline) -> Iterator[Path]:
    """What may stand beside the frames, or beside their folder."""
    folders = {file.parent for file in timeline.files}
    for folder in folders | {folder.parent for folder in folders if folder.name == "frames"}:
        yield from (folder / TIMES_FILE, folder / FACES_FILE)


def _identities(paths: Iterable[Path]) -> Iterator[tuple[int, int]]:
    """What tells the files that are there from all others."""
    for path in paths:
        with suppress(OSError):
            status = os.stat(path)
            yield status.st_dev, status.st_ino
