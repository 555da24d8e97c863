"""How smoothly the window plays, how soon it draws in full when it rests, and which frames the first rounds
show.

Every row of `playing` is one renderer in one mode, once its poses are in memory and the detail of its
previews has settled. Lag is how many frames the one that is shown was behind its time at worst, against when
it was least so. In `resting`, a pause, a drag that stops (with the button held) and the wheel are each
followed until a picture in full is there; the time counts from before the last event is sent.

`rounds` shows which frames appear as they were chosen, from the first round of playing on: at its start
nothing is prepared but the frame at rest. Processors are those that the window and the processes that help it
take, on average."""

from __future__ import annotations

import math
import os
import tempfile
import time
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import groupby, pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from virtual_screen import RunningApp, State, running_app, virtual_screen

from experiments.script import Script
from experiments.tables import Row
from viewer.app.playing.player import Player
from viewer.scan.open import open_scan

BACKENDS = ("surfels", "points")
MODES = ("real time", "every frame")
_POLL = 0.004  # seconds between looks at the window
_PATIENCE = 30  # seconds
_SETTLING = 6.0  # seconds of playing before measuring


@contextmanager
def window_on(options: Namespace) -> Iterator[tuple[RunningApp, Player]]:
    """The window at rest, and the timing of its scan. options: `size` and `scan`."""
    with open_scan(options.scan) as timeline:
        player = Player(timeline.times)
    with tempfile.TemporaryDirectory() as name:
        folders = [Path(name, part) for part in ("screen", "app")]
        for folder in folders:
            folder.mkdir()
        with (
            virtual_screen(folders[0], options.size) as screen,
            running_app(screen, folders[1], options.scan) as app,
        ):
            yield app, player


def switch_to(app: RunningApp, backend: str) -> State:
    """Draw with this backend; returns the state at rest."""
    while (state := app.settle()).backend != backend:
        app.screen.do("key", "b")
    return state


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
def is_playing(app: RunningApp) -> Iterator[None]:
    """While the scan plays."""
    app.screen.do("key", "space")
    yield
    app.screen.do("key", "space")


def playing(options: Namespace) -> Iterator[Row]:
    """Each renderer in each mode, once its poses are in memory and the detail of its previews has settled."""
    with window_on(options) as (app, player):
        watch = Watch(app)
        for mode in MODES:
            for backend in BACKENDS:
                full = Drew.of(switch_to(app, backend))
                with is_playing(app):
                    time.sleep(_SETTLING)
                    drawn = watch.pictures(options.seconds)
                shown = [drawn[0], *(b for a, b in pairwise(drawn) if b.frame != a.frame)]
                steps = np.diff([d.frame for d in shown]) % len(player)
                at = np.array([d.at for d in shown])
                lags = (at - at[0]) * player.rate - np.concatenate([[0], np.cumsum(steps)])
                points = float(np.median([d.points for d in drawn])) / full.points
                pixels = float(np.median([d.pixels for d in drawn])) / full.pixels
                yield {
                    "renderer": backend, "mode": mode, "fps": (len(shown) - 1) / float(at[-1] - at[0]),
                    "left out": int((steps - 1).sum()), "lag": float(np.ptp(lags)),
                    "points": f"{points:.0%}", "pixels": f"{pixels:.0%}", **_load(),
                }  # fmt: skip
            app.screen.do("key", "e")


def resting(options: Namespace) -> Iterator[Row]:
    """Milliseconds from rest to a picture in full."""
    with window_on(options) as (app, _):
        watch = Watch(app)
        for backend in BACKENDS:
            full = Drew.of(switch_to(app, backend))
            for what, times in rests(app, watch, options.rests, full).items():
                named = {"renderer": backend, "rest after": what}
                yield {**named, "median, ms": float(np.median(times)), "longest, ms": max(times), **_load()}


def rounds(options: Namespace) -> Iterator[Row]:
    """The frames that each round of playing shows by the chosen renderer and by others."""
    with window_on(options) as (app, player):
        switch_to(app, options.backend)
        first = app.state.pictures
        app.screen.do("key", "space")
        start = app.see(is_playing=True).at
        taken = [cpu_seconds(app.process.pid)]
        for number in range(options.rounds):
            time.sleep(max(0.0, start + (number + 1) * player.duration - time.monotonic()))
            taken.append(cpu_seconds(app.process.pid))
        drawn = app.pictures(first)
        app.screen.do("key", "space")
        for number in range(options.rounds):
            begin = start + number * player.duration
            states = [state for state in drawn if begin <= state.at < begin + player.duration]
            chosen = {state.frame for state in states if state.backend == options.backend}
            others = {state.frame for state in states if state.backend != options.backend}
            changes = len(list(groupby(state.frame for state in states)))
            yield {
                "round": number + 1, "frames": len(player), "shown": len(chosen), "others": len(others),
                "fps": changes / player.duration,
                "processors": (taken[number + 1] - taken[number]) / player.duration, **_load(),
            }  # fmt: skip


def _load() -> Row:
    return {"load": f"{os.getloadavg()[0]:.2f}"}


def cpu_seconds(process: int) -> float:
    """Processor time of a process and of those that it has started."""
    ticks = 0
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:  # it has ended meanwhile
                continue
            if process in (int(entry.name), int(fields[1])):
                ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def rests(app: RunningApp, watch: Watch, count: int, full: Drew) -> dict[str, list[float]]:
    """Milliseconds from rest to a picture in full, `count` times each."""
    left, top, width, height = app.view()
    x, y = left + width // 2, top + height // 2
    screen = app.screen
    times: dict[str, list[float]] = {"pause": [], "drag": [], "wheel": []}

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


EXPERIMENT = Script(
    [playing, resting, rounds],
    {"scan": "demo", "size": (1280, 720), "seconds": 10.0, "rests": 15, "rounds": 3, "backend": "voxels"},
)
