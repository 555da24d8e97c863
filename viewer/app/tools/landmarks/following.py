"""Landmarks tracked beside the window: only what has changed, and first the frame that is looked at."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence

from ....analysis.landmarks import Landmark
from ....analysis.track import Track
from ....analysis.tracking import Tracker
from ....document.landmarks import Landmarks
from ....scan.timeline import Timeline
from ....task import Task
from ...tool_context import ToolContext

_CALM = 0.2  # seconds without a change of the landmarks before they are tracked anew


class Following:
    """Has the landmarks of the open scan tracked, and tells all tools (`context.followed`).

    is_stopped: whether the user has cancelled it, until landmarks change or `resume` is called. pending: how
    many of the tracks have frames that nobody has looked at yet.
    """

    def __init__(self, context: ToolContext) -> None:
        self._context = context
        self.is_stopped = False
        self.pending = 0
        self._timeline: Timeline | None = None
        self._landmarks: Sequence[Landmark] | None = None
        self._tracker: Tracker | None = None
        self._task: Task | None = None
        self._is_done = False
        self._begins_at = 0.0  # by the clock
        self._looked_at = -1
        self._waiting: tuple[object, Mapping[str, Track]] = None, {}

    @property
    def is_running(self) -> bool:
        """Whether landmarks are being tracked."""
        return any(work.task is self._task for work in self._context.works)

    def resume(self) -> None:
        """Go on after the user has cancelled it."""
        self.is_stopped, self._begins_at = False, 0.0

    def advance(self, is_wanted: bool) -> bool:
        """Take in what was found, and have done what is left to do; whether there is something new.

        is_wanted: whether anything is to be tracked now.
        """
        timeline, landmarks = self._context.timeline, self._context.document.part(Landmarks).all
        if self._task is not None and not self.is_running:
            self.is_stopped |= self._task.cancelled
            self._is_done, self._task = not self._task.cancelled, None
        if timeline is not self._timeline or landmarks is not self._landmarks:
            if self._task is None:
                self._take_up(timeline, landmarks)
            else:
                self._task.cancel()  # what it has found is taken over when it has come to an end
        if self._tracker is not None:
            self._go_on(self._tracker, is_wanted)
        is_same = timeline is self._timeline  # else what is there is of the scan before
        found: Mapping[str, Track] = self._tracker.tracks if self._tracker and is_same else {}
        changed = self._context.followed.take_tracks({**found, **self._placed(timeline, landmarks, found)})
        if changed:
            self.pending = sum(not track.is_whole for track in found.values())
        is_left = self.pending > 0 and not (self._is_done or self.is_stopped)
        self._context.followed.is_following = self.is_running or (is_wanted and is_left)
        return changed

    def _placed(
        self, timeline: Timeline, landmarks: Sequence[Landmark], found: Mapping[str, Track]
    ) -> Mapping[str, Track]:
        """The tracks of landmarks that wait for others to be let go of: what was placed of them."""
        waiting = tuple(one for one in landmarks if one.keys and one.name not in found)
        of = timeline, waiting
        if of != self._waiting[0]:
            self._waiting = of, Tracker(timeline, waiting).tracks if waiting else {}
        return self._waiting[1]

    def _take_up(self, timeline: Timeline, landmarks: Sequence[Landmark]) -> None:
        """Begin with other landmarks, and keep what still holds of the same scan."""
        known = self._tracker if timeline is self._timeline else None
        self._timeline, self._landmarks = timeline, landmarks
        self._tracker, self._is_done, self.is_stopped = None, False, False
        self._begins_at = time.monotonic() + _CALM
        if any(landmark.keys for landmark in landmarks):
            self._looked_at = self._context.index
            points = self._context.followed.points
            carry = None if points is None else points.carried
            self._tracker = Tracker(timeline, landmarks, first=self._looked_at, known=known, carry=carry)

    def _go_on(self, tracker: Tracker, is_wanted: bool) -> None:
        if self._context.index != self._looked_at:
            self._looked_at = self._context.index
            tracker.look_at(self._looked_at)
        waits = self.is_stopped or self._is_done or time.monotonic() < self._begins_at
        if is_wanted and self._task is None and not waits:
            if not self.pending:
                self._is_done = True
                return

            def follow() -> None:
                for _ in tracker.run():
                    pass

            self._task = self._context.run("Tracking landmarks", follow, lambda _: None)
