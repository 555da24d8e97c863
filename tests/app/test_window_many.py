"""Hundreds of landmarks and dozens of measures: what the window does not do again."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from many_landmarks import left_open
from virtual_screen import RunningApp, Screen, running_app

LANDMARKS, MEASURES, FRAMES = 500, 30, 6
COUNTED = """
import importlib, logging
def count(module, owner, name):
    holder = importlib.import_module(module)
    holder = getattr(holder, owner) if owner else holder
    function = getattr(holder, name)
    def counted(*arguments, **named):
        logging.getLogger("viewer.counted").debug("call of %s", name)
        return function(*arguments, **named)
    setattr(holder, name, staticmethod(counted) if name == "of" else counted)
count("viewer.app.tools._seen", "", "are_seen")
count("viewer.app.tools.landmarks", "", "are_seen")
count("viewer.app.tools.plotting.lines", "", "lines_of")
count("viewer.app.tools.plotting.paths", "Paths", "_speed_colors")
count("viewer.app.tools.plotting.paths", "", "trajectory_of")
count("viewer.app.tools.plotting.measurer", "", "series_of")
count("viewer.app.tools.plotting.shown", "", "curve_of")
count("viewer.app.tools.plotting.shown", "", "plot_of")
"""


def calls(app: RunningApp, start: int) -> dict[str, int]:
    """How often what is counted was called, after so many characters of the log."""
    names = re.findall(r"call of (\w+)", app.log()[start:])
    return {name: names.count(name) for name in set(names)}


@pytest.mark.slow
def test_what_has_not_changed_is_not_found_again(screen: Screen, tmp_path: Path) -> None:
    scan = left_open(tmp_path, FRAMES, LANDMARKS, MEASURES)
    with running_app(screen, tmp_path, scan, before=COUNTED) as app:
        state = app.settle()
        assert (len(state.followed), len(state.measured)) == (LANDMARKS, MEASURES)
        assert calls(app, 0)["series_of"] >= MEASURES, "what is counted is called"
        left, top, width, height = app.view()
        start, drawn = len(app.log()), app.state.windows
        for number in range(10):
            screen.do("mousemove", left + width // 2 + 5 * number, top + height // 2)
            app.settle()
        assert app.state.windows > drawn + 10
        assert not calls(app, start), "the picture stays"

        start = len(app.log())
        screen.do("key", "period")
        assert app.settle().frame == 1
        told = calls(app, start)
        assert told.pop("are_seen") <= 9, (
            "landmarks, ways and lines, each at once, before, with a preview and with the picture"
        )
        assert told.pop("lines_of") <= MEASURES
        assert not told, "tracks, series, curves and ways are those of all frames"

        assert "Traceback" not in app.log()
