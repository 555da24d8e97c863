"""Decisions that all frames of a scan share: made once, corrected by the user, checked in later frames."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from functools import cache
from inspect import signature
from typing import Any, Literal, NamedTuple, TypeVar

from numpy.typing import NDArray

from .corrections import NOTHING_CORRECTED, Corrections
from .record import Aside, Contradiction, Decision, Reading, Take

ReportKind = Literal[
    "assumed", "unit", "times", "normals", "camera", "aside", "take", "contradiction", "correction",
]  # fmt: skip


T = TypeVar("T")


class Report(NamedTuple):
    """A message about a decision for the user. frame: that it was made from; None: all."""

    kind: ReportKind
    text: str
    frame: int | None


class _Made:
    """State that the frames of a scan share, under `lock`, which deciders hold for as long as they read."""

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.decisions: dict[str, Decision] = {}
        self.settled: dict[str, Decision] = {}
        self.aside: dict[Aside, None] = {}
        self.unused: dict[str, None] = {}
        self.takes: tuple[Take, ...] = ()
        self.contradictions: dict[tuple[int, str], Contradiction] = {}
        self.reports: dict[tuple[str, str], Report] = {}
        self.frames = 1
        self.shared: dict[object, tuple[object, Any]] = {}


class Decided:
    """The decisions about one scan, as a reader gets them with a frame. Any thread may call it.

    corrections: of the user. frame: which one is being read. other_colors: colours of some other frames as
    stored, (N, C) each, read when asked, for when those of one frame are not enough.
    """

    def __init__(
        self,
        corrections: Corrections = NOTHING_CORRECTED,
        other_colors: Callable[[], Iterator[NDArray]] = lambda: iter(()),
    ) -> None:
        self.corrections = corrections
        self.other_colors = other_colors
        self.frame = 0
        self._made = _Made()

    def at(self, frame: int) -> Decided:
        """Return the same decisions, for a reader of this frame."""
        other = Decided(self.corrections, self.other_colors)
        other.frame, other._made = frame, self._made
        return other

    @property
    def frames(self) -> int:
        """How many frames the scan has, as far as its source says."""
        return self._made.frames

    @frames.setter
    def frames(self, count: int) -> None:
        self._made.frames = count

    def shared(self, name: object, key: object, make: Callable[[], T]) -> T:
        """Return the result of `make`, and the same object for later frames as long as their key is equal.

        name: of what is shared; one object of each name is held, and none where the scan has one frame.
        """
        if self.frames == 1:
            return make()
        with self._made.lock:
            held = self._made.shared.get(name)
        if held is not None and held[0] == key:
            found: T = held[1]
            return found
        made = make()
        with self._made.lock:
            self._made.shared[name] = key, made
        return made

    def settle(self, key: str, decide: Callable[[], Decision]) -> Decision:
        """The decision about a key for the whole scan. The first call makes it; `decide` may read frames."""
        with self._made.lock:
            if key not in self._made.settled:
                self._made.settled[key] = self._made.decisions[key] = decide()
            return self._made.settled[key]

    def note(self, *decisions: Decision) -> None:
        """Put decisions into the record where it has none about their keys yet."""
        with self._made.lock:
            for decision in decisions:
                self._made.decisions.setdefault(decision.key, decision)

    def replace(self, *decisions: Decision) -> None:
        """Put decisions into the record in place of earlier ones."""
        with self._made.lock:
            self._made.decisions.update({decision.key: decision for decision in decisions})

    def note_unused(self, text: str) -> None:
        """Put into the record what the file holds and Scan4D does not use."""
        with self._made.lock:
            self._made.unused[text] = None

    def leave_aside(self, *files: Aside) -> None:
        """Put files into the record that the scan does not use."""
        with self._made.lock:
            self._made.aside.update(dict.fromkeys(files))

    def note_takes(self, takes: tuple[Take, ...]) -> None:
        """Put into the record which scans the folder holds."""
        with self._made.lock:
            self._made.takes = takes

    def contradict(self, key: str, what: str) -> None:
        """Record and report that this frame does not fit a decision; once for a key and a frame."""
        with self._made.lock:
            self._made.contradictions.setdefault((self.frame, key), Contradiction(self.frame, key, what))
        self.report("contradiction", what)

    def report(self, kind: ReportKind, text: str) -> None:
        """Have the user see a message; each text of a kind once a scan."""
        with self._made.lock:
            self._made.reports.setdefault((kind, text), Report(kind, text, self.frame))

    def reports(self, after: int = 0) -> list[Report]:
        """The messages so far, from number `after` on."""
        with self._made.lock:
            return list(self._made.reports.values())[after:]

    @property
    def reading(self) -> Reading:
        """The record as far as frames were read."""
        with self._made.lock:
            made = self._made
            return Reading(
                dict(made.decisions),
                tuple(made.aside),
                tuple(made.unused),
                made.takes,
                tuple(made.contradictions.values()),
            )

    def ignored(self) -> list[str]:
        """The keys that the user corrects and no decision has used so far."""
        with self._made.lock:
            used = {key for key, one in self._made.decisions.items() if one.source == "user"}
        return [key for key in self.corrections if key not in used]


def ask(hook: Callable[..., Any], *words: object, decided: Decided) -> Any:
    """Call a function of a reader, with the decisions where it has a parameter `decided`."""
    return hook(*words, decided=decided) if _takes_decided(hook) else hook(*words)


@cache
def _takes_decided(hook: Callable[..., Any]) -> bool:
    return "decided" in signature(hook).parameters
