"""Large text in a small window: no text is cut, and the timeline, the view and the drawer have room."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from virtual_screen import PANEL, SIZE, RunningApp, running_app, virtual_screen

from viewer.app.layout import drawer_height

LARGE = 1280, 800
SHORTEST = 8.0  # the track, in heights of the font


@contextmanager
def window(
    factory: pytest.TempPathFactory, size: tuple[int, int], scale: float, scan: object = None
) -> Iterator[RunningApp]:
    """The window on a small scan, with its welcome card, filling a screen of this size and scale."""
    if scan is None:
        scan = factory.mktemp("scan")
        for number in range(3):
            np.save(scan / f"{number}.npy", np.random.default_rng(number).random((500, 3)))
    with (
        virtual_screen(factory.mktemp("screen"), size, scale) as screen,
        running_app(screen, factory.mktemp("app"), scan) as app,
    ):
        yield app
        assert "Traceback" not in app.log()


def cut_in_any_state(app: RunningApp) -> dict[str, object]:
    """The texts that are cut, by what was opened."""
    found = {"first": app.settle().cut}
    app.act(PANEL)
    found["panel"] = app.settle().cut
    for keys in ("k", "m", "v", "F1", "ctrl+e", "ctrl+o", "ctrl+shift+s"):
        app.screen.do("key", keys)
        found[keys] = app.settle().cut
        app.screen.do("key", "v" if keys == "v" else "Escape")
        app.settle()
    return {name: texts for name, texts in found.items() if texts}


@pytest.mark.parametrize(
    ("size", "scale"),
    [
        (SIZE, 2.0),
        *(
            pytest.param(size, scale, marks=pytest.mark.slow)
            for size, scale in ((SIZE, 1.0), (SIZE, 1.5), (LARGE, 1.0), (LARGE, 1.5), (LARGE, 2.0))
        ),
    ],
)
@pytest.mark.slow
def test_no_text_is_cut_and_the_timeline_has_room(
    tmp_path_factory: pytest.TempPathFactory, size: tuple[int, int], scale: float
) -> None:
    with window(tmp_path_factory, size, scale) as app:
        assert app.settle().track >= SHORTEST
        height = app.view()[3]
        app.screen.do("key", "v")
        em = 16 * scale
        assert app.settle().view[3] >= height - 8 * em, "without measures the drawer has a line to say"
        app.screen.do("key", "v")
        assert cut_in_any_state(app) == {}


@pytest.mark.parametrize("window", [1400, 1000, 640, 420, 200])
@pytest.mark.parametrize("em", [16, 32])
def test_the_view_keeps_its_share_beside_the_drawer(window: float, em: float) -> None:
    room = window - 3 * em - 4.8 * em  # without toolbar and timeline
    for wanted in (1.0 * em, 15.0 * em, 60.0 * em):
        drawer = drawer_height(wanted, window, room)
        assert drawer <= wanted
        view = max(room, 0) - drawer
        assert view >= min(0.35 * window, 0.6 * room)
        assert drawer == wanted or view == pytest.approx(max(min(0.35 * window, 0.6 * room), 0))


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1.0, 1.5, 2.0])
def test_no_text_of_the_first_start_is_cut(tmp_path_factory: pytest.TempPathFactory, scale: float) -> None:
    with window(tmp_path_factory, SIZE, scale, "demo") as app:
        assert app.settle().cut == {}
        assert app.state.track >= SHORTEST
