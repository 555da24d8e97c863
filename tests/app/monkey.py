"""Random but seeded input on the window: keys, chords, clicks, drags, the wheel, resizes, texts.

`python tests/app/monkey.py ACTS [SEED]` lets it loose for so many and tells what came of it.
"""

from __future__ import annotations

import random
import re
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

import numpy as np
from virtual_screen import RunningApp, Screen, running_app, virtual_screen

SIZE = (1280, 720)
_KEYS = (
    *"abcdefghijklmnopqrstuvwxyz0123456789", "space", "Left", "Right", "Up", "Down", "Home", "End",
    "Prior", "Next", "BackSpace", "Tab", "Return", "Escape", "Delete", "bracketleft", "bracketright",
    "minus", "equal", "comma",
    *(f"F{n}" for n in range(1, 13)),
)  # fmt: skip
_MODIFIERS = ("ctrl", "shift", "alt", "ctrl+shift")
_TEXTS = ("/nowhere", "1e9", "-1", "nan", "0", "../..", "%d%d", "a b.csv", "f" * 300, "")
_TROUBLE = re.compile(r"Traceback|\bERROR\b|\bWARNING\b|[A-Z]\w+Error\b|assert", re.IGNORECASE)


class Monkey:
    """Does one thing after the other; the same ones for the same seed."""

    def __init__(self, screen: Screen, seed: int) -> None:
        self.screen = screen
        self.random = random.Random(seed)
        self.count = 0

    def act(self) -> None:
        """Do something. Mostly on the view and with keys, so that menus do not hold it up."""
        acts = (self.press, self.press, self.press, self.chord, self.click, self.click, self.drag, self.drag,
                self.wheel, self.write, self.resize, self.escape)  # fmt: skip
        self.random.choice(acts)()
        self.count += 1

    def press(self) -> None:
        self.screen.do("key", self.random.choice(_KEYS))

    def chord(self) -> None:
        self.screen.do("key", f"{self.random.choice(_MODIFIERS)}+{self.random.choice(_KEYS)}")

    def click(self) -> None:
        button = self.random.choice((1, 1, 1, 2, 3))
        self.screen.do("mousemove", *self._place(), "click", "--repeat", self.random.choice((1, 2)), button)

    def drag(self) -> None:
        start, end, button = self._place(), self._place(), self.random.choice((1, 1, 2, 3))
        self.screen.do("mousemove", *start, "mousedown", button, "sleep", 0.05, "mousemove", *end)
        self.screen.do("sleep", 0.05, "mouseup", button)

    def wheel(self) -> None:
        times = self.random.randrange(1, 30)
        self.screen.do("mousemove", *self._place(), "click", "--repeat", times, self.random.choice((4, 5)))

    def write(self) -> None:
        """Into whatever has the keyboard."""
        self.screen.do("type", "--delay", 5, "--", self.random.choice(_TEXTS) + "\n")

    def resize(self) -> None:
        """From too small for anything to the whole screen."""
        width, height = self.random.choice((SIZE, SIZE, (640, 480), (200, 150), (60, 40)))
        for window in self.screen.do("search", "--name", "Scan4D").split():
            self.screen.do("windowmove", window, 0, 0, "windowsize", window, width, height)

    def escape(self) -> None:
        self.screen.do("key", "Escape")

    def _place(self) -> tuple[int, int]:
        return self.random.randrange(SIZE[0]), self.random.randrange(SIZE[1])


def scan_with_faults(folder: Path) -> Path:
    """A sequence with a broken frame, one without points and one with NaNs."""
    folder.mkdir()
    for number in range(8):
        points = np.random.default_rng(number).random((3000, 3))
        np.save(folder / f"{number}.npy", points)
    (folder / "3.npy").write_bytes((folder / "3.npy").read_bytes()[:500])
    np.save(folder / "5.npy", np.zeros((0, 3)))
    np.save(folder / "6.npy", np.where(np.arange(9000).reshape(-1, 3) % 7, 1.0, np.nan))
    return folder


def let_loose(folder: Path, acts: int, seed: int) -> None:
    """Have it act so often, on a sequence with faults and the demo.

    Fails where the window breaks down or its log tells of trouble; one that was closed is opened again.
    """
    scan, starts = scan_with_faults(folder / "scan"), 0
    with virtual_screen(folder, SIZE) as screen:
        monkey = Monkey(screen, seed)
        while monkey.count < acts:
            starts += 1
            home = folder / str(starts)
            home.mkdir()
            with running_app(screen, home, scan, "demo") as app:
                while monkey.count < acts and app.process.poll() is None:
                    with suppress(subprocess.CalledProcessError):  # of a window that it has just closed
                        monkey.act()
                    check(app, monkey.count)


def check(app: RunningApp, count: int) -> None:
    """Fails where there is trouble. count: of the acts so far."""
    log = app.log()
    assert not app.process.poll(), f"it broke down after {count} acts:\n{log[-5000:]}"
    if trouble := _TROUBLE.search(log):
        around = log[max(trouble.start() - 3000, 0) : trouble.end() + 3000]
        raise AssertionError(f"after {count} acts:\n{around}")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        seed = int(sys.argv[2]) if len(sys.argv) > 2 else 0
        let_loose(Path(folder), int(sys.argv[1]), seed)
        print("no trouble")
