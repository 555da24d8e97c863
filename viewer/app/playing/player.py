"""Playback: which frame is due at a moment of the clock. Plain arithmetic, no window."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...params import param

SPEEDS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)  # that the window offers


@dataclass(frozen=True)
class Pace:
    """How to play."""

    speed: float = param(1.0, "Speed of playback, 1 is real time", low=SPEEDS[0], high=SPEEDS[-1])
    reverse: bool = param(False, "Play backward")
    loop: bool = param(True, "Start again at the first frame after the last frame")
    every_frame: bool = param(
        False,
        "Show every frame, even if playback gets slower. If this option is off, Scan4D skips frames "
        "that are late",
    )

    @property
    def direction(self) -> int:
        """1 or -1."""
        return -1 if self.reverse else 1

    def next_speed(self, direction: int) -> float:
        """The next of SPEEDS, faster for direction 1, slower for -1; the same at their ends."""
        beyond = [speed for speed in SPEEDS if (speed - self.speed) * direction > 0]
        return min(beyond, key=lambda speed: abs(speed - self.speed), default=self.speed)


class Player:
    """Plays the frames of a timeline at their own times.

    times: (T,) seconds, increasing. A frame lasts until the next one begins, the last one as
    long as the frame before it. Its own times count from the first frame: there they are exact.

    Inside, frames go on round the end: frame T is frame 0 of the next round. A position is a
    moment of the scan, one duration later a round. It is always reckoned from where and when
    playing began, so that no error adds up.
    """

    def __init__(self, times: NDArray[np.float64], pace: Pace | None = None) -> None:
        last = times[-1] - times[-2] if len(times) > 1 else 1.0
        self.edges = np.append(times, times[-1] + last) - times[0]  # (T + 1,): where frames begin and end
        self.pace = pace or Pace()
        self.playing = False
        self._started = 0.0  # by the clock
        self._from = 0.0  # position
        self._frame = 0  # given last

    def __len__(self) -> int:
        return len(self.edges) - 1

    @property
    def duration(self) -> float:
        """Seconds from the first frame's beginning to the last one's end."""
        return float(self.edges[-1])

    @property
    def rate(self) -> float:
        """Frames a second that are due, on average."""
        return len(self) / self.duration * self.pace.speed

    def play(self, index: int, now: float) -> int:
        """Start where playing enters a frame and return it; at the end without `loop`, start anew."""
        first, last = (len(self) - 1, 0) if self.pace.reverse else (0, len(self) - 1)
        if not self.pace.loop and index == last:
            index = first
        self.playing = len(self) > 1
        self.enter(index, now)
        return index

    def pause(self) -> None:
        """Stay where it is."""
        self.playing = False

    def change(self, pace: Pace, now: float) -> None:
        """Play otherwise from here on, from the frame given last and the moment in it that is now."""
        position = self._position(now)
        if self._frame_of(position) != self._frame:  # it should have left it
            position = self._exit(self._frame)
        rounds, self._frame = divmod(self._frame, len(self))
        self._from, self._started = position - rounds * self.duration, now
        self.pace = pace

    def enter(self, frame: int, now: float) -> None:
        """Go on from the moment at which playing comes to a frame."""
        self._frame = frame % len(self)
        self._from, self._started = self._edge(self._frame, self.pace.reverse), now

    def due(self, now: float) -> list[int]:
        """The frames whose time has come since the last call, in the order of playing.

        The last one is to be shown, those before it are late; one at most for `every_frame`,
        as time slips there. Empty while paused. Pauses at the end without `loop`.
        """
        if not self.playing:
            return []
        step, position = self.pace.direction, self._position(now)
        reached = self._frame_of(position)
        if self.pace.every_frame and (reached - self._frame) * step > 1:
            self.enter(self._frame + step, now)
            return [self._frame]
        if not self.pace.loop and (position <= 0 if self.pace.reverse else position >= self.duration):
            self.pause()
        frames = range(self._frame + step, reached + step, step)
        if frames:
            self._frame = reached
        return [frame % len(self) for frame in frames]

    def until_next(self, now: float) -> float:
        """Seconds until another frame is due; infinite while paused."""
        if not self.playing:
            return np.inf
        position = self._position(now)
        left = (self._exit(self._frame_of(position)) - position) * self.pace.direction
        return max(0.0, left / self.pace.speed)

    def frame_at(self, time: float) -> int:
        """The frame that lasts over this time, the nearest one outside of the scan's."""
        return self._search(time, "right")

    def step(self, index: int, count: int) -> int:
        """The frame `count` steps on: round the end with `loop`, else no further than it."""
        if self.pace.loop:
            return (index + count) % len(self)
        return min(max(index + count, 0), len(self) - 1)

    def _exit(self, frame: int) -> float:
        """The position at which playing leaves a frame."""
        return self._edge(frame, not self.pace.reverse)

    def _edge(self, frame: int, end: bool) -> float:
        rounds, index = divmod(frame, len(self))
        return rounds * self.duration + float(self.edges[index + end])

    def _position(self, now: float) -> float:
        return self._from + (now - self._started) * self.pace.speed * self.pace.direction

    def _frame_of(self, position: float) -> int:
        """The frame at a position; an edge belongs to the frame that is entered there."""
        rounds, time = divmod(position, self.duration) if self.pace.loop else (0, position)
        if not self.pace.reverse:
            return int(rounds) * len(self) + self._search(time, "right")
        if self.pace.loop and time == 0:  # the end of the round before
            rounds, time = rounds - 1, self.duration
        return int(rounds) * len(self) + self._search(time, "left")

    def _search(self, time: float, side: Literal["left", "right"]) -> int:
        return int(np.clip(np.searchsorted(self.edges, time, side) - 1, 0, len(self) - 1))
