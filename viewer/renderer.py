"""What lives longer than a frame: the context, the poses on the GPU, and what was prepared for them."""

from __future__ import annotations

import time
import weakref
from collections import OrderedDict
from collections.abc import Callable
from concurrent import futures
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from .backends import Backend, Derived
from .errors import InputError
from .gpu.context import Gpu, headless
from .gpu.pose import GpuPose
from .helper import Helper
from .look import Look, wants_normals
from .scan.estimate import estimate
from .scan.points import PointCloud
from .scan.pose import Pose
from .scan.spacing import spacings
from .task import Task
from .view import View

_MEGABYTE = 1 << 20
_VIEWS = 4  # of a pose that what is derived by camera is kept for
_START = 0.4  # seconds that a process takes to start
_PATIENCE = 0.05  # seconds: a picture late is better than one of points among others


@dataclass
class Prepared:
    """Result of a backend's derive function for a pose; None where it derives nothing."""

    derived: Derived | None


class DerivedKey(NamedTuple):
    """Key of derived data. what: the backend and its parameters. view: None where on no camera."""

    what: tuple[Any, ...]
    view: tuple[object, ...] | None


@dataclass
class _Job:
    """Job that the worker prepares: (result, milliseconds)."""

    task: Task
    future: Future[tuple[Any, float]]

    def cancel(self) -> bool:
        """Stop it, now or at its next step; True where it had not begun."""
        self.task.cancel()
        return self.future.cancel()


@dataclass
class _Resident:
    """pose: as it was given; that of the GpuPose is the same without keeping it alive."""

    pose: weakref.ref[Pose]
    gpu_pose: GpuPose
    derived: OrderedDict[DerivedKey, Prepared] = field(default_factory=OrderedDict)  # last used last
    jobs: dict[Any, _Job] = field(default_factory=dict)

    def keep(self, key: DerivedKey, prepared: Prepared) -> None:
        """Keep what was derived, in place of what was for the view that was seen longest ago."""
        self.derived[key] = prepared
        of_views = [other for other in self.derived if other.what == key.what and other.view is not None]
        for old in of_views[:-_VIEWS]:
            _release(self.derived.pop(old))

    def drop_passed(self, view: object) -> None:
        """Drop the jobs of all other views, finished ones too. What has just begun is let finish first, since
        cancelling ends a process."""
        for key, job in list(self.jobs.items()):
            passed = isinstance(key, DerivedKey) and key.view not in (None, view)
            if passed and (job.future.done() or job.future.cancel() or job.task.seconds > _START):
                job.cancel()
                del self.jobs[key]

    @property
    def nbytes(self) -> int:
        """Bytes on the GPU."""
        derived = sum(p.derived.nbytes for p in self.derived.values() if p.derived)
        return self.gpu_pose.uploaded_bytes + derived

    @property
    def held_bytes(self) -> int:
        """Bytes on the GPU, and of the estimates that it keeps on the CPU."""
        return self.nbytes + self.gpu_pose.estimated_bytes

    @property
    def current(self) -> Pose:
        """The pose with what was estimated of its points, which this merges."""
        return self.gpu_pose.pose.with_cloud(self.gpu_pose.cloud)

    def release(self) -> None:
        for job in self.jobs.values():
            job.cancel()
        for prepared in self.derived.values():
            _release(prepared)


class Renderer:
    """Keeps poses on the GPU, least recently used out first, within `budget_bytes`.

    The pose being drawn always stays; one that nobody else holds any more goes with the next
    frame, so that a timeline's cache bounds what is kept here too.

    gpu: None opens a headless context (raises NoOpenGLError). budget_bytes: None takes 1 GiB
    on hardware and 128 MiB on software drivers, where it is the same memory that the
    timeline's cache lives in.
    """

    def __init__(self, gpu: Gpu | None = None, budget_bytes: int | None = None) -> None:
        self.gpu = gpu or headless()
        self.budget_bytes = budget_bytes or (128 if self.gpu.software else 1024) * _MEGABYTE
        self._resident: OrderedDict[int, _Resident] = OrderedDict()
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="prepare")
        self._helper = Helper()

    @property
    def nbytes(self) -> int:
        """Bytes that poses hold on the GPU."""
        return sum(r.nbytes for r in self._resident.values())

    @property
    def _held_bytes(self) -> int:
        return sum(r.held_bytes for r in self._resident.values())

    def bytes_of(self, pose: Pose) -> int:
        """Bytes that one pose holds on the GPU, with what was derived from it; 0 where it is not there."""
        return self._resident[id(pose)].nbytes if id(pose) in self._resident else 0

    def resident(self, pose: Pose) -> GpuPose:
        """The pose on the GPU; its arrays are uploaded when something first reads them."""
        self.gpu.collect()
        key = id(pose)
        for gone in [k for k, r in self._resident.items() if r.pose() is None]:
            self._resident.pop(gone).release()
        if key not in self._resident:
            self._resident[key] = _Resident(weakref.ref(pose), GpuPose(self.gpu, replace(pose)))
        self._resident.move_to_end(key)
        while len(self._resident) > 1 and self._held_bytes > self.budget_bytes:
            self._resident.popitem(last=False)[1].release()
        return self._resident[key].gpu_pose

    def merge(self, gpu_pose: GpuPose) -> bool:
        """Have a worker merge the points of range views; whether they are there."""
        if gpu_pose.pose.is_merged:
            return True
        entry, args = self._entry(gpu_pose), (gpu_pose,)
        return bool(self._run(entry, _merge, "Merging range views", _merge, args, wait=False, on_thread=True))

    def prepare(
        self, gpu_pose: GpuPose, backend: Backend, params: Any, look: Look, wait: bool, view: View
    ) -> Prepared | None:
        """Make what a backend and a look need of a pose; None while a worker is still at it.

        First the attributes that the scan does not have are estimated, then the backend's
        derive function runs; only uploads happen on this thread. Without `wait`, both are done by a
        `Helper`, so that nothing stops this thread. What was cancelled begins anew. Raises InputError where
        the pose has no range views and the backend needs them.
        """
        entry = self._entry(gpu_pose)
        missing = _missing(gpu_pose, backend, params, look)
        if missing:
            name = f"Estimating {' and '.join(missing)}"
            result = self._run(entry, missing, name, estimate, (_bare(entry.current), missing), wait)
            if result is None:
                return None
            gpu_pose.add_estimates(result)
        if backend.derive is None:
            return Prepared(None)
        key = _derived_key(backend, params, view)
        entry.drop_passed(key.view)
        if key not in entry.derived:
            name = f"Preparing {backend.title}"
            pose = gpu_pose.pose if backend.draws_samples(gpu_pose.pose, params) else entry.current
            args = (pose, params, *([view] if backend.derived_by_camera else []))
            result = self._run(entry, key, name, backend.derive, args, wait, backend.derives_on_thread)
            if result is None:
                return None
            with gpu_pose.preparing("upload"):
                entry.keep(key, Prepared(backend.upload(self.gpu, result)))
        entry.derived.move_to_end(key)
        return entry.derived[key]

    def is_prepared(self, pose: Pose, backend: Backend, params: Any, look: Look, view: View) -> bool:
        """Whether `prepare` would have nothing to merge, estimate or derive."""
        if not (pose.is_merged or backend.draws_samples(pose, params)):
            return False
        entry = self._entry(self.resident(pose))
        if _missing(entry.gpu_pose, backend, params, look):
            return False
        return backend.derive is None or _derived_key(backend, params, view) in entry.derived

    @property
    def preparing(self) -> Task | None:
        """Task that is being prepared without anybody waiting for it, None where nothing is."""
        jobs = [job for entry in self._resident.values() for job in entry.jobs.values()]
        return next((job.task for job in jobs if not job.task.cancelled and not job.future.done()), None)

    def _entry(self, gpu_pose: GpuPose) -> _Resident:
        return next(r for r in self._resident.values() if r.gpu_pose is gpu_pose)

    def _run(
        self,
        entry: _Resident,
        key: Any,
        name: str,
        function: Callable[..., Any],
        args: Any,
        wait: bool,
        on_thread: bool = False,
    ) -> Any:
        """Result of the function; None while the worker is at it. on_thread: rather than by the helper."""
        job = entry.jobs.get(key)
        if job is not None and job.task.cancelled:
            job = None
        if job is None and wait:
            result, ms = _timed(lambda: function(*args))
        else:
            if job is None:
                self._drop_waiting_jobs()  # for poses that were passed meanwhile
                task = Task(name)

                def call() -> Any:
                    if not on_thread:
                        return self._helper.call(task, function, *args)
                    with task.current():
                        return function(*args)

                job = entry.jobs[key] = _Job(task, self._worker.submit(_timed, call))
                if on_thread:  # it may be done in time for this picture
                    futures.wait([job.future], _PATIENCE)
            if not (wait or job.future.done()):
                return None
            del entry.jobs[key]
            result, ms = job.future.result()
        entry.gpu_pose.add_ms("derive", ms)
        return result

    def _drop_waiting_jobs(self) -> None:
        for entry in self._resident.values():
            entry.jobs = {key: job for key, job in entry.jobs.items() if not job.future.cancel()}

    def release(self) -> None:
        """Delete every pose and stop the worker. The context stays open."""
        while self._resident:
            self._resident.popitem()[1].release()
        self._worker.shutdown(wait=True, cancel_futures=True)
        self._helper.close()
        self.gpu.collect()


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


def _derived_key(backend: Backend, params: Any, view: View) -> DerivedKey:
    return DerivedKey(
        (backend.name, *backend.derive_key(params)), view.key if backend.derived_by_camera else None
    )


def _release(prepared: Prepared) -> None:
    if prepared.derived is not None:
        prepared.derived.release()


def _timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """Do the work: its result, and the milliseconds that it took."""
    start = time.perf_counter()
    return work(), (time.perf_counter() - start) * 1e3
