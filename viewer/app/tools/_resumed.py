"""Work that runs beside the window, stops where the user cancels it, and goes on from there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

from ...task import Task
from ..tool_context import ToolContext


class FoundInParts(Protocol):
    """Something to find. problem: why it cannot be found, "" where nothing is wrong."""

    problem: str

    @property
    def is_whole(self) -> bool:
        """Whether all is found."""

    def find(self) -> None:
        """Find what is not known yet. Raises Cancelled, and InputError, which is also the problem."""


W = TypeVar("W", bound=FoundInParts)


class Resumed(Generic[W]):
    """Has one work done at a time, the one that was asked for last.

    work: that goes on, or has ended; None before the first. is_stopped: whether the user has cancelled it,
    until something else is asked for or `resume` is called.
    """

    def __init__(self, context: ToolContext, title: str) -> None:
        """title: of the work, as the window shows it."""
        self._context, self._title = context, title
        self.work: W | None = None
        self.is_stopped = False
        self._task: Task | None = None

    @property
    def is_running(self) -> bool:
        """Whether the work goes on."""
        return any(one.task is self._task for one in self._context.works)

    def resume(self) -> None:
        """Go on after the user has cancelled it, or after a problem."""
        self.is_stopped = False
        if self.work is not None and self.work.problem:
            self.work = None

    def take(self, is_same: Callable[[W], bool], make: Callable[[], W], is_wanted: bool) -> bool:
        """Have the work done that is asked for; whether it is another one than before.

        is_same: whether a work is that one. make: begins it. is_wanted: whether to begin, or to go on; what
        has begun goes on by itself.
        """
        work = self.work
        if self._task is not None and not self.is_running:
            self.is_stopped |= self._task.cancelled
            self._task = None
        if work is not None and not is_same(work):
            if self._task is not None:
                self._task.cancel()
            work, self.is_stopped, self._task = None, False, None
        if work is None and is_wanted:
            work = make()
        has_changed, self.work = work is not self.work, work
        is_over = work is None or work.is_whole or self.is_stopped or bool(work.problem)
        if work is not None and is_wanted and self._task is None and not is_over:
            self._task = self._context.run(self._title, work.find, lambda _: None)
        return has_changed
