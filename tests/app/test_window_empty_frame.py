"""The view shows only the background for a frame without points."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from virtual_screen import RunningApp, Screen, running_app

POINTS = np.random.default_rng(0).normal(size=(2000, 3))


def colors_of_view(app: RunningApp) -> int:
    """How many colours a part of the view has, left of the mouse and above all words."""
    left, top, width, height = app.view()
    rows, columns = slice(top + height // 4, top + height // 2), slice(left + width // 8, left + width // 2)
    return len(np.unique(app.screen.picture()[rows, columns].reshape(-1, 3), axis=0))


def test_an_empty_frame_is_an_empty_picture(tmp_path: Path, screen: Screen) -> None:
    scan = tmp_path / "scan"
    scan.mkdir()
    for number in range(3):
        np.save(scan / f"{number}.npy", POINTS[: 2000 * (number != 1)])
    with running_app(screen, tmp_path, scan) as app:
        app.settle()
        assert colors_of_view(app) > 20
        app.screen.do("key", "Right")
        app.settle()
        assert colors_of_view(app) == 1
        app.screen.do("key", "Right")
        app.see(frame=2)
        app.settle()
        assert colors_of_view(app) > 20
