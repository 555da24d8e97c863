"""No widget has the id of another, and nothing else is wrong with them: a walk hovers each, rests on it,
drags and clicks it, with what it opens, in the states that the window has."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from many_landmarks import left_open
from range_scenes import sphere_view
from scenes import sphere
from virtual_screen import Report, RunningApp, Screen, running_app

from viewer.scan import formats
from viewer.scan.range_view import merge

BARS = ("toolbar", "##MainMenuBar")
# Two buttons of one name at the start of the toolbar, where there is room for them.
TWINS = """
from imgui_bundle import imgui
from viewer.app.menu import MenuBar
draw = MenuBar.draw_toolbar
def draw_twins(bar):
    for _ in range(2):
        imgui.button("twin")
        imgui.same_line()
    draw(bar)
MenuBar.draw_toolbar = draw_twins
"""
# No frame of any scan comes.
STUCK = """
import threading
import viewer.scan.timeline as timeline
timeline.Timeline._read = lambda *of: threading.Event().wait()
"""


def check(app: RunningApp, report: Report, least: int) -> None:
    """Fails where something was wrong, or fewer widgets than that were found."""
    print(len(report.seen), "widgets")
    assert not report.problems, "\n".join(report.problems)
    assert len(report.seen) >= least, report.seen
    assert "Traceback" not in app.log(), app.log()[-5000:]


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scan") / "ball.npz"
    formats.write(path, sphere(2_000))
    return path


@pytest.mark.slow
def test_buttons_of_the_toolbar_that_share_an_id_are_found(
    screen: Screen, tmp_path: Path, ball: Path
) -> None:
    with running_app(screen, tmp_path, ball, before=f"exec({TWINS!r}); ") as app:
        report = app.walk(BARS[:1], presses=False)
        assert report.problems == ["toolbar: twin: 2 widgets have its id"]
        assert len(report.seen) >= 15, "the twins leave no room for undo and redo"
        assert "Traceback" not in app.log()


@pytest.mark.slow
def test_no_buttons_of_the_bars_share_an_id_but_those_that_do(
    screen: Screen, tmp_path: Path, ball: Path
) -> None:
    with running_app(screen, tmp_path, ball, before=f"exec({TWINS!r}); ") as app:
        report = app.walk(BARS, presses=False)
        assert report.problems == ["toolbar: twin: 2 widgets have its id"]
        menus = {words.rpartition(": ")[2] for words in report.seen if words.startswith("##MainMenuBar")}
        assert menus == {"File", "Edit", "View", "Tools", "Help"}
        assert len(report.seen) >= 15 + len(menus), "the twins leave no room for undo and redo"
        assert "Traceback" not in app.log()


# Of a walk, each of which takes a minute or two, and has at least its share of the widgets that are there at
# first: of 110 with landmarks. With what these open, parts had 49 to 180.
PARTS = 6
in_parts = pytest.mark.parametrize("part", range(PARTS))


@pytest.mark.slow
@in_parts
def test_all_widgets_of_a_scan_with_landmarks(screen: Screen, tmp_path: Path, part: int) -> None:
    scan = left_open(tmp_path, frames=3, landmarks=4, measures=2)
    with running_app(screen, tmp_path, scan) as app:
        check(app, app.walk(part=(part, PARTS)), 18)


@pytest.mark.slow
@in_parts
def test_all_widgets_of_a_range_scan(screen: Screen, tmp_path: Path, part: int) -> None:
    views = sphere_view((0.3, 0, 4)), sphere_view((3, -1, 4), name="right")
    formats.write(tmp_path / "rig.exr", merge(views), views)
    with running_app(screen, tmp_path, tmp_path / "rig.exr") as app:
        check(app, app.walk(part=(part, PARTS)), 15)


@pytest.mark.slow
def test_all_widgets_while_no_frame_is_there(screen: Screen, tmp_path: Path, ball: Path) -> None:
    with running_app(screen, tmp_path, ball, before=f"exec({STUCK!r}); ", shows=False) as app:
        check(app, app.walk(), 100)


@pytest.mark.slow
@in_parts
def test_all_widgets_in_large_text(screen: Screen, tmp_path: Path, ball: Path, part: int) -> None:
    folder = tmp_path / "config" / "scan4d"
    folder.mkdir(parents=True)
    (folder / "settings.json").write_text(json.dumps({"format": 1, "window_look": {"text_scale": 2.0}}))
    with running_app(screen, tmp_path, ball) as app:
        check(app, app.walk(part=(part, PARTS)), 10)
