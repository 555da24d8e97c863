"""Ways to look at a scan with real clicks and keys: cube, bookmarks, turntable, full screen, larger text."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from test_window import camera_of, drag, shown
from virtual_screen import RunningApp, running_app, virtual_screen

from viewer.camera import Camera

SCREEN = (1280, 720)
WINDOW = (1100, 640)
EM = 16.0  # the font's height


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningApp]:
    scan = tmp_path_factory.mktemp("scan") / "box.npy"
    np.save(scan, np.random.default_rng(0).uniform((-1, -2, -3), (1, 2, 3), (4000, 3)))
    with (
        virtual_screen(tmp_path_factory.mktemp("screen"), SCREEN) as screen,
        running_app(screen, tmp_path_factory.mktemp("app"), scan) as app,
    ):
        window = screen.do("search", "--name", "Scan4D").split()[-1]
        screen.do("windowmove", window, 60, 30, "windowsize", window, *WINDOW)
        app.see(size=[*WINDOW])
        app.settle()
        yield app


@pytest.fixture
def app(running: RunningApp) -> RunningApp:
    running.reset()
    return running


@pytest.mark.slow
def test_on_a_display_of_scale_2_all_is_twice_as_large(tmp_path: Path) -> None:
    np.save(tmp_path / "box.npy", np.random.default_rng(0).random((100, 3)))
    views = {}
    for scale in (1, 2):
        folder = tmp_path / str(scale)
        folder.mkdir()
        with (
            virtual_screen(folder, (800 * scale, 600 * scale), scale) as screen,
            running_app(screen, folder, tmp_path / "box.npy") as app,
        ):
            views[scale] = app.view()
    assert np.array(views[2]) == pytest.approx(2 * np.array(views[1]), abs=2)


def chord(app: RunningApp, modifier: str, key: str) -> None:
    app.screen.do("key", f"{modifier}+{key}")
    app.settle()


def on_cube(app: RunningApp, right: float, up: float) -> tuple[int, int]:
    """A place on the screen, from the cube's centre in half edges."""
    from viewer.app.scene.cube import cube_position

    left, top, width, height = app.view()
    x, y, half = cube_position(width, height, EM) or pytest.fail("there is no cube")
    return round(60 + left + x + right * half), round(30 + top + y - up * half)


def click_cube(app: RunningApp, right: float, up: float) -> Camera:
    app.do(("mousemove", *on_cube(app, right, up)), ("click", 1))
    return camera_of(app)


def back(camera: Camera) -> list[float]:
    """Where it looks from, as a unit vector."""
    return camera.rotation()[2].tolist()


@pytest.mark.slow
def test_the_cube_is_clicked_and_dragged_and_keeps_the_mouse_from_the_view(app: RunningApp) -> None:
    start = camera_of(app)
    corner = 3**-0.5
    assert back(click_cube(app, 0.8, 0)) == pytest.approx([2**-0.5, 0, 2**-0.5], abs=1e-3), "its left side"
    assert back(click_cube(app, 0.7, 0)) == pytest.approx([1, 0, 0], abs=1e-3)
    assert back(click_cube(app, -0.8, 0.8)) == pytest.approx([corner, corner, corner], abs=1e-3)
    assert back(click_cube(app, 0, 0.9)) == pytest.approx([0, 1, 0], abs=1e-3)
    chord(app, "ctrl", "1")
    place = on_cube(app, 0, 0)
    app.do(("mousemove", *place), ("click", 4, "click", 4))
    assert camera_of(app) == start, "a wheel over the cube does nothing"
    drag(app, 1, place, (place[0] - 60, place[1]))
    dragged = camera_of(app)
    assert dragged.target == start.target
    assert dragged.distance == pytest.approx(start.distance)
    assert np.degrees(np.arccos(np.dot(back(dragged), back(start)))) == pytest.approx(120, abs=15)
    app.screen.do("mousemove", *place, "mousemove", 0, 0)
    app.settle()


@pytest.mark.slow
def test_bookmarks_come_back_by_key(app: RunningApp) -> None:
    cameras = []
    for side in ("2", "5"):
        chord(app, "ctrl", side)
        chord(app, "ctrl", "b")
        app.told(r"Bookmark 'View \d' added")
        cameras.append(camera_of(app))
    chord(app, "ctrl", "1")
    app.screen.do("key", "n")
    assert camera_of(app) == cameras[0]
    chord(app, "shift", "n")
    assert camera_of(app) == cameras[1]


@pytest.mark.slow
def test_keys_typed_in_haste_are_what_was_typed(app: RunningApp) -> None:
    """Key and modifier go down and up between two frames."""
    before, told = app.state, len(app.notes)
    app.screen.do("key", "--delay", 8, *["ctrl+b"] * 8)
    after = app.settle()
    assert sum("Bookmark 'View" in note for note in app.notes[told:]) == 8
    assert after.pictures == before.pictures, "not the next renderer"


@pytest.mark.slow
def test_the_turntable_turns_until_a_key_or_the_mouse_stops_it(app: RunningApp) -> None:
    chord(app, "ctrl", "1")
    cameras = [camera_of(app)]
    for stop in ([("key", "y")], [("mousemove", 300, 300), ("click", 1)]):
        app.screen.do("key", "y")
        pictures = app.state.pictures
        app.see(lambda state: state.pictures > pictures + 4)  # noqa: B023
        app.do(*stop)
        cameras.append(camera_of(app))  # it would never settle while it turns
    angles = [float(np.degrees(np.arctan2(back(camera)[0], back(camera)[2]))) for camera in cameras]
    assert angles[0] == pytest.approx(0, abs=0.01)
    assert angles[0] < angles[1] < angles[2]
    for camera in cameras[1:]:
        assert camera.target == pytest.approx(cameras[0].target)
        assert camera.distance == pytest.approx(cameras[0].distance)


@pytest.mark.slow
def test_full_screen_is_the_view_alone_and_goes_back(app: RunningApp) -> None:
    screen = app.screen
    window = screen.do("search", "--name", "Scan4D").split()[-1]
    before, place = screen.do("getwindowgeometry", window), app.view()
    for leave in ("F11", "Escape"):
        screen.do("key", "F11")
        app.see(view=[0, 0, *SCREEN])
        app.settle()
        screen.do("key", "p")
        app.told("Saved")
        app.send_notes_away()  # Escape would end the message first
        screen.do("key", leave)
        app.see(view=[*place])
        app.settle()
        assert app.view() == place
        assert screen.do("getwindowgeometry", window) == before
    screen.do("key", "Tab")
    app.see(view=[0, 0, *WINDOW])
    screen.do("key", "Tab")
    app.see(view=[*place])


@pytest.mark.slow
def test_larger_text_takes_more_room(app: RunningApp) -> None:
    usual = app.view()
    chord(app, "ctrl", "equal")
    larger = app.view()
    assert larger[1] > usual[1]
    assert larger[2] < usual[2]
    chord(app, "ctrl", "0")
    assert app.view() == usual
    assert shown(app).size
    assert "Traceback" not in app.log()


def test_the_window_tells_the_desktop_how_small_it_may_be(app: RunningApp) -> None:
    display = pytest.importorskip("Xlib.display").Display(app.screen.env["DISPLAY"])
    number = int(app.screen.do("search", "--name", "Scan4D").split()[-1])
    hints = display.create_resource_object("window", number).get_wm_normal_hints()
    display.close()
    assert (hints.min_width, hints.min_height) == (640, 420)
