"""The window as a person uses it: real keys and mouse on a virtual screen."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from virtual_screen import PATIENCE, ROOT, RunningApp, Screen, running_app, virtual_screen

from viewer.backends import backend
from viewer.camera import Camera
from viewer.frame import Request, render_frame, shared_renderer
from viewer.gpu.surface import Surface
from viewer.look import Look
from viewer.scan.open import open_scan

SIZE = (1280, 720)


@pytest.fixture(scope="module")
def screen(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Screen]:
    with virtual_screen(tmp_path_factory.mktemp("screen"), SIZE) as screen:
        yield screen


@pytest.fixture(scope="module")
def hands(screen: Screen, tmp_path_factory: pytest.TempPathFactory, data_dir: Path) -> Iterator[RunningApp]:
    scan = data_dir / "sequences" / "hands_knot_5"
    with running_app(screen, tmp_path_factory.mktemp("hands"), scan) as app:
        yield app


class Screenshot:
    """A picture that the key P has saved."""

    def __init__(self, app: RunningApp) -> None:
        from PIL import Image

        app.screen.do("key", "p")
        with Image.open(app.expect(r"Saved (.+)")[1]) as file:
            self.description: dict[str, Any] = json.loads(file.text["scan4d"])  # type: ignore[attr-defined]
            self.pixels = np.asarray(file)

    @property
    def camera(self) -> Camera:
        return Camera.from_json(self.description["camera"])

    def drawn_headless(self) -> NDArray[np.uint8]:
        """The same picture, made from its description without a window."""
        d = self.description
        surface = Surface(shared_renderer().gpu, tuple(d["size"]))
        with open_scan(d["scan"]) as timeline:
            pose = timeline.pose(d["pose"])
        params = backend(d["backend"]).params(d["params"])
        request = Request(pose, self.camera, d["backend"], params, Look(**d["look"]))
        render_frame(shared_renderer(), request, surface)
        return surface.image()


def difference(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> int:
    return int(np.abs(one[..., :3].astype(int) - other[..., :3]).max())


def assert_true_picture(app: RunningApp) -> Screenshot:
    """What is on the screen is what was saved, and what comes out without a screen."""
    app.screen.do("mousemove", *(v - 1 for v in SIZE))  # the pointer is part of the screen's picture
    app.settle()
    shot = Screenshot(app)
    app.settle()
    width, height = shot.description["size"]
    assert difference(app.screen.picture()[:height, :width], shot.pixels) <= 1
    assert difference(shot.drawn_headless(), shot.pixels) <= 1
    assert np.ptp(shot.pixels[..., :3]) > 100, "there is something in the picture"
    return shot


def drag(app: RunningApp, button: int, start: tuple[int, int], end: tuple[int, int]) -> None:
    """As fast as a hand: what a widget sees in one frame is not a drag."""
    middle = [(a + b) // 2 for a, b in zip(start, end, strict=True)]
    app.screen.do("mousemove", *start, "sleep", 0.1, "mousedown", button, "sleep", 0.1)
    app.screen.do("mousemove", *middle, "sleep", 0.1, "mousemove", *end, "sleep", 0.3, "mouseup", button)
    app.settle()


def on_track(share: float) -> tuple[int, int]:
    """A place on the timeline's track."""
    return int(SIZE[0] * (0.25 + 0.74 * share)), SIZE[1] - 55


def test_opens_plays_scrubs_switches_and_saves_what_is_shown(hands: RunningApp) -> None:
    assert_true_picture(hands)
    hands.screen.do("key", "space")
    for frame in (1, 2, 3, 4, 0):
        hands.expect(f"drew frame {frame} with points")
    hands.screen.do("key", "space")
    hands.settle()
    hands.screen.do("key", "Home")
    hands.settle()
    drag(hands, 1, on_track(0.1), on_track(0.95))
    hands.expect("drew frame 4 with points")
    hands.screen.do("key", "Left")
    hands.expect("drew frame 3 with points")
    before = assert_true_picture(hands)
    assert before.description["pose"] == 3
    hands.screen.do("key", "b")
    hands.expect("drew frame 3 with surfels")
    surfels = assert_true_picture(hands)
    assert difference(before.pixels, surfels.pixels) > 20
    hands.screen.do("key", "b")
    hands.expect("drew frame 3 with points")
    assert difference(assert_true_picture(hands).pixels, before.pixels) == 0


@pytest.mark.slow
def test_the_mouse_orbits_pans_zooms_and_f_fits(hands: RunningApp) -> None:
    hands.screen.do("key", "f")
    hands.settle()
    start = Screenshot(hands)
    height = start.description["size"][1]
    drag(hands, 1, (400, 300), (400 + height // 2, 300))  # half a height is a quarter turn
    turned = assert_true_picture(hands).camera
    assert turned.target == start.camera.target
    assert turned.distance == pytest.approx(start.camera.distance)
    arms = [np.subtract(c.eye, c.target) / c.distance for c in (start.camera, turned)]
    assert arms[0] @ arms[1] == pytest.approx(0, abs=0.01)

    hands.screen.do("mousemove", 400, 300, "click", 4, "click", 4, "click", 4)
    hands.settle()
    near = Screenshot(hands).camera
    assert near.distance == pytest.approx(turned.distance / 1.15**3)

    drag(hands, 2, (400, 300), (500, 260))
    panned = Screenshot(hands).camera
    shift = near.rotation()[:2] @ np.subtract(near.target, panned.target) / near.view_height * height
    assert shift == pytest.approx([100, 40], abs=1)

    drag(hands, 3, (400, 300), (400, 200))
    assert Screenshot(hands).camera.distance < panned.distance

    hands.screen.do("key", "f")
    hands.settle()
    fitted = Screenshot(hands).camera
    assert fitted.target == pytest.approx(start.camera.target)
    assert fitted.rotation() == pytest.approx(turned.rotation(), abs=1e-9)


def test_idle_it_draws_nothing_and_takes_no_processor_time(hands: RunningApp) -> None:
    hands.settle(1.0)  # longer than a tooltip takes to appear
    frames, seconds = hands.log().count("drawn"), hands.cpu_seconds()
    time.sleep(5)
    assert hands.log().count("drawn") == frames
    assert hands.cpu_seconds() - seconds < 0.03 * 5


def test_a_parameter_and_the_look_are_changed_in_the_panel(hands: RunningApp) -> None:
    """The first row below the renderer is the points' size: a slider from 0 to 32."""
    before = Screenshot(hands)
    drag(hands, 1, (1110, 82), (1250, 82))
    after = assert_true_picture(hands)
    assert before.description["params"] == {"point_size": 0}
    assert after.description["params"] == {"point_size": 32}
    drag(hands, 1, (1250, 82), (1000, 82))
    assert difference(Screenshot(hands).pixels, before.pixels) == 0


def test_escape_does_not_quit_and_ctrl_q_does(screen: Screen, tmp_path: Path, data_dir: Path) -> None:
    with running_app(screen, tmp_path, data_dir / "sequences" / "hands_knot_5" / "00001.ply") as app:
        screen.do("key", "Escape")
        screen.do("key", "p")
        app.expect("Saved")
        # As fingers do it: one key after the other.
        screen.do("keydown", "ctrl", "sleep", 0.1, "key", "q", "sleep", 0.1, "keyup", "ctrl")
        assert app.process.wait(PATIENCE) == 0
        assert "Traceback" not in app.log()


def test_a_broken_frame_is_reported_and_playing_goes_on(screen: Screen, tmp_path: Path) -> None:
    scan = tmp_path / "scan"
    scan.mkdir()
    for number in range(5):
        angles = np.linspace(0, 6, 2000)
        np.save(scan / f"{number}.npy", np.stack([np.cos(angles), np.sin(angles * number), angles], axis=1))
    (scan / "2.npy").write_bytes((scan / "2.npy").read_bytes()[:1000])
    with running_app(screen, tmp_path, scan) as app:
        screen.do("key", "space")
        app.expect("frame 2 is left out")
        for frame in (3, 4, 0, 1, 3):
            app.expect(f"drew frame {frame} ")
        assert "drew frame 2 " not in app.log()
        assert "Traceback" not in app.log()


def run_without_display(scan: object) -> str:
    code = (
        "import sys; from viewer.app import run; from viewer.errors import Scan4DError\n"
        "try: run(sys.argv[1:])\n"
        "except Scan4DError as error: print(type(error).__name__, error)"
    )
    command = [sys.executable, "-c", code, str(scan)]
    return subprocess.run(
        command, env={"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=True
    ).stdout


def test_a_wrong_name_is_told_before_a_window_opens(tmp_path: Path) -> None:
    assert run_without_display(tmp_path / "none").startswith("InputError")


def test_without_a_display_it_says_so(tmp_path: Path) -> None:
    np.save(tmp_path / "points.npy", np.eye(3))
    message = run_without_display(tmp_path / "points.npy")
    assert message.startswith("NoOpenGLError no window can be opened")
    assert "DISPLAY" in message
