"""Has every point of the reference frame followed beside the window, and keeps what was found."""

from __future__ import annotations

from dataclasses import dataclass

from ....analysis.motion.followed_points import FollowedPoints
from ....document.recording import followed_points
from ....errors import InputError
from ....scan.timeline import Timeline
from ....task import Task, announce, checkpoint, over
from ...tool_context import ToolContext


@dataclass(eq=False)
class PointsWork:
    """Points as far as a thread of its own has followed them. points: None before the reference frame was
    read. problem: why there are none."""

    timeline: Timeline
    reference: int
    points: FollowedPoints | None = None
    problem: str = ""

    @property
    def is_whole(self) -> bool:
        """Whether the points are known in all frames."""
        return self.points is not None and self.points.is_whole

    def find(self) -> None:
        """Follow the points through what is not known yet. Raises Cancelled, and InputError."""
        try:
            if self.points is None:
                import scipy.spatial  # noqa: F401  before a second thread imports it

                announce("Reading the reference frame")
                self.points = followed_points(self.timeline, self.reference)
                over()
            for _ in self.points.find():
                checkpoint(len(self.points.known) / len(self.timeline))
        except InputError as error:
            self.problem = str(error)
            raise


class PointFollower:
    """Has the points of the open scan followed.

    work: that goes on, or has ended; None before the first. is_stopped: whether the user has cancelled it,
    until something else is asked for or `resume` is called.
    """

    def __init__(self, context: ToolContext) -> None:
        self._context = context
        self.work: PointsWork | None = None
        self.is_stopped = False
        self._task: Task | None = None
        self._seen = 0

    @property
    def points(self) -> FollowedPoints | None:
        """The points as far as they are known."""
        return None if self.work is None else self.work.points

    @property
    def known(self) -> frozenset[int]:
        """The frames in which the points are known."""
        return frozenset() if self.points is None else self.points.known

    def resume(self) -> None:
        """Go on after the user has cancelled it, or after a problem."""
        self.is_stopped = False
        if self.work is not None and self.work.problem:
            self.work = None

    def advance(self, reference: int, is_wanted: bool) -> bool:
        """Have the points of a frame followed; whether there is something new.

        is_wanted: whether to begin, or to go on; what has begun goes on by itself.
        """
        work, timeline = self.work, self._context.timeline
        if self._task is not None and not any(one.task is self._task for one in self._context.works):
            self.is_stopped |= self._task.cancelled
            self._task = None
        if work is not None and (work.timeline is not timeline or work.reference != reference):
            if self._task is not None:
                self._task.cancel()
            work, self.is_stopped, self._task = None, False, None
        if work is None and is_wanted:
            work = PointsWork(timeline, reference)
        has_changed, self.work = work is not self.work, work
        is_over = work is None or work.is_whole or self.is_stopped or bool(work.problem)
        if work is not None and is_wanted and self._task is None and not is_over:
            self._task = self._context.run("Following points", work.find, lambda _: None)
        before, self._seen = self._seen, len(self.known)
        return has_changed or before != self._seen
