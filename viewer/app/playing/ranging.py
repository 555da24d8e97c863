"""The range of colours over all frames, gathered as these are read, and beside the window at rest."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import Future
from dataclasses import dataclass, replace

from ...drawing.request import Request
from ...look import Look, is_open_range, with_range
from ...scan.pose import Pose
from ...scan.ranges import ValueRanges
from ...scan.timeline import Timeline
from ...task import Task, checkpoint, in_background
from ..part import WindowPart
from ..scene.activity import Activity
from ..session import Session

_LOOK = 0.2  # seconds between looks at whether the work goes on, or shall stop
_PAUSE = 0.5  # the same between pictures that show what has come meanwhile


@dataclass(eq=False)
class Ranging(WindowPart):
    """Finds what the colour map spans where the look leaves that to the frames.

    Frames come as they are read. The others are visited one by one on a thread, spread over the scan, while
    nothing plays or moves. Of numbers that tools lay, and heights of what they move, the frames that were
    shown are known.
    """

    name = "ranging"
    doing = "Finding the colour range"
    OFFERS = {"range_note": "words"}
    session: Session
    activity: Activity

    def __post_init__(self) -> None:
        self._timeline: Timeline | None = None
        self._ranges = ValueRanges(1)
        self._laid = self.session.laid.version
        self._wanted: Look | None = None  # that frames of the scan alone tell the range of
        self._is_idle = threading.Event()
        self._visiting: tuple[Look, Task, Future[None]] | None = None
        self._shown = 0, 0.0  # how many frames were known to what was drawn, and when by the clock

    def begin_scan(self, timeline: Timeline) -> None:
        """Gather of another scan from now on, also where others read it."""
        self.close()
        self._timeline, self._wanted = timeline, None
        self._ranges = ValueRanges(len(timeline))
        find = timeline.finish

        def finish(pose: Pose) -> None:
            find(pose)
            wanted = self._wanted
            if wanted is not None and self._timeline is timeline:
                self._ranges.take(pose, wanted)

        timeline.finish = finish

    def ranged(self, request: Request) -> Request:
        """The request with the ends of the colour map as far as they are known."""
        look, laid, pose = request.look, self.session.laid, request.pose
        if laid.version != self._laid:
            self._laid, self._ranges = laid.version, ValueRanges(self._ranges.count)
        chosen, layers = self.session.document.look, request.layers
        is_laid = chosen.color_by in laid.names or not layers.world_from_pose.is_identity
        self._wanted = None if is_laid or not is_open_range(chosen) else chosen
        if not is_open_range(look) or self._ranges.count == 1:
            return request
        self._ranges.take(pose, look, layers)
        return replace(request, look=with_range(look, self._ranges.range(look)))

    def words(self) -> str:
        """Words of the colour bar while not all frames are known; empty once they are."""
        look, count = self.session.document.look, self._ranges.count
        known = self._ranges.known(look)
        return (
            f"colour range of {known} of {count} frames" if is_open_range(look) and 0 < known < count else ""
        )

    def advance(self, now: float) -> bool:
        """Go on while nothing else reads or draws; whether there is more to show."""
        (self._is_idle.set if self.activity.is_idle else self._is_idle.clear)()
        wanted, timeline, ranges = self._wanted, self._timeline, self._ranges
        if self._visiting is not None:
            look, task, work = self._visiting
            if work.done() and not task.cancelled:
                self._visiting = None
                work.result()
            elif look != wanted:
                self.close()
        known = 0 if wanted is None else ranges.known(wanted)
        if self._visiting is None and wanted is not None and timeline is not None and known < ranges.count:
            task = Task("Finding the colour range")
            order = self._order(ranges.count)
            work = in_background(task, lambda: ranges.gather(timeline, wanted, order))
            self._visiting = wanted, task, work
        before, shown_at = self._shown
        if known == before or (known < ranges.count and now < shown_at + _PAUSE):
            return False
        self._shown = known, now
        return True

    def _order(self, count: int) -> Iterator[int]:
        """All frames, spread ever more closely, each when there is time for it."""
        digits = (count - 1).bit_length()
        for index in sorted(range(count), key=lambda index: f"{index:0{digits}b}"[::-1]):
            while not self._is_idle.wait(_LOOK):
                checkpoint()
            checkpoint()
            yield index

    def close(self) -> None:
        """Stop visiting."""
        if self._visiting is not None:
            self._visiting[1].cancel()
            self._visiting = None
