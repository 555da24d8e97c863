"""A scan being played: which pose is shown, without ever waiting for the disk."""

from __future__ import annotations

import logging
import math
import time
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ...errors import InputError
from ...scan.pose import Pose
from ...scan.timeline import Timeline
from ...scan.units import Scale
from ..commands import Command
from ..part import WindowPart
from ..session import Session
from .player import Player

log = logging.getLogger(__name__)
FRAMES = "several frames"  # a condition
_now = time.monotonic
_RATE_SPAN = 1.0  # seconds over which shown frames are counted, longer where few are due
_RATE_FRAMES = 4
_PATIENCE = 0.5, 2.0  # seconds, and frames, that no other pose comes for until the clock waits for one


def _pace(name: str, title: str, key: str) -> Command:
    """Switches a field of the `Pace`."""
    return Command(
        name, title,
        lambda playback: playback.change(_now(), **{name: not getattr(playback.session.pace, name)}),
        key, FRAMES, is_on=lambda playback: getattr(playback.session.pace, name),
    )  # fmt: skip


def _end(name: str, title: str, key: str, is_last: bool) -> Command:
    """Chooses the frame that is shown as the first or the last that is played."""
    return Command(
        name, title, lambda playback: playback.set_end(is_last, playback.session.index), key, FRAMES
    )


class Playback(WindowPart):
    """Moves `session.index` along the timeline of the open scan and finds the pose to show.

    pose: the one that is shown, None before the first. Where reading or preparing is slower than
    playing, it is the latest one that is there. dropped: readable frames that were not there
    at their time, since playing began; none where every frame is shown. jumps: how often it went elsewhere
    than playing would. is_prepared: whether a pose can be drawn as it is to be; until then the one before
    stays. is_held: whether the clock waits, since no pose has come for a while. player: plays the frames that
    the document keeps to, `span`. whole: all frames, which steps go through.
    """

    name = "playback"
    doing = "Playing"
    turn = -1
    CONDITIONS = {FRAMES: lambda playback: len(playback.timeline) > 1}

    def __init__(self, timeline: Timeline, session: Session, first: int = 0) -> None:
        """first: the frame to begin with."""
        self.session = session
        self.jumps = 0
        self.is_prepared: Callable[[Pose], bool] = lambda pose: True
        self.begin(timeline, first)

    def begin(self, timeline: Timeline, first: int = 0) -> None:
        """Show another scan from now on, paused at one of its frames; the one before stays open."""
        self.timeline = timeline
        self.player = self.whole = Player(timeline.times, self.session.pace)
        self.span = range(len(timeline))
        self.pose: Pose | None = None
        self.dropped = 0
        self._shown: deque[float] = deque()  # when poses were, lately
        self._moved_at = -math.inf  # when the last pose came, or playing went elsewhere
        self.is_held = False
        self.session.index = first
        self.jumps += 1
        timeline.request(first)

    def retime(self, now: float) -> None:
        """Take in that the frames have other times; playing goes on from the frame shown."""
        was_playing = self.player.playing
        self.whole = Player(self.timeline.times, self.session.pace)
        self.player = Player(self.timeline.times[self.span.start : self.span.stop], self.session.pace)
        self._shown.clear()
        if was_playing:
            self._play(now)

    @property
    def unit(self) -> str:
        """The scan's unit of length: as the user calls it, else as the scan tells, else "units"."""
        return self.session.document.unit or self.timeline.unit

    @property
    def scale(self) -> Scale:
        """The scale of displayed lengths."""
        return Scale.of(self.unit, self.session.document.shown_unit)

    @property
    def problem(self) -> InputError | None:
        """Why the current frame cannot be read, None where it can."""
        return self.timeline.broken.get(self.session.index)

    @property
    def is_empty(self) -> bool:
        """Whether the current frame holds no points, so that the view shows only the background."""
        return self.session.index in self.timeline.empty

    @property
    def waiting(self) -> bool:
        """Whether the current frame is still being read or prepared."""
        return (self.pose is None or self.pose.index != self.session.index) and self.problem is None

    def toggle(self, now: float) -> None:
        """Play from the current frame, or pause. now: seconds of the clock."""
        self._keep_to(self._chosen(), now)
        if self.player.playing:
            self.player.pause()
        else:
            self.dropped = 0
            self._shown.clear()
            self._moved_at = now
            self._play(now)

    def _play(self, now: float) -> None:
        self.session.index = self.span[self.player.play(self._in_span(self.session.index), now)]
        self._read_ahead()

    def _in_span(self, index: int) -> int:
        """The number of a frame among those that are played, of the one that comes first where it is none."""
        if index in self.span:
            return index - self.span.start
        return len(self.span) - 1 if self.session.pace.reverse else 0

    def _chosen(self) -> range:
        """The frames to play: those that the document keeps to, as many of them as there are."""
        count, ends = len(self.timeline), self.session.document.span
        if ends is None or ends[0] >= count:
            return range(count)
        return range(ends[0], min(ends[1] + 1, count))

    def _keep_to(self, span: range, now: float) -> None:
        """Play these frames from now on."""
        if span != self.span:
            was_playing, self.span = self.player.playing, span
            self.player = Player(self.timeline.times[span.start : span.stop], self.session.pace)
            if was_playing:
                self._play(now)

    def set_end(self, is_last: bool, index: int) -> None:
        """Begin playing with a frame, or end with it; the other end goes along where it would be passed."""
        span = self._chosen()
        ends = (min(span[0], index), index) if is_last else (index, max(span[-1], index))
        whole = (0, len(self.timeline) - 1)
        self.session.change("Set frames to play", merge="span", span=None if ends == whole else ends)

    def clear_span(self) -> None:
        """Play all frames again."""
        self.session.change("Play all frames", span=None)

    def after(self, index: int, steps: int) -> int | None:
        """The frame that playing shows so many steps after one; None where it has come to its end by then."""
        step = self._in_span(index) + steps * self.session.pace.direction
        if not (self.session.pace.loop or 0 <= step < len(self.span)):
            return None
        return self.span[step % len(self.span)]

    def steps_to(self, index: int, start: int) -> int:
        """How many steps after one frame playing shows another, round the end."""
        both = self._in_span(index) - self._in_span(start)
        return both * self.session.pace.direction % len(self.span)

    def change(self, now: float, **changes: Any) -> None:
        """Change fields of the `Pace`; playing goes on from the frame shown."""
        self.session.pace = replace(self.session.pace, **changes)
        self.player.change(self.session.pace, now)
        self.whole.pace = self.session.pace
        self._shown.clear()
        if self.player.playing:
            self._read_ahead()
        log.debug("%s", self.session.pace)

    def change_speed(self, direction: int) -> None:
        """Play faster for 1, slower for -1."""
        self.change(time.monotonic(), speed=self.session.pace.next_speed(direction))

    def seek(self, index: int, now: float) -> None:
        """Go to a frame, -1 is the last one; playing goes on from there."""
        index %= len(self.timeline)
        if index == self.session.index:
            return
        self.session.index = index
        self.jumps += 1
        self._moved_at = now
        self.timeline.request(index)
        self.player.enter(self._in_span(index), now)

    def step(self, count: int, now: float) -> None:
        """Pause, and go some frames on."""
        self.player.pause()
        self.seek(self.whole.step(self.session.index, count), now)

    def advance(self, now: float) -> None:
        """Take in what time and the timeline's worker have brought."""
        self._keep_to(self._chosen(), now)
        late = self.waiting
        seconds, frames_long = _PATIENCE
        patience = max(seconds, frames_long / self.player.rate)
        self.is_held = late and self.player.playing and now > self._moved_at + patience
        if late and (self.session.pace.every_frame or self.is_held):
            self.player.enter(self._in_span(self.session.index), now)  # its time begins when it is there
        if frames := [self.span[frame] for frame in self.player.due(now)]:
            missed = ([self.session.index] if late else []) + frames[:-1]
            self.dropped += len([frame for frame in missed if frame not in self.timeline.broken])
            self.session.index = frames[-1]
            self._read_ahead()
        pose = self._best_pose()
        if pose is not None and pose is not self.pose:
            self.pose = pose
            self._moved_at = now
            self._shown.append(now)
        span = max(_RATE_SPAN, _RATE_FRAMES / self.player.rate)
        while self._shown and self._shown[0] < now - span:
            self._shown.popleft()

    @property
    def rate(self) -> float:
        """Frames a second that were shown lately; 0 until there are two."""
        seconds = self._shown[-1] - self._shown[0] if self._shown else 0.0
        return (len(self._shown) - 1) / seconds if seconds else 0.0

    def _read_ahead(self) -> None:
        self.timeline.prefetch(self.session.index, self.session.pace.direction)

    def _best_pose(self) -> Pose | None:
        """The pose of the current frame, or while playing in real time the latest one since the one that is
        shown; None where none can be shown yet. The first of a scan is shown as it is."""
        wanted, pace, shown = self.session.index, self.session.pace, self.pose
        if shown is None:
            return self.timeline.ready(wanted)
        in_time = self.player.playing and not pace.every_frame
        late = self.steps_to(wanted, shown.index) if in_time else 1
        for steps in range(max(late, 1)):
            number = self._in_span(wanted) - steps * pace.direction
            pose = self.timeline.ready(self.span[number % len(self.span)] if steps else wanted)
            if pose is not None and (pose is shown or self.is_prepared(pose)):
                return pose
        return None

    def close(self) -> None:
        """Stop reading."""
        self.timeline.close()

    @property
    def waits(self) -> bool:
        """Whether the current frame is about to come."""
        return self.waiting

    def next_change(self, now: float) -> float:
        """Seconds until another frame is due; infinite while nothing plays."""
        return self.player.until_next(now)

    COMMANDS = (
        Command("play", "Play", lambda playback: playback.toggle(_now()), "Space", FRAMES,
            is_on=lambda playback: playback.player.playing),
        Command("next", "Next frame", lambda playback: playback.step(1, _now()), "Right .", FRAMES,
            repeats=True),
        Command("back", "Previous frame", lambda playback: playback.step(-1, _now()), "Left ,", FRAMES,
            repeats=True),
        Command("first", "First frame", lambda playback: playback.seek(0, _now()), "Ctrl+Home", FRAMES),
        Command("last", "Last frame", lambda playback: playback.seek(-1, _now()), "Ctrl+End End", FRAMES),
        Command("slower", "Slower", lambda playback: playback.change_speed(-1), "[", FRAMES, repeats=True),
        Command("faster", "Faster", lambda playback: playback.change_speed(1), "]", FRAMES, repeats=True),
        Command("speed_1", "Speed 1x", lambda playback: playback.change(_now(), speed=1.0), "Backspace",
            FRAMES),
        _end("span_first", "Set start of playback", "I", is_last=False),
        _end("span_last", "Set end of playback", "Shift+I", is_last=True),
        Command("span_all", "Play all frames", clear_span, "Alt+I",
            can=lambda playback: playback.session.document.span is not None),
        _pace("loop", "Loop", "L"),
        _pace("reverse", "Backward", "Shift+Space"),
        _pace("every_frame", "Every frame", "E"),
    )  # fmt: skip
