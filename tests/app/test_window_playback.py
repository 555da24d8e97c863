"""Playing in the window with real keys, and its themes."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import pytest
from virtual_screen import RunningApp, Screen, running_app, virtual_screen

SIZE = (1280, 720)
COUNT = 7  # frames


@pytest.fixture(scope="module")
def app(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningApp]:
    scan = tmp_path_factory.mktemp("scan")
    for number in range(COUNT):
        np.save(scan / f"{number}.npy", np.random.default_rng(number).random((500, 3)))
    with (
        virtual_screen(tmp_path_factory.mktemp("screen"), SIZE) as screen,
        running_app(screen, tmp_path_factory.mktemp("app"), scan) as app,
    ):
        yield app


def shift_space(screen: Screen) -> None:
    """As fingers do it: one key after the other."""
    screen.do("keydown", "shift", "sleep", 0.1, "key", "space", "sleep", 0.1, "keyup", "shift")


def wait_for_frames(app: RunningApp, count: int) -> list[int]:
    """The frame that is shown, and so many after it."""
    before = len(app.frames())
    while len(app.frames()) < before + count:
        assert app.process.poll() is None, app.log()
        time.sleep(0.02)
    return app.frames()[before - 1 :]


def steps(frames: list[int]) -> set[int]:
    """The steps between frames that follow one another, round the end."""
    return {int(step) for step in np.diff(frames) % COUNT}


def test_every_frame_backward_faster_and_real_time(app: RunningApp) -> None:
    screen = app.screen
    screen.do("key", "e")
    app.expect("every_frame=True")
    screen.do("key", "space")
    assert steps(wait_for_frames(app, 2 * COUNT)) == {1}

    screen.do("key", "bracketleft")
    app.expect("speed=0.5")
    shift_space(screen)
    app.expect("reverse=True")
    assert steps(wait_for_frames(app, COUNT)) == {COUNT - 1}

    for speed in ("1.0", "2.0", "5.0", "10.0"):
        screen.do("key", "bracketright")
        app.expect(f"speed={speed}")
    assert steps(wait_for_frames(app, 2 * COUNT)) == {COUNT - 1}

    screen.do("key", "e")  # 250 frames a second are due, more than any screen shows
    app.expect("every_frame=False")
    assert steps(wait_for_frames(app, 2 * COUNT)) - {COUNT - 1}

    shift_space(screen)
    app.expect("reverse=False")
    screen.do("key", "BackSpace")
    app.expect("speed=1.0")
    screen.do("key", "space")
    app.settle()
    assert "Traceback" not in app.log()


def test_without_loop_it_stops_at_either_end(app: RunningApp) -> None:
    screen = app.screen
    screen.do("key", "l")
    app.expect("loop=False")
    screen.do("key", "Home", "key", "space")
    app.settle()
    assert app.frames()[-1] == COUNT - 1
    shift_space(screen)
    app.expect("reverse=True")
    screen.do("key", "space")
    app.settle()
    assert app.frames()[-1] == 0
    shift_space(screen)
    screen.do("key", "l")
    app.expect("loop=True")
    app.settle()


def test_the_theme_changes_the_panels_and_not_the_picture(app: RunningApp) -> None:
    screen = app.screen
    screen.do("mousemove", *(v - 1 for v in SIZE), "key", "Escape")  # no note over the picture
    app.settle()
    dark = screen.picture()
    screen.do("key", "t")
    app.settle()
    light = screen.picture()
    left, top, width, height = app.view()
    view = np.s_[top : top + height, left : left + width - 112]  # without the cube, which is a widget
    assert (dark[view] == light[view]).all()
    assert np.ptp(dark[view]) > 100
    for part in (np.s_[top:, left + width + 5 :], np.s_[top + height :, :]):  # panel, timeline
        assert np.median(dark[part]) < 60
        assert np.median(light[part]) > 230
    screen.do("key", "t")
    app.settle()
    assert (screen.picture() == dark).all()
