"""The frame rate of a scan in the window: told in the panel, undone, and there again at the next start."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from virtual_screen import PANEL, PATIENCE, Screen, running_app, stored_of

from viewer.scan import formats
from viewer.scan.points import PointCloud


@pytest.mark.slow
def test_a_rate_and_names_tell_the_times(screen: Screen, tmp_path: Path) -> None:
    scan = tmp_path / "scan"
    scan.mkdir()
    points = np.random.default_rng(0).uniform(-1, 1, (500, 3))
    for stamp in ("5.000", "5.500", "6.000"):
        formats.write(scan / f"{stamp}.npz", PointCloud.from_arrays(points))
    with running_app(screen, tmp_path, scan) as app:
        app.see(scan_rate=2)
        app.act(PANEL, ("item_input_value", "##rate", 50.0))
        app.see(scan_rate=50)
        app.act(PANEL, ("item_check", "Times from file names"))
        app.see(scan_rate=2)
        app.screen.do("key", "End")
        app.see(frame=2)
        assert app.settle().shown_time == 1.0
        app.screen.do("key", "ctrl+z")
        app.see(scan_rate=pytest.approx(50))
        app.see(shown_time=pytest.approx(0.04))
        app.screen.do("key", "ctrl+q")
        app.process.wait(PATIENCE)
    assert stored_of(tmp_path, scan).document.fps == 50
    with running_app(screen, tmp_path, scan) as app:
        app.see(scan_rate=pytest.approx(50))
