"""Time per pass: timer queries where they tell the truth, finish-to-finish elsewhere."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

import moderngl


class Timers:
    """Collects the passes of a frame.

    On hardware drivers a pass is a timer query, read when the frame is over. Software
    drivers report about nothing for compute in a query, so there a pass is the wall time
    between two finishes. While not `enabled`, a pass costs nothing and waits for nothing.
    """

    def __init__(self, ctx: moderngl.Context, software: bool) -> None:
        self._ctx = ctx
        self.kind = "finish" if software else "query"
        self.enabled = False
        self._passes: list[tuple[str, float | moderngl.Query]] = []
        self._queries: dict[tuple[str, int], moderngl.Query] = {}  # moderngl never deletes one

    def start_frame(self) -> None:
        """Forget the passes of the last frame."""
        self._passes = []

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Time nothing that runs inside."""
        enabled, self.enabled = self.enabled, False
        try:
            yield
        finally:
            self.enabled = enabled

    @contextmanager
    def measure(self, name: str) -> Iterator[None]:
        """Time what runs inside; passes do not nest."""
        if not self.enabled:
            yield
        elif self.kind == "query":
            key = name, sum(name == other for other, _ in self._passes)
            if key not in self._queries:
                self._queries[key] = self._ctx.query(time=True)
            query = self._queries[key]
            with query:
                yield
            self._passes.append((name, query))
        else:
            self._ctx.finish()
            start = time.perf_counter()
            yield
            self._ctx.finish()
            self._passes.append((name, (time.perf_counter() - start) * 1e3))

    def passes(self) -> list[tuple[str, float]]:
        """(name, milliseconds) of each pass of this frame, in order; waits for queries."""
        return [(n, t if isinstance(t, float) else t.elapsed * 1e-6) for n, t in self._passes]
