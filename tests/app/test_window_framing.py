"""What F and Home show of a range scan with a background far behind, and of levels without data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from range_scenes import sphere_view
from scenes import rarely
from virtual_screen import PANEL, RunningApp, Screen, running_app

from viewer.app.scene.view import words_on_levels
from viewer.camera import Camera
from viewer.scan import formats
from viewer.scan.range_view import merge

FAR = 40.0  # of the background; the ball's radius is 1, and it is 3.7 away


@pytest.fixture(scope="module")
def running(screen: Screen, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningApp]:
    """A ball before a wall, as one depth camera sees them."""
    pod = sphere_view((1.0, 2.0, 3.0))
    depth = np.where(pod.valid(), pod.depth, FAR).astype(np.float32)
    view = replace(pod, depth=depth, mask=np.ones_like(pod.mask))
    scan = tmp_path_factory.mktemp("scan") / "ball.exr"
    formats.write(scan, merge([view]), [view])
    with running_app(screen, tmp_path_factory.mktemp("app"), scan) as app:
        yield app
    assert "Traceback" not in app.log()


@pytest.fixture
def app(running: RunningApp) -> RunningApp:
    running.screen.do("key", "Escape", "key", "Home")
    running.settle()
    return running


def keys(app: RunningApp, *names: str) -> Camera:
    """Press them; the camera then."""
    for name in names:
        app.screen.do("key", name)
        app.settle()
    return Camera.from_json(app.settle().camera)


def ball_height(camera: Camera) -> float:
    """The ball's diameter, in heights of the view."""
    return 2 / float(camera.heights_at(np.zeros((1, 3)))[0])


def middle(camera: Camera) -> tuple[float, float]:
    """Where the ball's middle is in the view, in heights from its centre."""
    place = camera.place_in_picture((0.0, 0.0, 0.0))
    assert place is not None
    return place


@pytest.mark.parametrize("side", [*rarely("Home", "ctrl+1", "ctrl+5"), "ctrl+3"])
def test_f_shows_the_ball_and_not_the_room(app: RunningApp, side: str) -> None:
    camera = keys(app, side, "f")
    assert 0.5 < ball_height(camera) < 1.2
    assert np.abs(middle(camera)).max() < 0.4


def test_f_says_where_parts_of_the_scan_are_outside(app: RunningApp) -> None:
    keys(app, "ctrl+3", "f")
    app.told("Zoom out to see the rest of the scan")


@pytest.mark.slow
def test_home_brings_the_opening_view_back(app: RunningApp) -> None:
    opening = keys(app)
    assert np.linalg.norm(np.subtract(opening.eye, (1, 2, 3))) == pytest.approx(0, abs=1e-5), (
        "the pod's place"
    )
    assert keys(app, "ctrl+3", "o", "f") != opening
    assert keys(app, "Home") == opening
    assert keys(app, "ctrl+z") != opening


@pytest.mark.slow
def test_levels_without_data_are_named_instead_of_f(app: RunningApp) -> None:
    app.choose(PANEL, "##backend", "###pyramidal")
    app.screen.do("key", "0", "key", "1", "key", "2", "key", "3")
    app.settle()
    app.see(counted=True, words=None)  # level 4 fills some pixels
    app.screen.do("key", "4")
    app.see(words="All levels are off; press 0")
    app.screen.do("key", "0")
    app.see(counted=True, words=None)


@pytest.mark.parametrize(
    ("shown", "words"),
    [
        ((4,), "Level 4 has no pixels in this view; press 0"),
        ((2, 4), "Levels 2 and 4 have no pixels in this view; press 0"),
        ((1, 2, 4), "Levels 1, 2 and 4 have no pixels in this view; press 0"),
        ((), "All levels are off; press 0"),
    ],
)
def test_words_on_levels(shown: tuple[int, ...], words: str) -> None:
    assert words_on_levels({level: level in shown for level in range(5)}, "0") == words
