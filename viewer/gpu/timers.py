"""Time per pass: time stamps of the GPU where they tell the truth, finish-to-finish elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field

import moderngl

from . import gl

_UNTIMED = nullcontext()
Stamp = Callable[[], float]  # gives a time in ms, and waits for it


@dataclass
class _Pass:
    """A pass: its name, and the stamps between which it ran. begun: the stamp of the part that runs now."""

    name: str
    begun: Stamp
    parts: list[tuple[Stamp, Stamp]] = field(default_factory=list)

    @property
    def ms(self) -> float:
        """How long it ran."""
        return sum(end() - start() for start, end in self.parts)


class Timers:
    """Collects the passes of a frame.

    On hardware drivers a stamp is a query, read when the frame is over. Software drivers report about nothing
    for compute in a query, so there a stamp is the wall time after a finish. A pass inside another one is not
    counted for the outer one too, so the passes add up to what the GPU did for them. While not `enabled`, a
    pass costs nothing and waits for nothing.
    """

    def __init__(self, ctx: moderngl.Context, software: bool) -> None:
        self._ctx = ctx
        self.kind = "finish" if software else "query"
        self.enabled = False
        self._passes: list[_Pass] = []
        self._running: list[_Pass] = []  # the innermost last
        self._first: Stamp | None = None
        self._queries: list[int] = []  # made once, used again in each frame
        self._used = 0

    def start_frame(self) -> None:
        """Forget the passes of the last frame."""
        self._passes, self._used = [], 0
        self._first = self._stamp() if self.enabled else None

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Time nothing that runs inside."""
        enabled, self.enabled = self.enabled, False
        try:
            yield
        finally:
            self.enabled = enabled

    def measure(self, name: str, *, only_alone: bool = False) -> AbstractContextManager[None]:
        """Time what runs inside. only_alone: within another pass it counts for that one."""
        return _UNTIMED if not self.enabled or (only_alone and self._running) else self._measure(name)

    @contextmanager
    def _measure(self, name: str) -> Iterator[None]:
        start = self._stamp()
        if self._running:
            self._running[-1].parts.append((self._running[-1].begun, start))
        this = _Pass(name, start)
        self._running.append(this)
        try:
            yield
        finally:
            end = self._stamp()
            this.parts.append((this.begun, end))
            self._running.pop()
            if self._running:
                self._running[-1].begun = end
            self._passes.append(this)

    def passes(self) -> list[tuple[str, float]]:
        """(name, milliseconds) of each pass of this frame, in order of their ends; waits for the GPU."""
        return [(each.name, each.ms) for each in self._passes]

    def frame_ms(self) -> float:
        """Milliseconds from the start of the frame to now, with what is in no pass; 0 while not enabled."""
        return 0.0 if self._first is None or not self.enabled else self._stamp()() - self._first()

    def _stamp(self) -> Stamp:
        """The time when the GPU has done everything so far."""
        if self.kind == "finish":
            self._ctx.finish()
            now = 1e3 * time.perf_counter()
            return lambda: now
        if self._used == len(self._queries):
            self._queries += gl.new_queries(16)
        query, self._used = self._queries[self._used], self._used + 1
        gl.record_time(query)
        return lambda: gl.recorded_ns(query) * 1e-6
