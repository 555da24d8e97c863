"""Keeping a file up to date while its content changes, so that a crash loses little."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Generic, TypeVar

T = TypeVar("T")


class Keeper(Generic[T]):
    """Saves values on a thread of its own: what has changed, now and then. Nobody waits but in `close`."""

    def __init__(self, what: str, save: Callable[[T], str | None], saved: T | None, every: float) -> None:
        """what: for messages, such as "Settings". save: writes a value, and returns what the user should
        know; it may raise anything.

        saved: what is in the file. every: seconds between looks at what has changed.
        """
        self._what, self._save, self._every = what, save, every
        self._saved = saved
        self._next_look = 0.0
        self._writing: Future[str | None] | None = None
        self._worker = ThreadPoolExecutor(1, thread_name_prefix=what.lower())

    def look(self, now: float, current: Callable[[], T]) -> str | None:
        """Save what has changed, unless that was done just now. now: by the clock, seconds.

        Returns what went wrong, once: from then on only `keep` and `close` try again.
        """
        if now < self._next_look:
            return None
        self._next_look = now + self._every
        if problem := self._take_problem():
            return problem
        if not self._is_writing:
            self.keep(current())
        return None

    def keep(self, current: T) -> None:
        """Save a value at once, where it is another one, after what is being written."""
        if current != self._saved:
            self._saved = current
            self._writing = self._worker.submit(self._save, current)

    def close(self, current: T) -> str | None:
        """Save, and wait for it. Returns what went wrong."""
        if self._is_writing:
            self._saved = None  # which may fail
        self.keep(current)
        self._worker.shutdown()
        return self._take_problem()

    @property
    def _is_writing(self) -> bool:
        return self._writing is not None and not self._writing.done()

    def _take_problem(self) -> str | None:
        if self._writing is None or self._is_writing:
            return None
        written, self._writing = self._writing, None
        if (error := written.exception()) is None:
            return written.result()
        self._next_look, self._saved = math.inf, None
        return f"{self._what} are not kept: {error}"
