"""The range of colours in the window: over all frames, told while it is not, fixed in two actions."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from test_window import replayed
from virtual_screen import PANEL, RunningApp, Screen, State, running_app
from written import picture

from viewer.scan import formats
from viewer.scan.points import PointCloud

FRAMES = 12
HIGHEST = 0.98 * (FRAMES - 1)


def write_frames(folder: Path) -> None:
    """Frames of a grid whose scalar goes from 0 to the number of the frame."""
    x, y = np.meshgrid(np.linspace(-1, 1, 61), np.linspace(-1, 1, 61))
    positions = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    for index in range(FRAMES):
        values = np.linspace(0, index, x.size, dtype=np.float32)
        cloud = PointCloud.from_arrays(positions, scalars={"displacement": values})
        formats.write(folder / f"{index:02d}.npz", cloud)


@pytest.fixture
def app(screen: Screen, tmp_path: Path) -> Iterator[RunningApp]:
    (tmp_path / "scan").mkdir()
    write_frames(tmp_path / "scan")
    with running_app(screen, tmp_path, tmp_path / "scan") as app:
        yield app
    assert "Traceback" not in app.log()


def spans(low: float, high: float) -> object:
    return lambda state: state.color_range == [pytest.approx(low, abs=0.01), pytest.approx(high, abs=0.01)]


def look_of(state: State) -> dict:
    return state.document["look"]


@pytest.mark.slow
def test_all_frames_have_one_range_that_two_actions_fix(app: RunningApp) -> None:
    app.choose(PANEL, "color_by/##value", "###displacement")
    app.see(spans(0, HIGHEST))
    app.see(range_note="")
    assert look_of(app.state)["high"] is None, "it is found, not chosen"
    app.screen.do("key", "End")
    app.see(frame=FRAMES - 1)
    app.see(spans(0, HIGHEST))

    app.choose(PANEL, "range/##value", "###fixed")
    assert look_of(app.settle())["high"] == pytest.approx(HIGHEST, abs=0.01)
    assert app.state.undoes == "Change range"


@pytest.mark.slow
def test_each_frame_may_have_its_own(app: RunningApp) -> None:
    app.choose(PANEL, "color_by/##value", "###displacement")
    app.choose(PANEL, "range/##value", "###frame")
    app.screen.do("key", "Right", "key", "Right")
    app.see(frame=2)
    app.see(spans(0.04, 0.98 * 2))


@pytest.mark.slow
def test_an_end_that_is_no_longer_automatic_begins_where_it_was(app: RunningApp) -> None:
    app.choose(PANEL, "color_by/##value", "###displacement")
    app.see(spans(0, HIGHEST))
    app.act(PANEL, ("item_uncheck", "high/auto"))
    assert look_of(app.settle())["high"] == pytest.approx(HIGHEST, abs=0.01)
    assert look_of(app.state)["low"] is None


@pytest.mark.slow
def test_a_saved_picture_is_drawn_again_in_the_same_colours(app: RunningApp) -> None:
    app.choose(PANEL, "color_by/##value", "###displacement")
    app.see(spans(0, HIGHEST))
    app.settle()
    app.screen.do("key", "p")
    saved = Path(app.told(r"Saved (.+)")[1])
    np.testing.assert_array_equal(picture(saved), replayed(saved, "again.png")[0])
