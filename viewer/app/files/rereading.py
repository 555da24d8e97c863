"""Reading the open scan anew as soon as its document has other corrections of how Scan4D reads it."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ...scan.reading.corrections import Corrections
from ...scan.reading.record import KEYS, Decision, Reading
from ...scan.units import checked_unit
from ..notices import Offer, Problem, Refusal
from ..part import WindowPart
from ..playing.playback import Playback
from ..scene.steering import Steering
from ..session import Session, known_as
from .opener import CANNOT_OPEN, Opener

log = logging.getLogger(__name__)


@dataclass(eq=False)
class Rereading(WindowPart):
    """Corrects how Scan4D reads the open scan: a correction is a step of the history, and the scan is opened
    anew with it. Where Scan4D cannot read the scan so, the step goes and the scan stays as it is.

    The frame and the camera stay; a camera that the user has not moved is fitted to the new points.
    """

    name = "rereading"
    doing = "Reading the scan anew"
    turn = -5
    OFFERS = {"correct_reading": "correct_all"}
    session: Session
    playback: Playback
    opener: Opener
    steering: Steering
    note_of_opening: Callable[[str], None]

    def __post_init__(self) -> None:
        self._asked: Mapping[str, str] | None = None  # the corrections that it is being opened with
        self._step = ""  # the name of the last correction in the history
        self._refits = False  # whether the camera is to be fitted

    @property
    def record(self) -> Reading:
        """The record of the open scan, with what the panel states about it."""
        record, document = self.playback.timeline.reading, self.session.document
        if document.unit is not None and document.unit != record["unit"].value:
            stated = Decision("unit", document.unit, "user", "the panel", changes_numbers=True)
            record = record.with_(stated)
        return record

    def is_corrected(self, key: str) -> bool:
        """Whether the user says how Scan4D reads this."""
        document = self.session.document
        by_fields = {"unit": document.unit, "times": document.fps or document.times_by_names or None}
        return key in document.reading or by_fields.get(key) is not None

    def text_of(self, key: str) -> str:
        """The text of a correction; empty where there is none."""
        return self.session.document.reading.get(key, "")

    def correct(self, key: str, text: str | None) -> None:
        """Have Scan4D read the scan with this correction. text: as `--read` takes it; None: as Scan4D decides
        by itself. Raises InputError where it is unusable."""
        others = {name: one for name, one in self.session.document.reading.items() if name != key}
        fields: dict[str, object] = {"reading": others}
        if key == "unit":
            fields["unit"] = None if text is None else checked_unit(text.strip())
        elif text is not None:
            fields["reading"] = dict(Corrections.parse({**others, key: text}).texts)
        if key == "times":
            fields |= {"fps": None, "times_by_names": False}
        label = KEYS[key].lower()
        self._step = f"Correct the {label}" if text is not None else f"Reset the {label}"
        self.session.change(self._step, **fields)

    def correct_all(self, corrections: Mapping[str, str], scan: str | None = None) -> None:
        """Have Scan4D read a scan with these corrections, in one step.

        corrections: key -> text as `--read` takes it. They amend those that hold, and an empty text ends one.
        scan: to open with them; None: the open one. Raises InputError where one is unusable.
        """
        if scan is not None and known_as(scan) != known_as(self.session.scan):
            self.opener.open(scan, stated={key: text for key, text in corrections.items() if text})
            return
        texts = {**self.session.document.reading, **corrections}
        reading = Corrections.parse({key: text for key, text in texts.items() if text}).texts
        fields: dict[str, object] = {"reading": dict(reading)}
        if "times" in corrections:
            fields |= {"fps": None, "times_by_names": False}
        self._step = "Correct how Scan4D reads the scan"
        self.session.change(self._step, **fields)

    def advance(self, now: float) -> None:
        """Open the scan anew where its document has other corrections than it was opened with."""
        wanted, job = self.session.document.reading, self.opener.job
        if job.scan is None or known_as(job.scan) != known_as(self.session.scan):
            self._asked = None  # nothing is opened, or another scan
        if wanted in (self.opener.reading, self._asked) or (job.scan is not None and self._asked is None):
            return
        self._refits = self.steering.is_at_first
        log.debug("reading the scan again with %s", dict(wanted))
        self.opener.reread()
        self._asked = wanted

    def refused(self, problem: str) -> bool:
        """Take back corrections that the scan cannot be read with, and show why; whether there are any."""
        if self._asked is None:
            return False
        self._asked = None
        if self.session.history.undoes == self._step:
            self.session.history.undo()
        if self.session.document.reading != self.opener.reading:
            self.session.change("Remove the correction", reading=self.opener.reading)
        why = problem.removeprefix(CANNOT_OPEN)
        text = f"Scan4D cannot read the scan with this correction, and removes the correction: {why}"
        if isinstance(problem, Offer):
            self.note_of_opening(Refusal(text, problem.choices, problem.about))
        else:
            self.note_of_opening(Problem(text))
        return True

    def begin_scan(self, timeline: object) -> None:
        """Take in that a scan was opened."""
        if self._asked is not None and self._refits:
            self.session.amend(camera=None, pivot=None)
        self._asked, self._refits = None, False
