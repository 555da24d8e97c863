"""Has every point of the reference frame followed beside the window, and keeps what was found."""

from __future__ import annotations

from dataclasses import dataclass

from ....analysis.motion.followed_points import FollowedPoints
from ....document.recording import followed_points
from ....errors import InputError
from ....scan.timeline import Timeline
from ....task import announce, checkpoint, over
from ...tool_context import ToolContext
from .._resumed import Resumed


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


class PointFollower(Resumed[PointsWork]):
    """Has the points of the open scan followed."""

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context, "Following points")
        self._seen = 0

    @property
    def points(self) -> FollowedPoints | None:
        """The points as far as they are known."""
        return None if self.work is None else self.work.points

    @property
    def known(self) -> frozenset[int]:
        """The frames in which the points are known."""
        return frozenset() if self.points is None else self.points.known

    def advance(self, reference: int, is_wanted: bool) -> bool:
        """Have the points of a frame followed; whether there is something new. is_wanted: see `take`."""
        timeline = self._context.timeline

        def is_same(work: PointsWork) -> bool:
            return work.timeline is timeline and work.reference == reference

        has_changed = self.take(is_same, lambda: PointsWork(timeline, reference), is_wanted)
        before, self._seen = self._seen, len(self.known)
        return has_changed or before != self._seen
