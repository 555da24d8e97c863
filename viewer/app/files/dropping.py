"""What is dropped onto the window: scans, folders, recordings, pictures that tell how they were made."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

from ...document.recording import is_recording
from ...document.saved_session import is_session
from ...scan.listing import as_one_scan
from .scans import Scans
from .sessions import Sessions


def take(
    paths: Sequence[str],
    scans: Scans,
    sessions: Sessions,
    replay: Callable[[Path], None],
    take_file: Callable[[Path], bool],
    note: Callable[[str], None],
) -> None:
    """Open what was dropped together: a whole sequence as one scan, else the first, and the others listed.

    A recording or a picture is replayed, a session is opened, a tool's file is taken by it where it was
    dropped alone. paths: none where nothing was dropped. take_file: has a tool take one that is its own.
    """
    if len(paths) == 1 and is_session(Path(paths[0])):
        sessions.open(Path(paths[0]))
        return
    if len(paths) == 1 and take_file(Path(paths[0])):
        return
    told = [path for path in paths if os.path.isfile(path) and is_recording(Path(path))]
    if told and len(paths) == 1:
        replay(Path(paths[0]))
        return
    if told:
        names = ", ".join(Path(path).name for path in told)
        note(f"Not opened: {names}. Drop a recording, a session or a picture alone to open it.")
    named = [path for path in paths if path not in told]
    if named:
        one = as_one_scan(named)
        scans.open([one] if one else named)
