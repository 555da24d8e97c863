"""Escape in the window, with real keys: each press ends the uppermost thing and nothing else."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from scenes import rarely
from virtual_screen import PANEL, RunningApp, Screen, running_app

from viewer.app.scene.cube import cube_position

KINDS = ("lists", "pages", "is_export_open", "is_browser_open", "clicking", "shown_notes", "works")
EM = 16.0  # height of the font, pixels
VIEW_MENU, LOOK_FROM = (107, 12), (140, 130)  # pixels of the screen
# What a renderer needs is never found, until its work is cancelled.
ENDLESS = """
import time
from viewer.helper import Helper
def call(self, task, function, *arguments, **others):
    while True:
        task.check()
        time.sleep(0.1)
Helper.call = call
"""


@pytest.fixture(scope="module")
def running(screen: Screen, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningApp]:
    scan = tmp_path_factory.mktemp("scan") / "points.npy"
    np.save(scan, np.random.default_rng(0).random((500, 3)))
    with running_app(screen, tmp_path_factory.mktemp("app"), scan, before=ENDLESS) as app:
        yield app
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_the_menu_of_up_axes_comes_again_only_with_the_mouse(app: RunningApp) -> None:
    """It drops while the mouse comes to its button; Escape closes it though the mouse rests there."""
    left, top, width, height = app.view()
    x, y, _ = cube_position(width, height, EM) or pytest.fail("there is no cube")
    button = round(left + x), round(top + 2.02 * y + 0.7 * EM)
    away = left + width // 2, top + height // 2
    for _ in range(2):
        app.screen.do("mousemove", *away)
        app.settle()
        app.screen.do("mousemove", *button)
        app.see(lists=1)
        app.screen.do("key", "Escape")
        app.see(lists=0)
        app.screen.do("mousemove", button[0] + 3, button[1])
        assert app.settle().lists == 0
    app.screen.do("click", 1)
    app.see(lists=1)


@pytest.fixture
def app(running: RunningApp) -> Iterator[RunningApp]:
    running.reset()
    yield running
    for _ in range(6):
        if any(stack(running).values()):
            running.screen.do("key", "Escape")


def stack(app: RunningApp) -> dict[str, Any]:
    """What Escape could end, and how much there is of it."""
    state = app.settle()
    return {kind: np.size(getattr(state, kind) or ()) if kind != "lists" else state.lists for kind in KINDS}


def ended(app: RunningApp, before: dict[str, Any]) -> str:
    """Press Escape; what that has ended, which is one thing."""
    app.screen.do("key", "Escape")
    now = stack(app)
    changed = {kind: before[kind] - now[kind] for kind in KINDS if now[kind] != before[kind]}
    assert list(changed.values()) == [1], changed
    return next(iter(changed))


def ended_in_turn(app: RunningApp) -> list[str]:
    """Press Escape until nothing is left; what each press has ended."""
    kinds = []
    while any((before := stack(app)).values()):
        kinds.append(ended(app, before))
    return kinds


def test_a_tool_then_each_message_the_latest_first(app: RunningApp) -> None:
    app.screen.do("key", "p")
    app.told("Saved")
    app.screen.do("key", "p")
    second = app.told("Saved.*")[0]
    app.screen.do("key", "m")
    before = stack(app)
    assert ended(app, before) == "clicking"
    assert stack(app)["shown_notes"] == 2
    app.screen.do("key", "Escape")
    assert second not in " ".join(app.settle().shown_notes)
    assert len(app.state.shown_notes) == 1


@pytest.mark.parametrize("opened", ["keys", *rarely("mouse")])
def test_a_submenu_then_its_menu_then_the_tool(app: RunningApp, opened: str) -> None:
    app.screen.do("key", "m")
    app.settle()
    if opened == "keys":
        for key in ("alt+v", "Down", "Down", "Down", "Down", "Right"):
            app.screen.do("key", key)
            app.settle()
    else:
        app.screen.do("mousemove", *VIEW_MENU, "click", 1)
        app.settle()
        for step in range(3):  # ImGui opens it once the mouse moves on it
            app.screen.do("mousemove", LOOK_FROM[0] + step, LOOK_FROM[1])
        app.settle()
    assert stack(app)["lists"] == 2
    assert ended_in_turn(app) == ["lists", "lists", "clicking"]


def test_the_list_in_a_dialog_then_the_dialog_then_the_tool(app: RunningApp) -> None:
    app.screen.do("key", "m", "key", "ctrl+e")
    app.settle()
    app.act("Export", ("item_click", "##format"))
    assert ended(app, stack(app)) == "lists"  # of the combo box
    before = stack(app)
    app.screen.do("key", "Escape")
    now = stack(app)
    assert (before["is_export_open"], now["is_export_open"], now["clicking"]) == (1, 0, 1)
    assert ended(app, now) == "clicking"


def test_a_page_of_the_help_with_its_field_then_the_tool(app: RunningApp) -> None:
    app.screen.do("key", "m", "key", "F1")
    assert stack(app)["pages"] == 1
    assert ended_in_turn(app) == ["pages", "clicking"]


def test_a_page_without_the_keyboard_comes_after_the_tool(app: RunningApp) -> None:
    app.screen.do("key", "F1")
    app.settle()
    left, top, _, height = app.view()
    app.screen.do("mousemove", left + 20, top + height - 120, "click", 1, "key", "m")
    assert ended_in_turn(app) == ["clicking", "pages"]


def test_a_field_of_the_panel_then_the_keyboard_then_the_tool(app: RunningApp) -> None:
    app.screen.do("key", "m", "key", "F6")
    app.settle()
    app.screen.do("key", "Escape")
    assert app.settle().clicking == "measuring", "the keyboard went back to the view"
    assert ended(app, stack(app)) == "clicking"


def test_work_in_the_status_bar_goes_on(app: RunningApp) -> None:
    app.choose(PANEL, "##backend", "###surfels")
    app.see(lambda state: any("normals" in name for name in state.works))
    for _ in range(4):
        app.screen.do("key", "Escape")
        app.take_in()
    assert not any("Cancelled" in text for text in app.notes)
    app.act("timeline", ("item_click", "###work"))
    app.see(lists=1)
    app.screen.do("key", "Escape")
    assert app.see(lists=0).works, "the list of work is closed, the work goes on"
    app.act("timeline", ("item_click", "###cancel"))
    app.told("Cancelled: Estimating normals")
    app.see(works=[])
