"""Threads and processes beside this one for heavy work on points.

Native libraries hold the interpreter's lock while they work (open3d for seconds), which would stop
the window whatever thread they run on; and what runs in a process can be ended at any moment.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from queue import LifoQueue
from typing import IO, Any, NamedTuple, ParamSpec, TypeVar

import numpy as np

from .errors import Scan4DError
from .task import Task

P = ParamSpec("P")
R = TypeVar("R")
_NICE = 10  # the window's own work goes first
_MOST = 4  # workers: each has a process with libraries of its own, some 100 MB
_WATCH = 0.5  # seconds between looks at who started this process
_NO_CONSOLE = getattr(subprocess, "CREATE_NO_WINDOW", 0)  # on Windows it would open a window of its own


def start_python(code: str, *arguments: str, nice: int, **streams: Any) -> subprocess.Popen[bytes]:
    """Run code in a process of its own, whose standard output is a pipe; it finds the modules found here.

    nice: how much it steps back for others, where the system knows that. streams: `stdin`, `stderr`.
    Raises OSError.
    """
    # The same modules as here, whatever lies in the working directory. Ctrl-C, which reaches it too, ends it.
    begin = (
        "import os, signal, sys; signal.signal(signal.SIGINT, signal.SIG_DFL); "
        f"sys.path[:] = {sys.path!r}; hasattr(os, 'nice') and os.nice({nice})"
    )
    begin += f"\nfrom {__name__} import end_with; end_with({os.getpid()})"
    return subprocess.Popen(
        [sys.executable, "-c", f"{begin}\n{code}", *arguments],
        stdout=subprocess.PIPE, creationflags=_NO_CONSOLE, **streams,
    )  # fmt: skip


def end_with(parent: int) -> None:
    """Have this process get SIGTERM when the one that started it is gone, however that ended.

    parent: its number. Where the system forgets nothing of parents (Windows), nothing happens.
    """

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_WATCH)
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=watch, name="parent", daemon=True).start()


class _Progress(NamedTuple):
    """A message of the process while it works: how far it is, 0..1."""

    share: float


class Helper:
    """Starts its process at the first call and keeps it for the next ones."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._lock = threading.Lock()

    def call(self, task: Task, function: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """Call the function with these arguments in the process, and wait for its result.

        One call at a time. function: a public one of a module. Raises Cancelled as soon as the task
        is cancelled, which ends the process; Scan4DError where the function or the process fails.
        """
        with self._lock:
            process = self._process = self._process or _start()
            with task.stopped_by(process.kill):
                answer = _ask(process, (function, args, kwargs), task)
            if answer is None or task.cancelled:
                self._process = None
                _end(process)
                task.check()
                raise Scan4DError(f"{task.name} failed: its process ended with code {process.returncode}")
        result, error = answer
        if error is not None:
            raise error
        return result

    def close(self) -> None:
        """End the process. Cancel the task of a call before, and it waits for that."""
        with self._lock:
            if self._process is not None:
                _end(self._process)
            self._process = None

    def __del__(self) -> None:
        if self._process is not None:
            _end(self._process)  # where an error kept anybody from closing it


@dataclass(frozen=True)
class Job:
    """Work that `Workers` do or will do. future: (its result, the milliseconds that it took)."""

    task: Task
    future: Future[tuple[Any, float]]

    @property
    def is_waiting(self) -> bool:
        """Whether it has not begun."""
        return not (self.future.running() or self.future.done())

    @property
    def error(self) -> BaseException | None:
        """The error that it ended with; None if there is none, and for a job that was cancelled."""
        is_over = self.future.done() and not self.task.cancelled
        return self.future.exception() if is_over else None

    def failed(self, error: Exception) -> Job:
        """Make a job of it that has ended with an error."""
        future: Future[tuple[Any, float]] = Future()
        future.set_exception(error)
        return replace(self, future=future)

    def drop(self) -> bool:
        """Take it out of the queue; False where it had begun, and goes on."""
        return self.future.cancel()

    def cancel(self) -> None:
        """Stop it, now or at its next step."""
        self.task.cancel()
        self.future.cancel()


class Workers:
    """Threads that do jobs in the order they come in, each with a `Helper` for what needs a process.

    count: of them, as many as there are processors, but no more than four. A process starts when all that
    have started are at work.
    """

    def __init__(self) -> None:
        self.count = min(os.cpu_count() or 1, _MOST)
        self._threads = ThreadPoolExecutor(self.count, thread_name_prefix="prepare")
        self._helpers: LifoQueue[Helper] = LifoQueue()  # that are free; those with a process are on top
        for _ in range(self.count):
            self._helpers.put(Helper())

    def begin(self, name: str, function: Callable[..., Any], args: Any, on_thread: bool = False) -> Job:
        """Have a function called. name: of its task. on_thread: here rather than in another process."""
        task = Task(name)
        return Job(task, self._threads.submit(self._timed, task, function, args, on_thread))

    def _timed(
        self, task: Task, function: Callable[..., Any], args: Any, on_thread: bool
    ) -> tuple[Any, float]:
        start = time.perf_counter()
        task.begin()
        if on_thread:
            with task.current():
                task.check()
                result = function(*args)
        else:
            helper = self._helpers.get()
            try:
                result = helper.call(task, function, *args)
            finally:
                self._helpers.put(helper)
        return result, (time.perf_counter() - start) * 1e3

    def close(self) -> None:
        """End threads and processes. Cancel the jobs before, and it waits for those that have begun."""
        self._threads.shutdown(wait=True, cancel_futures=True)
        while not self._helpers.empty():
            self._helpers.get().close()


def _start() -> subprocess.Popen[bytes]:
    try:
        return start_python(f"from {__name__} import serve; serve()", nice=_NICE, stdin=subprocess.PIPE)
    except OSError as error:
        raise Scan4DError(f"Scan4D cannot start a process ({error.strerror})") from error


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
    for stream in (process.stdin, process.stdout):
        if stream is not None:
            with suppress(OSError):  # what was not read any more
                stream.close()


def _ask(process: subprocess.Popen[bytes], question: Any, task: Task) -> Any:
    """The answer to a question, None where the process has ended."""
    assert process.stdin is not None and process.stdout is not None
    try:
        _send(process.stdin, question)
    except OSError:
        return None
    while isinstance(answer := _receive(process.stdout), _Progress):
        task.report(answer.share)
    return answer


def serve() -> None:
    """Answer calls until nobody is left to ask: what the process does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the window ends this process
    questions, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print must not get between the answers
    while (question := _receive(questions)) is not None:
        _send(answers, _answer(question, answers))


def _answer(question: Any, answers: IO[bytes]) -> tuple[Any, Scan4DError | None]:
    """The result of a call, or why it failed."""
    function, args, kwargs = question
    try:
        with _Told(answers).current():
            return function(*args, **kwargs), None
    except Scan4DError as error:
        return None, error
    except MemoryError:
        return None, Scan4DError("not enough memory", hint="Close other programs")
    except Exception as error:
        return None, Scan4DError(f"{function.__name__} failed ({type(error).__name__}: {error})")


class _Told(Task):
    """A task whose progress goes to the process that asked."""

    def __init__(self, answers: IO[bytes]) -> None:
        self._answers = answers
        super().__init__("")

    def report(self, progress: float) -> None:
        _send(self._answers, _Progress(progress))


def _send(stream: IO[bytes], message: Any) -> None:
    """Write a message, its arrays as they lie in memory, so that no lock is held while they are copied."""
    buffers: list[pickle.PickleBuffer] = []
    head = pickle.dumps(message, protocol=5, buffer_callback=buffers.append)
    parts = [memoryview(head), *(buffer.raw() for buffer in buffers)]
    stream.write(np.array([len(parts), *(part.nbytes for part in parts)], np.uint64).tobytes())
    for part in parts:
        stream.write(part)
    stream.flush()


def _receive(stream: IO[bytes]) -> Any:
    """The next message, None where the stream has ended."""
    try:
        (count,) = _read(stream, 8).view(np.uint64).tolist()
        sizes = _read(stream, 8 * count).view(np.uint64).tolist()
        head, *buffers = (_read(stream, size) for size in sizes)
    except EOFError:
        return None
    return pickle.loads(head.data, buffers=buffers)


def _read(stream: IO[bytes], size: int) -> np.ndarray[Any, np.dtype[np.uint8]]:
    data = np.empty(size, np.uint8)
    view, done = data.data, 0
    while done < size:
        count = stream.readinto(view[done:])  # type: ignore[attr-defined]
        if not count:
            raise EOFError
        done += count
    return data
