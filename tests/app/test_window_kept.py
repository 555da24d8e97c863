"""Nothing that was done and kept is lost where the window is killed."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from virtual_screen import PANEL, RunningApp, Screen, running_app, wait_until_stored

ACTS = 100
KEYS = {
    "view": ("ctrl+1", "ctrl+2", "ctrl+3", "ctrl+4", "ctrl+5", "ctrl+6", "o", "f", "ctrl+b", "n", "z"),
    "look": ("g", "b", "shift+b", "ctrl+r"),
    "frames": ("Right", "Left", "End", "ctrl+Home", "Home", "i", "shift+i", "alt+i"),
    "history": ("ctrl+z", "ctrl+z", "ctrl+y"),
}
LISTS = {
    "color_by": ("auto", "plain", "height", "id"),
    "light": ("auto", "head", "fixed"),
    "quality": ("fast", "balanced"),
}


class Hand:
    """Does one thing after the other in the window of a scan, by chance."""

    def __init__(self, app: RunningApp, seed: int) -> None:
        self.app, self.random = app, random.Random(seed)

    def act(self) -> None:
        acts: tuple[Callable[[], None], ...] = (
            *[self.press] * 6, self.drag, self.drag, self.wheel, self.measure, self.measure, self.choose,
        )  # fmt: skip
        self.random.choice(acts)()

    def press(self) -> None:
        keys = self.random.choice(list(KEYS.values()))
        self.app.screen.do("key", self.random.choice(keys))

    def drag(self) -> None:
        start, end = self.place(), self.place()
        down = "mousedown", self.random.choice((1, 2))
        self.app.do(("mousemove", *start, *down), ("mousemove", *end), ("mouseup", 1, "mouseup", 2))

    def wheel(self) -> None:
        times, button = self.random.randrange(1, 5), self.random.choice((4, 5))
        self.app.screen.do("mousemove", *self.place(), "click", "--repeat", times, button)

    def measure(self) -> None:
        """Between two places near the middle, where the scan mostly is."""
        clicks = [(("mousemove", *self.place(0.1)), ("click", 1)) for _ in range(2)]
        self.app.do(("key", "m"), *clicks[0], *clicks[1], ("key", "Escape"))

    def choose(self) -> None:
        name = self.random.choice(list(LISTS))
        self.app.settle()  # rows of the panel move until all is measured
        self.app.choose(PANEL, f"{name}/##value", f"###{self.random.choice(LISTS[name])}")

    def place(self, reach: float = 0.4) -> tuple[int, int]:
        """A place in the view. reach: from its middle, of its size."""
        left, top, width, height = self.app.view()
        across, down = (0.5 + self.random.uniform(-reach, reach) for _ in range(2))
        return round(left + across * width), round(top + down * height)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_a_hundred_acts_are_there_again_after_a_kill(screen: Screen, tmp_path: Path, seed: int) -> None:
    scan = tmp_path / "scan"
    scan.mkdir()
    for number in range(4):
        points = np.random.default_rng(number).normal(size=(3000, 3))
        np.save(scan / f"{number}.npy", points / np.linalg.norm(points, axis=1, keepdims=True))
    for number in range(2):
        (tmp_path / f"run{number}").mkdir()
    home = tmp_path / "home"
    with running_app(screen, tmp_path / "run0", scan, home=home) as app:
        hand = Hand(app, seed)
        for _ in range(ACTS):
            hand.act()
        done = app.settle()
        assert "Traceback" not in app.log()
        app.screen.do("key", "ctrl+b")  # an act that nothing settles after
        done = app.see(lambda state: len(state.document["bookmarks"]) > len(done.document["bookmarks"]))
        wait_until_stored(home, scan, app.settle())
        app.process.kill()
        app.process.wait()
    parts = done.document
    assert parts["bookmarks"]
    assert parts["parts"]["landmarks"]["measures"]
    with running_app(screen, tmp_path / "run1", scan, home=home) as app:
        again = app.settle()
        assert again.document == done.document
        assert again.frame == done.frame
