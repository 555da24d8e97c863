"""Deviations from a reference at a key: colours, numbers and curves, as recorded and stabilised."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rigid_hills import RigidHills
from virtual_screen import PANEL, ROOT, Screen, running_app, virtual_screen, wait_until_stored

from viewer.document.recording import Recording
from viewer.look import Look
from viewer.scan import formats

FRAMES, RISE = 4, 0.6
ABOVE_LEGEND = 320  # rows of the picture
RMS = "Deviation, RMS"


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    """Hills that move as one, while one side also rises."""
    source = RigidHills(FRAMES, rise=RISE)
    folder = tmp_path / "hills"
    folder.mkdir()
    for frame in range(FRAMES):
        formats.write(folder / f"{frame}.npz", source.load(frame))
    return folder


def alone(folder: Path) -> str:
    """Python that keeps the cache of a test apart."""
    return f"import os; os.environ['XDG_CACHE_HOME'] = {str(folder / 'cache')!r}; "


def picture(file: Path) -> np.ndarray:
    return np.asarray(Image.open(file).convert("RGB")).astype(int)[:ABOVE_LEGEND]


@pytest.mark.slow
def test_a_key_shows_deviations_which_pictures_and_films_keep(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    with running_app(screen, tmp_path, scan, before=alone(tmp_path)) as app:
        app.press("shift+m")
        recorded = app.see(lambda state: np.isfinite(state.curves.get(RMS, [np.nan])).all()).curves[RMS]
        look = app.settle().document["look"]
        assert (look["color_by"], look["color_map"]) == ("deviation", "vik")
        assert look["low"] == -look["high"], "0 has the middle of the map"
        assert recorded[0] < 0.1 < recorded[1] < recorded[3]
        app.press("u", "Right", "Right")
        stabilised = app.see(
            lambda state: np.isfinite(state.curves[RMS]).all() and state.curves[RMS][3] < recorded[3]
        )
        assert stabilised.curves[RMS][3] > 0.3, "what has risen stays"
        app.settle()
        app.press("p")
        saved = Path(app.told(r"Saved (.+\.png)")[1])
        (entry,) = Recording.load(saved).entries
        assert entry.deviation is not None
        assert (entry.deviation.first, entry.deviation.last, entry.deviation.file) == (0, 0, None)
        redraw = [sys.executable, "-m", "viewer.cli", "render", "--replay", str(saved), "-o"]
        here = {**os.environ, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(tmp_path / "other")}
        for name, more in (("again.png", []), ("nameless.png", ["--anonymous"])):
            subprocess.run([*redraw, str(tmp_path / name), *more], check=True, cwd=tmp_path, env=here)
        again, nameless = picture(tmp_path / "again.png"), picture(tmp_path / "nameless.png")
        assert (picture(saved) == again).all(), "deviations are measured again"
        assert np.abs(picture(saved) - nameless).mean() < 1
        assert len(np.unique(again.reshape(-1, 3), axis=0)) > 500, "it is coloured"
        app.press("ctrl+e")
        app.choose("Export", "##format", "###mp4")
        app.act("Export", ("item_click", "Export"))
        film = Path(app.told(r"Saved (.+\.mp4)")[1])
        assert film.stat().st_size > 1000
        app.press("shift+m")
        state = app.settle()
        assert (state.document["look"]["color_by"], state.document["look"]["plain"]) == ("auto", Look().plain)
        assert RMS not in state.curves
        app.press("ctrl+z", "ctrl+z")
        assert app.settle().document["look"]["color_by"] == "deviation"
        assert not any("to colour by" in note for note in app.notes), "the numbers are there at once"
        wait_until_stored(tmp_path, scan, app.state)
        assert "Traceback" not in app.log()
    kept = {file: file.stat().st_mtime_ns for file in (tmp_path / "cache/scan4d/deviation").iterdir()}
    assert len(kept) == 1
    assert str(tmp_path) not in next(iter(kept)).read_text()
    with running_app(screen, tmp_path, scan, before=alone(tmp_path)) as app:
        app.see(lambda state: state.is_idle and np.isfinite(state.curves.get(RMS, [np.nan])).all())
    assert {file: file.stat().st_mtime_ns for file in kept} == kept, "they were read, not found again"


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1, 2])
def test_references_and_a_region_are_chosen(tmp_path: Path, scan: Path, scale: int) -> None:
    folder = tmp_path / "screen"
    folder.mkdir()
    with (
        virtual_screen(folder, (1024 * scale, 640 * scale), scale) as screen,
        running_app(screen, tmp_path, scan, before=alone(tmp_path)) as app,
    ):
        app.act(PANEL, ("item_click", "###show deviation"))
        app.press("Right", "Right")
        app.act(PANEL, ("item_click", "###reference of deviations"))
        assert app.settle().document["parts"]["deviation"]["first"] == 2
        app.see(lambda state: np.argmin(state.curves.get(RMS, [0])) == 2)
        app.choose(PANEL, "##reference kind", "###mean")
        parts = app.settle().document["parts"]["deviation"]
        assert (parts["kind"], parts["first"], parts["last"]) == ("mean", 2, 3)
        app.act(PANEL, ("item_click", "###paint measured region"))
        left, top, width, height = app.settle() and app.view()
        assert app.state.frame == 2, "painting is in the first frame of the mean"
        app.drag((left + width * 0.45, top + height // 2), (left + width * 0.5, top + height // 2))
        app.press("Escape")
        app.see(lambda state: f"Deviation of region, {RMS[-3:]}" in state.curves)
        app.choose(PANEL, "##reference kind", "###file")
        app.press("Escape")
        assert app.settle().document["parts"]["deviation"]["kind"] == "file"
        assert not app.state.curves, "no file is chosen"
        assert not {where for where in app.state.cut if "deviation" in str(where).lower()}
        assert "Traceback" not in app.log()
