"""Previews in the window: while it plays or turns, and the picture in full at rest, with real events."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from scenes import sphere
from virtual_screen import PANEL, RunningApp, State, running_app, slow_pictures, virtual_screen, wait_until
from written import picture

from viewer import cli
from viewer.app.scene.motion import REST
from viewer.document.recording import Recording
from viewer.scan import formats

SIZE = (1280, 720)
# Of pictures to save nothing is drawn before there is a file "go" in the working directory.
HELD = """
from os.path import exists
from viewer.app.output.unsaved_picture import UnsavedPicture
draw = UnsavedPicture.advance
UnsavedPicture.advance = lambda picture: draw(picture) if exists("go") else None
"""
FRAMES, POINTS = 5, 200_000
SLOW = 0.1  # seconds over each picture: several times what a frame lasts
MIDDLE = np.s_[120:440, 300:640]  # of the view: no cube, scale bar or note there


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningApp]:
    scan, folder = tmp_path_factory.mktemp("scan"), tmp_path_factory.mktemp("app")
    for number in range(FRAMES):
        formats.write(scan / f"{number}.npz", sphere(POINTS, radius=1 + 0.1 * number))
    with (
        virtual_screen(tmp_path_factory.mktemp("screen"), SIZE) as screen,
        running_app(screen, folder, scan, before=f"exec({HELD!r}); " + slow_pictures(SLOW)) as app,
    ):
        (folder / "go").touch()
        yield app


@pytest.fixture
def app(running: RunningApp) -> RunningApp:
    running.reset()
    return running


def is_full(app: RunningApp, state: State) -> bool:
    _, _, width, height = app.view()
    return (state.pixels, state.points) == ([width, height], POINTS)


def wait_for_preview(app: RunningApp, since: int = 0) -> None:
    """Since: the number of the picture before."""
    app.see(lambda _: any(not is_full(app, state) for state in app.pictures(since)), backend="surfels")


def act_until_preview(app: RunningApp, act: Callable[[], object]) -> None:
    """Act again and again without a rest, until a picture of that is a preview."""
    before = app.settle().pictures

    def is_previewed() -> bool:
        act()
        return any(not is_full(app, state) for state in app.pictures(before))

    wait_until(is_previewed)


def expect_full(app: RunningApp) -> None:
    """Wait for a picture in full, and see that it stays."""
    app.see(lambda state: is_full(app, state))
    assert is_full(app, app.settle())


def saved(app: RunningApp) -> tuple[Path, np.ndarray]:
    """A screenshot, and what is drawn again from what it tells."""
    app.screen.do("key", "p")
    path = Path(app.told(r"Saved (.+\.png)")[1])
    again = path.with_name(f"again_{path.name}")
    assert cli.main(["render", "--replay", str(path), "-o", str(again)]) == 0
    return path, picture(again)


@pytest.mark.slow
def test_playing_is_previewed_and_saved_in_full(app: RunningApp) -> None:
    screen = app.screen
    screen.do("mousemove", *(v - 1 for v in SIZE), "key", "r", "key", "e", "key", "space")
    wait_for_preview(app, app.state.pictures)
    app.see(frame=4)
    path, again = saved(app)
    np.testing.assert_array_equal(picture(path), again)
    wait_for_preview(app, app.state.pictures)
    screen.do("key", "space")
    expect_full(app)

    path, again = saved(app)
    app.send_notes_away()
    app.settle()
    left, top, width, height = app.view()
    shown = screen.picture()[top : top + height, left : left + width]
    assert np.abs(shown[MIDDLE].astype(int) - again[MIDDLE][..., :3]).max() <= 1
    np.testing.assert_array_equal(picture(path), again)
    screen.do("key", "r")
    recording = Recording.load(Path(app.told(r"Saved (.+\.json)")[1]))
    assert {entry.size for entry in recording.entries} == {(width, height)}, "recorded as asked for"


@pytest.mark.slow
def test_every_frame_leaves_none_out_and_real_time_does(app: RunningApp) -> None:
    screen = app.screen
    screen.do("key", "e")
    app.see(every_frame=True)
    before = len(app.frames())
    screen.do("key", "space")
    app.see(lambda _: len(app.frames()) >= before + 12)
    assert set(np.diff(app.frames()[before - 1 :]) % FRAMES) == {1}
    screen.do("key", "e")
    app.see(every_frame=False)
    for speed in (2, 5, 10):
        screen.do("key", "bracketright")
        app.see(speed=speed)
    before = len(app.frames())
    app.see(lambda _: len(app.frames()) >= before + 12)
    assert set(np.diff(app.frames()[before:]) % FRAMES) - {1}, "250 frames a second are due"
    screen.do("key", "space", "key", "BackSpace")
    expect_full(app)


@pytest.mark.slow
def test_a_drag_that_stops_and_the_wheel_are_followed_by_a_picture_in_full(app: RunningApp) -> None:
    screen = app.screen
    left, top, width, height = app.view()
    x, y = left + width // 2, top + height // 2
    app.do(("mousemove", x, y), ("mousedown", 1))
    moves = itertools.cycle((*range(0, 60, 3), *range(60, 0, -3)))
    act_until_preview(app, lambda: screen.do("mousemove", x + next(moves), y))
    expect_full(app)  # with the button held
    screen.do("mouseup", 1)
    turns = itertools.cycle((4, 5))
    act_until_preview(app, lambda: screen.do("click", "--repeat", 8, "--delay", 40, next(turns)))
    expect_full(app)
    before = app.state.pictures
    time.sleep(2 * REST)  # what comes sooner counts as moving
    screen.do("key", "f")
    app.see(lambda state: state.pictures > before)
    expect_full(app)
    assert app.state.pictures == before + 1, "a single change is drawn in full at once"
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_a_picture_at_rest_becomes_smooth_and_any_act_goes_first(app: RunningApp) -> None:
    screen = app.screen
    assert app.settle().samples == 5
    app.choose(PANEL, "quality/##value", "###fine")
    assert app.settle().samples == 17
    screen.do("key", "Right")
    app.see(lambda state: state.frame == 1 and 1 < state.samples < 17)
    screen.do("key", "Right")
    app.see(frame=2, samples=1)
    assert app.settle().samples == 17
    path, again = saved(app)
    np.testing.assert_array_equal(picture(path), again)
    app.choose(PANEL, "quality/##value", "###fast")
    assert app.settle().samples == 1


@pytest.mark.slow
def test_a_picture_is_saved_as_it_was_while_the_window_goes_on_and_can_be_cancelled(app: RunningApp) -> None:
    screen = app.screen
    app.choose(PANEL, "quality/##value", "###fine")
    app.settle()
    screen.do("key", "Right")
    app.see(frame=1)
    go = app.folder / "go"
    go.unlink()
    screen.do("key", "p", "key", "Right")
    app.see(frame=2, is_saving=True)
    go.touch()
    path = Path(app.told(r"Saved (.+\.png)")[1])
    (entry,) = Recording.load(path).entries
    assert (entry.pose, entry.look.quality) == (1, "fine")
    assert app.settle().frame == 2
    again = path.with_name(f"again_{path.name}")
    assert cli.main(["render", "--replay", str(path), "-o", str(again)]) == 0
    np.testing.assert_array_equal(picture(path), picture(again))

    there = set(path.parent.glob("scan4d_*"))
    screen.do("key", "Right")
    app.see(frame=3)
    go.unlink()
    screen.do("key", "p")
    app.see(works=["Drawing the picture to save"])
    screen.do("key", "Escape")  # which ends no work
    app.act("timeline", ("item_click", "###cancel"))
    app.told("Cancelled: Drawing the picture to save")
    go.touch()
    app.settle()
    assert set(path.parent.glob("scan4d_*")) == there
    app.choose(PANEL, "quality/##value", "###balanced")
