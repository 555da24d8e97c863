"""Files that change on disk while the window shows them: its offer, and what the mouse does with it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from virtual_screen import RunningApp, Screen, running_app

from viewer.app.theme import PALETTES, rgb


def points(seed: int) -> NDArray[np.float64]:
    return np.random.default_rng(seed).random((500, 3))


def lowest_button(app: RunningApp) -> tuple[int, int]:
    """The middle of the lowest button over the view, on the screen."""
    color = np.array(rgb(PALETTES[app.settle().theme].button[0])) * 255
    left, top, width, height = app.view()
    part = app.screen.picture()[top : top + height, left : left + width].astype(float)
    is_button = np.abs(part - color).max(axis=-1) < 2
    y = int(np.nonzero(is_button.sum(axis=1) > 20)[0].max()) - 3  # above its round corners
    x = np.nonzero(is_button[y])[0]
    return left + int(x.min() + x.max()) // 2, top + y


@pytest.mark.slow
def test_new_frames_come_in_by_the_button_that_reloads(screen: Screen, tmp_path: Path) -> None:
    scan = tmp_path / "scan"
    scan.mkdir()
    for number in range(3):
        np.save(scan / f"{number}.npy", points(number))
    with running_app(screen, tmp_path, scan) as app:
        screen.do("key", "End")
        assert app.settle().frame == 2
        app.see(knows_files=True)
        np.save(scan / "3.npy", points(3))
        app.told("The scan has 1 new file on disk")
        app.settle()
        app.do(("mousemove", *lowest_button(app)), ("click", 1))
        app.see(lambda state: state.is_opening)
        app.see(lambda state: not state.is_opening)
        screen.do("key", "End")
        app.see(frame=3)
        assert "Traceback" not in app.log()
