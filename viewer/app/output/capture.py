"""Pictures and recordings of what is shown."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future, wait
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from threading import Lock

import numpy as np
from imgui_bundle import icons_fontawesome_6 as icons
from numpy.typing import NDArray

from ...choice.choose import Choice
from ...document.journal import Journal, journal_folder, journals, saved, written
from ...document.landmarks import Landmarks
from ...document.recording import Entry, Recorder, Recording
from ...drawing.request import Request
from ...errors import InputError, explained, failure_in_words
from ...files import free_file, working_folder
from ...output.export import with_hidden, write_png
from ...output.film import FILM_SUFFIX
from ...output.labels import LabelPlaces
from ...output.legend import Legend, Marks
from ...output.marked import marked
from ...output.overlays import NOTHING_DRAWN, DrawnMarks
from ...picture.surface import Surface
from ...task import Task, in_background
from ..commands import Command
from ..keys import Keys
from ..notices import Offer, Problem
from ..part import WindowPart
from ..playing.playback import Playback
from ..scene.viewport import Viewport
from ..session import Session
from .unsaved_picture import UnsavedPicture

_PATIENCE = 10.0  # seconds that closing waits for pictures


@dataclass(eq=False)
class Capture(WindowPart):
    """Saves what is shown in the working directory.

    marks_of_files: brings the marks of what is saved. make_film: of a recording, under this name. range_note:
    brings what the colour bar of the view says. drawn: brings what tools draw over a frame. choice_of: brings
    the choice that a picture was drawn by. label_places: brings the positions of the view's labels.
    recorder: takes down what is shown, None while nothing is recorded. last: the recording saved last.
    """

    name = "capture"
    doing = "Saving"
    OFFERS = {"shown_entry": "shown", "last_recording": "last"}
    session: Session
    playback: Playback
    viewport: Viewport
    note_of_work: Callable[[str], None]
    marks_of_files: Callable[[], Marks]
    make_film: Callable[[Recording, Path], object]
    range_note: Callable[[], str] = str
    drawn: Callable[[int], DrawnMarks] = lambda _: NOTHING_DRAWN
    choice_of: Callable[[Request], Choice | None] = lambda _: None
    label_places: Callable[[], LabelPlaces] = LabelPlaces
    keys: Keys | None = None

    def __post_init__(self) -> None:
        self.recorder: Recorder | None = None
        self.last: Path | None = None
        self._journal: Journal | None = None  # of what is recorded
        self._unsaved: list[tuple[UnsavedPicture, Callable[[Surface], None]]] = []
        self._saving: list[Future[str]] = []  # files; each brings words for the user
        self._naming = Lock()  # one free name at a time

    def shown(self, marks: Marks | None = None) -> Entry | None:
        """The entry that says what the picture shows, None where there is none.

        marks: over it; None: those that what is saved has. Raises InputError where its colours are by numbers
        that no file has.
        """
        session, viewport, request = self.session, self.viewport, self.viewport.request
        if not viewport.is_there or request is None:
            return None
        drawn = self.drawn(request.pose.index)
        kept = replace(request, layers=request.layers.without(drawn.replayable))
        entry = Entry.of(
            kept, session.scan, session.hash, viewport.size, self.playback.unit,
            self.marks_of_files() if marks is None else marks, self.choice_of(request),
        )  # fmt: skip
        entry = entry.with_reading(self.playback.timeline)
        entry = entry.with_notes(session.document.part(Landmarks).notes)
        entry = entry.with_drawn(drawn)
        labels = self.label_places().spots if entry.marks else ()
        return replace(entry, shown_unit=session.document.shown_unit, labels=labels)

    def screenshot(self) -> None:
        """Save the picture as it is shown, in full and without panels; what is not drawn of it yet is drawn
        in slices first."""
        viewport, request = self.viewport, self.viewport.request
        if viewport.surface is None or request is None or not viewport.is_there:
            self.note_of_work("There is no picture to save yet.")
            return
        if any(unsaved.request is request for unsaved, _ in self._unsaved):
            return
        try:
            entry = self.shown()
        except InputError as error:
            entry = None
            self.note_of_work(Problem(f"Scan4D cannot replay this picture: {error}"))
        legend = None
        if entry is not None:
            plain = entry.legend(self.playback.timeline, request.pose)
            legend = replace(plain, range_note=self.range_note())
        save = partial(self._begin_saving, entry, legend, self.session.hash_found)
        if viewport.is_refined:
            save(viewport.surface)
        else:
            self._unsaved.append((UnsavedPicture(viewport.renderer, request, viewport.size), save))

    @property
    def task(self) -> Task | None:
        """The picture that is being drawn to be saved, None without one."""
        return self._unsaved[0][0].task if self._unsaved else None

    def _draw_unsaved(self) -> None:
        """Draw a slice of the first picture that is to be saved, and begin to save it once it is complete."""
        unsaved, save = self._unsaved[0]
        try:
            surface = None if unsaved.task.cancelled else unsaved.advance()
            if surface is not None:
                save(surface)
        except Exception as error:  # whatever a scan brings, the window stays
            self.note_of_work(Problem(failure_in_words("Drawing the picture to save", error)))
            unsaved.task.cancel()
            surface = None
        if surface is not None or unsaved.task.cancelled:
            self._unsaved.pop(0)
            unsaved.release()

    def _begin_saving(
        self, entry: Entry | None, legend: Legend | None, hash: Future[str | None], surface: Surface
    ) -> None:
        """Save what a surface shows, with the marks of its legend."""
        legend = None if legend is None else with_hidden(legend, surface)
        finish = partial(marked, surface.image(), legend, surface.color_range, surface.value_kind)
        work = partial(self._save_picture, finish, entry, hash)
        self._saving.append(in_background(Task("Saving"), work))

    # --- recording --------------------------------------------------------------------

    def toggle_recording(self) -> None:
        """Take down what is shown from now on; or stop, and save it."""
        now = time.monotonic()
        if self.recorder is None:
            try:
                self.shown()
            except InputError as error:
                self.note_of_work(Problem(f"Cannot record: {error}"))
                return
            self.recorder = Recorder(now)
            keys = self.keys.of["record"] if self.keys else ""
            self.note_of_work(f"Recording the view ({keys} stops)" if keys else "Recording the view")
            self._begin_journal()
            self.note_shown()
            return
        recorder, self.recorder = self.recorder, None
        journal, self._journal = self._journal, None
        if len(recorder):
            self._save_recording(recorder.finish(now), journal)
        else:
            self.note_of_work("The recording is empty: the window showed nothing.")
            if journal is not None:
                journal.remove()

    def _save_recording(self, recording: Recording, journal: Journal | None) -> None:
        """Save a recording, and offer a film of it. journal: what is there of it already."""
        try:
            path = self.last = written(recording, working_folder())
        except Exception as error:  # whatever a folder brings, the window stays
            words = failure_in_words("Saving the recording", error)
            if journal is not None:
                journal.leave()
                words += " Scan4D keeps what it has recorded, and saves the recording at the next start."
            self.note_of_work(Problem(words))
            return
        if journal is not None:
            journal.remove()
        choices = {
            "Save as film": lambda: self.make_film(recording, path.with_suffix(FILM_SUFFIX)),
            "Keep recording only": lambda: None,
        }
        self.note_of_work(Offer(f"Recorded {recording.seconds:.1f} s.  Saved {path}", choices, "recording"))

    def note_shown(self) -> None:
        """Take down what is shown where that is being recorded; where that cannot be, the recording ends."""
        if self.recorder is None:
            return
        try:
            entry = self.shown()
        except InputError as error:
            self.note_of_work(Problem(f"The recording has stopped: {error}"))
            self.toggle_recording()
            return
        if entry is None:
            return
        change = self.recorder.note(entry, time.monotonic())
        if change is not None and self._journal is not None and not self._journal.is_closed:
            try:
                self._journal.add(change)
            except OSError as error:
                self._journal.close()  # it goes when the recording is saved
                self._tell_unsafe(error)

    def _begin_journal(self) -> None:
        try:
            self._journal = Journal(working_folder())
        except OSError as error:
            self._tell_unsafe(error)

    def _tell_unsafe(self, error: OSError) -> None:
        what, _ = explained(error)
        self.note_of_work(
            f"Scan4D cannot write to {journal_folder()}: {what}. Until you stop the recording, Scan4D "
            "keeps it only in memory."
        )

    def find_unfinished(self) -> None:
        """Save what processes have recorded that were killed meanwhile."""
        for journal in journals():
            self._saving.append(in_background(Task("Saving"), partial(_saved_late, journal)))

    def _save_picture(
        self, finish: Callable[[], NDArray[np.uint8]], entry: Entry | None, hash: Future[str | None]
    ) -> str:
        """Write the image that `finish` brings under the next free name, with the entry's text and the scan's
        hash, which this waits for.

        Returns what to tell.
        """
        text = None if entry is None else replace(entry, hash=hash.result()).description()
        with self._naming:
            path = free_file(working_folder(), ".png")
            try:
                write_png(finish(), path, text)
            except Exception as error:  # whatever a folder brings, the window stays
                return failure_in_words(f"Saving {path}", error)
        return f"Saved {path}"

    def advance(self, now: float) -> None:
        """Draw a slice of what is to be saved, and tell of the work that is done: of files in the order of
        their names."""
        if self._unsaved:
            self._draw_unsaved()
        while self._saving and self._saving[0].done():
            if words := self._saving.pop(0).result():
                self.note_of_work(words)

    @property
    def waits(self) -> bool:
        """Whether something is being saved."""
        return bool(self._unsaved or self._saving)

    def finish(self) -> None:
        """Save what is being recorded, and wait for pictures that are being drawn and written, but not for a
        disk that does not answer."""
        if self.recorder is not None:
            self.toggle_recording()
        end = time.monotonic() + _PATIENCE
        while self._unsaved and time.monotonic() < end:
            self._draw_unsaved()
        wait(self._saving, _PATIENCE)
        self.advance(time.monotonic())

    COMMANDS = (
        Command(
            "screenshot", "Screenshot", screenshot, "P", short="Screenshot", icon=icons.ICON_FA_CAMERA
        ),
        Command(
            "record", "Record", toggle_recording, "R", is_on=lambda capture: capture.recorder is not None,
            short="Record", icon=icons.ICON_FA_CIRCLE_DOT,
        ),
    )  # fmt: skip


def _saved_late(journal: Path) -> str:
    """Save the recording that a journal holds; what to tell of it, nothing where it holds none."""
    try:
        path = saved(journal)
    except InputError as error:
        return str(error)
    return f"Saved an unfinished recording: {path}" if path else ""
