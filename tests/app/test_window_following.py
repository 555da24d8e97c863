"""A subject that walks stays in view in the real window: the first view and F hold all frames, or the view
goes with it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from virtual_screen import RunningApp, Screen, running_app

from viewer.bounds import Bounds
from viewer.camera import Camera
from viewer.view import View

FRAMES = 12
ALL = Bounds(np.array([-0.5, -0.5, -0.5]), np.array([FRAMES - 0.5, 0.5, 0.5]))


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A ball that goes a unit along x in each frame; the sixth frame is astray."""
    folder = tmp_path_factory.mktemp("walk")
    away = np.random.default_rng(4).normal(size=(4000, 3))
    ball = away / np.linalg.norm(away, axis=1, keepdims=True) / 2
    for frame in range(FRAMES):
        step = 1e4 if frame == 5 else frame
        np.save(folder / f"f{frame:02d}.npy", np.add(ball, (step, 0, 0)).astype(np.float32))
    return folder


@pytest.fixture(scope="module")
def app(screen: Screen, tmp_path_factory: pytest.TempPathFactory, walk: Path) -> Iterator[RunningApp]:
    with running_app(screen, tmp_path_factory.mktemp("window"), walk) as app:
        yield app


def holds_all(state: object) -> bool:
    """Whether all frames are in the picture, and fill most of its width."""
    camera, size = Camera.from_json(state.camera), (state.view[2], state.view[3])
    pixels, _ = View.of(camera, size, np.zeros(3), ALL).project(ALL.corners())
    inside = (pixels >= 0).all() and (pixels <= size).all()
    return bool(inside and np.ptp(pixels[:, 0]) > 0.6 * size[0])


def keys(app: RunningApp, *names: str) -> object:
    app.screen.do("key", "--delay", 100, *names)
    return app.settle()


@pytest.mark.slow
def test_the_first_view_and_f_hold_all_frames(app: RunningApp) -> None:
    app.see(holds_all)
    assert app.settle().undoes is None, "nobody did anything"
    keys(app, "ctrl+3")
    for names in (("ctrl+1",), ("End", "f"), ("ctrl+Home", "f")):
        assert holds_all(keys(app, *names))


@pytest.mark.slow
def test_the_view_goes_with_the_subject(app: RunningApp) -> None:
    keys(app, "ctrl+Home", "ctrl+1")
    before = Camera.from_json(keys(app, "shift+f").camera)
    after = keys(app, "End")
    assert Camera.from_json(after.camera).rotation() == pytest.approx(before.rotation())
    moved = np.subtract(Camera.from_json(after.camera).target, before.target)
    assert moved == pytest.approx([FRAMES - 1, 0, 0], abs=0.02)
    assert Camera.from_json(keys(app, "ctrl+Home").camera).target == pytest.approx(before.target, abs=1e-3)
    near = Camera.from_json(keys(app, "f").camera)
    assert near.distance < before.distance / 3, "the subject alone"
    stays = Camera.from_json(keys(app, "shift+f").camera)
    assert Camera.from_json(keys(app, "End").camera) == stays


def test_where_nothing_is_seen_the_way_back_is_told(app: RunningApp) -> None:
    keys(app, "ctrl+Home", "f")
    left, top, width, height = app.view()
    x, y = left + width // 2, top + height // 2
    for _ in range(3):
        app.screen.do("mousemove", x, y, "mousedown", 2, "mousemove", x, y + height // 2, "mouseup", 2)
    assert app.see(lambda state: state.words).words == "Nothing is in view: press F to show all"
    assert keys(app, "f").words is None
