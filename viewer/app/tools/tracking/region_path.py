"""The mean path of a painted region, found beside the window once the points are known in all frames."""

from __future__ import annotations

from collections.abc import Mapping

from ....analysis.measures import Series
from ....analysis.motion.axes import anatomical_axes
from ....analysis.motion.curves import path_curves
from ....analysis.motion.displacements import MeanPath
from ....analysis.motion.followed_points import FollowedPoints
from ....task import Task
from ...tool_context import ToolContext
from .._cached import Cached
from .._painting import Sphere, painted_region


class RegionPath:
    """The path of the region as it was asked for last. path: None before it is known."""

    def __init__(self, context: ToolContext) -> None:
        self._context = context
        self._cached = Cached()
        self._of: tuple[object, ...] | None = None
        self._task: Task | None = None
        self.path: MeanPath | None = None

    def advance(self, points: FollowedPoints | None, spheres: tuple[Sphere, ...]) -> None:
        """Have the path found. points: that are known in all frames; None where they are not."""
        of = None if points is None or not spheres else (points, spheres)
        if of == self._of:
            return
        if self._task is not None:
            self._task.cancel()
        self._of, self.path, self._task = of, None, None
        if points is None or of is None:
            return

        def take(path: MeanPath) -> None:
            if self._of == of:
                self.path = path

        find = points.mean_path
        self._task = self._context.run("Averaging a path", lambda: find(painted_region(spheres)), take)

    def curves(self, start: int) -> Mapping[str, Series]:
        """The curves of the path from a frame on, as the scan is shown: as recorded, or stabilised."""
        path, still, times = self.path, self._context.followed.still, self._context.timeline.times
        up, front = self._context.document.look.up, self._context.document.front
        key = "curves", start, up, front

        def make() -> Mapping[str, Series]:
            if path is None:
                return {}
            return path_curves(path, start, times, anatomical_axes(up, front), still)

        self._cached.forget_others({key})
        return self._cached.of(key, (path, still, times), make)
