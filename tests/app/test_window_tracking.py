"""Every point of a frame is followed at a key: colours of its motion, in the view and in what is saved."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from moving_hills import SIDE, hills
from PIL import Image
from rigid_hills import pose_of_head
from virtual_screen import PANEL, ROOT, RunningApp, Screen, running_app, virtual_screen, wait_until_stored

from viewer.analysis.motion.curves import PATH
from viewer.document.recording import Recording
from viewer.look import Look
from viewer.scan import formats
from viewer.scan.points import PointCloud

FRAMES, RISE = 5, 0.6  # of what is at x > 14, each frame; less from x = 8 on
ABOVE_LEGEND = 320  # rows of the picture


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    """Hills that move as one, while one side also rises; the frames share their points."""
    folder = tmp_path / "hills"
    folder.mkdir()
    x, y = np.random.default_rng(0).uniform(-SIDE / 2, SIDE / 2, (2, 2500))
    for frame in range(FRAMES):
        z = hills(x, y) + RISE * frame * np.clip((x - 8) / 6, 0, 1)
        cloud = PointCloud.from_arrays(pose_of_head(frame).points(np.column_stack([x, y, z])))
        formats.write(folder / f"{frame}.npz", replace(cloud, topology="hills"))
    return folder


def alone(folder: Path) -> str:
    """Python that keeps the cache of a test apart."""
    return f"import os; os.environ['XDG_CACHE_HOME'] = {str(folder / 'cache')!r}; "


def picture(file: Path) -> np.ndarray:
    return np.asarray(Image.open(file).convert("RGB")).astype(int)[:ABOVE_LEGEND]


@pytest.mark.slow
def test_from_opening_to_a_stabilised_film_coloured_by_displacement_in_eight_actions(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    actions = 1  # the scan is opened
    with running_app(screen, tmp_path, scan, before=alone(tmp_path)) as app:
        app.press("u")
        app.press("shift+d")
        app.press("ctrl+e")
        actions += 3
        app.choose("Export", "##format", "###mp4")
        actions += 2  # the list, and the item
        app.act("Export", ("item_click", "Export"))
        actions += 1
        film = Path(app.told(r"Saved (.+\.mp4)")[1])
        assert film.stat().st_size > 1000
        assert actions <= 8
        assert app.state.undoes == "Follow points"
        app.press("Right", "Right")
        low, high = app.state.color_range
        assert low == 0
        assert 2 * RISE < high < 6 * RISE, "the motion of the whole is removed: the side has risen"
        app.press("p")
        saved = Path(app.told(r"Saved (.+\.png)")[1])
        (entry,) = Recording.load(saved).entries
        assert entry.followed is not None
        assert [one.frame for one in entry.followed.motions] == [0, 2]
        redraw = [sys.executable, "-m", "viewer.cli", "render", "--replay", str(saved), "-o"]
        here = {**os.environ, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(tmp_path / "other")}
        for name, more in (("again.png", []), ("nameless.png", ["--anonymous"])):
            subprocess.run([*redraw, str(tmp_path / name), *more], check=True, cwd=tmp_path, env=here)
        again, nameless = picture(tmp_path / "again.png"), picture(tmp_path / "nameless.png")
        assert (picture(saved) == again).all(), "points are followed again"
        assert np.abs(picture(saved) - nameless).mean() < 1
        assert len(np.unique(again.reshape(-1, 3), axis=0)) > 500, "it is coloured"
        app.press("u")
        assert app.state.color_range[1] > high, "as recorded, all of it moves"
        app.press("ctrl+z", "ctrl+z")
        look = app.state.document["look"]
        assert (look["color_by"], look["plain"]) == ("auto", Look().plain)
        app.press("ctrl+y")
        assert app.state.color_range[1] > 0
        assert not any("to colour by" in note for note in app.notes), "the numbers are there at once"
        assert "Traceback" not in app.log()


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1, 2])
def test_colors_are_chosen_and_points_are_there_after_the_next_start(
    tmp_path: Path, scan: Path, scale: int
) -> None:
    folder = tmp_path / "screen"
    folder.mkdir()
    with virtual_screen(folder, (1024 * scale, 640 * scale), scale) as screen:
        with running_app(screen, tmp_path, scan, before=alone(tmp_path)) as app:
            shown = chosen(app, tmp_path, scan)
        kept = (tmp_path / "cache/scan4d/dense").rglob("frame_*")
        files = {file: file.stat().st_mtime_ns for file in kept}
        assert len(files) == 2 * FRAMES, "of two reference frames"
        with running_app(screen, tmp_path, scan, before=alone(tmp_path)) as app:
            app.see(lambda state: state.color_range == shown and state.is_idle)
    assert {file: file.stat().st_mtime_ns for file in files} == files, "they were read, not found again"


def chosen(app: RunningApp, folder: Path, scan: Path) -> list[float]:
    """Follow points, and colour them in several ways; gives the ends of the colour map."""
    app.act(PANEL, ("item_click", "Follow points"))
    parts = app.settle().document["parts"]
    assert parts["dense_tracking"] == {"is_on": True, "reference": 0, "spheres": []}
    app.press("Right")
    for name in ("normal displacement", "first principal strain", "area change"):
        app.choose(PANEL, "##motion color", f"###{name}")
        look = app.settle().document["look"]
        assert (look["color_by"], look["color_map"]) == (name, "vik")
        assert look["low"] == -look["high"], "0 has the middle of the map"
    app.choose(PANEL, "##motion color", "###point speed")
    look = app.settle().document["look"]
    assert (look["low"], look["color_map"]) == (0, "batlow")
    app.act(PANEL, ("item_click", "###paint tracked region"))
    left, top, width, height = app.settle() and app.view()
    app.drag((left + width * 0.45, top + height // 2), (left + width * 0.5, top + height // 2))
    app.press("Escape")
    distances = app.see(lambda state: PATH[3] in state.curves).curves[PATH[3]]
    assert distances[0] == 0
    assert len(distances) == FRAMES
    assert np.diff(distances).min() > 0.1, "the region moves along with the whole"
    app.press("Right", "Right")
    app.act(PANEL, ("item_click", "###reference of points"))
    assert app.settle().document["parts"]["dense_tracking"]["reference"] == 2
    assert not {where for where in app.state.cut if "tracking" in str(where).lower()}
    wait_until_stored(folder, scan, app.state)
    assert "Traceback" not in app.log()
    shown: list[float] = app.state.color_range
    return shown
