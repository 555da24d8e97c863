"""What is measured is drawn over the picture; regions by a lasso, with real drags."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from virtual_screen import PANEL, RunningApp, Screen, State, running_app

from viewer.app.tools.plotting.lasso import FEWEST, MOST, corners_of, without_overlap
from viewer.document.recording import Recording
from viewer.document.schema import plain
from viewer.output.plots import PLOT_COLORS

SIDE, HEIGHT, STEP = 41, 30.0, 2.0  # points along a side, between two sheets, between points; scan units
FRAMES = 3
GROWS = 0.1  # of its size, from frame to frame


def sheets() -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Two flat sheets, one behind the other, that grow: positions (T, 2 N, 3), and faces."""
    x, y = np.meshgrid(np.arange(SIDE) - SIDE // 2, np.arange(SIDE) - SIDE // 2)
    flat = np.stack([x.ravel(), y.ravel(), np.zeros(SIDE**2)], axis=1) * STEP
    corner = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).ravel()
    one = np.stack([corner, corner + 1, corner + SIDE], axis=1)
    other = np.stack([corner + 1, corner + SIDE + 1, corner + SIDE], axis=1)
    front = np.concatenate([one, other])
    both = np.concatenate([flat + np.array([0, 0, HEIGHT]), flat])
    scales = (1 + GROWS * np.arange(FRAMES))[:, None, None]
    return both * scales, np.concatenate([front, front + SIDE**2])


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    positions, faces = sheets()
    np.savez(tmp_path / "scan.npz", positions=positions, faces=faces)
    return tmp_path / "scan.npz"


def drag_round(app: RunningApp, radius: float) -> None:
    """Drag a square round the middle of the view, to the pixel where it began. radius: half its side,
    pixels."""
    left, top, width, height = app.view()
    x, y = left + width // 2, top + height // 2
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))
    places = [(x + radius * a, y + radius * b) for a, b in corners]
    shares = np.linspace(0.2, 1, 5)
    between = [(a + s * (c - a), b + s * (d - b)) for (a, b), (c, d) in pairwise(places) for s in shares]
    app.screen.do("mousemove", x, y)  # where it was already, it would not move: actions by name take it away
    app.drag(places[0], *between)


def pixels_of(picture: NDArray[np.uint8], color: int) -> float:
    """How many pixels are of a colour, 0xRRGGBB."""
    wanted = np.array([color >> 16, color >> 8 & 255, color & 255])
    return float((np.abs(picture.astype(int) - wanted).max(axis=2) < 12).sum())


@pytest.mark.slow
def test_a_region_is_drawn_and_its_area_is_known_in_all_frames(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    with running_app(screen, tmp_path, scan) as app:
        left, top, width, height = app.view()
        view = slice(top, top + height), slice(left, left + width)
        assert pixels_of(screen.picture()[view], PLOT_COLORS[0]) < 20
        app.act(PANEL, ("item_click", "###region"))
        assert app.settle().clicking == "plotting"
        drag_round(app, height / 8)
        assert app.state.clicking is None
        parts = app.state.document["parts"]["landmarks"]
        assert [measure["kind"] for measure in parts["measures"]] == ["area", "perimeter"]
        count = len(parts["all"])
        assert 6 <= count <= 16
        places = np.array([one["keys"][0]["position"] for one in parts["all"]])
        assert np.abs(places[:, 2] - HEIGHT).max() < 1e-3, "on the front sheet"
        x, y = places[:, :2].T
        area = abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2

        def areas(state: State) -> list[float]:
            return state.measured.get("Region 1, area", [np.nan])

        front = areas(app.see(lambda state: np.isfinite(areas(state)).all()))
        np.testing.assert_allclose(front, area * (1 + GROWS * np.arange(FRAMES)) ** 2, rtol=1e-3)
        app.settle()
        keys = {label["key"] for label in app.state.labels}
        assert keys == {"Region 1, area", "Region 1, perimeter"}, "its corners have no names"
        screen.do("key", "p")
        saved = app.told("Saved (.+png)")[1]
        entry = Recording.load(Path(saved)).entries[0]
        assert plain(entry.labels) == app.state.labels, "the picture has them where the view has them"
        picture = screen.picture()[view]
        assert pixels_of(picture, PLOT_COLORS[0]) + pixels_of(picture, PLOT_COLORS[1]) > 4 * height / 8

        app.act(PANEL, ("item_click", "###region"))
        left, top, *_ = app.view()
        app.drag((left + 4, top + 40), (left + 20, top + 60))
        app.told("There is no surface inside this outline")
        assert app.settle().clicking == "plotting"
        screen.do("key", "Escape")
        assert app.settle().clicking is None
        assert len(app.state.document["parts"]["landmarks"]["measures"]) == 2
        assert "Traceback" not in app.log()


@pytest.mark.slow
def test_a_region_through_all_sheets_has_the_area_of_each(screen: Screen, tmp_path: Path, scan: Path) -> None:
    with running_app(screen, tmp_path, scan) as app:

        def area(number: int) -> NDArray[np.float64]:
            """Of a region that is dragged now, in each frame."""
            app.act(PANEL, ("item_click", "###region"))
            drag_round(app, app.view()[3] / 8)
            name = f"Region {number}, area"
            state = app.see(lambda state: np.isfinite(state.measured.get(name, [np.nan])).all())
            return np.array(state.measured[name])

        front = area(1)
        app.act(PANEL, ("item_click", "Include surface behind"))
        np.testing.assert_allclose(area(2), 2 * front, rtol=0.05)
        assert len(app.state.document["parts"]["landmarks"]["measures"]) == 4
        assert "Traceback" not in app.log()


def test_corners_tell_the_form_of_an_outline() -> None:
    turns = 2 * np.pi * np.arange(200) / 200
    circle = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    corners = corners_of(circle)
    assert FEWEST < len(corners) <= MOST
    assert (np.diff(corners) > 0).all()
    gaps = np.diff([*turns[corners], turns[corners[0]] + 2 * np.pi])
    assert 1 - np.cos(gaps.max() / 2) < 0.03 * 2
    side = np.linspace(0, 1, 50, endpoint=False)
    square = np.concatenate(
        [
            np.stack([a, b, 0 * a], 1)
            for a, b in (
                (side, 0 * side),
                (1 + 0 * side, side),
                (1 - side, 1 + 0 * side),
                (0 * side, 1 - side),
            )
        ]
    )
    assert {0, 50, 100, 150} <= set(corners_of(square).tolist())
    assert corners_of(circle[:2]).tolist() == [0, 1]
    again = np.concatenate([circle, circle[:1] + 1e-3, circle[:1]])
    np.testing.assert_array_equal(without_overlap(again), circle[:-1])
    assert len(without_overlap(np.zeros((9, 3)))) == 1
    assert len(without_overlap(np.zeros((0, 3)))) == 0
    assert len(corners_of(np.zeros((9, 3)))) <= MOST
