"""How long the window's loop takes, so that what freezes it has a name."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager

log = logging.getLogger(__name__)
_WORTH_LOGGING = 10.0  # milliseconds


class Turns:
    """Times the parts of each turn of the loop, apart from waiting, and logs them."""

    def __init__(self) -> None:
        self._parts: dict[str, float] = {}

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Count what runs inside as this part of the turn."""
        start = time.perf_counter()
        yield
        self.add(name, (time.perf_counter() - start) * 1e3)

    def add(self, name: str, ms: float) -> None:
        """Count time as this part of the turn; a negative one is taken off."""
        self._parts[name] = self._parts.get(name, 0.0) + ms

    def end(self) -> None:
        """The turn is over."""
        total = sum(self._parts.values())
        if total >= _WORTH_LOGGING:
            parts = ", ".join(f"{name} {ms:.0f}" for name, ms in self._parts.items() if ms >= 0.5)
            log.debug("turn of %.0f ms: %s", total, parts)
        self._parts.clear()
