"""Files of the open scan that change on disk: looked at beside the window, which offers to read them anew."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from pathlib import Path

from ...scan.timeline import Timeline
from ...task import Task, in_background
from ..notices import Offer
from ..session import Session

EVERY = 3.0  # seconds between looks
Stamps = tuple[tuple[int, int] | None, ...]  # time of the last change and size of each file; None: not there


class Changes:
    """Looks whether the open scan's files are as they were when it was opened."""

    def __init__(self, session: Session, note: Callable[[str], None], open: Callable[[str], None]) -> None:
        """open: opens a scan anew."""
        self._session, self._note, self._open = session, note, open
        self._files: Sequence[Path] = ()
        self._known: Stamps | None = None  # as they were when the scan was opened, or reading was offered
        self._last: Stamps | None = None  # as they were at the last look
        self._look: Future[Stamps] | None = None
        self._next = 0.0  # by the clock, when to look again

    def begin(self, timeline: Timeline) -> None:
        """Look at the files of another scan from now on."""
        self._files, self._known, self._last, self._look, self._next = timeline.files, None, None, None, 0.0

    def advance(self, now: float) -> None:
        """Take in what was found, and look again after a while. now: by the clock, seconds.

        What is still being written is left alone: nothing is offered before two looks have found the same.
        """
        if self._look is not None and self._look.done():
            found, self._look, self._next = self._look.result(), None, now + EVERY
            is_still, self._last = found == self._last, found
            if self._known is None:
                self._known = found
            elif is_still and found != self._known and None not in found:
                self._known = found
                self._offer()
        if self._look is None and self._files and now >= self._next:
            files = self._files
            self._look = in_background(Task("Looking for changes"), lambda: stamps(files))

    def _offer(self) -> None:
        scan = self._session.scan
        choices = {"Reload": lambda: self._open(scan)}
        self._note(Offer("Files of the scan have changed on disk.", choices, "changes"))


def stamps(files: Sequence[Path]) -> Stamps:
    """When each file was changed last, nanoseconds, and its bytes."""
    return tuple(_stamp(file) for file in files)


def _stamp(file: Path) -> tuple[int, int] | None:
    try:
        found = os.stat(file)
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size
