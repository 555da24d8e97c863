"""A scan that moves as one stands still at a key: in the view, in pictures, and after the next start."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from rigid_hills import RigidHills, truth
from virtual_screen import Screen, running_app, wait_until_stored

from viewer.document.recording import Recording
from viewer.scan import formats

FRAMES, GAP = 5, 3
STILL = np.eye(4)


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
