"""Averages of frames in the window: the panel says how much is averaged, and measures use scanned points."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from virtual_screen import PANEL, PATIENCE, RunningApp, Screen, running_app, stored_of, wait_until

from viewer.document.recording import Recording
from viewer.scan import formats
from viewer.scan.averaging import Averaging
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud

FRAMES, SIDE, NOISE = 8, 60, 0.3


def write_noisy(folder: Path) -> None:
    """A noisy plate of 60 x 60 points, 1 apart, of which a corner rises."""
    folder.mkdir()
    x, y = np.meshgrid(np.arange(SIDE), np.arange(SIDE))
    for frame in range(FRAMES):
        rng = np.random.default_rng(frame)
        z = 3 * np.sin(x / 9) + NOISE * rng.normal(size=x.shape) + 4.0 * frame * ((x > 45) & (y > 45))
        points = np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(np.float32)
        gray = np.clip(150 + 8 * rng.normal(size=(SIDE * SIDE, 1)), 0, 255)
        colors = np.repeat(gray, 3, axis=1).astype(np.uint8)
        formats.write(folder / f"{frame}.npz", PointCloud.from_arrays(points, colors=colors))


def measure(app: RunningApp) -> list[dict[str, Any]]:
    """Measure between two places of the view; the ends."""
    left, top, width, height = app.view()
    app.press("m")
    for across, down in ((0.36, 0.7), (0.68, 0.8)):
        app.screen.do("mousemove", round(left + across * width), round(top + down * height), "click", 1)
        app.take_in()
    app.press("Escape")
    ends: list[dict[str, Any]] = app.settle().distances[-1]["ends"]
    return ends


def off_points(end: dict[str, Any], cloud: PointCloud) -> float:
    """How far the points that an end follows are from those of a cloud."""
    ids = [neighbor["id"] for neighbor in end["neighbors"]]
    found = np.array([neighbor["offset"] for neighbor in end["neighbors"]]) + end["position"]
    return float(np.abs(found - cloud.world(ids)).max())


@pytest.mark.slow
def test_frames_are_averaged_and_measures_are_not(screen: Screen, tmp_path: Path) -> None:
    scan = tmp_path / "scan"
    write_noisy(scan)
    with open_scan(scan) as timeline:
        last = timeline.pose(FRAMES - 1).cloud
        timeline.average(Averaging(8))
        averaged = timeline.drawn(FRAMES - 1).cloud
    with running_app(screen, tmp_path, scan) as app:
        app.screen.do("key", "End")
        app.see(frame=FRAMES - 1)
        assert app.settle().average == ""
        app.choose(PANEL, "##average", "###8")
        app.see(lambda state: state.average.endswith(" % of the points stand still: mean of 8 frames"))
        assert 85 <= int(app.settle().average.split()[0]) <= 95
        for end in measure(app):
            assert end["averaged"] == 0
            assert off_points(end, last) < 1e-5, "clicks use the points as scanned"
        app.act(PANEL, ("item_check", "Measure on averaged points"))
        app.settle()
        for end in measure(app):
            assert end["averaged"] == 8
            assert off_points(end, averaged) < 1e-5
        app.press("p")
        wait_until(lambda: list(tmp_path.glob("scan4d_*.png")))
        app.settle()
        (picture,) = tmp_path.glob("scan4d_*.png")
        assert Recording.load(picture).entries[0].average == 8
        app.screen.do("key", "ctrl+q")
        app.process.wait(PATIENCE)
    document = stored_of(tmp_path, scan).document
    assert (document.average, document.measure_averaged) == (8, True)
    with running_app(screen, tmp_path, scan) as app:
        app.see(lambda state: "mean of" in state.average)
        app.act(PANEL, ("item_uncheck", "Measure on averaged points"))
        app.choose(PANEL, "##average", "###0")
        app.see(average="")
        app.screen.do("key", "ctrl+z")
        app.see(lambda state: "mean of" in state.average)
