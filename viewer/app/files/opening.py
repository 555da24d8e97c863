"""Opening a scan beside the window: the shown one stays until the first pose of the other is there."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from concurrent.futures import Future, wait
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import NamedTuple

from ...document.recording import fingerprint
from ...document.saved_session import SavedSession, stored
from ...errors import InputError, Scan4DError
from ...scan.pose import Pose
from ...scan.spacing import spacings
from ...scan.timeline import Timeline
from ...task import Cancelled, Task, checkpoint, in_background
from ..session import known_as

log = logging.getLogger(__name__)
_MANY = 200_000  # points, of which facts take longer to find than a window may stop for


def find_facts(pose: Pose, of_points: bool = False, is_first: bool = False) -> None:
    """Find what drawing asks of a large pose, on the thread that has read it.

    of_points: whether its points are drawn, so that those of range views are merged. is_first: whether the
    first view of the scan may be made of it.
    """
    if is_first:
        pose.upright  # noqa: B018, found once
    large = pose.count > _MANY
    if large:
        pose.overview.bounds()
    if of_points or pose.is_merged:
        cloud = pose.cloud
        if large:
            spacings(cloud)


class Opened(NamedTuple):
    """A scan that can be shown.

    hash: its `fingerprint`, which takes a moment for a large file. first: the frame to begin with. left: how
    it was left, None where it was never open. problem: why that cannot come back. session: what the user
    opens it with, None where that is the scan alone. reading: the corrections that it was opened with.
    """

    timeline: Timeline
    hash: Future[str | None]
    first: int
    left: SavedSession | None
    problem: str | None
    session: SavedSession | None
    reading: Mapping[str, str]


class Way(NamedTuple):
    """How to open a scan.

    find: finds how it was left, and may raise InputError. open_it: opens it, with corrections of how Scan4D
    reads it. session: to open it with; None: as it was left. stated: corrections of the command line, which
    win over those of the document. must_correct: whether it is not to be opened without its corrections.
    """

    find: Callable[[], SavedSession | None]
    open_it: Callable[[Mapping[str, str]], Timeline]
    session: SavedSession | None = None
    stated: Mapping[str, str] = MappingProxyType({})
    must_correct: bool = False


def begin(way: Way, check: Callable[[Timeline, int], int] = lambda _, first: first) -> Opened:
    """Open a scan as it was left, have its poses come with their facts, and find its hash in the background.

    check: finds the frame to begin with, and may raise InputError. Where the scan cannot be opened with the
    corrections of its document, it is opened without them, and the problem says so. Raises InputError.
    """
    left, problem = None, None
    try:
        left = way.find()
    except InputError as error:
        problem = str(error)
    begins = way.session or left
    first, own = (0, {}) if begins is None else (begins.pose, begins.document.reading)

    def opened(reading: Mapping[str, str]) -> Opened:
        timeline = way.open_it(reading)
        timeline.finish = partial(find_facts, is_first=True)
        try:
            found = check(timeline, min(first, len(timeline) - 1))
        except (InputError, Cancelled):
            timeline.close()
            raise
        hash = in_background(Task("Computing the checksum"), lambda: fingerprint(timeline.files))
        return Opened(timeline, hash, found, left, problem, way.session, reading)

    both = {**own, **way.stated}
    try:
        return opened(both)
    except InputError as error:
        if both == way.stated or way.must_correct:
            raise
        ours = opened(way.stated)
        what = (
            f"Scan4D cannot read the scan with the saved corrections, so it ignores the corrections: {error}"
        )
        return ours._replace(problem=what)


def find_stored(scan: str, up: str | None) -> SavedSession | None:
    """Find what is kept of a scan. up: the up axis that the command line states. Raises InputError where that
    is damaged."""
    found = stored(known_as(scan))
    return found if found is None or up is None else replace(found, document=found.document.with_up(up))


class Opening:
    """Opens one scan at a time.

    scan: the one being opened, as the user named it. task: how far that is. Both None where there is none.
    """

    def __init__(self) -> None:
        self.scan: str | None = None
        self.task: Task | None = None
        self._future: Future[Opened] | None = None

    def start(self, scan: str, title: str, way: Way) -> None:
        """Open a scan instead of any other that is being opened."""
        self.cancel()
        self.scan, self.task = scan, Task(f"Opening {title}")
        self._future = in_background(self.task, lambda: _opened(way))

    def cancel(self) -> None:
        """Give up what is being opened."""
        if self.task is not None and self._future is not None:
            self.task.cancel()
            self._future.add_done_callback(_close_unclaimed)  # at once where it is ready
        self.scan = self.task = self._future = None

    def take(self) -> tuple[str, Opened] | None:
        """Take what was opened, and its name, once; None while nothing is ready. Raises Scan4DError."""
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


def _opened(way: Way) -> Opened:
    """A scan of which a frame is in memory, the one to begin with or the next that can be read, and whose
    hash is known.

    Raises InputError where it has no frame that can be read.
    """
    opened = begin(way, read_from)
    wait([opened.hash])
    return opened


def read_from(timeline: Timeline, first: int) -> int:
    """The first frame from one on, round the end, that can be read; it is in memory then.

    Raises InputError where none can: that of the first one tried, which tells of how many.
    """
    count = len(timeline)
    problem: InputError | None = None
    for tried in range(count):
        checkpoint(tried / count if tried else None)
        index = (first + tried) % count
        try:
            timeline.pose(index)
        except InputError as error:
            problem = problem or error
        else:
            return index
    assert problem is not None  # a timeline has a frame
    if count == 1:
        raise problem
    raise InputError(
        f"Scan4D cannot read any of the {count} frames. The first problem: {problem}", timeline.name
    )
