"""Pictures and recordings of what is shown, and replaying them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from concurrent.futures import Future, wait
from functools import partial
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING

from ...errors import InputError, explained
from ...export import write_png
from ...files import free_file, working_folder
from ...journal import Journal, journals, saved
from ...recording import Entry, Recorder
from ...task import Task, in_background
from ..failures import in_words
from .replaying import Replaying

if TYPE_CHECKING:
    from ..app import App

_LOOK = 0.02  # seconds between looks at whether a picture has been written


class Capture:
    """Saves what is shown in the working directory.

    recorder: takes down what is shown, None while nothing is recorded. replaying: a recording that is
    shown again, None while none is. last: the recording saved last.
    """

    def __init__(self, app: App) -> None:
        self._app = app
        self.recorder: Recorder | None = None
        self.replaying: Replaying | None = None
        self.last: Path | None = None
        self._journal: Journal | None = None  # of what is recorded
        self._words: list[Future[str]] = []  # that there will be to tell, in their order
        self._naming = Lock()  # one free name at a time

    def shown(self) -> Entry | None:
        """What the picture shows, None where there is none."""
        app = self._app
        request = app.picture.request
        if not app.picture.is_there or request is None:
            return None
        return Entry.of(request, app.session.scan, app.hash, app.picture.size, app.unit)

    def screenshot(self) -> None:
        """Save the picture as it is shown, in full and without panels."""
        self._app.picture.finish()
        surface, entry = self._app.picture.surface, self.shown()
        if surface is None or entry is None:
            self._app.note("There is no picture to save.")
            return
        image, text = surface.image(), entry.description()
        work = partial(self._saved, ".png", lambda path: write_png(image, path, text))
        self.tell_later(lambda: work()[1])

    # --- recording --------------------------------------------------------------------

    def toggle_recording(self) -> None:
        """Take down what is shown from now on; or stop, and save it."""
        now = time.monotonic()
        if self.recorder is None:
            self.recorder = Recorder(now)
            self._app.note("Recording what is shown, until you stop it.")
            self._begin_journal()
            self.note_shown()
            return
        recorder, self.recorder = self.recorder, None
        path, words = None, "Nothing was shown while recording."
        if len(recorder):
            path, words = self._saved(".json", recorder.finish(now).save)
            self.last = path or self.last
        self._end_journal(is_needed=len(recorder) > 0 and path is None)
        self._app.note(words)

    def note_shown(self) -> None:
        """Take down what is shown where that is being recorded."""
        if self.recorder is None or (entry := self.shown()) is None:
            return
        change = self.recorder.note(entry, time.monotonic())
        if change is not None and self._journal is not None:
            try:
                self._journal.add(change)
            except OSError as error:
                self._tell_unsafe(error)

    def _begin_journal(self) -> None:
        try:
            self._journal = Journal(working_folder())
        except OSError as error:
            self._tell_unsafe(error)

    def _tell_unsafe(self, error: OSError) -> None:
        self._end_journal(is_needed=True)
        what, _ = explained(error)
        self._app.note(f"The recording is kept in memory alone until you stop it: {what}.")

    def _end_journal(self, is_needed: bool) -> None:
        """is_needed: to save what is in it at the next start."""
        journal, self._journal = self._journal, None
        if journal is not None:
            (journal.leave if is_needed else journal.remove)()

    def find_unfinished(self) -> None:
        """Save what processes have recorded that were killed meanwhile."""
        for journal in journals():
            self.tell_later(partial(_saved_late, journal))

    def _saved(self, suffix: str, write: Callable[[Path], None]) -> tuple[Path | None, str]:
        """Write a file under the next free name; returns it, None where that fails, and what to tell."""
        with self._naming:
            path = free_file(working_folder(), suffix)
            try:
                write(path)
            except Exception as error:  # whatever a folder brings, the window stays
                return None, in_words(f"Saving {path}", error)
        return path, f"Saved {path}"

    def tell_later(self, work: Callable[[], str]) -> None:
        """Do some work beside the window, and tell what comes of it; empty: nothing."""
        self._words.append(in_background(Task("Saving"), work))

    def _tell(self) -> None:
        """Tell of the work that is done."""
        while self._words and self._words[0].done():
            if words := self._words.pop(0).result():
                self._app.note(words)

    # --- replaying --------------------------------------------------------------------

    def replay(self, path: Path) -> None:
        """Show a recording again, or what a picture tells of itself."""
        try:
            self.replaying = Replaying(path)
        except InputError as error:
            self._app.note(str(error))
            return
        self._app.playback.player.pause()
        self._app.steering.turntable.stop()

    def replay_last(self) -> None:
        """Show the recording saved last again."""
        if self.last is not None:
            self.replay(self.last)

    def stop_replaying(self) -> None:
        """Stay at what is shown."""
        self.replaying = None

    def until_next(self, now: float) -> float:
        """Seconds until there is something to do; infinite where there is nothing."""
        soon = _LOOK if self._words else math.inf
        return soon if self.replaying is None else min(soon, self.replaying.until_next(now))

    def advance(self, now: float) -> None:
        """Let the replay go on. The user's own moves end it."""
        self._tell()
        if self.replaying is not None and (self._app.moving or not self.replaying.advance(self._app, now)):
            self.stop_replaying()

    def close(self) -> None:
        """Save what is being recorded, and wait for pictures that are being written."""
        if self.recorder is not None:
            self.toggle_recording()
        wait(self._words)
        self._tell()


def _saved_late(journal: Path) -> str:
    """What to tell of the recording that a journal becomes; nothing where none does."""
    try:
        path = saved(journal)
    except InputError as error:
        return str(error)
    return f"Saved a recording that was not finished: {path}" if path else ""
