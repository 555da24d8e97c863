"""Opening a scan beside the window: the shown one stays until the first pose of the other is there."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import Future, wait
from typing import NamedTuple

from ...document.recording import fingerprint
from ...errors import InputError, Scan4DError
from ...scan.pose import Pose
from ...scan.spacing import spacings
from ...scan.timeline import Timeline
from ...task import Cancelled, Task, checkpoint, in_background

log = logging.getLogger(__name__)
_MANY = 200_000  # points, of which facts take longer to find than a window may stop for


def find_facts(pose: Pose) -> None:
    """Find what drawing asks of a large pose, on the thread that has read it."""
    if len(pose.cloud) > _MANY:
        pose.cloud.bounds()
        spacings(pose.cloud)


class Opened(NamedTuple):
    """A scan that can be shown, and its `fingerprint`, which takes a moment for a large file."""

    timeline: Timeline
    hash: Future[str | None]


def begin(timeline: Timeline) -> Opened:
    """Have its poses come with their facts, and find its hash in the background."""
    timeline.finish = find_facts
    return Opened(timeline, in_background(Task("Hashing"), lambda: fingerprint(timeline.files)))


class Opening:
    """Opens one scan at a time.

    scan: the one being opened, as the user named it. task: how far that is. Both None where there is none.
    """

    def __init__(self) -> None:
        self.scan: str | None = None
        self.task: Task | None = None
        self._future: Future[Opened] | None = None

    def start(self, scan: str, title: str, index: int, open_it: Callable[[], Timeline]) -> None:
        """Open a scan instead of any other that is being opened. index: the frame to read first."""
        self.cancel()
        self.scan, self.task = scan, Task(f"Opening {title}")
        self._future = in_background(self.task, lambda: _opened(open_it, index))

    def cancel(self) -> None:
        """Give up what is being opened."""
        if self.task is not None and self._future is not None:
            self.task.cancel()
            self._future.add_done_callback(_close_unclaimed)  # at once where it is ready
        self.scan = self.task = self._future = None

    def take(self) -> tuple[str, Opened] | None:
        """What was opened, and its name, once; None while nothing is ready. Raises Scan4DError."""
        scan, future = self.scan, self._future
        if scan is None or future is None or not future.done():
            return None
        self.scan = self.task = self._future = None
        try:
            return scan, future.result()
        except Scan4DError:
            raise
        except Exception as error:  # whatever a file brings, the window stays
            log.debug("cannot open %s", scan, exc_info=error)
            raise InputError(f"cannot be opened ({type(error).__name__}: {error})", scan) from error


def _close_unclaimed(future: Future[Opened]) -> None:
    """Close a scan that was opened in spite of being cancelled."""
    if future.exception() is None:
        future.result().timeline.close()


def _opened(open_it: Callable[[], Timeline], index: int) -> Opened:
    """A scan whose frame `index` is in memory and whose hash is known.

    Raises InputError where it has no frame that can be shown.
    """
    opened = begin(timeline := open_it())
    try:
        checkpoint()
        timeline.pose(min(index, len(timeline) - 1))
    except InputError:
        if len(timeline) == 1:
            timeline.close()
            raise
    except Cancelled:
        timeline.close()
        raise
    wait([opened.hash])
    return opened
