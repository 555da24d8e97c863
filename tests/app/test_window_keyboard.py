"""The window without a mouse, with real keys: menus, the panel, the timeline, dialogs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from virtual_screen import RunningApp, Screen, running_app

from viewer.app.theme import PALETTES, rgb
from viewer.camera import Camera


@pytest.fixture(scope="module")
def running(screen: Screen, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningApp]:
    scan = tmp_path_factory.mktemp("scan")
    for number in range(5):
        points = np.random.default_rng(number).uniform((-1, -2, -3), (1, 2, 3), (400, 3))
        np.save(scan / f"{number}.npy", points)
    with running_app(screen, tmp_path_factory.mktemp("app"), scan) as app:
        yield app


@pytest.fixture
def app(running: RunningApp) -> RunningApp:
    running.reset()
    return running


def framed(app: RunningApp, *box: int) -> int:
    """How many pixels of a part of the screen have the colour of what frames the widget with the keyboard.

    box: left, top, right, bottom.
    """
    left, top, right, bottom = box
    accent = np.array(rgb(PALETTES[app.settle().theme].accent)) * 255
    part = app.screen.picture()[top:bottom, left:right].astype(float)
    return int((np.abs(part - accent).max(axis=-1) < 3).sum())


def panel(app: RunningApp) -> tuple[int, int, int, int]:
    """Where the panel is on the screen: left, top, right, bottom."""
    left, top, width, height = app.view()
    return left + width, top, app.state.size[0], top + height


def timeline(app: RunningApp) -> tuple[int, int, int, int]:
    """Where the buttons of the timeline are on the screen."""
    _, top, _, height = app.view()
    return 0, top + height, 220, app.state.size[1]


def looks_from(app: RunningApp) -> list[int]:
    """The side that the view is seen from, as a direction."""
    camera = app.settle().camera
    away = np.subtract(camera["eye"], camera["target"])
    return [int(part) for part in np.round(away / np.linalg.norm(away))]


@pytest.mark.slow
def test_alt_opens_the_menus_and_arrows_and_enter_choose(app: RunningApp) -> None:
    assert looks_from(app) == [0, 0, 1]
    app.press("Alt_L", "Right", "Right")  # File, Edit, View
    app.press(*["Down"] * 4, "Right", "Down", "Return")  # Look from, Back
    assert looks_from(app) == [0, 0, -1]


def test_alt_and_a_letter_open_a_menu_and_escape_gives_the_view_its_keys_back(app: RunningApp) -> None:
    app.press("alt+v", *["Down"] * 4, "Right", "Return")
    app.press("alt+t", "Escape")
    app.press("Alt_L", "Right", "Left", "Escape")
    assert app.settle().frame == 0
    app.press("Right")
    assert app.settle().frame == 1


@pytest.mark.slow
def test_alt_with_something_else_opens_nothing(app: RunningApp) -> None:
    app.screen.do("keydown", "Alt_L", "key", "i", "keyup", "Alt_L")
    app.settle()
    left, top, width, height = app.view()
    app.screen.do("mousemove", left + width // 2, top + height // 2)
    app.screen.do("keydown", "Alt_L", "click", 1, "keyup", "Alt_L")
    app.settle()
    app.press("Right")  # in a menu it would go to the next
    assert app.settle().frame == 1


def test_f6_leads_through_panel_and_timeline_and_back(app: RunningApp) -> None:
    ticks, loop = framed(app, *panel(app)), framed(app, *timeline(app))  # of what is on
    app.press("F6")
    assert framed(app, *panel(app)) > ticks + 100
    app.press("Right", "space", "space")  # in the panel these are not the view's
    assert (app.settle().frame, app.state.is_playing) == (0, False)
    app.press("ctrl+F6")
    assert framed(app, *panel(app)) == ticks
    assert framed(app, *timeline(app)) > loop + 50
    app.press("F6", "Right")
    assert app.settle().frame == 1
    assert framed(app, *timeline(app)) == loop


def test_a_widget_of_the_panel_is_worked_by_keys(app: RunningApp) -> None:
    assert app.settle().clicking is None
    app.press("F6", "Home", "Return")  # closes the first section
    app.press(*["Tab"] * 4, "Return")  # over the next heads and the template to a button
    assert app.settle().clicking == "landmarks"
    app.press("Return")
    assert app.settle().clicking is None
    app.press("Home", "Return")


@pytest.mark.slow
def test_the_timeline_plays_and_pauses_by_its_button(app: RunningApp) -> None:
    app.press("shift+F6", "Right", "Right")
    app.screen.do("key", "Return")
    app.see(is_playing=True)
    app.screen.do("key", "Return")
    app.see(is_playing=False)
    app.screen.do("key", "Escape", "key", "ctrl+Home", "key", "space")
    app.see(is_playing=True)
    app.screen.do("key", "space")
    app.see(is_playing=False)


def test_the_mouse_takes_the_keyboard_back(app: RunningApp) -> None:
    ticks = framed(app, *panel(app))
    app.press("F6")
    left, top, width, height = app.view()
    app.screen.do("mousemove", left + width // 2, top + height // 2, "click", 1)
    app.settle()
    assert framed(app, *panel(app)) == ticks
    app.press("Right")
    assert app.settle().frame == 1


@pytest.mark.slow
def test_the_view_is_turned_panned_and_zoomed_by_keys(app: RunningApp) -> None:
    """By so many steps: on a slow machine a key that is pressed briefly repeats."""
    start = Camera.from_json(app.settle().camera)
    app.screen.do("key", "ctrl+Left", "key", "ctrl+Left")
    turned = Camera.from_json(app.settle().camera)
    steps = np.degrees(np.arccos(start.rotation()[2] @ turned.rotation()[2])) / 15
    assert steps == pytest.approx(max(round(steps), 2))
    assert turned.rotation()[2][0] > 0, "as a drag to the left"
    app.press("ctrl+z")
    assert Camera.from_json(app.settle().camera) == start, "they are one step"
    app.press("shift+Up")
    moved = Camera.from_json(app.settle().camera)
    steps = 12 * np.subtract(start.target, moved.target)[1] / start.view_height
    assert steps == pytest.approx(max(round(steps), 1), abs=1e-3)
    app.press("equal")
    near = Camera.from_json(app.settle().camera).distance
    assert near < moved.distance
    app.press("minus")
    assert Camera.from_json(app.settle().camera).distance > near


@pytest.mark.slow
def test_the_dialog_that_exports_is_filled_in_by_keys(app: RunningApp) -> None:
    app.press("ctrl+e")
    assert app.settle().is_export_open
    app.press("shift+Tab", "shift+Tab", "Return")  # from the last button, Cancel, to the one before
    path = app.told(r"Saved (.+\.png)")[1]
    assert Path(path).stat().st_size > 1000
