"""Signals that end a program, as an exception: raised at once, or when it may be."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

_ENDING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


@contextmanager
def ending_as_interrupts() -> Iterator[None]:
    """Meanwhile SIGTERM and SIGHUP raise KeyboardInterrupt in the main thread, as Ctrl-C does, or is made to.

    So whoever tidies up after the one does so after the others. Those that are ignored (nohup), or handled by
    whoever called, stay as they are; outside of the main thread nothing changes.
    """
    with _handled(_ENDING, [signal.SIG_DFL], _interrupt):
        yield


def ignore_from_now_on() -> None:
    """None of these signals does anything any more: for a process that ends, and only says so yet."""
    if threading.current_thread() is threading.main_thread():
        for number in _ENDING:
            signal.signal(number, signal.SIG_IGN)


class Interrupts:
    """Interrupts that are raised where they are let in, and wait elsewhere."""

    def __init__(self) -> None:
        self.waiting = False
        self._open = False

    @contextmanager
    def let_in(self) -> Iterator[None]:
        """Within, one is raised, at once if it waited; further ones wait."""
        try:
            self._open = True
            if self.waiting:
                self.waiting = False
                raise KeyboardInterrupt
            yield
        finally:
            self._open = False

    def take(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal."""
        self.waiting = not self._open
        if self._open:
            self._open = False
            raise KeyboardInterrupt


@contextmanager
def held_interrupts() -> Iterator[Interrupts]:
    """Interrupts wait, but where they are let in. One that still waits at the end is raised there."""
    interrupts = Interrupts()
    raising = [signal.default_int_handler, _interrupt]
    with _handled(_ENDING, raising, interrupts.take):
        yield interrupts
    if interrupts.waiting:
        raise KeyboardInterrupt


@contextmanager
def _handled(
    numbers: Sequence[int], former: Sequence[object], handler: Callable[[int, FrameType | None], None]
) -> Iterator[None]:
    """Handle these signals, in the main thread, where their handler is one of the former ones."""
    handlers = {number: signal.getsignal(number) for number in numbers}
    is_main = threading.current_thread() is threading.main_thread()
    taken = [number for number in numbers if is_main and handlers[number] in former]
    for number in taken:
        signal.signal(number, handler)
    try:
        yield
    finally:
        for number in taken:
            signal.signal(number, handlers[number])


def _interrupt(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt
