"""What is dropped onto the window: scans, folders, recordings, pictures that tell how they were made."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ...document.recording import is_recording
from ...document.saved_session import is_session
from ...scan.listing import as_one_scan
from ..part import WindowPart
from ..window import Window
from .scans import Scans
from .sessions import Sessions


@dataclass(eq=False)
class Dropping(WindowPart):
    """Takes what is dropped onto the window."""

    name = "dropping"
    doing = "Opening what you dropped"
    window: Window
    scans: Scans
    sessions: Sessions
    replay: Callable[[Path], None]
    take_file: Callable[[Path], bool]
    note: Callable[[str], None]

    def advance(self, now: float) -> None:
        """Open what was dropped together: a whole sequence as one scan, else the first, and the others
        listed.

        Alone, a recording or a picture is replayed, a session is opened, and a tool takes its own file.
        """
        paths = self.window.take_dropped()
        if len(paths) == 1 and is_session(Path(paths[0])):
            self.sessions.open(Path(paths[0]))
            return
        if len(paths) == 1 and self.take_file(Path(paths[0])):
            return
        recordings = [path for path in paths if os.path.isfile(path) and is_recording(Path(path))]
        if recordings and len(paths) == 1:
            self.replay(Path(paths[0]))
            return
        if recordings:
            names = ", ".join(Path(path).name for path in recordings)
            self.note(
                f"Scan4D did not open {names}. To open a recording, a session or a picture, drop only this "
                "file."
            )
        named = [path for path in paths if path not in recordings]
        if named:
            one = as_one_scan(named)
            self.scans.open([one] if one else named)
