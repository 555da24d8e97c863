"""Levels and holes as the window shows them: keys pressed while range views of two pods play."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import test_window
from numpy.typing import NDArray
from PIL import Image
from scenes import sphere_mesh
from test_window import replayed
from virtual_screen import PANEL, RunningApp, Screen, State, running_app

from viewer.document.recording import Recording
from viewer.look import HOLE_COLOR, LEVEL_COLORS, Look, rgba
from viewer.mesh.triangles import Mesh
from viewer.scan import formats
from viewer.scan.points import PointCloud
from viewer.scan.range_view import RangeView, merge
from viewer.simulate.scanner import Faults, capture, rig

FRAMES = 6
KEYS = (*((str(level), f"level_{level}") for level in range(5)), ("h", "fill"), ("shift+h", "hide"))
HOLE = np.array([0.1, 0.5, np.sqrt(0.74)])  # on the ball


def shown(app: RunningApp) -> NDArray[np.uint8]:
    """The 3D view on the screen, without messages."""
    app.send_notes_away()
    return test_window.shown(app)


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
        views = [without(view, HOLE, 0.08) for view in seen]
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
def app(running: RunningApp) -> Iterator[RunningApp]:
    running.reset()
    yield running
    running.see(lambda state: state.counted)
    assert "Traceback" not in running.log()


def holes(app: RunningApp) -> int:
    """How many pixels of the view's upper half, where no legend is, are painted as holes."""
    view = shown(app)
    return int((view[: len(view) // 2] == rgba(HOLE_COLOR)[:3]).all(axis=2).sum())


@pytest.mark.slow
def test_a_key_paints_holes_whatever_draws(app: RunningApp) -> None:
    assert not holes(app)
    for name in ("points", "surfels"):
        while app.state.backend != name:
            app.press("b")
        before = shown(app).copy()
        app.press("g")
        assert app.state.document["look"]["holes"]
        assert holes(app) > 20
        app.press("g")
        np.testing.assert_array_equal(shown(app), before)


def counted(app: RunningApp) -> dict[int, int]:
    """How many pixels of the view's upper half are coloured as levels; 0: grey, as measured ones."""
    view = shown(app)[: app.view()[3] // 2]
    found = {n: view == rgba(color)[:3] for n, color in enumerate(LEVEL_COLORS, start=1)}
    background = view == rgba(Look().background)[:3]
    count = {n: int(same.all(axis=2).sum()) for n, same in found.items()}
    return {0: int(((np.ptp(view, axis=2) == 0) & ~background.all(axis=2)).sum()), **count}


def params(state: State) -> dict[str, object]:
    return dict(state.document["params"].get("pyramidal", {}))


def draw_pyramids(app: RunningApp, primitive: str) -> None:
    """Have pyramidal projection draw, which is the default, of points or polygons."""
    assert app.settle().backend == "pyramidal"
    app.choose(PANEL, "renderer/primitive/##value", f"###{primitive}")
    app.settle()


@pytest.fixture
def levels(app: RunningApp) -> Iterator[RunningApp]:
    """Pyramidal projection of points, coloured by level and not lit."""
    draw_pyramids(app, "points")
    app.choose(PANEL, "color_by/##value", "###level")
    app.choose(PANEL, "light/##value", "###flat")
    app.settle()
    yield app
    app.choose(PANEL, "color_by/##value", "###auto")
    app.choose(PANEL, "light/##value", "###auto")


@pytest.mark.slow
def test_each_level_has_its_key(levels: RunningApp) -> None:
    app, before = levels, shown(levels).copy()
    on = counted(app)
    assert min(on[n] for n in range(4)) > 20, on
    for level in range(5):
        app.press(str(level))
        assert params(app.state)[f"level_{level}"] is False
        assert counted(app)[level] == 0
        assert counted(app) != on or level == 4
        app.press(str(level))
        np.testing.assert_array_equal(shown(app), before)
    app.press("g")
    open_with_levels = holes(app)
    app.press("h")
    assert params(app.state)["fill"] is False
    off = counted(app)
    assert off[0] > 0
    assert not any(off[level] for level in range(1, 5))
    assert holes(app) > 5000 + 10 * open_with_levels
    app.press("h")
    app.press("g")
    np.testing.assert_array_equal(shown(app), before)


@pytest.mark.slow
def test_the_key_of_hidden_points_uncovers_what_is_seen_through_a_surface(levels: RunningApp) -> None:
    app, before = levels, shown(levels).copy()
    app.press("shift+h")
    assert params(app.state)["hide"] is False
    assert (shown(app) != before).any(axis=2).sum() > 100
    app.press("shift+h")
    np.testing.assert_array_equal(shown(app), before)


@pytest.mark.slow
def test_what_is_under_the_mouse_tells_its_level(levels: RunningApp) -> None:
    app, view = levels, shown(levels)
    left, top, *_ = app.view()
    for level in (1, 2):
        rows, columns = np.nonzero((view == rgba(LEVEL_COLORS[level - 1])[:3]).all(axis=2))
        place = len(rows) // 2
        app.screen.do("mousemove", left + columns[place], top + rows[place])
        assert f"in a hole that the renderer filled from level {level}" in app.settle().pointed
    app.press("m")
    app.screen.do("click", 1)  # a distance may begin where points of one surface lie around
    app.see(is_under_way=True)
    app.press("Escape")
    assert not app.settle().distances


@pytest.mark.slow
def test_keys_pressed_while_it_plays_are_recorded_and_replayed_to_the_same_bytes(
    app: RunningApp,
) -> None:
    draw_pyramids(app, "polygons")
    app.press("r")
    app.see(is_recording=True)
    app.screen.do("key", "e", "key", "space")
    app.see(is_playing=True)
    for key, name in KEYS:
        for wanted in (False, True):
            app.screen.do("key", key)
            state = app.see(lambda state: params(state).get(name) is wanted)  # noqa: B023
            app.see(lambda later: later.frame != state.frame)  # noqa: B023
            assert app.state.is_playing
    app.screen.do("key", "space", "key", "e", "key", "h")
    app.settle()
    app.press("p")
    picture = Path(app.told(r"Saved (.+\.png)")[1])
    app.press("r")
    recording = Path(app.told(r"Saved (.+\.json)")[1])
    app.press("h")
    entries = Recording.load(recording).entries
    for _, name in KEYS:
        assert any(not getattr(entry.params, name) for entry in entries), f"none without {name}"
    assert {entry.pose for entry in entries} == {*range(FRAMES)}
    once, again = replayed(recording, "%04d.png"), replayed(recording, "%04d.png")
    assert len(once) == len(entries)
    for one, other in zip(once, again, strict=True):
        np.testing.assert_array_equal(one, other)
    with Image.open(picture) as file:
        np.testing.assert_array_equal(np.asarray(file), once[-1])


@pytest.fixture
def polygons(app: RunningApp) -> Iterator[RunningApp]:
    """The default renderer of range views as it comes; its switches are on again afterwards."""
    draw_pyramids(app, "polygons")
    yield app
    for name in ("fill", *(f"level_{level}" for level in range(5))):
        if not params(app.settle()).get(name, True):
            app.act("toolbar", ("item_click", f"###switch_{name}"))


@pytest.mark.slow
def test_a_key_that_shows_nothing_says_why_and_offers_what_does(polygons: RunningApp) -> None:
    app = polygons
    app.screen.do("key", "4")
    assert app.see(lambda state: state.caption).caption == "Level 4: off"
    offer = app.told("Level 4: off. The picture did not change: polygons connect the samples")[0]
    assert any(note.startswith(offer) for note in app.settle().shown_notes)
    app.act("problems", ("item_click", "$$0/###Draw samples as points (Shift+P)"))
    app.see(caption="Draw samples as points: on")
    assert params(app.settle())["primitive"] == "points"
    assert not app.state.shown_notes
    app.press("4", "shift+p")
    assert params(app.state)["primitive"] == "polygons"
    assert params(app.state)["level_4"] is True
    app.send_notes_away()  # of level 4, which changes few pixels
    app.screen.do("key", "2", "key", "shift+p")  # the key that the message names
    assert params(app.settle())["primitive"] == "points"
    assert not app.state.shown_notes
    app.press("2")
    assert not any("did not change" in note for note in app.state.shown_notes)


@pytest.mark.slow
def test_the_toolbar_has_the_switches_of_range_views(polygons: RunningApp) -> None:
    app = polygons
    for name in (*(f"level_{level}" for level in range(5)), "fill"):
        app.act("toolbar", ("item_click", f"###switch_{name}"))
        assert params(app.settle())[name] is False
    app.act("toolbar", ("item_click", "###switch_fill"))
    assert params(app.settle())["fill"] is True


@pytest.mark.slow
def test_a_key_that_cannot_switch_says_why(polygons: RunningApp) -> None:
    app = polygons
    app.press("h", "2")
    app.told("'Level 2' has no effect with this value of 'Fill holes'. Press H to change it")
    assert params(app.state).get("level_2", True) is True
    app.press("h")
    while app.state.backend != "points":
        app.press("b")
    app.press("1")
    app.told(r"The renderer 'Points' has no switch 'Level 1'. Choose the renderer 'Filled surface'")
    while app.state.backend != "pyramidal":
        app.press("b")
