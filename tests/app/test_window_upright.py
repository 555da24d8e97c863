"""Scans stand upright in the real window, by a guess or by one act; up belongs to each scan."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from virtual_screen import PANEL, RunningApp, Screen, running_app, stored_of

from viewer.app.scene.cube import cube_position
from viewer.camera import Camera
from viewer.geometry import up_vector

EM = 15  # height of the font, pixels
ROW = 22  # of a menu, pixels


def person(up: int) -> np.ndarray:
    """Somebody on a plate, as points, standing along an axis."""
    rng = np.random.default_rng(2)
    body = rng.uniform(-0.5, 0.5, (6000, 3)) * (0.4, 0.3, 1.7) + (0, 0, 0.85)
    plate = rng.uniform(-0.5, 0.5, (3000, 3)) * (0.8, 0.7, 0.02)
    return np.roll(np.concatenate([body, plate]), up - 2, axis=1)


@pytest.fixture(scope="module")
def scans(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scans")
    for name, axis in (("along_y", 1), ("along_z", 2)):
        np.save(folder / f"{name}.npy", person(axis))
    return folder


@pytest.fixture
def app(screen: Screen, tmp_path: Path, scans: Path) -> Iterator[RunningApp]:
    with running_app(screen, tmp_path, scans / "along_y.npy", scans / "along_z.npy") as app:
        yield app


def camera_of(app: RunningApp) -> Camera:
    return Camera.from_json(app.settle().camera)


def below_cube(app: RunningApp) -> tuple[int, int]:
    """The middle of the button below the orientation cube, on the screen."""
    left, top, width, height = app.view()
    x, y, _ = cube_position(width, height, EM) or pytest.fail("there is no cube")
    return round(left + x), round(top + 2.02 * y + 0.7 * EM)


@pytest.mark.slow
def test_each_scan_stands_upright_by_itself_and_keeps_what_its_user_said(
    app: RunningApp, tmp_path: Path, scans: Path
) -> None:
    assert camera_of(app).up == up_vector("+y")
    app.screen.do("key", "Next")
    words = app.told(r"assumes that (\S+) points up, because (.*?)\. You can change").groups()
    assert words == ("+z", "the scan stands stably with this axis up")
    assert camera_of(app).up == up_vector("+z")
    app.choose(PANEL, "##up", "###-x")
    assert camera_of(app).up == up_vector("-x")
    app.screen.do("key", "Prior")
    app.see(lambda state: state.scan.endswith("along_y.npy"))
    assert camera_of(app).up == up_vector("+y"), "what was said of another scan is not said of this one"
    app.screen.do("key", "Next")
    app.see(lambda state: state.scan.endswith("along_z.npy"))
    assert camera_of(app).up == up_vector("-x")
    app.screen.do("key", "ctrl+q")
    app.process.wait()
    assert stored_of(tmp_path, scans / "along_z.npy").document.look.up == "-x"
    assert stored_of(tmp_path, scans / "along_y.npy").document.look.up == "+y"


@pytest.mark.slow
def test_one_click_beside_the_cube_turns_the_view_upright(app: RunningApp) -> None:
    before, (x, y) = camera_of(app), below_cube(app)
    app.screen.do("mousemove", x, y)
    app.settle()
    app.do(("mousemove", x, y + EM + 6 * ROW), ("click", 1))  # the last of the six
    assert camera_of(app).up == up_vector("-z")
    app.do(("mousemove", x, y), ("mousemove", 300, 300))
    app.settle()  # the menu is closed
    app.screen.do("key", "ctrl+z")
    assert camera_of(app) == before


@pytest.mark.slow
def test_a_side_can_be_the_front(app: RunningApp, tmp_path: Path, scans: Path) -> None:
    app.screen.do("key", "ctrl+3")
    left = camera_of(app)
    app.act("##MainMenuBar", ("menu_click", "View/###set_front"))
    app.screen.do("key", "ctrl+4", "key", "ctrl+1")
    assert camera_of(app).eye == pytest.approx(left.eye)
    app.screen.do("key", "ctrl+q")
    app.process.wait()
    assert stored_of(tmp_path, scans / "along_y.npy").document.front == pytest.approx(90)


@pytest.mark.slow
def test_a_surface_that_is_clicked_faces_up(app: RunningApp) -> None:
    app.act("##MainMenuBar", ("menu_click", "View/###pick_up"))
    left, top, width, height = app.view()
    app.do(("mousemove", left + width // 2, top + height // 2), ("click", 1))
    turned = camera_of(app)
    assert np.dot(turned.up, up_vector("+z")) > 0.95, "the chest, rough as points fill the body, is up now"
    assert not app.state.clicking
    app.screen.do("key", "ctrl+z")
    assert camera_of(app).up == up_vector("+y")
