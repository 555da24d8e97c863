"""The scans that the user can go to without a dialog."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from ...document.schema import ReadBy, ScanName, structured
from ...errors import InputError
from ...files import printable
from ...scan.listing import is_there, named_scans, scans_beside
from ...scan.open import DEMO, STANDARD_INPUT
from ...scan.timeline import Timeline
from ...task import Task, in_background
from ..commands import Command, Item, Listing
from ..notices import Problem
from ..part import WindowPart, remembered
from ..session import Session, known_as

MOST_RECENT = 15  # scans that are remembered


def _read_recent(data: Any) -> tuple[str, ...]:
    return tuple(dict.fromkeys(structured(tuple[ScanName, ...], data)))[:MOST_RECENT]


Recent = Annotated[tuple[str, ...], ReadBy(_read_recent)]


@dataclass(eq=False)
class Scans(WindowPart):
    """Lists of scans: those to go through one after another, and those opened lately.

    listed: what the user named together, else the scans in the folder of the open one, in natural order.
    are_together: whether the user did. recent: the last MOST_RECENT that were opened, newest first, as
    `known_as` has them. named: what the user named at the start, at least one.
    """

    name = "scans"
    doing = "Listing scans"
    CONDITIONS = {"several scans": lambda scans: len(scans.listed) > 1}
    OFFERS = {"list_scans": "open", "after": "after"}
    session: Session
    note_of_opening: Callable[[str], None]
    refuse: Callable[..., None]
    open_scan: Callable[[str], None]
    named: Sequence[str]
    recent: Recent = remembered(())

    def __post_init__(self) -> None:
        self.listed: list[str] = []
        self.are_together = False
        self._asked = ""  # in the list: what was asked for last
        self._together = list(dict.fromkeys(self.named))
        self._there: frozenset[str] = frozenset()  # of the recent ones
        self._naming: Future[tuple[list[str], list[InputError]]] | None = None
        self._looking: Future[tuple[list[str], frozenset[str]]] | None = None

    def open(self, names: Sequence[str]) -> None:
        """Open the first of what the user names together, and list them all; looked at beside the window."""
        self._naming = in_background(Task("Looking for scans"), lambda: named_scans(names))

    def tell(self, problems: Sequence[InputError], is_all: bool = False) -> None:
        """Tell in one message what cannot be opened. is_all: whether nothing else was asked for."""
        if problems:
            others = f" {len(problems) - 1} other scans cannot be opened either." if len(problems) > 1 else ""
            text = f"Cannot open: {problems[0]}.{others}"
            if is_all:
                self.refuse(text, problems[0].where)
            else:
                self.note_of_opening(Problem(text))

    def begin_scan(self, timeline: Timeline) -> None:
        """Take in that a scan was opened. The list stays where that is in it, else it is made anew."""
        scan = self._asked = self.session.scan
        name = known_as(scan)
        self.recent = (name, *(other for other in self.recent if other != name))[:MOST_RECENT]
        if len(self._together) > 1 and scan in self._together:
            self.listed, self._together, self.are_together = self._together, [], True
        is_listed = len(self.listed) > 1 and scan in self.listed
        if not is_listed:
            self.listed, self.are_together = [scan], False
        self.look(scan, is_listed)

    def look(self, scan: str, is_listed: bool = True) -> None:
        """Find out, beside the window, what stands beside a scan and which recent ones are still there."""
        recent, listed = self.recent, self.listed

        def work() -> tuple[list[str], frozenset[str]]:
            return listed if is_listed else scans_beside(scan), frozenset(filter(is_there, recent))

        self._looking = in_background(Task("Looking for scans"), work)

    @property
    def waits(self) -> bool:
        """Whether something is being looked for."""
        return self._naming is not None or self._looking is not None

    def refused(self, problem: str) -> bool:
        """Look again what there is, since a scan could not be opened."""
        self.look(self.session.scan)
        return False

    def advance(self, now: float) -> bool:
        """Take in what was found; whether there was anything."""
        if self._naming is not None and self._naming.done():
            (scans, problems), self._naming = self._naming.result(), None
            if scans:
                self._together = list(dict.fromkeys(scans))
                self.open_scan(scans[0])
            self.tell(problems, is_all=not scans)
        if self._looking is None or not self._looking.done():
            return False
        self.listed, self._there = self._looking.result()
        self._looking = None
        return True

    def step(self, count: int) -> None:
        """Open the scan so many entries further in the list, round its end; past what cannot be opened."""
        if len(self.listed) > 1:
            current = self._asked if self._asked in self.listed else self.listed[0]
            self._asked = self.listed[(self.listed.index(current) + count) % len(self.listed)]
            self.open_scan(self._asked)

    def after(self, scan: str) -> str | None:
        """The scan that the user named behind one of those named together; None where that is the last."""
        later = self.listed[self.listed.index(scan) + 1 :] if scan in self.listed else []
        return later[0] if later and self.are_together else None

    @property
    def lately(self) -> list[str]:
        """The recent ones that are still there, without the open one."""
        return [one for one in self.recent if one in self._there and one != known_as(self.session.scan)]

    def items(self, scans: Iterable[str]) -> Iterator[Item]:
        """Entries of a menu for some of them."""
        shown = known_as(self.session.scan)
        for scan in scans:
            yield title(scan), partial(self.open_scan, scan), known_as(scan) == shown

    COMMANDS = (
        Listing("Open recent", lambda scans: scans.items(scans.lately), "open_recent"),
        Listing("Scans", lambda scans: scans.items(scans.listed), "scans"),
        Command("next_scan", "Next scan", lambda scans: scans.step(1), "PageDown", "several scans"),
        Command("previous_scan", "Previous scan", lambda scans: scans.step(-1), "PageUp", "several scans"),
    )


_TITLES = {DEMO: "Demo scan", STANDARD_INPUT: "Standard input"}


def title(scan: str) -> str:
    """A scan's name for lists."""
    return _TITLES.get(scan) or printable(Path(known_as(scan)).name or scan)
