"""The plan of a frame: what its request comes to, and whether all is there to draw it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

from ..backends import Derived, missing_source
from ..errors import InputError, Scan4DError
from ..gpu.pose import GpuPose
from ..view import View
from .jobs import Preparation, Stage
from .renderer import Renderer
from .request import Request, colorable, fallback, view_of
from .steps import derived_key, next_step


class Effort(Enum):
    """The work that a plan may begin for missing data."""

    NONE = "none"  # look only
    BEGIN = "begin"  # let workers begin, wait for nothing
    WAIT = "wait"  # make everything now


@dataclass(frozen=True, eq=False)
class Resolved:
    """A request with everything that follows from it.

    view: None in a plan without a size. start: by the performance counter, when the plan was begun.
    """

    request: Request
    pose: GpuPose
    view: View | None
    start: float

    @property
    def size(self) -> tuple[int, int]:
        """The size of the picture, pixels."""
        assert self.view is not None, "a plan to draw must have a size"
        return self.view.size


@dataclass(frozen=True, eq=False)
class Ready(Resolved):
    """A plan that can be drawn. derived: what the backend derived."""

    derived: Derived | None = None


@dataclass(frozen=True, eq=False)
class Waiting(Resolved):
    """A plan that lacks data. stage: the next to be made. why: as users read it."""

    stage: Stage = Stage.UPLOAD
    why: str = ""

    @cached_property
    def stand_in(self) -> Ready:
        """The plan of plain points in the same view, which need no preparation."""
        return Ready(fallback(self.request), self.pose, self.view, self.start)


@dataclass(frozen=True, eq=False)
class Failed:
    """A plan that the scan or the parameters do not allow."""

    request: Request
    error: BaseException


Plan = Ready | Waiting | Failed


def make_plan(
    renderer: Renderer,
    request: Request,
    size: tuple[int, int] | None,
    effort: Effort = Effort.WAIT,
    upload_ms: float | None = None,
) -> Plan:
    """Resolve a request for a picture of this size, pixels, and make or order what it lacks.

    size: None leaves out what depends on the view. upload_ms: how long to upload the arrays that the picture
    reads; the plan waits while some are missing. A window calls this again and again, so that neither
    uploads nor preparation stop it. None: arrays are uploaded when drawing reads them.
    """
    try:
        return _plan(renderer, request, size, effort, upload_ms)
    except Scan4DError as error:
        return Failed(request, error)


def _plan(
    renderer: Renderer,
    request: Request,
    size: tuple[int, int] | None,
    effort: Effort,
    upload_ms: float | None,
) -> Plan:
    start, may_begin = time.perf_counter(), effort is not Effort.NONE
    if may_begin:
        renderer.gpu.timers.start_frame()
    resident = renderer.draw(request.pose) if may_begin else renderer.find(request.pose)
    _check(request, resident.gpu_pose)
    view = None if size is None else view_of(request, size)
    resolved = (request, resident.gpu_pose, view, start)
    key = derived_key(request, view)
    if may_begin:
        resident.jobs.drop_passed(None if key is None else key.view)

    def is_done(step: Preparation) -> bool:
        return may_begin and renderer.work.do(resident, step, effort is Effort.WAIT)

    step = next_step(resident, request, view)
    if step is not None and step.stage is Stage.MERGE and is_done(step):
        step = next_step(resident, request, view)
    is_merged = step is None or step.stage is not Stage.MERGE
    if upload_ms is not None and is_merged and not _upload(resident.gpu_pose, request, view, upload_ms):
        return Waiting(*resolved, Stage.UPLOAD, "Uploading")
    while step is not None and is_done(step):
        step = next_step(resident, request, view)
    if step is None:
        return Ready(*resolved, None if key is None else resident.find(key, used=may_begin))
    job = resident.jobs.running(step.key)
    if job is not None and job.error is not None:
        return Failed(request, job.error)
    return Waiting(*resolved, step.stage, step.name)


def _check(request: Request, pose: GpuPose) -> None:
    """Raise InputError for layers that do not fit the pose, colours by a number that nothing has, or more
    points than the backend takes."""
    if pose.is_split and not (request.draws_samples or request.backend.takes_parts):
        raise InputError(
            f"has {request.pose.count:,} points in one pose, but {request.backend.title} can draw only "
            f"{pose.gpu.max_points:,} on this driver",
            hint="Choose the renderer Points, split the scan, or thin it out",
        )
    request.layers.check(request.pose)
    if colorable(request) is not request:
        names = request.layers.names(request.pose.overview.scalars)
        raise missing_source(request.look.color_by, request.backend, names)


def _upload(pose: GpuPose, request: Request, view: View | None, upload_ms: float) -> bool:
    """Upload what the picture reads of the pose; whether all of it is there."""
    if view is not None:
        pose.center(view.origin)
    return pose.upload(pose.names_of(request.reads), upload_ms)
