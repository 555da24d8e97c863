"""Keeping files up to date while their content changes, so that a crash loses little."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import Generic, TypeVar

T = TypeVar("T")
_LONGEST_PAUSE = 60.0  # seconds between attempts to save what could not be saved


@dataclass
class _Failure:
    """Why a file could not be written. pause: seconds until it is tried again. at: when, by the clock."""

    error: BaseException
    pause: float
    at: float


class Saver(Generic[T]):
    """Saves values on a thread of its own: what has changed, now and then. Nobody waits but in `close`.

    What cannot be saved is tried again after pauses that grow, and reported once until it was saved.
    """

    def __init__(
        self,
        what: str,
        save: Callable[[T], str | None],
        saved: T | None,
        every: float,
        file: Callable[[T], Hashable] = lambda _: None,
    ) -> None:
        """what: for messages, such as "Settings". save: writes a value, and returns what the user should
        know; it may raise anything.

        saved: what is in the file. every: seconds between looks at what has changed. file: what tells the
        files apart that values go to.
        """
        self._what, self._save, self._every, self._file = what, save, every, file
        self._last = saved
        self._next_look = 0.0
        self._unsaved: dict[Hashable, T] = {}  # the newest value for each file that it is not known to have
        self._writing: list[tuple[T, Future[str | None]]] = []
        self._failures: dict[Hashable, _Failure] = {}
        self._words: list[str] = []  # for the user
        self._worker = ThreadPoolExecutor(1, thread_name_prefix=what.lower())

    def look(self, now: float, current: Callable[[], T]) -> str | None:
        """Save what has changed, unless that was done just now. now: by the clock, seconds.

        Returns what the user should know, and what went wrong, once.
        """
        if now < self._next_look:
            return None
        self._next_look = now + self._every
        self._take_written(now)
        if not self._writing:
            self.note(current())
            for file, failure in self._failures.items():
                if now >= failure.at:
                    self._write(self._unsaved[file])
        return self._words.pop(0) if self._words else None

    def note(self, current: T) -> None:
        """Save a value at once, where it is another one, after what is being written; where its file could
        not be written, when that is tried again."""
        if current != self._last:
            self._last = self._unsaved[self._file(current)] = current
            if self._file(current) not in self._failures:
                self._write(current)

    def close(self, current: T) -> str | None:
        """Save all, and wait for it. Returns what the user should know, and what went wrong."""
        self.note(current)
        self._wait()
        for value in self._unsaved.values():
            self._write(value)
        self._wait()
        self._worker.shutdown()
        self._words += [self._message(failure.error) for failure in self._failures.values()]
        return "\n".join(dict.fromkeys(self._words)) or None

    def _write(self, value: T) -> None:
        self._writing.append((value, self._worker.submit(self._save, value)))

    def _wait(self) -> None:
        wait([future for _, future in self._writing])
        self._take_written(0.0)

    def _message(self, error: BaseException) -> str:
        return f"{self._what} cannot be saved: {error}"

    def _take_written(self, now: float) -> None:
        """Take in what has come of writing."""
        done = [pair for pair in self._writing if pair[1].done()]
        self._writing = [pair for pair in self._writing if pair not in done]
        for value, future in done:
            file = self._file(value)
            former = self._failures.pop(file, None)
            if (error := future.exception()) is not None:
                pause = min(2 * former.pause if former else self._every, _LONGEST_PAUSE)
                self._failures[file] = _Failure(error, pause, now + pause)
                if former is None:
                    self._words.append(self._message(error))
                continue
            if words := future.result():
                self._words.append(words)
            if self._unsaved.get(file) is value:
                del self._unsaved[file]
            elif former is not None and file in self._unsaved:  # it changed while this was tried again
                self._write(self._unsaved[file])
