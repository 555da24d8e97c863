"""Replaying in the window: a recording is shown again, picture by picture."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ...document.anonymous import in_place, middle_of
from ...document.recording import Entry, Recording, fingerprint_as, place_of, places_of
from ...errors import InputError
from ...scan.pose import Pose
from ...scan.times import frame_in_words
from ..notices import Problem
from ..session import known_as

if TYPE_CHECKING:
    from ..app import App

log = logging.getLogger(__name__)
_LOOK = 0.015  # seconds between looks at whether what is awaited has come


class Replaying:
    """A replay: shows the entries of a recording, each in full for as long as it was shown.

    None is left out: where reading or drawing takes longer than then, time slips. Raises InputError for what
    is wrong in the file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.recording = Recording.load(path)
        self._next = 0
        self._since: float | None = None  # by the clock, when the last one was there in full
        self._asked: str | None = None  # the scan that was to be opened
        self._compared: str | None = None  # the scan whose hash was

    def __str__(self) -> str:
        return f"Replaying {self.path.name}: {self._next} of {len(self.recording.entries)}. Esc to stop."

    def until_next(self, now: float) -> float:
        """Seconds until another picture is due, or is to be looked for while one is awaited."""
        left = 0.0 if self._since is None else self._left(self._since, now)
        return left if left > 0 else _LOOK

    def _left(self, since: float, now: float) -> float:
        """Seconds for which what has been there since then is still shown; not above 0 once it is over."""
        entries = self.recording.entries
        until = entries[self._next].at if self._next < len(entries) else self.recording.seconds
        return since + until - entries[self._next - 1].at - now

    def advance(self, app: App, now: float) -> bool:
        """Show the next picture if it is due and all that it needs is there; whether it goes on."""
        if self._next:
            if self._since is None and not app.viewport.is_complete:
                return True
            self._since = now if self._since is None else self._since
            if self._left(self._since, now) > 0:
                return True
        if self._next == len(self.recording.entries):
            return False
        entry = self.recording.entries[self._next]
        if not self._has_opened(app, entry):
            return app.opening is not None
        timeline = app.playback.timeline
        if entry.pose in timeline.broken or entry.pose >= len(timeline):
            app.note(f"{frame_in_words(entry.pose).capitalize()} cannot be shown: Scan4D skips it.")
            self._next += 1
        elif (pose := timeline.ready(entry.pose)) is None:
            timeline.request(entry.pose)
        else:
            _show(app, entry, pose)
            self._next, self._since = self._next + 1, None
        return True

    def _has_opened(self, app: App, entry: Entry) -> bool:
        """Whether the scan of an entry is open; it is being opened where it is not."""
        if app.opening is not None:
            return False
        scan = app.session.scan
        here = known_as(scan)
        if entry.scan is not None and here not in map(known_as, places_of(entry.scan, self.path)):
            try:
                place = place_of(entry.scan, self.path)
            except InputError as error:
                app.note(Problem(str(error)))
                return False
            if self._asked != place:  # else it could not be opened, and that was told
                self._asked = place
                app.open(place)
            return False
        if self._compared != here:
            self._compared = here
            if entry.hash is not None:
                app.capture.tell_later(partial(self._changed, scan, entry.hash, app.playback.timeline.files))
        return True

    def _changed(self, scan: str, hash: str, files: Sequence[Path]) -> str:
        """Compare a scan with the hash that it had; what to tell of it, nothing where it is the same."""
        if fingerprint_as(hash, files) in (hash, None):
            return ""
        return f"{scan} has changed since {self.path.name} was recorded: pictures may differ."


def _show(app: App, entry: Entry, pose: Pose) -> None:
    """Show what an entry of a recording does. pose: of the scan, which is open."""
    camera, look, place = entry.camera, entry.look, entry.motion
    if entry.anonymous:
        camera, look = in_place(camera, look, pose)
        place = place.in_frame(-middle_of(pose))
    app.seek(entry.pose)
    app.session.laid.replay(entry.pose, place)
    shown = replace(app.document.drawn_by(entry.backend), camera=camera, pivot=None, look=look)
    shown = shown.with_params(entry.backend, entry.params)
    app.session.history.change("Replay", shown, merge="replay")
    app.viewport.rest()
    app.window.touch()
    log.debug("replays frame %d", entry.pose)


class Replayer:
    """Shows recordings again. replaying: the one that is shown, None while none is.

    It does what a user would, from opening scans to looking from elsewhere, so it knows the whole app.
    """

    def __init__(self, app: App) -> None:
        self._app = app
        self.replaying: Replaying | None = None

    def replay(self, path: Path) -> None:
        """Show a recording again, or what a picture tells of itself."""
        try:
            self.replaying = Replaying(path)
        except InputError as error:
            self._app.refuse(str(error))
            return
        self._app.browser.opened()
        self._app.playback.player.pause()
        self._app.steering.turntable.stop()

    def replay_last(self) -> None:
        """Show the recording saved last again."""
        if self._app.capture.last is not None:
            self.replay(self._app.capture.last)

    def on_escape(self) -> bool:
        """End the replay, and stay at what is shown; whether there is one."""
        was_replaying, self.replaying = self.replaying is not None, None
        return was_replaying

    def until_next(self, now: float) -> float:
        """Seconds until there is something to do; infinite where there is nothing."""
        return math.inf if self.replaying is None else self.replaying.until_next(now)

    def advance(self, now: float) -> None:
        """Let the replay go on. The user's own moves end it."""
        if self.replaying is not None and (self._app.moving or not self.replaying.advance(self._app, now)):
            self.replaying = None
