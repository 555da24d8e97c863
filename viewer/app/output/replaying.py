"""Replaying in the window: a recording is shown again, picture by picture."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from ...document.anonymous import in_scan_coordinates, middle_of
from ...document.recording import Entry, Recording, fingerprint_as, scan_path, scan_paths
from ...errors import InputError
from ...files import printable
from ...scan.listing import is_there
from ...scan.pose import Pose
from ...scan.times import frame_in_words
from ..commands import Command
from ..files.opener import Opener
from ..notices import Problem
from ..part import WindowPart
from ..playing.playback import Playback
from ..scene.steering import Steering
from ..scene.viewport import Viewport
from ..session import Session, known_as

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
        self.next = 0
        self.since: float | None = None  # by the clock, when the last one was there in full
        self.asked: str | None = None  # the scan that was to be opened
        self.compared: str | None = None  # the scan whose hash was
        self.read_as: Mapping[str, str] | None = None  # the corrections that the scan was to be read with
        self.located: dict[str, str] = {}  # scans as entries name them -> where the user says that they are

    def __str__(self) -> str:
        return f"Replaying {self.path.name}: {self.next} of {len(self.recording.entries)}. Esc to stop."

    def paths(self, scan: str) -> list[str]:
        """Paths where a scan may be that an entry names."""
        located = self.located.get(scan)
        return scan_paths(scan, self.path) if located is None else [located]

    def until_next(self, now: float) -> float:
        """Seconds until another picture is due, or is to be looked for while one is awaited."""
        left = 0.0 if self.since is None else self.left(self.since, now)
        return left if left > 0 else _LOOK

    def left(self, since: float, now: float) -> float:
        """Seconds for which what has been there since then is still shown; not above 0 once it is over."""
        entries = self.recording.entries
        until = entries[self.next].at if self.next < len(entries) else self.recording.seconds
        return since + until - entries[self.next - 1].at - now


@dataclass(eq=False)
class Replayer(WindowPart):
    """Shows recordings again. replaying: the one that is shown, None while none is."""

    name = "replayer"
    layer = 30
    doing = "Replaying"
    turn = -3
    OFFERS = {"replay": "replay", "is_replaying": "is_on"}
    session: Session
    playback: Playback
    viewport: Viewport
    steering: Steering
    opener: Opener
    note: Callable[[str], None]
    refuse: Callable[[str], None]
    open_scan: Callable[[str], None]
    close_browser: Callable[[], None]
    tell_later: Callable[[Callable[[], str]], None]
    offer_to_locate: Callable[..., None]
    last_recording: Callable[[], Path | None]
    redraw: Callable[[], None]

    def __post_init__(self) -> None:
        self.replaying: Replaying | None = None

    def replay(self, path: Path) -> None:
        """Show a recording again, or what a picture tells of itself."""
        try:
            replaying = Replaying(path)
        except InputError as error:
            self.refuse(str(error))
            return
        self._begin(replaying)

    def _begin(self, replaying: Replaying) -> None:
        self.replaying = replaying
        self.close_browser()
        self.playback.player.pause()
        self.steering.turntable.stop()

    @property
    def is_on(self) -> bool:
        """Whether a recording is shown."""
        return self.replaying is not None

    def replay_last(self) -> None:
        """Show the recording saved last again."""
        if (last := self.last_recording()) is not None:
            self.replay(last)

    def on_escape(self) -> bool:
        """End the replay, and stay at what is shown; whether there is one."""
        was_replaying, self.replaying = self.is_on, None
        return was_replaying

    def next_change(self, now: float) -> float:
        """Seconds until there is something to do; infinite where there is nothing."""
        return math.inf if self.replaying is None else self.replaying.until_next(now)

    def advance(self, now: float) -> None:
        """Let the replay go on. The user's own moves end it."""
        moves = self.playback.player.playing or self.steering.moves
        if self.replaying is not None and (moves or not self._go_on(self.replaying, now)):
            self.replaying = None

    def _go_on(self, replaying: Replaying, now: float) -> bool:
        """Show the next picture if it is due and all that it needs is there; whether it goes on."""
        if replaying.next:
            if replaying.since is None and not self.viewport.is_complete:
                return True
            replaying.since = now if replaying.since is None else replaying.since
            if replaying.left(replaying.since, now) > 0:
                return True
        if replaying.next == len(replaying.recording.entries):
            return False
        entry = replaying.recording.entries[replaying.next]
        if not self._has_opened(replaying, entry):
            return self.opener.job.scan is not None
        if not self._is_read_as(replaying, entry):
            return True
        timeline = self.playback.timeline
        if timeline.averaging.frames != entry.average:
            if self.session.document.average != entry.average:
                self.session.change("Replay", merge="replay", average=entry.average)
            return True
        if entry.pose in timeline.empty:
            self._show(entry, timeline.drawn(entry.pose))
            replaying.next, replaying.since = replaying.next + 1, None
        elif entry.pose in timeline.broken or entry.pose >= len(timeline):
            self.note(f"Scan4D cannot show {frame_in_words(entry.pose)}, and skips this frame.")
            replaying.next += 1
        elif (pose := timeline.ready(entry.pose)) is None:
            timeline.request(entry.pose)
        else:
            self._show(entry, pose)
            replaying.next, replaying.since = replaying.next + 1, None
        return True

    def _has_opened(self, replaying: Replaying, entry: Entry) -> bool:
        """Whether the scan of an entry is open; it is being opened where it is not."""
        if self.opener.job.scan is not None:
            return False
        scan = self.session.scan
        here = known_as(scan)
        if entry.scan is not None and here not in map(known_as, replaying.paths(entry.scan)):
            try:
                path = replaying.located.get(entry.scan) or scan_path(entry.scan, replaying.path)
            except InputError as error:
                self.note(Problem(str(error)))
                return False
            if not is_there(path):
                self._offer_to_locate(replaying, entry.scan)
                return False
            if replaying.asked != path:  # else it could not be opened, and a message said so
                replaying.asked = path
                self.open_scan(path)
            return False
        if replaying.compared != here:
            replaying.compared = here
            if entry.hash is not None:
                self.tell_later(
                    partial(_changed, replaying.path, scan, entry.hash, self.playback.timeline.files)
                )
        return True

    def _is_read_as(self, replaying: Replaying, entry: Entry) -> bool:
        """Whether the scan is read with the corrections of an entry, as far as that is possible."""
        document = self.session.document
        wanted = {key: text for key, text in entry.reading.items() if key != "unit"}
        if document.reading != self.opener.reading:  # it is about to be read anew
            return False
        now = {key: text for key, text in document.reading.items() if key != "unit"}
        if entry.anonymous or wanted in (now, replaying.read_as):
            return True
        replaying.read_as = wanted
        unit = {key: text for key, text in document.reading.items() if key == "unit"}
        self.session.change("Replay", merge="replay", reading={**unit, **wanted})
        return False

    def _offer_to_locate(self, replaying: Replaying, scan: str) -> None:
        def take(path: str) -> None:
            replaying.located[scan], replaying.asked = path, None
            self._begin(replaying)

        problem = f"{replaying.path.name}: Scan4D cannot find the scan '{printable(scan)}' of this recording."
        self.offer_to_locate(problem, replaying.path.parent, take)

    def _show(self, entry: Entry, pose: Pose) -> None:
        """Show what an entry of a recording does. pose: of the scan, which is open."""
        camera, look, motion = entry.camera, entry.look, entry.motion
        if entry.anonymous:
            camera, look = in_scan_coordinates(camera, look, pose)
            motion = motion.in_frame(-middle_of(pose))
        self.playback.seek(entry.pose, time.monotonic())
        self.session.laid.replay(entry.pose, motion)
        shown = replace(self.session.document.drawn_by(entry.backend), camera=camera, pivot=None, look=look)
        shown = shown.with_params(entry.backend, entry.params)
        self.session.history.change("Replay", shown, merge="replay")
        self.viewport.rest()
        self.redraw()
        log.debug("replays frame %d", entry.pose)

    COMMANDS = (
        Command(
            "replay", "Replay the recording", replay_last, "Shift+R",
            can=lambda replayer: replayer.last_recording() is not None,
        ),
    )  # fmt: skip


def _changed(path: Path, scan: str, hash: str, files: Sequence[Path]) -> str:
    """Compare a scan with the hash that it had; what to tell of it, nothing where it is the same."""
    if fingerprint_as(hash, files) in (hash, None):
        return ""
    return f"{scan} has changed since {path.name} was recorded: pictures may differ."
