"""Signals that close the window: Ctrl-C in its terminal, the end of the session, whoever asks it to end."""

from __future__ import annotations

import signal
import time
from types import FrameType, TracebackType
from typing import Any

_PATIENCE = 5.0  # seconds that closing may take
_CLOSING = [
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
    if hasattr(signal, name)  # each system has some
]


class Signals:
    """While it is entered, signals are only noted; those that were ignored (nohup) stay ignored.

    came: whether one did. From then on they stay noted, so that a second one does not break the closing; one
    that comes much later ends the process, which does not close then.
    """

    def __init__(self) -> None:
        self.came = False
        self._since = 0.0  # by the clock, when the first one came
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Signals:
        for number in _CLOSING:
            if signal.getsignal(number) is not signal.SIG_IGN:
                self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if not self.came:
            for number, handler in self._before.items():
                signal.signal(number, handler)

    def _note(self, number: int, frame: FrameType | None) -> None:
        now = time.monotonic()
        if not self.came:
            self.came, self._since = True, now
        elif now - self._since > _PATIENCE:
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)
