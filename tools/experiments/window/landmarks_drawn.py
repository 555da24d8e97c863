"""What the window's own drawing takes with many landmarks and measures of a long scan.

The window runs under Xvfb at 1280x720, with curves under the timeline, the section of landmarks in the panel
and half a dozen paths. It plays the scan with every frame, stands while the mouse moves over it, and orbits.
Milliseconds of processor time of the window's thread a turn of its loop, without the picture of the scan and
what the graphics driver takes: declaring all widgets and marks, and work beside."""

from __future__ import annotations

import re
import tempfile
from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from many_landmarks import left_open
from virtual_screen import RunningApp, running_app, virtual_screen

from experiments.script import Script
from experiments.tables import Row

_TURN = re.compile(r"turn of [\d.]+ ms: (.*)")
_OWN = ("advance", "widgets")
_TIMED = """
import time, types
from viewer.app import turns
turns._WORTH_LOGGING = 0.0
turns.time = types.SimpleNamespace(perf_counter=time.thread_time)
turns.Turns.end = lambda self: (
    turns.log.debug("turn of 0 ms: %s", ", ".join(f"{k} {v:.3f}" for k, v in self._parts.items())),
    self._parts.clear(),
)
"""


def own_ms(app: RunningApp, skipped: int) -> list[float]:
    """What each turn took in which widgets were declared, after the first lines of the log."""
    taken = []
    for line in app.log().splitlines()[skipped:]:
        if (found := _TURN.search(line)) and "widgets" in found[1]:
            parts = dict(part.rsplit(" ", 1) for part in found[1].split(", "))
            taken.append(sum(float(parts.get(name, 0)) for name in _OWN))
    return taken


def turns(options: Namespace) -> Iterator[Row]:
    """What the turns of each step take."""
    with tempfile.TemporaryDirectory() as name, virtual_screen(Path(name), (1280, 720)) as screen:
        folder = Path(name)
        scan = left_open(folder, options.frames, options.landmarks, options.measures)
        with running_app(screen, folder, scan, before=_TIMED) as app:
            state = app.settle()
            assert len(state.followed) == options.landmarks
            assert len(state.measured) == options.measures
            left, top, width, height = app.view()
            for step in ("plays", "mouse moves", "orbits"):
                start = len(app.log().splitlines())
                if step == "plays":
                    screen.do("key", "e", "key", "space", "sleep", 12, "key", "space")
                else:
                    screen.do("mousemove", left + width // 2, top + height // 2, "sleep", 0.3)
                    if step == "orbits":
                        screen.do("mousedown", 1)
                    for number in range(60):
                        x = left + width // 2 + number
                        screen.do("mousemove", x, top + height // 2 + number % 7, "sleep", 0.05)
                    screen.do("mouseup", 1)
                app.settle()
                taken = own_ms(app, start)
                middle, high = np.percentile(taken, (50, 95)).tolist()
                yield {"step": step, "turns": len(taken), "median, ms": middle, "95 %, ms": high}


EXPERIMENT = Script([turns], {"landmarks": 500, "measures": 30, "frames": 200})
