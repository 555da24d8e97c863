"""The jobs of one pose: what workers make for its pictures."""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import Enum
from typing import Any, NamedTuple

from ..helper import Job

_START = 0.4  # seconds that a process takes to start


class Stage(Enum):
    """The work that a picture may wait for, in order."""

    MERGE = "merge"  # the points of range views become one cloud
    UPLOAD = "upload"  # the arrays that the backend reads go to the GPU
    ESTIMATE = "estimate"  # normals and radii that the scan lacks
    FORESEE = "foresee"  # facts about the points, where pictures wait for them
    DERIVE = "derive"  # what the backend prepares for the pose
    DERIVE_VIEW = "derive for the view"  # what the backend prepares for one view of the pose


class DerivedKey(NamedTuple):
    """Key of derived data. what: the backend and its parameters. view: None where any view can use it."""

    what: tuple[Any, ...]
    view: tuple[object, ...] | None


class Preparation(NamedTuple):
    """The next work that a picture needs."""

    stage: Stage
    key: Any  # of the job, among those of its pose
    name: str  # as users read it
    function: Callable[..., Any]
    args: Callable[[], tuple[Any, ...]]  # made when the work begins
    take: Callable[[Any], object]  # takes in the result, on the GL thread
    on_thread: bool = False  # see `Workers.begin`


class Begun(NamedTuple):
    """A job that a worker has, or that waits for one."""

    job: Job
    take: Callable[[Any], object]  # takes in the result, on the GL thread
    at: float  # by the clock, when it was asked for


class Jobs(dict[Any, Begun]):
    """The jobs of one pose by key. since: by the clock, when the first of them began; NaN without any."""

    since = math.nan

    def note(self, key: Any, begun: Begun) -> Begun:
        """Take in a job that was begun."""
        if math.isnan(self.since):
            self.since = begun.at
        self[key] = begun
        return begun

    def running(self, key: Any) -> Job | None:
        """The job of this key, finished or not, unless it was cancelled."""
        begun = self.get(key)
        return None if begun is None or begun.job.task.cancelled else begun.job

    def drop_passed(self, view: object) -> None:
        """Drop the jobs for all other views, finished ones too. A process that has just started goes on,
        since cancelling ends it."""
        for key, (job, *_) in list(self.items()):
            passed = isinstance(key, DerivedKey) and key.view not in (None, view)
            if passed and (job.future.done() or job.drop() or job.task.seconds > _START):
                self.cancel(key)

    def drop_waiting(self) -> None:
        """Drop the jobs that have not begun."""
        for key, (job, *_) in list(self.items()):
            if job.drop():
                del self[key]
        if not self:
            self.since = math.nan

    def drop_others(self, wanted: set[int], is_urgent: bool, turned: float) -> None:
        """Drop the jobs that are not wanted. wanted: ids of jobs. is_urgent: whether wanted jobs wait; then
        running jobs that were asked for before `turned` end, too."""
        for key, (job, _, at) in list(self.items()):
            if id(job) in wanted or job.future.done():
                continue
            if job.drop() or (is_urgent and at < turned and job.task.seconds > _START):
                self.cancel(key)
                self.since = math.nan

    def cancel(self, key: Any) -> None:
        """End one job."""
        self.pop(key).job.cancel()

    @property
    def unfinished(self) -> list[Job]:
        """The jobs without a result so far."""
        return [job for job, *_ in self.values() if not (job.task.cancelled or job.future.done())]
