"""Work that takes a while, beside whatever shows it: how far it has come, and whether it shall stop."""

from __future__ import annotations

import atexit
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

T = TypeVar("T")
_WAIT = 2.0  # seconds that the end of the process waits for work in the background


class Cancelled(BaseException):
    """The work was cancelled. No Exception, so that nobody takes it for a failure of a file."""


class Task:
    """One piece of work. Any thread may read, report and cancel it.

    progress: 0..1, None while nobody can tell.
    """

    def __init__(self, name: str) -> None:
        self._names = [name]
        self.progress: float | None = None
        self._began = time.monotonic()
        self._lock = threading.Lock()
        self._cancelled = False
        self._stops: list[Callable[[], object]] = []

    def begin(self) -> None:
        """Count from now, where it had to wait for its turn."""
        self._began = time.monotonic()

    @property
    def name(self) -> str:
        """The name of what it does now, as users read it: its own, or the last announced one not yet over."""
        return self._names[-1]

    @property
    def seconds(self) -> float:
        """How long ago it began."""
        return time.monotonic() - self._began

    @property
    def cancelled(self) -> bool:
        """Whether the task was cancelled."""
        return self._cancelled

    def cancel(self) -> None:
        """Tell it to stop; it does so at its next `check`, or by what `stopped_by` named."""
        with self._lock:
            self._cancelled = True
            stops, self._stops = self._stops, []
        for stop in stops:
            stop()

    def check(self) -> None:
        """Raise Cancelled if the task was cancelled."""
        if self._cancelled:
            raise Cancelled(self.name)

    def report(self, progress: float) -> None:
        """Note how far it has come, 0..1."""
        self.progress = progress

    @contextmanager
    def stopped_by(self, stop: Callable[[], object]) -> Iterator[None]:
        """Have `cancel` call this while what is inside runs. Raises Cancelled where it is too late."""
        with self._lock:
            self.check()
            self._stops.append(stop)
        try:
            yield
        finally:
            with self._lock:
                if stop in self._stops:
                    self._stops.remove(stop)

    @contextmanager
    def current(self) -> Iterator[None]:
        """Make it the task that `checkpoint` speaks of in this thread."""
        token = _current.set(self)
        try:
            yield
        finally:
            _current.reset(token)


_current: ContextVar[Task | None] = ContextVar("task", default=None)


def checkpoint(progress: float | None = None) -> None:
    """Long work calls this now and then, with how far it has come (0..1) where it knows.

    Raises Cancelled where the task that this thread works on was cancelled; without a task it
    does nothing.
    """
    task = _current.get()
    if task is not None:
        task.check()
        if progress is not None:
            task.report(progress)


def announce(what: str) -> None:
    """Say why work takes longer than at other times: the task of this thread bears it as its name.

    It does so until `over` is called. Callbacks of `listening` hear of it as well.
    """
    task = _current.get()
    if task is not None:
        task._names.append(what)
    for listener in list(_listeners):
        listener(what)


def over() -> None:
    """Say that what was announced last in this thread is done: its task gets the name back that it had."""
    task = _current.get()
    if task is not None:
        task._names.pop()


@contextmanager
def listening(listener: Callable[[str], object]) -> Iterator[None]:
    """Have `announce` call the listener, on whatever thread, while what is inside runs."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


_listeners: list[Callable[[str], object]] = []


def in_background(task: Task, work: Callable[[], T]) -> Future[T]:
    """Do the work on a thread of its own. At the end of the process it is cancelled."""
    future: Future[T] = Future()

    def run() -> None:
        try:
            with task.current():
                task.check()
                result = work()
        except BaseException as error:
            future.set_exception(error)
        else:
            future.set_result(result)
        finally:
            del _running[thread]

    thread = threading.Thread(target=run, name=task.name, daemon=True)
    _running[thread] = task
    thread.start()
    return future


_running: dict[threading.Thread, Task] = {}


@atexit.register
def _end() -> None:
    """A thread inside a native library must not outlive the interpreter; one that hangs is not waited for."""
    running = list(_running.items())
    for _, task in running:
        task.cancel()
    end = time.monotonic() + _WAIT
    for thread, _ in running:
        thread.join(max(0.0, end - time.monotonic()))
