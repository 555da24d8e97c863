"""What the frames of the open scan fill together: the view is fitted to all that are known."""

from __future__ import annotations

import threading
from concurrent.futures import Future
from contextlib import suppress

from ...bounds import Bounds
from ...errors import InputError
from ...scan.pose import Pose
from ...scan.timeline import Timeline
from ...task import Task, checkpoint, in_background

_VISITED = 5  # frames, spread over the scan, that are read for it


class Extent:
    """Gathers the bounds of frames as these are read, and of a few that are visited for it.

    Poses count as they are stored, whatever tools move them to.
    """

    def __init__(self) -> None:
        self._known: dict[int, Bounds] = {}  # by frame; replaced as a whole, so that any thread may read it
        self._state = threading.Lock()  # held by whoever adds to it
        self._timeline: Timeline | None = None
        self._visiting: tuple[Task, Future[None]] | None = None

    def begin(self, timeline: Timeline) -> None:
        """Gather of another scan from now on, also where others read it."""
        self.close()
        self._timeline, self._known = timeline, {}
        find = timeline.finish

        def finish(pose: Pose) -> None:
            find(pose)
            self._note(timeline, pose)

        timeline.finish = finish

    def _note(self, timeline: Timeline, pose: Pose) -> None:
        with suppress(InputError):  # without any point
            bounds = pose.bounds
            with self._state:
                if timeline is self._timeline:
                    self._known = {**self._known, pose.index: bounds}

    def around(self, bounds: Bounds) -> Bounds:
        """The box around these bounds, of the frame that is shown, and those of all known frames but such as
        are astray."""
        return Bounds.of_frames(bounds, [*self._known.values()])

    def visit(self) -> None:
        """Read a few frames beside the window, those that were not read yet."""
        timeline = self._timeline
        if timeline is None or len(timeline) == 1 or self._visiting is not None:
            return
        last = len(timeline) - 1
        spread = dict.fromkeys(last * step // (_VISITED - 1) for step in range(_VISITED))

        def work() -> None:
            for index in spread:
                checkpoint()
                if index not in self._known:
                    with suppress(InputError):
                        self._note(timeline, timeline.visit(index))

        task = Task("Finding the size of the scan")
        self._visiting = task, in_background(task, work)

    def take_visited(self) -> bool:
        """Whether the frames that were to be visited have been, reported once."""
        if self._visiting is None or not self._visiting[1].done():
            return False
        task, done = self._visiting
        self._visiting = None
        if not task.cancelled:
            done.result()
        return True

    def close(self) -> None:
        """Stop visiting."""
        if self._visiting is not None:
            self._visiting[0].cancel()
            self._visiting = None
