"""Questions whose answer takes a moment: found beside the window, and shown as soon as it is there."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field

from ..task import Task, in_background
from .part import WindowPart


@dataclass(eq=False)
class Later(WindowPart):
    """Waits for answers."""

    name = "later"
    doing = "Looking"
    OFFERS = {"tell_later": "tell"}
    note_of_work: Callable[[str], None]
    _looking: list[Future[str]] = field(default_factory=list, init=False)

    def tell(self, look: Callable[[], str]) -> None:
        """Find something out beside the window, and show the words that it brings; empty: nothing."""
        self._looking.append(in_background(Task("Looking"), look))

    @property
    def waits(self) -> bool:
        """Whether an answer is awaited."""
        return bool(self._looking)

    def advance(self, now: float) -> None:
        """Show the answers that are there."""
        done = [work for work in self._looking if work.done()]
        self._looking = [work for work in self._looking if work not in done]
        for words in filter(None, (work.result() for work in done)):
            self.note_of_work(words)
