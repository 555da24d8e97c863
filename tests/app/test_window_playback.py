"""Playing in the window with real keys, and its themes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from virtual_screen import PANEL, RunningApp, Screen, running_app, slow_pictures, virtual_screen
from written import picture

from viewer.app.theme import PALETTES, rgb
from viewer.look import rgba

SIZE = (1280, 720)
TRACK = 300  # pixels from the left, between the loop's button and the bar
COUNT = 7  # frames


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningApp]:
    scan = tmp_path_factory.mktemp("scan")
    for number in range(COUNT):
        np.save(scan / f"{number}.npy", np.random.default_rng(number).random((500, 3)))
    with (
        virtual_screen(tmp_path_factory.mktemp("screen"), SIZE) as screen,
        # So slow that no machine shows 250 frames a second.
        running_app(screen, tmp_path_factory.mktemp("app"), scan, before=slow_pictures(0.01)) as app,
    ):
        yield app


@pytest.fixture
def app(running: RunningApp) -> RunningApp:
    running.reset()
    return running


def shift_space(screen: Screen) -> None:
    """As fingers do it: one key after the other."""
    screen.do("key", "shift+space")


def wait_for_frames(app: RunningApp, count: int) -> list[int]:
    """The frame that is shown, and so many after it."""
    before = len(app.frames())
    app.see(lambda _: len(app.frames()) >= before + count)
    return app.frames()[before - 1 :]


def steps(frames: list[int]) -> set[int]:
    """The steps between frames that follow one another, round the end."""
    return {int(step) for step in np.diff(frames) % COUNT}


@pytest.mark.slow
def test_every_frame_backward_faster_and_real_time(app: RunningApp) -> None:
    screen = app.screen
    screen.do("key", "e")
    app.see(every_frame=True)
    screen.do("key", "space")
    assert steps(wait_for_frames(app, 2 * COUNT)) == {1}

    screen.do("key", "bracketleft")
    app.see(speed=0.5)
    shift_space(screen)
    app.see(reverse=True)
    assert steps(wait_for_frames(app, COUNT)) == {COUNT - 1}

    for speed in (1, 2, 5, 10):
        screen.do("key", "bracketright")
        app.see(speed=speed)
    assert steps(wait_for_frames(app, 2 * COUNT)) == {COUNT - 1}

    screen.do("key", "e")  # 250 frames a second are due, more than any screen shows
    app.see(every_frame=False)
    assert steps(wait_for_frames(app, 2 * COUNT)) - {COUNT - 1}

    shift_space(screen)
    app.see(reverse=False)
    screen.do("key", "BackSpace")
    app.see(speed=1)
    screen.do("key", "space")
    app.settle()
    assert "Traceback" not in app.log()


def handles(app: RunningApp) -> tuple[tuple[int, int], tuple[int, int]]:
    """The middles of the two handles of the timeline on the screen, as seen."""
    app.screen.do("mousemove", 5, 300)  # away with the tooltip
    accent = np.array(rgb(PALETTES[app.settle().theme].accent)) * 255
    _, top, _, height = app.view()
    part = app.screen.picture()[top + height :, TRACK:].astype(float)
    y, x = np.nonzero(np.abs(part - accent).max(axis=-1) < 3)
    low = y >= y.max() - 2  # below the line between them
    middle = (x[low].min() + x[low].max()) / 2
    sides = [x[low][(x[low] > middle) == is_last].mean() for is_last in (False, True)]
    row = top + height + int(y[low].mean())
    return (TRACK + round(sides[0]), row), (TRACK + round(sides[1]), row)


def drag_to(app: RunningApp, start: tuple[int, int], x: float) -> None:
    app.do(("mousemove", *start), ("mousedown", 1))
    app.do(("mousemove", round(x), start[1]), ("mouseup", 1))
    app.settle()


@pytest.mark.slow
def test_the_mouse_chooses_the_frames_that_are_played(app: RunningApp) -> None:
    first, last = handles(app)
    wide = (last[0] - first[0]) / COUNT  # of a frame
    drag_to(app, first, first[0] + 2.5 * wide)
    assert app.state.document["span"] == [2, COUNT - 1]
    assert app.state.frame == 0, "choosing them goes nowhere"
    drag_to(app, last, first[0] + 4.5 * wide)
    assert app.state.document["span"] == [2, 4]
    near, far = handles(app)
    assert near[0] == pytest.approx(first[0] + 2 * wide, abs=3)
    assert far[0] == pytest.approx(first[0] + 5 * wide, abs=3)
    app.screen.do("key", "e", "key", "space")
    app.see(is_playing=True)
    assert set(wait_for_frames(app, 6)[1:]) == {2, 3, 4}
    app.screen.do("key", "space")
    app.see(is_playing=False)
    drag_to(app, (first[0] + round(0.5 * wide), first[1] - 8), first[0] + 5.5 * wide)
    assert app.settle().frame == 5, "on the bar itself it goes there"
    app.screen.do("key", "alt+i")
    assert app.settle().document["span"] is None


@pytest.mark.slow
def test_without_loop_it_stops_at_either_end(app: RunningApp) -> None:
    screen = app.screen
    screen.do("key", "l")
    app.see(loop=False)
    screen.do("key", "ctrl+Home", "key", "space")
    app.see(is_playing=True)
    app.settle()
    assert app.frames()[-1] == COUNT - 1
    shift_space(screen)
    app.see(reverse=True)
    screen.do("key", "space")
    app.see(is_playing=True)
    app.settle()
    assert app.frames()[-1] == 0


@pytest.mark.slow
def test_backgrounds_by_what_they_are_for_are_shown_and_saved(app: RunningApp) -> None:
    left, top, *_ = app.view()
    corner = np.s_[top + 60 : top + 120, left + 20 : left + 80]
    for name, shade in (("white", 255), ("black", 0)):
        app.choose(PANEL, "background/##background", f"###{name}")
        app.settle()
        assert (app.screen.picture()[corner] == shade).all()
    app.choose(PANEL, "background/##background", "###transparent")
    app.settle()
    checks = app.screen.picture()[corner]
    assert len(np.unique(checks)) == 2
    app.screen.do("key", "p")
    saved = picture(Path(app.told(r"Saved (.+\.png)")[1]))
    assert (saved[60:120, 20:80, 3] == 0).all()
    assert (saved[..., 3] == 255).any()
    app.choose(PANEL, "background/##background", "###own")
    app.settle()
    assert len(np.unique(app.screen.picture()[corner].reshape(-1, 3), axis=0)) == 1
    app.choose(PANEL, "background/##background", "###theme")
    app.settle()


@pytest.mark.slow
def test_the_theme_changes_the_panels_and_what_is_behind_the_scan(app: RunningApp) -> None:
    screen = app.screen
    app.see(counted=True)
    dark = screen.picture()
    screen.do("key", "t")
    app.settle()
    light = screen.picture()
    left, top, width, height = app.view()
    view = np.s_[top : top + height, left : left + width - 112]  # without the cube, which is a widget
    behind = (dark[view] == rgba(PALETTES["dark"].picture)[:3]).all(axis=2)
    assert 0.2 < behind.mean() < 0.9
    assert (light[view][behind] == rgba(PALETTES["light"].picture)[:3]).all()
    same = (dark[view] == light[view]).all(axis=2)
    assert (same | behind).mean() > 0.95, "all but the edges of the scan"
    assert np.ptp(dark[view]) > 100
    for part in (np.s_[top:, left + width + 5 :], np.s_[top + height :, :]):  # panel, timeline
        assert np.median(dark[part]) < 60
        assert np.median(light[part]) > 230
    screen.do("key", "t")
    app.settle()
    app.see(counted=True)
    assert (screen.picture() == dark).all()


def test_the_timeline_shows_the_frame_under_the_mouse_small(app: RunningApp) -> None:
    """Also one that was not read yet; as the view has it, and once."""
    first, last = handles(app)
    wide, row = (last[0] - first[0]) / COUNT, first[1] - 6
    app.screen.do("key", "ctrl+Left")  # turns the view: those of the view before are let go
    app.settle()
    for count, number in enumerate((COUNT - 2, 3), 1):
        app.screen.do("mousemove", round(first[0] + (number + 0.5) * wide), row)
        app.see(thumbnails=count)
    app.settle()
    bottom = first[1] - 30
    place = np.s_[bottom - 170 : bottom, first[0] : last[0]]
    with_it = app.screen.picture()[place].astype(int)
    app.screen.do("mousemove", 5, 300)
    app.settle()
    without = app.screen.picture()[place].astype(int)
    changed = np.abs(with_it - without).max(axis=-1) > 40
    assert changed.sum() > 3000
    assert app.state.frame == 0, "nothing but the mouse went there"
