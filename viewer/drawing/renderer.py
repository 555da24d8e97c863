"""What lives longer than a frame: the context, the poses on the GPU, and what was prepared for them."""

from __future__ import annotations

import math
import time
import weakref
from collections import OrderedDict, deque
from collections.abc import Callable, Iterable
from concurrent import futures
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from ..backends import Backend, Derived, Derives
from ..errors import InputError
from ..gpu.context import Gpu, headless
from ..gpu.pose import GpuPose
from ..helper import Job, Workers
from ..look import Look, wants_normals
from ..scan.cache import default_budget
from ..scan.estimate import estimate
from ..scan.points import PointCloud
from ..scan.pose import Life, Pose
from ..scan.spacing import spacings
from ..task import Task
from ..view import View

_GIGABYTE = 1 << 30
_VIEWS = 4  # of a pose that what is derived by camera is kept for
_WAYS = 4  # of a pose that what is derived is kept for: backends and parameters
_START = 0.4  # seconds that a process takes to start
_PATIENCE = 0.05  # seconds: a picture late is better than one of points among others
_QUEUED = 3  # jobs for each worker, so that none waits for a turn of the window's loop
_TAKE_SECONDS = 0.01  # that taking in what is ready ahead may take in one turn
_LATELY = 8  # poses that tell how long preparing one takes


@dataclass
class Prepared:
    """Result of a backend's derive function for a pose; None where it derives nothing."""

    derived: Derived | None


class DerivedKey(NamedTuple):
    """Key of derived data. what: the backend and its parameters. view: None where on no camera."""

    what: tuple[Any, ...]
    view: tuple[object, ...] | None


class Want(NamedTuple):
    """A pose and how it is to be drawn. view: None leaves out what is derived for one view alone."""

    pose: Pose
    backend: Backend
    params: Any
    look: Look
    view: View | None


class _Step(NamedTuple):
    """Work to be done next of all that a picture needs.

    key: of the job, within its pose. name: as users read it. args: made when it begins. take: takes the
    result in, on the GL thread. on_thread: see `Workers.begin`.
    """

    key: Any
    name: str
    function: Callable[..., Any]
    args: Callable[[], tuple[Any, ...]]
    take: Callable[[Any], object]
    on_thread: bool = False


class _Begun(NamedTuple):
    """A job, what takes its result in, and when it was asked for, by the clock."""

    job: Job
    take: Callable[[Any], object]
    at: float


@dataclass
class _Resident:
    """life: of the pose as it was given; that of the GpuPose is the same without keeping it alive."""

    life: weakref.ref[Life]
    gpu_pose: GpuPose
    derived: OrderedDict[DerivedKey, Prepared] = field(default_factory=OrderedDict)  # last used last
    jobs: dict[Any, _Begun] = field(default_factory=dict)
    began: float = math.nan  # by the clock, when the first of the jobs did that are not taken in

    def keep(self, key: DerivedKey, prepared: Prepared) -> None:
        """Keep what was derived, in place of what was for the view and with the parameters that were used
        longest ago."""
        self.derived[key] = prepared
        of_views = [other for other in self.derived if other.what == key.what and other.view is not None]
        ways = list(dict.fromkeys(other.what for other in reversed(self.derived)))
        of_ways = [other for other in self.derived if other.what in ways[_WAYS:]]
        for old in of_views[:-_VIEWS] + of_ways:
            _release(self.derived.pop(old))

    def drop_passed(self, view: object) -> None:
        """Drop the jobs of all other views, finished ones too. What has just begun is let finish first, since
        cancelling ends a process."""
        for key, (job, *_) in list(self.jobs.items()):
            passed = isinstance(key, DerivedKey) and key.view not in (None, view)
            if passed and (job.future.done() or job.drop() or job.task.seconds > _START):
                job.cancel()
                del self.jobs[key]

    def drop_waiting(self) -> None:
        """Take what has not begun out of the queue."""
        self.jobs = {key: begun for key, begun in self.jobs.items() if not begun.job.drop()}
        if not self.jobs:
            self.began = math.nan

    @property
    def unfinished(self) -> list[Job]:
        """The jobs whose results are not there yet."""
        return [job for job, *_ in self.jobs.values() if not (job.task.cancelled or job.future.done())]

    @property
    def nbytes(self) -> int:
        """Bytes on the GPU; of what it shares with other poses, its part."""
        derived = sum(p.derived.nbytes for p in self.derived.values() if p.derived)
        return self.gpu_pose.counted_bytes + derived

    @property
    def held_bytes(self) -> int:
        """Bytes on the GPU, and of the estimates that it keeps on the CPU."""
        return self.nbytes + self.gpu_pose.estimated_bytes

    @property
    def current(self) -> Pose:
        """The pose with what was estimated of its points, which this merges."""
        return self.gpu_pose.pose.with_cloud(self.gpu_pose.cloud)

    def release(self) -> None:
        for job, *_ in self.jobs.values():
            job.cancel()
        for prepared in self.derived.values():
            _release(prepared)


class Renderer:
    """Keeps poses on the GPU within `budget_bytes`, with what was estimated and derived of them.

    The pose being drawn always stays; one that nobody else holds any more goes with the next
    frame, so that a timeline's cache bounds what is kept here too.

    gpu: None opens a headless context (raises NoOpenGLError). budget_bytes: None takes 1 GiB on hardware, and
    on software drivers, where it is the same memory that the timeline's cache lives in, half as much as that.
    steps_to: how many poses are drawn before one, as far as known: the farthest one goes first, and of those
    as far the one that was drawn longest ago.
    """

    def __init__(self, gpu: Gpu | None = None, budget_bytes: int | None = None) -> None:
        self.gpu = gpu or headless()
        self.budget_bytes = budget_bytes or (default_budget() // 2 if self.gpu.software else _GIGABYTE)
        self.steps_to: Callable[[Pose], int] = lambda pose: 0
        self._resident: OrderedDict[int, _Resident] = OrderedDict()
        self._drawn = 0  # key of the pose that was asked for last
        self._workers = Workers()
        self._latencies: deque[float] = deque(maxlen=_LATELY)
        self._turned = -math.inf  # by the clock, when other pictures were asked for ahead

    @property
    def nbytes(self) -> int:
        """Bytes that poses hold on the GPU."""
        return sum(r.nbytes for r in self._resident.values())

    @property
    def held_bytes(self) -> int:
        """Bytes that poses hold on the GPU, and of the estimates that are kept on the CPU."""
        return sum(r.held_bytes for r in self._resident.values())

    def bytes_of(self, pose: Pose) -> int:
        """Bytes that one pose holds on the GPU, with what was derived from it and its part of what it shares
        with others; 0 where it is not there."""
        entry = self._resident.get(id(pose.life))
        return 0 if entry is None else entry.nbytes

    def resident(self, pose: Pose) -> GpuPose:
        """The pose on the GPU; its arrays are uploaded when something first reads them."""
        self.gpu.collect()
        entry = self._find(pose)
        self._hold(pose, entry)
        self._drawn = id(pose.life)
        self._resident.move_to_end(self._drawn)
        self._make_room()
        return entry.gpu_pose

    def _hold(self, pose: Pose, entry: _Resident) -> None:
        """Keep what there is of a pose from now on, and let go of those that nobody else holds."""
        for gone in [k for k, r in self._resident.items() if r.life() is None]:
            passed = self._resident.pop(gone)
            entry.gpu_pose.adopt(passed.gpu_pose)
            passed.release()
        self._resident[id(pose.life)] = entry

    def _find(self, pose: Pose) -> _Resident:
        """The entry of a pose, else one without anything."""
        entry = self._resident.get(id(pose.life))
        if entry is None or entry.life() is not pose.life:
            entry = _Resident(weakref.ref(pose.life), GpuPose(self.gpu, replace(pose)))
        return entry

    def _make_room(self) -> None:
        """Let go of what is drawn last of all until the rest is within the budget."""
        while len(self._resident) > 1 and self.held_bytes > self.budget_bytes:
            others = [key for key in self._resident if key != self._drawn]
            farthest = max(others, key=lambda key: self._steps_to(self._resident[key]))
            self._resident.pop(farthest).release()

    def _steps_to(self, entry: _Resident) -> float:
        return math.inf if entry.life() is None else self.steps_to(entry.gpu_pose.pose)

    def merge(self, gpu_pose: GpuPose) -> bool:
        """Have a worker merge the points of range views; whether they are there."""
        return gpu_pose.pose.is_merged or self._do(self._entry(gpu_pose), _merging(gpu_pose), wait=False)

    def prepare(
        self, gpu_pose: GpuPose, backend: Backend, params: Any, look: Look, wait: bool, view: View
    ) -> Prepared | None:
        """Make what a backend and a look need of a pose; None while a worker is still at it.

        First the attributes that the scan does not have are estimated, then the backend's
        derive function runs; only uploads happen on this thread. Without `wait`, both are done by
        `Workers`, before all that was asked of them ahead, so that nothing stops this thread. What was
        cancelled begins anew. Raises InputError where the pose has no range views and the backend needs them.
        """
        entry, want = self._entry(gpu_pose), Want(gpu_pose.pose, backend, params, look, view)
        key = _derived_key(backend, params, view)
        entry.drop_passed(key.view)
        while (step := self._step(entry, want)) is not None:
            if not self._do(entry, step, wait):
                return None
        if backend.derives is Derives.NEVER:
            return Prepared(None)
        entry.derived.move_to_end(key)
        return entry.derived[key]

    def is_prepared(self, want: Want) -> bool:
        """Whether nothing has to be merged, estimated or derived before a picture, or that has failed, as
        drawing it will tell."""
        entry = self._find(want.pose)
        try:
            step = self._step(entry, want)
        except InputError:
            return True
        begun = entry.jobs.get(step.key) if step is not None else None
        return step is None or (begun is not None and begun.job.has_failed)

    def prepare_ahead(self, wants: Iterable[Want], afresh: bool = False) -> None:
        """Have workers make what pictures of these poses need, those named first before others, and take in
        what they have made of any pose.

        A few jobs at a time, and no more than the budget holds beside what is drawn sooner. What waits for
        other pictures is dropped; what a worker is at is let finish and kept. afresh: the pictures are others
        than those of the call before, so that what a worker is at is cancelled where it keeps these waiting.
        """
        if afresh:
            self._turned = time.monotonic()
        self._take_finished()
        wanted: set[int] = set()
        for want in wants:
            entry = self._find(want.pose)
            try:
                step = self._step(entry, want)
            except InputError:  # which drawing it will tell
                continue
            if step is None:
                self._note_prepared(entry)
                continue
            begun = entry.jobs.get(step.key)
            if begun is None or begun.job.task.cancelled:
                if len(self._unfinished) >= _QUEUED * self._workers.count or not self._has_room(want.pose):
                    break
                self._hold(want.pose, entry)
                begun = self._begin(entry, step)
            wanted.add(id(begun.job))
        self._drop_others(wanted)

    def _take_finished(self) -> None:
        """Take in what workers have made of any pose, for as long as a turn of a window's loop may take."""
        end = time.perf_counter() + _TAKE_SECONDS
        for entry in self._resident.values():
            for key, (job, take, at) in list(entry.jobs.items()):
                if time.perf_counter() > end:
                    return
                if job.future.done() and not (job.task.cancelled or job.has_failed):
                    try:
                        self._take(entry, key, job, take)
                    except Exception as error:  # which drawing it will tell
                        entry.jobs[key] = _Begun(job.failed(error), take, at)
        self._make_room()

    def _take(self, entry: _Resident, key: Any, job: Job, take: Callable[[Any], object]) -> None:
        """Take in what a job has made. Raises what it failed with."""
        del entry.jobs[key]
        result, ms = job.future.result()
        entry.gpu_pose.add_ms("derive", ms)
        take(result)

    def _note_prepared(self, entry: _Resident) -> None:
        if not (entry.jobs or math.isnan(entry.began)):
            self._latencies.append(time.monotonic() - entry.began)
            entry.began = math.nan

    @property
    def latency(self) -> float:
        """Seconds from when work on a pose is begun until it is prepared, the least of late; 0 at first."""
        return min(self._latencies, default=0.0)

    def _has_room(self, pose: Pose) -> bool:
        """Whether the budget holds another pose beside those that are drawn sooner than this one."""
        entries, steps = self._resident.values(), self.steps_to(pose)
        sooner = [r.held_bytes for r in entries if r.life() is not pose.life and self._steps_to(r) <= steps]
        largest = max((r.held_bytes for r in entries), default=0)
        return sum(sooner) + largest <= self.budget_bytes

    def _drop_others(self, wanted: set[int]) -> None:
        """Drop the jobs that are not among these: those that wait, and what keeps these waiting where other
        pictures were to be drawn when it was asked for."""
        is_urgent = any(job.is_waiting for job in self._unfinished if id(job) in wanted)
        for entry in self._resident.values():
            for key, (job, _, at) in list(entry.jobs.items()):
                if id(job) in wanted or job.future.done():
                    continue
                if job.drop() or (is_urgent and at < self._turned and job.task.seconds > _START):
                    job.cancel()
                    del entry.jobs[key]
                    entry.began = math.nan

    @property
    def _unfinished(self) -> list[Job]:
        return [job for entry in self._resident.values() for job in entry.unfinished]

    @property
    def unfinished(self) -> int:
        """Number of jobs that workers do or will do."""
        return len(self._unfinished)

    @property
    def preparing(self) -> Task | None:
        """The task that a worker has been at for longest, else one that waits; None where there is none."""
        jobs = sorted(self._unfinished, key=lambda job: (job.is_waiting, -job.task.seconds))
        return jobs[0].task if jobs else None

    def _entry(self, gpu_pose: GpuPose) -> _Resident:
        return next(r for r in self._resident.values() if r.gpu_pose is gpu_pose)

    def _step(self, entry: _Resident, want: Want) -> _Step | None:
        """The work to be done next for a picture; None where all is there."""
        gpu_pose, (_, backend, params, look, view) = entry.gpu_pose, want
        draws_samples = backend.draws_samples(gpu_pose.pose, params)
        if not (gpu_pose.pose.is_merged or draws_samples):
            return _merging(gpu_pose)
        missing = _missing(gpu_pose, backend, params, look)
        if missing:
            name = f"Estimating {' and '.join(missing)}"
            args = lambda: (_bare(entry.current), missing)  # noqa: E731
            return _Step(missing, name, estimate, args, gpu_pose.add_estimates)
        if backend.derives is Derives.NEVER or (backend.derived_by_camera and view is None):
            return None
        key = _derived_key(backend, params, view)
        if key in entry.derived:
            return None

        def derive_args() -> tuple[Any, ...]:
            pose = gpu_pose.pose if draws_samples else entry.current
            return pose, params, view if backend.derived_by_camera else None

        def take(result: Any) -> None:
            with gpu_pose.preparing("upload"):
                entry.keep(key, Prepared(backend.upload(self.gpu, result)))

        name, on_thread = f"Preparing {backend.title}", backend.derives is Derives.ON_THREAD
        return _Step(key, name, backend.derive, derive_args, take, on_thread)

    def _do(self, entry: _Resident, step: _Step, wait: bool) -> bool:
        """Do a step, or have the workers do it before all that waits; whether it is done."""
        begun = entry.jobs.get(step.key)
        job = None if begun is None or begun.job.task.cancelled else begun.job
        if job is None and wait:
            entry.jobs.pop(step.key, None)
            with entry.gpu_pose.preparing("derive"):
                result = step.function(*step.args())
            step.take(result)
            return True
        if job is None:
            for other in self._resident.values():
                other.drop_waiting()
            job = self._begin(entry, step).job
            if step.on_thread:  # it may be done in time for this picture
                futures.wait([job.future], _PATIENCE)
        if not (wait or job.future.done()):
            return False
        self._take(entry, step.key, job, step.take)
        return True

    def _begin(self, entry: _Resident, step: _Step) -> _Begun:
        now = time.monotonic()
        job = self._workers.begin(step.name, step.function, step.args(), step.on_thread)
        if math.isnan(entry.began):
            entry.began = now
        entry.jobs[step.key] = begun = _Begun(job, step.take, now)
        return begun

    def release(self) -> None:
        """Delete every pose and stop the workers. The context stays open."""
        while self._resident:
            self._resident.popitem()[1].release()
        self._workers.close()
        self.gpu.collect()


def _merging(pose: GpuPose) -> _Step:
    return _Step(_merge, "Merging range views", _merge, lambda: (pose,), lambda _: None, on_thread=True)


def _merge(pose: GpuPose) -> bool:
    """Merge the points of range views, and find what drawing asks of them."""
    spacings(pose.stored)
    return True


def _missing(pose: GpuPose, backend: Backend, params: Any, look: Look) -> tuple[str, ...]:
    """The attributes of the points to be estimated. Looks at no point where the backend draws samples."""
    wanted = set(backend.needs(pose.pose, params))
    if "views" in wanted and not pose.views:
        raise InputError(f"{backend.title} draws range views, and this scan has none", hint="Choose another")
    has_own = backend.finds_normals or backend.draws_samples(pose.pose, params)
    if wants_normals(look) and not has_own:
        wanted.add("normals")
    wanted.discard("views")
    return tuple(sorted(name for name in wanted if getattr(pose.cloud, name) is None and len(pose.cloud)))


def _bare(pose: Pose) -> Pose:
    """The pose with all that estimates look at and nothing more, as it may have to go to another process."""
    bare = pose.with_cloud(_bare_cloud(pose.cloud))
    if isinstance(bare.points, PointCloud):
        return bare
    views = tuple(replace(view, color=None, confidence=None) for view in pose.views)
    return replace(bare, points=replace(bare.points, views=views))


def _bare_cloud(cloud: PointCloud) -> PointCloud:
    return PointCloud(cloud.positions, cloud.origin, ids=cloud.ids, viewpoint=cloud.viewpoint)


def _derived_key(backend: Backend, params: Any, view: View | None) -> DerivedKey:
    seen = view.key if backend.derived_by_camera and view is not None else None
    return DerivedKey((backend.name, *backend.derive_key(params)), seen)


def _release(prepared: Prepared) -> None:
    if prepared.derived is not None:
        prepared.derived.release()
