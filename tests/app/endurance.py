"""Playing and scrubbing by real events for as long as one likes, with an eye on memory.

`python tests/app/endurance.py SECONDS` does so, and prints the memory after each round.
"""

from __future__ import annotations

import itertools
import re
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median

import numpy as np
from virtual_screen import RunningApp, running_app, virtual_screen

CACHE_MB = 64
FRAMES, POINTS = 60, 200_000  # 144 MB: more than twice what the cache holds
# Poses in the cache, and the same on the GPU, which on a software driver is ordinary memory; and what is
# being read, drawn and kept in hand by allocators. The estimate of noise loads numba after the first pose.
BUDGET_MB = 2 * CACHE_MB + 64 + 64
GROWTH_MB = 32  # from one half of the time to the other: what is in hand varies by that
_TROUBLE = re.compile(r"Traceback|Error|Warning|[Cc]annot|leaves out|failed")


@contextmanager
def playing_app(folder: Path) -> Iterator[RunningApp]:
    """The window on a sequence that does not fit the cache."""
    scan, screen_folder, own = folder / "scan", folder / "screen", folder / "app"
    for part in (scan, screen_folder, own):
        part.mkdir()
    body = np.random.default_rng(0).normal(size=(POINTS, 3)).astype(np.float32)
    for number in range(FRAMES):
        np.save(scan / f"{number:03}.npy", body * np.float32(1 + 0.3 * np.sin(number / 10)))
    with virtual_screen(screen_folder, (1280, 720)) as screen:
        screen.env["SCAN4D_CACHE_MB"] = str(CACHE_MB)
        with running_app(screen, own, scan) as app:
            yield app


def endure(app: RunningApp, seconds: float) -> Iterator[tuple[float, int]]:
    """After each round of playing and scrubbing, of about ten seconds: when it ended, and `own_megabytes`.

    All frames are shown before, so that the cache is full.
    """
    app.screen.do("key", "e", "key", "space")
    app.see(lambda _: set(app.frames()) == set(range(FRAMES)))
    app.screen.do("key", "space", "key", "e")
    start = time.monotonic()
    for round_ in itertools.count():
        _play(app, seconds=2.5)
        app.screen.do("key", "e")  # every frame, and real time again
        _play(app, seconds=1.5)
        app.screen.do("key", "e")
        for key in ("bracketright", "bracketright"):
            app.screen.do("key", key)
        _play(app, seconds=1.5)
        app.screen.do("key", "BackSpace")
        _scrub(app, round_)
        app.screen.do("key", "--repeat", 20, "--delay", 30, "Right" if round_ % 2 else "Left")
        now = time.monotonic() - start
        yield now, own_megabytes(app)
        if now > seconds:
            return


def _play(app: RunningApp, seconds: float) -> None:
    app.screen.do("key", "space", "sleep", seconds, "key", "space")


def _scrub(app: RunningApp, seed: int) -> None:
    """Drag over the timeline's track to places here and there."""
    _, top, _, height = app.view()
    track = top + height + 25
    words: list[object] = ["mousemove", 640, track, "mousedown", 1]
    for x in np.random.default_rng(seed).integers(560, 1200, 40):
        words += ["mousemove", x, track, "sleep", 0.05]
    app.screen.do(*words, "mouseup", 1)


def own_megabytes(app: RunningApp) -> int:
    """Memory of its own; pages of mapped files are the system's to take."""
    status = Path(f"/proc/{app.process.pid}/status").read_text()
    found = re.search(r"RssAnon:\s+(\d+) kB", status)
    assert found is not None
    return int(found[1]) // 1024


def problems(before: int, sizes: list[int]) -> list[str]:
    """What is wrong with the memory. before: with one pose. sizes: after each round. In megabytes."""
    half = len(sizes) // 2
    earlier, later = median(sizes[:half]), median(sizes[half:])
    found = []
    if max(sizes) > before + BUDGET_MB:
        found.append(f"{max(sizes)} MB are more than {BUDGET_MB} above the {before} at the start")
    if later > earlier + GROWTH_MB:
        found.append(f"it grew from {earlier} to {later} MB")
    return found


def trouble(app: RunningApp) -> list[str]:
    """The lines of the log that tell of something wrong."""
    return [line for line in app.log().splitlines() if _TROUBLE.search(line)]


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder, playing_app(Path(folder)) as app:
        before, sizes = own_megabytes(app), []
        print(f"{before} MB with one frame", flush=True)
        for seconds, megabytes in endure(app, float(sys.argv[1])):
            sizes.append(megabytes)
            print(f"{seconds:.0f} s: {megabytes} MB", flush=True)
        half = len(sizes) // 2
        first, last = median(sizes[:half]), median(sizes[half:])
        print(f"first half {first} MB, second half {last} MB: {last / first - 1:+.1%}")
        print("\n".join(problems(before, sizes) + trouble(app)) or "no trouble")
