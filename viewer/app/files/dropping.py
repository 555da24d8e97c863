"""What is dropped onto the window: scans, folders, recordings, pictures that tell how they were made."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ...document.recording import is_recording
from ...document.saved_session import is_session
from ...scan.listing import as_one_scan

if TYPE_CHECKING:
    from ..app import App


def take(app: App, paths: Sequence[str]) -> None:
    """Open what was dropped together: a whole sequence as one scan, else the first, and the others listed.

    A recording or a picture is replayed, a session is opened where it was dropped alone. paths: none where
    nothing was dropped.
    """
    if len(paths) == 1 and is_session(Path(paths[0])):
        app.sessions.open(Path(paths[0]))
        return
    told = [path for path in paths if os.path.isfile(path) and is_recording(Path(path))]
    if told and len(paths) == 1:
        app.replayer.replay(Path(paths[0]))
        return
    if told:
        names = ", ".join(Path(path).name for path in told)
        app.note(f"Left out: {names}. Drop a recording, a session or a picture by itself to see it again.")
    scans = [path for path in paths if path not in told]
    if scans:
        one = as_one_scan(scans)
        app.scans.open([one] if one else scans)
