"""How long the window does not answer while large scans load, play and are prepared.

The window runs under Xvfb, as in the tests, with real keys. For each step, in milliseconds: the longest
turn of the window's loop without drawing (freeze), by its parts; the longest that a process which does
nothing was kept waiting meanwhile (control: on a busy machine a freeze below it means nothing); the longest
drawing of the picture, the renderer's own time: tens of milliseconds a million points on a software
driver. Of the parts, late is how much longer than asked the loop slept, as another thread held the
interpreter's lock, and upload is a pose on its way to the GPU.
"""

from __future__ import annotations

import re
import tempfile
import threading
import time
from argparse import Namespace
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from virtual_screen import RunningApp, running_app, virtual_screen

from experiments.script import Failed, Script
from experiments.speed.clouds import dented_sphere
from experiments.tables import Row
from viewer.scan import formats
from viewer.scan.points import PointCloud
from viewer.scan.range_view import RangeView

_TURN = re.compile(r"turn of \d+ ms: (.*)")
_DRAWING = ("picture", "show")


def sphere(count: int, seed: int = 0, colored: bool = False) -> PointCloud:
    """Points in random order on a dented sphere, without normals."""
    cloud = dented_sphere(count, seed)
    return cloud if colored else replace(cloud, colors=None)


def range_views(height: int, width: int) -> list[RangeView]:
    """Two pods that see a wavy wall."""
    y, x = np.mgrid[:height, :width].astype(np.float32)
    depth = 2000 + 100 * np.sin(x / 300) * np.cos(y / 200)
    color = np.stack([x / width, y / height, 0 * x], axis=2).astype(np.float16)
    return [
        RangeView(
            depth=depth, mask=np.ones(depth.shape, bool), color=color, confidence=None, fx=3000.0, fy=3000.0,
            cx=width / 2, cy=height / 2, world_to_camera=np.eye(4), name=name, unit="mm",
        )
        for name in ("left", "right")
    ]  # fmt: skip


def make_scans(folder: Path, points: int, estimated: int) -> dict[str, Path]:
    """What is opened, by what it is, in this order."""
    scans = {
        "small": folder / "0_small.ply",
        f"{points:,} points, PLY": folder / "1_large.ply",
        f"{points:,} points, NPZ": folder / "2_large.npz",
        "1,000,000 points, ascii PLY": folder / "3_text.ply",
        "200 frames of 50,000 points": folder / "4_sequence",
        "range images, EXR": folder / "5_range.exr",
        f"{estimated:,} points without normals": folder / "6_estimated.npz",
        "damaged": folder / "7_damaged.ply",
    }
    small, large, packed, text, sequence, exr, bare, damaged = scans.values()
    formats.write(small, sphere(1000, colored=True))
    cloud = sphere(points, colored=True)
    formats.write(large, cloud)
    formats.write(packed, cloud)
    with text.open("w") as stream:
        stream.write("ply\nformat ascii 1.0\nelement vertex 1000000\n")
        stream.write("property float x\nproperty float y\nproperty float z\nend_header\n")
        np.savetxt(stream, sphere(1_000_000).positions, fmt="%.5f")
    sequence.mkdir()
    for number in range(200):
        np.save(sequence / f"{number:03}.npy", sphere(50_000, number).positions)
    formats.write(exr, PointCloud.from_arrays(np.zeros((1, 3))), range_views(2048, 2448))
    damaged.write_bytes(large.read_bytes()[: large.stat().st_size // 2])
    formats.write(bare, sphere(estimated))
    return scans


class Control:
    """A thread of this process, which does nothing else, that sleeps a little again and again."""

    def __init__(self) -> None:
        self._longest = 0.0
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        while True:
            start = time.monotonic()
            time.sleep(0.002)
            self._longest = max(self._longest, (time.monotonic() - start) * 1e3)

    def take(self) -> float:
        """The longest sleep since the last call, milliseconds."""
        longest, self._longest = self._longest, 0.0
        return longest


class Watch:
    """Runs steps, and measures what each does to the loop."""

    def __init__(self, app: RunningApp) -> None:
        self._app, self._control = app, Control()

    def step(self, name: str, act: Callable[[], object]) -> Row:
        """Do something, wait until nothing happens any more; what it did to the loop."""
        self._control.take()
        before, start = len(self._app.log()), time.monotonic()
        act()
        self._app.settle()
        turns = [_parts(line) for line in _TURN.findall(self._app.log()[before:])]
        parts = max(turns, key=_freeze, default={})
        drawing = max((sum(turn.get(name, 0) for name in _DRAWING) for turn in turns), default=0)
        said = ", ".join(f"{part} {ms:.0f}" for part, ms in parts.items() if part not in _DRAWING)
        seconds = time.monotonic() - start
        return {
            "step": name, "s": seconds, "freeze, ms": _freeze(parts), "control, ms": self._control.take(),
            "drawing, ms": float(drawing), "the freeze by its parts": said,
        }  # fmt: skip


def _parts(line: str) -> dict[str, float]:
    return {name: float(ms) for name, ms in (part.rsplit(" ", 1) for part in line.split(", "))}


def _freeze(parts: dict[str, float]) -> float:
    return sum(ms for name, ms in parts.items() if name not in _DRAWING)


def scrub(app: RunningApp) -> None:
    """Drag along the timeline's track, to and fro."""
    _, top, _, height = app.view()
    track = top + height + 30
    words: list[object] = ["mousemove", 640, track, "mousedown", 1]
    for x in np.concatenate([np.linspace(640, 1000, 30), np.linspace(1000, 640, 30)]):
        words += ["mousemove", int(x), track, "sleep", 0.05]
    app.screen.do(*words, "mouseup", 1)


def orbit(app: RunningApp) -> None:
    """Drag over the view for two seconds."""
    words: list[object] = ["mousemove", 300, 300, "mousedown", 1]
    for x in range(300, 500, 5):
        words += ["mousemove", x, 300, "sleep", 0.05]
    app.screen.do(*words, "mouseup", 1)


def open_next(app: RunningApp) -> None:
    """Go to the next scan, and wait until it is there or cannot be."""
    app.screen.do("key", "Next")
    before, seen = app.state.scan, len(app.notes)
    app.see(lambda state: state.scan != before or any("Cannot open" in note for note in app.notes[seen:]))


def estimate(app: RunningApp) -> None:
    """Choose surfels, and orbit while normals are being estimated."""
    app.screen.do("key", "b")
    orbit(app)
    app.see(backend="surfels")


def freezes(options: Namespace) -> Iterator[Row]:
    """Open every scan, play, scrub and change the renderer. Raises Failed where the log has a traceback."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for part in ("scans", "screen", "app"):
            (folder / part).mkdir()
        scans = make_scans(folder / "scans", options.points, options.estimated)
        damaged = scans.popitem()
        real = sorted(options.data.glob("models/*.ply")) if options.data else []
        scans |= {path.name: path for path in real} | dict([damaged])
        with (
            virtual_screen(folder / "screen", (1280, 720)) as screen,
            running_app(screen, folder / "app", *scans.values()) as app,
        ):
            watch, key = Watch(app), partial(app.screen.do, "key")
            for title in list(scans)[1:]:
                yield watch.step(f"open: {title}", partial(open_next, app))
                if "frames" in title:
                    yield watch.step("play for 10 s", partial(key, "space", "sleep", 10, "key", "space"))
                    yield watch.step("scrub for 3 s", partial(scrub, app))
                if "without" in title:
                    yield watch.step("surfels, and orbiting meanwhile", partial(estimate, app))
                    yield watch.step("points again", partial(key, "b"))
        log = (folder / "app" / "log").read_text()
    if "Traceback" in log:
        raise Failed(log[log.index("Traceback") :])


EXPERIMENT = Script([freezes], {"points": 10_000_000, "estimated": 2_000_000, "data": None})
