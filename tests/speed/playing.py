"""How smoothly the window plays the demo, and how soon it is drawn in full when it rests. Prints two tables.

    python tests/speed/playing.py [--seconds 10] [--rests 15] [--size 1280x720] [SCAN]

The window runs under Xvfb, as in the tests, with real keys and a real mouse. Every row of the first table
is one renderer in one mode, once its poses are in memory and the detail of its previews has settled.
Lag is how many frames the one that is shown was behind its time at worst, against when it was least so.
In the second table, a pause, a drag that stops (with the button held) and the wheel are each followed until
a picture in full is there; the time counts from before the last event is sent.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from played_window import RunningApp, State, arguments_of, switch_to, window_on

from viewer.app.playing.player import Player

BACKENDS = ("surfels", "points")
MODES = ("real time", "every frame")
_POLL = 0.004  # seconds between looks at the window
_PATIENCE = 30  # seconds
_SETTLING = 6.0  # seconds of playing before measuring


class Drew(NamedTuple):
    """A picture that was drawn. at: seconds of the clock."""

    at: float
    frame: int
    backend: str
    pixels: int
    points: int

    @classmethod
    def of(cls, state: State) -> Drew:
        """The picture that a state of the window shows."""
        return cls(state.at, state.frame, state.backend, math.prod(state.pixels), state.points)


class Watch:
    """Follows the pictures. last: the one drawn last."""

    def __init__(self, app: RunningApp) -> None:
        self._app = app
        self._number = 0
        self.last: Drew | None = None

    def new(self) -> list[Drew]:
        """The pictures since the last call."""
        states = self._app.pictures(since=self._number)
        if states:
            self._number, self.last = states[-1].pictures, Drew.of(states[-1])
        return [Drew.of(state) for state in states]

    def pictures(self, seconds: float) -> list[Drew]:
        """Those that are drawn from now on, for so long."""
        self.new()
        end, drawn = time.monotonic() + seconds, []
        while time.monotonic() < end:
            drawn += self.new()
            time.sleep(_POLL)
        return drawn

    def until_full(self, start: float, full: Drew) -> float:
        """Milliseconds from `start` until the last picture is one in full, and stays for a second."""
        while (now := time.monotonic()) < start + _PATIENCE:
            self.new()
            last = self.last
            if last and last[3:] == full[3:] and now > max(last.at, start) + 1:
                return max(0.0, last.at - start) * 1e3
            time.sleep(_POLL)
        raise SystemExit(f"no picture in full within {_PATIENCE} s")


@contextmanager
def playing(app: RunningApp) -> Iterator[None]:
    """While the scan plays."""
    app.screen.do("key", "space")
    yield
    app.screen.do("key", "space")


def measure_playing(app: RunningApp, watch: Watch, seconds: float, player: Player, full: Drew) -> str:
    """The numbers of a row of the first table."""
    with playing(app):
        time.sleep(_SETTLING)
        drawn = watch.pictures(seconds)
    shown = [drawn[0], *(b for a, b in pairwise(drawn) if b.frame != a.frame)]
    steps = np.diff([d.frame for d in shown]) % len(player)
    at = np.array([d.at for d in shown])
    lags = (at - at[0]) * player.rate - np.concatenate([[0], np.cumsum(steps)])
    share = np.median([d.points for d in drawn]) / full.points
    pixels = np.median([d.pixels for d in drawn]) / full.pixels
    return (
        f"{(len(shown) - 1) / (at[-1] - at[0]):6.1f} {int((steps - 1).sum()):8d} {np.ptp(lags):6.2f} "
        f"{share:8.0%} {pixels:8.0%}"
    )


def rests(app: RunningApp, watch: Watch, count: int, full: Drew) -> dict[str, list[float]]:
    """Milliseconds from rest to a picture in full, `count` times each."""
    left, top, width, height = app.view()
    x, y = left + width // 2, top + height // 2
    screen, times = app.screen, {"pause": [], "drag": [], "wheel": []}

    def follow(what: str, *last: object) -> None:
        watch.new()
        start = time.monotonic()
        screen.do(*last)
        times[what].append(watch.until_full(start, full))

    for turn in range(count):
        screen.do("key", "space", "sleep", 1.2)
        follow("pause", "key", "space")
        screen.do("mousemove", x, y, "mousedown", 1)
        moves = [("mousemove", x + 4 * i * (-1) ** turn, y, "sleep", 0.02) for i in range(25)]
        screen.do(*(word for move in moves for word in move))
        follow("drag", "mousemove", x, y + 1)
        screen.do("mouseup", 1, "sleep", 0.3)
        button = 4 + turn % 2
        screen.do("click", "--repeat", 9, "--delay", 40, button)
        follow("wheel", "click", button)
    return times


def main() -> None:
    arguments = arguments_of(__doc__)
    arguments.add_argument("--seconds", type=float, default=10.0)
    arguments.add_argument("--rests", type=int, default=15)
    options = arguments.parse_args()
    with window_on(options) as (app, player):
        watch = Watch(app)
        print(f"{options.scan}, {len(player)} frames at {player.rate:.3g} a second, window {options.size}")
        print(f"load of the machine before: {os.getloadavg()[0]:.2f}")
        print(f"renderer mode        {'fps':>6} {'left out':>8} {'lag':>6} {'points':>8} {'pixels':>8}")
        for mode in MODES:
            for backend in BACKENDS:
                full = Drew.of(switch_to(app, backend))
                print(f"{backend:8} {mode:11} {measure_playing(app, watch, options.seconds, player, full)}")
            app.screen.do("key", "e")
        print(f"renderer rest after  {'median ms':>10} {'longest':>8}   to a picture in full")
        for backend in BACKENDS:
            full = Drew.of(switch_to(app, backend))
            for what, times in rests(app, watch, options.rests, full).items():
                print(f"{backend:8} {what:11} {np.median(times):10.0f} {max(times):8.0f}")
        print(f"load of the machine after: {os.getloadavg()[0]:.2f}")


if __name__ == "__main__":
    main()
