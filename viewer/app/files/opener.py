"""Showing a scan: the first one, and each that is opened instead of it."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from ...backends import backend
from ...document.saved_session import SavedSession
from ...errors import InputError, Scan4DError
from ...files import printable
from ...scan.listing import is_there
from ...scan.open import DEMO, open_scan
from ...scan.pose import Pose
from ...scan.reading.frames import USE_ALL
from ...scan.reading.record import Take
from ...scan.reading.takes import ALL
from ...scan.timeline import ScanMessage, Timeline
from ...task import Task, in_background
from ..notices import Notices, Offer, Problem, Refusal
from ..part import Parts, WindowPart
from ..playing.playback import Playback
from ..session import Session, known_as
from ..window import Window
from .frames_dialog import CHOOSE_FRAMES
from .opening import Opened, Opening, Way, find_facts, find_stored
from .same_content import offer_of_change, offer_of_stored
from .scans import title
from .table_dialog import READ_TABLE, is_table

log = logging.getLogger(__name__)
CANNOT_OPEN = "Cannot open: "
_MOST_TAKES = 12  # that have a button


@dataclass(eq=False)
class Opener(WindowPart):
    """Opens scans, and has all parts begin with each.

    opened: the first scan. unit, fps, up: what the command line states of all scans. corrections: of how
    Scan4D reads those that it names, which are `named`. job: what is being opened. reading: the corrections
    that the open scan was opened with.
    """

    name = "opener"
    doing = "Opening"
    turn = -4
    OFFERS = {"open_scan": "open", "refuse": "refuse", "take_up": "take_up"}
    window: Window
    parts: Parts
    session: Session
    playback: Playback
    notices: Notices
    opened: Opened
    unit: str | None
    fps: float | None
    up: str | None
    corrections: Mapping[str, str] | None
    named: Sequence[str]
    tell_later: Callable[[Callable[[], str]], None]
    open_with: Callable[..., None]
    offer_to_locate: Callable[..., None]
    ask_for_table: Callable[..., None]
    ask_for_frames: Callable[[], None]
    correct_reading: Callable[[Mapping[str, str]], None]
    after: Callable[[str], str | None]
    abandon: Callable[[], None]

    def __post_init__(self) -> None:
        self.job = Opening()
        self.reading: Mapping[str, str] = {}
        self._reported: set[str] = set()  # what could not be read of documents
        self._has_begun = self._looks_further = False  # whether a frame of any scan was shown, or looked for
        self._messages_read = 0
        self._texts: dict[str, dict[str, str]] = {}  # corrections of scans, as `known_as` has them

    def open(
        self, scan: str, session: SavedSession | None = None, stated: Mapping[str, str] | None = None
    ) -> None:
        """Open another scan on a worker, instead of one that is being opened; the current one stays
        until a pose of it is there.

        session: to open it with; None: as it was left. stated: corrections of how Scan4D reads it, which win
        over those of its document.
        """
        left = self.session.left(scan)
        find = (lambda: find_stored(scan, self.up)) if left is None else lambda: left
        if stated is None and left is None and session is None and scan in self.named:
            stated = self.corrections
        self._start(scan, Way(find, partial(self._open, scan), session, stated or {}))

    def reread(self) -> None:
        """Open the scan that is open anew, with the corrections that its document has now. Its history, the
        camera and the frame stay."""
        scan = self.session.scan
        as_it_is = replace(self.session.saved(self.session.index), hash=None)
        self._start(scan, Way(lambda: as_it_is, partial(self._open, scan), must_correct=True))

    def _start(self, scan: str, way: Way) -> None:
        self.notices.end("opening")
        self.job.start(scan, title(scan), way)

    def _open(self, scan: str, reading: Mapping[str, str]) -> Timeline:
        return open_scan(scan, self.unit, self.fps, reading)

    def advance(self, now: float) -> None:
        """Show the scan that has been opened, where one has, and pass on what the timeline reports."""
        self._take_opened()
        self._pass_on_messages()

    def _take_opened(self) -> None:
        asked = self.job.scan
        try:
            opened = self.job.take()
        except Scan4DError as error:
            if not self._has_begun and asked is not None:  # else nothing would be shown
                self.open(self.after(asked) or DEMO)
            self.refuse(self._refusal(f"{CANNOT_OPEN}{error}", asked), asked)
            return
        if opened is not None:
            scan, begun = opened
            # It may wait for a pose that is being read.
            in_background(Task("Closing"), self.playback.timeline.close)
            for part in self.parts:
                part.leave_scan()
            self.session.turn_to(scan, begun.left, self.up)
            self.playback.begin(begun.timeline, begun.first)
            self.begin(begun)
            log.debug("opened %s", scan)

    def begin(self, opened: Opened) -> None:
        """Have all parts begin with a scan, whose session and playback have."""
        timeline, self.session.hash_found, _, left, problem, session, self.reading = opened
        timeline.finish = self._find_facts
        if session is not None:
            self.session.take_up(session)
        if self.unit:
            self.session.amend(unit=self.unit)
        if problem and self.session.document.reading:  # which it could not be read with
            self.session.change("Read without corrections", reading=self.reading)
        else:
            self.session.amend(reading=self.reading)
        for part in self.parts:
            part.begin_scan(timeline)
        if problem:
            self.notices.tell_of_scan(problem)
        self._check(session or left)
        if session is None and not (left and left.document.made):
            self._look_for_stored()
        self._messages_read = 0
        self.window.title = f"{timeline.name} - Scan4D"

    def _find_facts(self, pose: Pose) -> None:
        """Find what drawing as it is chosen asks of a pose, on the thread that has read it."""
        name, params = self.session.document.chosen(pose)
        find_facts(pose, of_points=not backend(name).draws_samples(pose, params))

    def take_up(self, session: SavedSession) -> None:
        """Show the open scan as a session has it."""
        self.abandon()
        self.session.take_up(session)
        self.playback.seek(min(session.pose, len(self.playback.timeline) - 1), time.monotonic())
        self._check(session)
        self.window.touch()

    def _check(self, saved: SavedSession | None) -> None:
        """Report what could not be read of what was saved, once, and find out beside the window whether the
        scan is the one that it was saved of."""
        problem = saved and saved.problem
        if problem and problem not in self._reported:
            self._reported.add(problem)
            self.notices.tell_of_scan(problem)
        if saved is not None and saved.hash is not None:
            scan, found = self.session.scan, self.session.hash_found
            self.tell_later(partial(offer_of_change, saved, found, partial(self._begin_anew, scan)))

    def _look_for_stored(self) -> None:
        """Offer what is kept of the open scan's files under another name, as soon as it is found."""
        scan = known_as(self.session.scan)
        use = partial(self.open_with, scan=self.session.scan)
        self.tell_later(partial(offer_of_stored, scan, self.session.hash_found, use))

    def _begin_anew(self, scan: str) -> None:
        """Leave aside what the user made on other files than those of a scan, where it is still open."""
        if scan != self.session.scan:
            return
        self.abandon()
        self.session.change("Start without the saved work", bookmarks=(), parts={}, unread={})
        self._look_for_stored()

    def _pass_on_messages(self) -> None:
        """Report what the timeline has to say.

        Where the frame that the window began with cannot be read, another one is looked for, as where any
        other scan is opened.
        """
        messages = self.playback.timeline.messages[self._messages_read :]
        self._messages_read += len(messages)
        self._has_begun = self._has_begun or self.playback.pose is not None
        if not self._has_begun and not self._looks_further and self.playback.problem is not None:
            self._looks_further = True
            self.open(self.session.scan)
            self._messages_read = len(self.playback.timeline.messages)
            return
        for message in messages:
            self.notices.tell_of_scan(self._shown(message))

    def _shown(self, message: ScanMessage) -> str:
        """A report about the open scan as the window shows it: with buttons where the user has a choice."""
        if message.kind == "take":
            return self._offer_of_takes(self.playback.timeline.reading.takes)
        if message.kind == "aside":
            choices = {CHOOSE_FRAMES: self.ask_for_frames}
            return Offer(message.text.removesuffix(USE_ALL), choices, "aside")
        return message.text

    def _offer_of_takes(self, takes: Sequence[Take]) -> Offer:
        """The message that the folder of the open scan holds several, with a button for each."""
        shown = self.playback.timeline.reading["take"].value
        named = {take.name: f"{take.name} ({take.frames})" for take in takes[:_MOST_TAKES]}
        named |= {ALL: "All"}
        choices = {title: partial(self.correct_reading, {"take": name}) for name, title in named.items()}
        text = (
            f"The folder holds {len(takes)} recordings (takes). Scan4D shows {shown}. Choose one recording, "
            "or all recordings."
        )
        return Offer(text, choices, "takes")

    def _has_moved(self, scan: str) -> bool:
        """Whether a scan is missing that the user has worked on; then offer to locate it."""
        if is_there(scan):
            return False
        try:
            saved = self.session.left(scan) or find_stored(scan, self.up)
        except InputError:
            return False
        if saved is None or not saved.document.made:
            return False
        problem = f"Scan4D cannot find the scan '{printable(scan)}'. Scan4D still has your work on this scan."
        self.offer_to_locate(problem, Path(known_as(scan)).parent, partial(self.open_with, saved))
        return True

    def _refusal(self, problem: str, scan: str | None) -> str:
        """A problem with a scan; of a text table it offers to state how Scan4D reads that."""
        if scan is None or not is_table(scan) or not os.path.isfile(scan):
            return problem
        is_open = self._has_begun and known_as(scan) == known_as(self.session.scan)
        ask = partial(self.ask_for_table, None if is_open else scan)
        return Refusal(problem, {READ_TABLE: ask}, "refusal")

    def refuse(self, problem: str, scan: object = None) -> None:
        """Show why what the user asked for was not opened: in the dialog, where that waits for it.

        scan: that was to be opened; where it has moved, the message offers to locate it.
        """
        if scan is not None and self._has_moved(str(scan)):
            return
        if not any([part.refused(problem) for part in self.parts]):
            self.notices.tell_of_opening(problem if isinstance(problem, Offer) else Problem(problem))

    def close(self) -> None:
        """Give up what is being opened."""
        self.job.cancel()
