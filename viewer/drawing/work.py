"""Work in the background: workers prepare poses for pictures, first those that are drawn first."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Iterable
from concurrent import futures
from typing import Any

from ..errors import InputError
from ..helper import Job, Workers
from ..task import Task
from .foresight import Foresight
from .jobs import Begun, Preparation
from .request import Request
from .residents import Resident, Residents
from .steps import next_step

_PATIENCE = 0.05  # seconds: a picture late is better than one of plain points among others
_QUEUED = 3  # jobs for each worker, so that none waits for a turn of the window's loop
_TAKE_SECONDS = 0.01  # most time of one turn to take in what is ready
_LATELY = 8  # poses whose preparation tells how long preparing one takes


class BackgroundWork:
    """The jobs of all poses, and the workers that do them."""

    def __init__(self, residents: Residents) -> None:
        self._residents = residents
        self._workers = Workers()
        self._foresight = Foresight()
        self._latencies: deque[float] = deque(maxlen=_LATELY)
        self._turned = -math.inf  # by the clock, when other pictures were asked for ahead

    def do(self, resident: Resident, step: Preparation, wait: bool) -> bool:
        """Do a step here, or, without `wait`, let workers do it before everything else; whether it is done.

        A cancelled step begins again. Raises what the step failed with.
        """
        job = resident.jobs.running(step.key)
        if job is None and wait:
            resident.jobs.pop(step.key, None)
            with resident.gpu_pose.preparing("derive"):
                result = step.function(*step.args())
            step.take(result)
            return True
        if job is None:
            for other in self._residents:
                other.jobs.drop_waiting()
            job = self._begin(resident, step)
            if step.on_thread:  # it may be done in time for this picture
                futures.wait([job.future], _PATIENCE)
        if not (wait or job.future.done()):
            return False
        self._take(resident, step.key)
        return True

    def prepare_ahead(self, requests: Iterable[Request], afresh: bool = False) -> None:
        """Let workers make what these pictures need, the first ones first, and take in what is ready of any
        pose. What depends on the view is left out.

        Threads find the facts that pictures read but do not wait for (`Backend.foresee`).
        A few jobs run at a time, and no more than the budget holds beside what is drawn sooner. Jobs that
        wait for other pictures are dropped. Running jobs finish, and their results are kept. afresh: the
        pictures are others than in the last call. Then running jobs end if they keep these waiting.
        """
        if afresh:
            self._turned = time.monotonic()
        self._take_finished()
        requests = list(requests)
        self._foresight.begin(requests)
        wanted: set[int] = set()
        for request in requests:
            resident = self._residents.find(request.pose)
            try:
                step = next_step(resident, request, None)
            except InputError:  # drawing it reports this
                continue
            if step is None:
                self._note_prepared(resident)
                continue
            job = resident.jobs.running(step.key)
            if job is None:
                is_full = len(self._unfinished) >= _QUEUED * self._workers.count
                if is_full or not self._residents.has_room(request.pose):
                    break
                self._residents.hold(request.pose, resident)
                job = self._begin(resident, step)
            wanted.add(id(job))
        is_urgent = any(job.is_waiting for job in self._unfinished if id(job) in wanted)
        for resident in self._residents:
            resident.jobs.drop_others(wanted, is_urgent, self._turned)

    def prepare(self, request: Request) -> None:
        """Let workers make what `prepare_ahead` does for the pictures of one request, and wait for it."""
        while True:
            self.prepare_ahead([request])
            running: list[futures.Future[Any]] = [job.future for job in self._unfinished]
            running += self._foresight.running
            if not running:
                return
            futures.wait(running, return_when=futures.FIRST_COMPLETED)

    @property
    def latency(self) -> float:
        """Seconds from the start of work on a pose until it is prepared: the least of late; 0 at first."""
        return min(self._latencies, default=0.0)

    @property
    def unfinished(self) -> int:
        """Number of jobs that workers do or will do."""
        return len(self._unfinished)

    @property
    def preparing(self) -> Task | None:
        """The task that a worker has done for longest, else one that waits; None if there is none."""
        jobs = sorted(self._unfinished, key=lambda job: (job.is_waiting, -job.task.seconds))
        return jobs[0].task if jobs else None

    @property
    def _unfinished(self) -> list[Job]:
        return [job for resident in self._residents for job in resident.jobs.unfinished]

    def _begin(self, resident: Resident, step: Preparation) -> Job:
        at = time.monotonic()
        job = self._workers.begin(step.name, step.function, step.args(), step.on_thread)
        resident.jobs.note(step.key, Begun(job, step.take, at))
        return job

    def _take(self, resident: Resident, key: Any) -> None:
        """Take in the result of a job. Raises what it failed with."""
        job, take, _ = resident.jobs.pop(key)
        result, ms = job.future.result()
        resident.gpu_pose.spent.derive_ms += ms
        take(result)

    def _take_finished(self) -> None:
        """Take in what workers have made of any pose, for as long as a turn of a window's loop may take."""
        end = time.perf_counter() + _TAKE_SECONDS
        for resident in self._residents:
            for key, begun in list(resident.jobs.items()):
                if time.perf_counter() > end:
                    return
                if begun.job.future.done() and not (begun.job.task.cancelled or begun.job.error):
                    try:
                        self._take(resident, key)
                    except Exception as error:  # drawing it reports this
                        resident.jobs[key] = begun._replace(job=begun.job.failed(error))
        self._residents.make_room()

    def _note_prepared(self, resident: Resident) -> None:
        jobs = resident.jobs
        if not (jobs or math.isnan(jobs.since)):
            self._latencies.append(time.monotonic() - jobs.since)
            jobs.since = math.nan

    def close(self) -> None:
        """Stop the workers. Cancel all jobs before, and it waits for those that have begun."""
        self._workers.close()
