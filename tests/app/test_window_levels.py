"""Levels and holes as the window shows them: keys pressed while range views of two pods play."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import sphere_mesh
from test_window import shown
from virtual_screen import RunningApp, Screen, running_app

from viewer.look import HOLE_COLOR, rgba
from viewer.mesh.triangles import Mesh
from viewer.scan import formats
from viewer.scan.points import PointCloud
from viewer.scan.range_view import RangeView, merge
from viewer.simulate.scanner import Faults, capture, rig

FRAMES = 6
HOLE = np.array([0.1, 0.5, np.sqrt(0.74)])  # on the ball


def head_with_a_hand(frame: int) -> Mesh:
    """A ball, and before it a small one that moves with the frames."""
    head = sphere_mesh(40)
    hand = sphere_mesh(16)
    cloud = PointCloud.from_arrays(
        np.concatenate([head.points.world(), 0.25 * hand.points.world() + [0.5 * np.sin(frame), -0.3, 1.4]]),
        normals=np.concatenate([head.points.normals, hand.points.normals]),
        colors=np.concatenate([head.points.colors, 255 - hand.points.colors]),
    )
    return Mesh(cloud, np.concatenate([head.faces, hand.faces + len(head.points)]).astype(np.uint32))


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Range views of two pods, with a hole in their masks."""
    folder = tmp_path_factory.mktemp("scan") / "hand"
    folder.mkdir()
    pods = rig(head_with_a_hand(0).bounds, (-27.5, 27.5), aspect=4 / 3)
    for frame in range(FRAMES):
        seen = capture(head_with_a_hand(frame), pods, (120, 90), [Faults()] * 2, frame=frame, unit="mm")
        views = [without(view, HOLE, 0.06) for view in seen]
        formats.write(folder / f"{frame:02d}.exr", merge(views), views)
    return folder


def without(view: RangeView, place: NDArray[np.float64], radius: float) -> RangeView:
    """The view with all masked out that it sees round a place."""
    mask = view.valid()
    mask[mask] = np.linalg.norm(view.positions() - place, axis=1) > radius
    return replace(view, mask=mask)


@pytest.fixture(scope="module")
def running(screen: Screen, scan: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningApp]:
    with running_app(screen, tmp_path_factory.mktemp("app"), scan) as app:
        yield app


@pytest.fixture
def app(running: RunningApp) -> RunningApp:
    running.reset()
    return running


def press(app: RunningApp, key: str) -> None:
    app.screen.do("key", key)
    app.settle()


def holes(app: RunningApp) -> int:
    """How many pixels of the view's upper half, where no legend is, are painted as holes."""
    view = shown(app)
    return int((view[: len(view) // 2] == rgba(HOLE_COLOR)[:3]).all(axis=2).sum())


def test_a_key_paints_holes_whatever_draws(app: RunningApp) -> None:
    assert not holes(app)
    for name in ("points", "surfels"):
        while app.state.backend != name:
            press(app, "b")
        before = shown(app).copy()
        press(app, "g")
        assert app.state.document["look"]["holes"]
        assert holes(app) > 20
        press(app, "g")
        np.testing.assert_array_equal(shown(app), before)
