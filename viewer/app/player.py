"""Playback: which frame is due at a moment of the clock. Plain arithmetic, no window."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class Player:
    """Plays the frames of a timeline at their own times.

    times: (T,) seconds, increasing. A frame lasts until the next one begins, the last one as
    long as the frame before it. Where drawing is late, frames are passed over: time is kept.
    Its own times count from the first frame: there they are exact.
    """

    def __init__(self, times: NDArray[np.float64]) -> None:
        last = times[-1] - times[-2] if len(times) > 1 else 1.0
        self.edges = np.append(times, times[-1] + last) - times[0]  # (T + 1,): where frames begin and end
        self.playing = False
        self.loop = True
        self._started = 0.0  # by the clock
        self._from = 0.0

    def __len__(self) -> int:
        return len(self.edges) - 1

    @property
    def duration(self) -> float:
        """Seconds from the first frame's beginning to the last one's end."""
        return float(self.edges[-1])

    def play(self, index: int, now: float) -> int:
        """Start at the beginning of a frame and return it; without `loop`, the last one starts anew."""
        if not self.loop and index == len(self) - 1:
            index = 0
        self.playing, self._started, self._from = len(self) > 1, now, float(self.edges[index])
        return index

    def pause(self) -> None:
        """Stay where it is."""
        self.playing = False

    def due(self, index: int, now: float) -> int:
        """The frame to show now; `index` itself while paused. Pauses at the end without `loop`."""
        if not self.playing:
            return index
        if not self.loop and self._position(now) >= self.duration:
            self.pause()
            return len(self) - 1
        return self.frame_at(self._position(now))

    def until_next(self, now: float) -> float:
        """Seconds until another frame is due; infinite while paused."""
        if not self.playing:
            return np.inf
        position = self._position(now)
        return max(0.0, float(self.edges[self.frame_at(position) + 1]) - position)

    def frame_at(self, time: float) -> int:
        """The frame that lasts over this time, the nearest one outside of the scan's."""
        return int(np.clip(np.searchsorted(self.edges, time, side="right") - 1, 0, len(self) - 1))

    def step(self, index: int, count: int) -> int:
        """The frame `count` steps on: round the end with `loop`, else no further than it."""
        if self.loop:
            return (index + count) % len(self)
        return min(max(index + count, 0), len(self) - 1)

    def _position(self, now: float) -> float:
        position = self._from + (now - self._started)  # exact when it starts
        return position % self.duration if self.loop else position
