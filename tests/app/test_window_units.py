"""The unit of a scan in the window: guessed, told by one click, and another one to show lengths in."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from many_landmarks import left_open
from scenes import sphere
from test_window_measuring import ctrl
from virtual_screen import PANEL, RunningApp, Screen, running_app

from viewer.scan import formats

HOSTILE = "%s%s%s%s%s%s"


@pytest.fixture
def app(screen: Screen, tmp_path: Path) -> Iterator[RunningApp]:
    """The window on a ball of a quarter of a unit, as a head in metres is."""
    ball = sphere(20_000)
    points = ball.world() * 0.125 / np.abs(ball.world()).max()
    formats.write(tmp_path / "head.npz", type(ball).from_arrays(points, normals=ball.normals))
    folder = tmp_path / "config" / "scan4d"
    folder.mkdir(parents=True)
    (folder / "keys.toml").write_text('[keys]\ncopy_distances = "Ctrl+C"\n')
    with running_app(screen, tmp_path, tmp_path / "head.npz") as app:
        yield app
    assert "Traceback" not in app.log()


def place(app: RunningApp) -> list[float]:
    """The position that the line below the picture tells."""
    return [float(number) for number in app.state.pointed[0].partition(" ±")[0].split(", ")]


@pytest.mark.slow
def test_a_guess_is_taken_and_lengths_are_shown_in_another_unit(app: RunningApp) -> None:
    assert app.state.unit == "units", "a guess is nothing before somebody agrees"
    app.act(PANEL, ("item_click", "###accept"))
    app.see(unit="m")
    left, top, width, height = app.view()
    middle = left + width // 2, top + height // 2
    app.screen.do("mousemove", *middle)
    app.see(lambda state: state.pointed and state.pointed[0].endswith(" m"))
    metres = place(app)
    app.choose(PANEL, "##shown_unit", "###mm")
    app.do(("mousemove", left, top), ("mousemove", *middle))
    app.see(lambda state: state.pointed and state.pointed[0].endswith(" mm"))
    assert place(app) == pytest.approx([1000 * number for number in metres], abs=0.01)

    app.choose(PANEL, "color_by/##value", "###height")
    app.choose(PANEL, "range/##value", "###fixed")
    look = app.settle().document["look"]
    assert -0.13 < look["low"] < -0.1 < 0.1 < look["high"] < 0.13
    app.act(PANEL, ("item_input_value", "high/##value", 50.0))
    assert app.settle().document["look"]["high"] == pytest.approx(0.05), "50 mm"
    assert app.state.document["look"]["low"] == look["low"]
    for _ in range(3):
        ctrl(app.screen, "z")
    app.see(lambda state: state.document["look"]["color_by"] == "auto")

    app.screen.do("key", "m")
    app.see(clicking="measuring")
    for x in (-width // 12, width // 12):
        app.do(("mousemove", middle[0] + x, middle[1]), ("click", 1))
        app.settle()
    made = app.see(lambda state: state.distances).distances[0]
    assert made["distance"] < 0.25, "it is kept in units of the scan"
    ctrl(app.screen, "c")
    app.told("Copied")
    row = next(csv.DictReader(io.StringIO(app.screen.clipboard()), delimiter="\t"))
    assert row["unit"] == "mm"
    assert float(row["distance"]) == pytest.approx(1000 * made["distance"])
    ctrl(app.screen, "z")
    ctrl(app.screen, "z")
    assert app.settle().document["shown_unit"] is None
    ctrl(app.screen, "z")
    app.see(unit="units")


@pytest.mark.slow
def test_a_unit_that_is_no_word_ends_nothing(screen: Screen, tmp_path: Path) -> None:
    """Of a document that was kept, with a measure, whose row of the panel has a format with the unit."""
    scan = left_open(tmp_path, frames=1, landmarks=2, measures=1)
    (file,) = (tmp_path / "config" / "scan4d" / "scans").iterdir()
    kept = json.loads(file.read_text())
    kept["document"] |= {"unit": HOSTILE, "goal": {"kind": "error", "bound": 0.5, "unit": HOSTILE}}
    file.write_text(json.dumps(kept))
    with running_app(screen, tmp_path, scan) as app:
        app.act(PANEL, ("mouse_move", "##noise"))
        app.told("cannot read some of your saved work on this scan: (goal, unit|unit, goal)")
        state = app.settle()
        assert (state.unit, len(state.landmarks)) == ("units", 2)
        assert "Traceback" not in app.log()
