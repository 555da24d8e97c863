"""A scan that moves as one stands still at a key: in the view, in pictures, and after the next start."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from rigid_hills import RigidHills, truth
from scipy.spatial.transform import Rotation
from virtual_screen import PANEL, ROOT, Screen, running_app, virtual_screen, wait_until_stored

from viewer.analysis.motion.axes import NAMES as AXES
from viewer.document.recording import Recording
from viewer.scan import formats

FRAMES, GAP = 5, 3
STILL = np.eye(4)
ABOVE_LEGEND = 320  # rows of the picture


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    """Hills of which one side also rises; a frame shows something else."""
    source = RigidHills(FRAMES, rise=0.6, lacking=frozenset({GAP}))
    folder = tmp_path / "hills"
    folder.mkdir()
    for frame in range(FRAMES):
        formats.write(folder / f"{frame}.npz", source.load(frame))
    return folder


def alone(folder: Path) -> str:
    """Python that keeps the cache of a test apart."""
    return f"import os; os.environ['XDG_CACHE_HOME'] = {str(folder / 'cache')!r}; "


def is_back(moved: NDArray[np.float64], frame: int) -> bool:
    """Whether a frame was moved back to where the first one is, as far as it can be told."""
    off = np.array(moved) @ truth(frame, 0).matrix - STILL
    return bool(np.abs(off[:3, :3]).max() < 0.01 and np.abs(off).max() < 0.1)


@pytest.mark.slow
def test_a_key_switches_between_as_recorded_and_stabilised(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    with running_app(screen, tmp_path, scan, before=alone(tmp_path)) as app:
        app.press("u")
        assert app.state.moved == STILL.tolist(), "the reference stays where it is"
        app.press("Right", "Right")
        assert app.state.frame == 2
        assert is_back(app.state.moved, 2)
        app.press("p")
        (entry,) = Recording.load(Path(app.told(r"Saved (.+\.png)")[1])).entries
        assert is_back(entry.motion.matrix, 2)
        app.press("Right")
        assert app.state.moved == STILL.tolist(), "a gap is shown as recorded"
        app.press("Right")
        assert is_back(app.state.moved, 4)
        app.press("u")
        assert app.state.moved == STILL.tolist()
        app.press("ctrl+z")
        assert is_back(app.state.moved, 4)
        wait_until_stored(tmp_path, scan, app.state)
        assert "Traceback" not in app.log()
    with running_app(screen, tmp_path, scan, before=alone(tmp_path)) as app:
        app.see(lambda state: is_back(state.moved, 4))
        kept = "".join(file.read_text() for file in (tmp_path / "cache/scan4d/motions").iterdir())
        assert "motion" in kept
        assert str(tmp_path) not in kept


@pytest.mark.slow
def test_from_opening_to_a_stabilised_film_coloured_by_distance_in_eight_actions(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    actions = 1  # the scan is opened
    with running_app(screen, tmp_path, scan, before=alone(tmp_path)) as app:
        app.press("shift+u")
        assert "to colour by" not in app.log(), "no message that its numbers are not known yet"
        app.press("ctrl+e")
        actions += 2
        for field, item in (("what", "###frames"), ("format", "###mp4")):
            app.choose("Export", f"##{field}", item)
            actions += 2  # the list, and the item
        app.act("Export", ("item_click", "Export"))
        actions += 1
        film = Path(app.told(r"Saved (.+\.mp4)")[1])
        assert film.stat().st_size > 1000
        assert actions <= 8
        assert app.state.undoes == "Colour by distance"
        app.press("Right")
        assert app.state.color_range[0] == 0
        app.press("p")
        saved = Path(app.told(r"Saved (.+\.png)")[1])
        (entry,) = Recording.load(saved).entries
        assert entry.stabilised is not None
        assert (entry.stabilised.region, entry.stabilised.reference) == ("found by Scan4D", 0)
        assert not entry.stabilised.is_gap
        redraw = [sys.executable, "-m", "viewer.cli", "render", "--replay", str(saved), "-o"]
        here = {**os.environ, "PYTHONPATH": str(ROOT)}
        for name, more in (("again.png", []), ("nameless.png", ["--anonymous"])):
            subprocess.run([*redraw, str(tmp_path / name), *more], check=True, cwd=tmp_path, env=here)
        pictures = [
            np.asarray(Image.open(file).convert("RGB")).astype(int)[:ABOVE_LEGEND]
            for file in (saved, tmp_path / "again.png", tmp_path / "nameless.png")
        ]
        assert (pictures[0] == pictures[1]).all(), "its colours are computed again"
        assert np.abs(pictures[0] - pictures[2]).mean() < 1
        assert len(np.unique(pictures[0].reshape(-1, 3), axis=0)) > 1000, "it is coloured"
        rises = app.state.curves["Residual (RMS)"]
        assert 0 < rises[1] < 0.5
        assert np.isnan(rises[GAP])
        turn = np.array([app.state.curves[f"Rotation, {axis}"] for axis in AXES])[:, 2]
        wanted = Rotation.from_matrix(truth(2, 0).rotation).magnitude()
        assert np.linalg.norm(np.radians(turn)) == pytest.approx(wanted, abs=0.01)
        app.press("shift+u")
        assert app.state.document["look"]["color_by"] == "auto"
        assert "Traceback" not in app.log()


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1, 2])
def test_a_region_is_painted_shown_and_taken_back(tmp_path: Path, scan: Path, scale: int) -> None:
    folder = tmp_path / "screen"
    folder.mkdir()
    with (
        virtual_screen(folder, (1024 * scale, 640 * scale), scale) as screen,
        running_app(screen, tmp_path, scan, before=alone(tmp_path)) as app,
    ):
        app.press("Right")
        app.choose(PANEL, "##region", "###painted")
        app.act(PANEL, ("item_click", "###paint region"))
        assert app.settle().frame == 0, "painting is in the reference frame"
        assert app.state.clicking == "stabilising"
        left, top, width, height = app.view()
        y = top + height // 2
        app.drag((left + width * 0.3, y), (left + width * 0.4, y), (left + width * 0.5, y))
        away = [(left + width * x, y + height * z) for z in (-0.1, 0.1) for x in (0.2, 0.25, 0.3, 0.4, 0.5)]
        app.drag(*away)
        (painted,) = app.state.document["parts"].values()
        assert painted["region"] == "painted"
        assert len(painted["spheres"]) >= 10
        assert not app.state.moved or app.state.moved == STILL.tolist()
        app.do(("mousemove", left + int(width * 0.45), y + height // 12), ("click", 1))
        more = app.settle().document["parts"]["stabilising"]
        assert len(more["spheres"]) == len(painted["spheres"]) + 1, "a click paints, too"
        app.press("ctrl+z")
        assert app.state.document["parts"]["stabilising"] == painted
        app.act(PANEL, ("item_click", "###erase region"))
        app.drag((left + width * 0.5, y), (left + width * 0.55, y))
        erased = app.settle().document["parts"]["stabilising"]["spheres"]
        assert [one[3] < 0 for one in erased].count(True) >= 1, "the eraser removes what lies within it"
        assert app.state.undoes == "Erase from region"
        app.press("ctrl+z", "shift+g")
        assert app.state.document["parts"]["stabilising"] == painted
        app.do(("mousemove", left + 5, top + height - 5), ("click", 1))
        app.told("No surface here")
        app.press("Escape", "Escape")
        assert app.state.clicking is None
        app.press("u")
        app.act(PANEL, ("item_click", "Show region"))
        assert app.settle().color_range == [0, 1]
        app.press("Right", "Right")
        assert is_back(app.state.moved, 2)
        cut = {where for where in app.state.cut if "stabilising" in str(where).lower()}
        assert not cut
        assert "Traceback" not in app.log()
