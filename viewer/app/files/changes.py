"""Files of the open scan that change on disk: looked at beside the window, which offers to read them anew."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from ...errors import InputError
from ...scan.open import find_source
from ...scan.timeline import Timeline
from ...task import Task, in_background
from ..notices import Offer
from ..part import WindowPart
from ..session import Session

EVERY = 3.0  # seconds between looks
_Stamp = tuple[int, int] | None  # time of the last change, nanoseconds, and size; None: not there


@dataclass(frozen=True)
class Seen:
    """The files of a scan at one moment, by when and how large each was, and the folders that they lie in."""

    files: Mapping[Path, _Stamp]
    folders: Mapping[Path, _Stamp]

    @classmethod
    def of(cls, scan: str, files: Iterable[Path], before: Seen | None = None) -> Seen:
        """How the files are. scan: as the user named it. before: at the last look; where a folder has changed
        since, the scan's files are looked for anew."""
        there = list(files if before is None else before.files)
        folders = {folder: _stamp(folder) for folder in dict.fromkeys(file.parent for file in there)}
        if before is not None and folders != before.folders:
            with suppress(InputError):  # as where the only file is being replaced
                there = list(find_source(scan).files)
        return cls({file: _stamp(file) for file in there}, folders)


@dataclass(eq=False)
class Changes(WindowPart):
    """Looks whether the open scan's files are as they were when it was opened."""

    name = "changes"
    doing = "Looking for changes"
    session: Session
    note_of_scan: Callable[[str], None]
    open_scan: Callable[[str], None]

    def __post_init__(self) -> None:
        self._files: Sequence[Path] = ()
        self._known: Seen | None = None  # as they were when the scan was opened, or reading was offered
        self._last: Seen | None = None  # as they were at the last look
        self._look: Future[Seen] | None = None
        self._next = 0.0  # by the clock, when to look again

    def begin_scan(self, timeline: Timeline) -> None:
        """Look at the files of another scan from now on."""
        self._files, self._known, self._last, self._look, self._next = timeline.files, None, None, None, 0.0

    def advance(self, now: float) -> None:
        """Take in what was found, and look again after a while. now: by the clock, seconds.

        What is still being written is left alone: nothing is offered before two looks have found the same.
        """
        if self._look is not None and self._look.done():
            found, self._look, self._next = self._look.result(), None, now + EVERY
            is_still, self._last = self._last is not None and found.files == self._last.files, found
            if self._known is None:
                self._known = found
            elif is_still and found.files != self._known.files and None not in found.files.values():
                self._offer(len(found.files) - len(self._known.files))
                self._known = found
        if self._look is None and self._files and now >= self._next:
            scan, files, last = self.session.scan, self._files, self._last
            self._look = in_background(Task("Looking for changes"), lambda: Seen.of(scan, files, last))

    def _offer(self, new: int) -> None:
        """Offer to read the scan again. new: how many files it has more."""
        scan = self.session.scan
        choices = {"Reload": lambda: self.open_scan(scan)}
        text = (
            f"The scan has {new} new file{'s' * (new > 1)} on disk."
            if new > 0
            else "Another program has changed files of the scan."
        )
        self.note_of_scan(Offer(text, choices, "changes"))


def _stamp(path: Path) -> _Stamp:
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size
