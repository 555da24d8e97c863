"""Curves under the timeline and ways over the picture, by real clicks and keys; a mouth opens as is known."""

from __future__ import annotations

import csv
import io
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from extended import use_tools
from numpy.typing import NDArray
from PIL import Image
from virtual_screen import PANEL, ROOT, RunningApp, Screen, running_app

from viewer.analysis.track import Known
from viewer.camera import Camera
from viewer.document.recording import Recording
from viewer.output.overlays import STATE_MARKS

RATE, FRAMES = 25.0, 50
PEAK, WIDE, OPENING = 1.0, 0.25, 12.0  # seconds, seconds, scan units
UPPER, LOWER = 112, 52  # points of the grid, two rows and four apart
CLICK = 0.45  # scan units, more than a pixel of the view that is started with
DRAWER = "drawer/plotting"
BELOW = """
from imgui_bundle import imgui
from viewer.app.commands import Command
TITLE = "Below {name}"
class Tool:
    def __init__(self, context): self.context, self.is_on = context, False
    def toggle(self): self.is_on = not self.is_on
    def is_below(self): return self.is_on
    def below(self, ui):
        if imgui.button("Press {name}"): {pressed}
COMMANDS = {{"Tools": (Command("below_{name}", "Below {name}", Tool.toggle, "Alt+{key}"),)}}
"""


def opening(times: NDArray[np.float64]) -> NDArray[np.float64]:
    return OPENING * np.exp(-0.5 * ((times - PEAK) / WIDE) ** 2)


def frames() -> NDArray[np.float64]:
    """A grid of 15 x 11 points, whose upper half goes up as a mouth opens, (T, 165, 3)."""
    x, y = np.meshgrid(np.arange(15) - 7, np.arange(11) - 5)
    rest = np.stack([x.ravel(), y.ravel(), np.zeros(165)], axis=1) * 8.0
    moved = np.repeat(rest[None], FRAMES, axis=0)
    moved[:, 75:, 1] += opening(np.arange(FRAMES) / RATE)[:, None]
    return moved


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    np.savez(tmp_path / "scan.npz", positions=frames(), faces=np.array([(0, 1, 2), (1, 2, 3)]))
    return tmp_path / "scan.npz"


@pytest.fixture
def keys_file(tmp_path: Path) -> None:
    """Keys for what has none of its own."""
    folder = tmp_path / "config" / "scan4d"
    folder.mkdir(parents=True)
    (folder / "keys.toml").write_text('[keys]\ncopy_curves = "Ctrl+C"\ncopy_numbers = "Ctrl+K"\n')


def click_point(app: RunningApp, number: int) -> None:
    left, top, width, height = app.view()
    place = Camera.from_json(app.state.camera).place_in_picture(tuple(frames()[0, number]))
    assert place is not None
    x, y = int(left + width / 2 + place[0] * height), int(top + height / 2 - place[1] * height)
    app.do(("mousemove", x, y), ("click", 1))
    app.settle()


def ctrl(screen: Screen, key: str) -> None:
    """As fingers do it: one key after the other."""
    screen.do("key", f"ctrl+{key}")


def pasted(screen: Screen) -> list[dict[str, str]]:
    """The table that another program would paste."""
    return list(csv.DictReader(io.StringIO(screen.clipboard()), delimiter="\t"))


def save_as(app: RunningApp, name: str) -> Path:
    app.act(DRAWER, ("item_click", "Export plot..."))
    assert re.fullmatch(r"\w+_measures.csv", app.settle().fields["##name"]), "named like the scan"
    app.screen.do("type", "--delay", 40, name)
    app.screen.do("key", "Return")
    return Path(app.told(r"Saved (.+?)(?: and .+)?$")[1])


def playhead(app: RunningApp) -> tuple[int, int]:
    """A place on the line in the plot that is at the frame that is shown."""
    _, top, _, height = app.view()
    picture = app.screen.picture()[top + height :].astype(int)
    is_text = (np.abs(picture - (0xE3, 0xE6, 0xEA)).max(axis=2) < 24)[:, : picture.shape[1] // 2]
    column = int(is_text.sum(axis=0).argmax())
    rows = np.flatnonzero(is_text[:, column])
    return column, top + height + int(np.median(rows))


@pytest.mark.slow
def test_tools_stand_beside_each_other_under_the_timeline(screen: Screen, tmp_path: Path, scan: Path) -> None:
    folder = tmp_path / "tools"
    folder.mkdir()
    for name, key, pressed in (
        ("one", "A", "self.context.note('one is pressed')"),
        ("two", "B", "raise ValueError('two is pressed')"),
    ):
        (folder / f"{name}.py").write_text(BELOW.format(name=name, key=key, pressed=pressed))
    with running_app(screen, tmp_path, scan, before=use_tools(folder)) as app:
        left, top, width, height = app.view()
        app.press("alt+a")
        app.press("alt+b")
        lower = app.view()[3]
        assert app.view()[:3] == (left, top, width)
        assert lower < height - 150
        app.act("drawer/one", ("item_click", "Press one"))
        app.told("one is pressed")
        bottom = screen.picture().shape[0] - (height - lower)
        app.drag((300, bottom + 3), (300, bottom - 37))
        assert app.view()[3] == pytest.approx(lower - 40, abs=3)
        app.act("drawer/two", ("item_click", "Press two"))
        app.told("switched off .*two until the next start: ValueError: two is pressed")
        app.press("alt+a")
        assert app.view()[3] == height


@pytest.mark.usefixtures("keys_file")
def test_from_opening_a_scan_to_the_curve_of_the_mouth_in_four_actions(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    with running_app(screen, tmp_path, scan) as app:
        app.press("k")
        click_point(app, UPPER)
        click_point(app, LOWER)
        app.press("d")

        ctrl(screen, "c")
        app.told("Copied 1 curves")
        rows = pasted(screen)
        (name,) = (name for name in rows[0] if name.startswith("Distance") and "±" not in name)
        wanted = np.linalg.norm(frames()[:, UPPER] - frames()[:, LOWER], axis=1)
        assert [row["frame"] for row in rows] == [str(frame + 1) for frame in range(FRAMES)]
        np.testing.assert_allclose([float(row[name]) for row in rows], wanted, atol=2 * CLICK)
        ctrl(screen, "k")
        app.told("Copied amplitude, onset, peak and duration of 1 curves")
        (numbers,) = pasted(screen)
        assert float(numbers["amplitude"]) == pytest.approx(OPENING, rel=0.03)
        reach = WIDE * math.sqrt(2 * math.log(10))
        for field, seconds in (("peak", PEAK), ("onset", PEAK - reach), ("duration", 2 * reach)):
            assert float(numbers[f"{field} [s]"]) == pytest.approx(seconds, abs=0.02), field

        app.act(PANEL, ("item_click", "$$0/\uf044"))
        screen.do("type", "--delay", 40, "mouth")
        screen.do("key", "Return")
        app.settle()
        ctrl(screen, "c")
        app.told("Copied 1 curves")
        assert any(column.startswith("mouth [") for column in pasted(screen)[0])

        before = playhead(app)
        x = screen.picture().shape[1] // 4
        app.do(("mousemove", x, before[1]), ("click", 1))
        clicked = app.settle().frame
        assert 10 < clicked < FRAMES
        column, row = playhead(app)
        assert abs(column - x) < 12, "the line is where it was clicked"
        dragged = app.drag((column, row), (column - 60, row)).frame
        assert 0 < dragged < clicked - 3
        for _ in range(2):
            ctrl(screen, "z")
            app.settle()
        assert not app.state.document["parts"]["landmarks"]["measures"]
        assert "Traceback" not in app.log()


def check_saved_picture(app: RunningApp, folder: Path) -> None:
    """A picture that is saved has landmarks, ways and measures as the view has them, and is drawn again."""
    app.press("p")
    saved = Path(app.told(r"Saved (.+\.png)")[1])
    picture = np.asarray(Image.open(saved).convert("RGB")).astype(int)
    app.send_notes_away()  # that of the saved picture lies over the view
    left, top, width, height = app.view()
    view = app.screen.picture()[top : top + height, left : left + width].astype(int)
    entry = Recording.load(saved).entries[0]
    assert len(entry.landmarks) == 4
    assert sum(len(path.places) for path in entry.trajectories) == FRAMES
    assert [path.name.split()[0] for path in entry.measure_lines] == ["Distance", "Distance"]
    assert entry.plot is not None
    whole = folder / "whole.png"  # without the plot below it
    alone = ["--marks", "landmarks", "trajectories", "measure_lines"]
    redraw = [sys.executable, "-m", "viewer.cli", "render", "--replay", str(saved)]
    here = {**os.environ, "PYTHONPATH": str(ROOT)}
    subprocess.run([*redraw, "-o", str(whole), *alone], check=True, cwd=folder, env=here)
    drawn = np.asarray(Image.open(whole).convert("RGB")).astype(int)
    marks = [(one.place, STATE_MARKS[Known.PLACED].color) for one in entry.landmarks]
    (line, upper), way = entry.measure_lines, entry.trajectories[0]
    assert line.places == upper.places, "the latter covers the former"
    marks.append((line.places[len(line.places) // 2], upper.colors[0]))
    fastest = int(np.linalg.norm(np.diff(np.array(way.places), axis=0), axis=1).argmax())
    marks.append((way.places[fastest], way.colors[fastest]))
    missed: dict[str, list[object]] = {"picture": [], "view": []}
    for place, color in marks:
        at = entry.camera.place_in_picture(place)
        assert at is not None
        x, y = int(width / 2 + at[0] * height), int(height / 2 - at[1] * height)
        for name, image in (("picture", drawn), ("view", view)):
            around = image[max(y - 3, 0) : y + 4, x - 3 : x + 4]
            if np.abs(around - bytes_of(color)).max(axis=2).min() >= 60:
                missed[name].append((place, f"{color:06x}"))
    assert not missed["picture"]
    assert len(missed["view"]) <= 1, missed  # the selected one has another colour
    again = folder / "again.png"
    subprocess.run([*redraw, "-o", str(again)], check=True, cwd=folder, env=here)
    assert (np.asarray(Image.open(again).convert("RGB")) == picture).all()


def bytes_of(color: int) -> list[int]:
    return [color >> 16, color >> 8 & 255, color & 255]


@pytest.mark.slow
def test_curves_are_saved_and_ways_are_drawn_and_held_still(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    pytest.importorskip("matplotlib")
    with running_app(screen, tmp_path, scan) as app:
        app.press("k")
        for number in (UPPER, LOWER, 0, 14):
            click_point(app, number)
        app.press("Escape")
        app.press("d")
        app.choose(DRAWER, "##order", "###speed")
        app.settle()
        saved = save_as(app, "speed.csv")
        rows = list(csv.reader(io.StringIO(saved.read_text(encoding="utf-8"))))
        assert rows[0][2].endswith("[units/s]")
        assert save_as(app, "speed.svg").read_text().count("<svg") == 1
        assert save_as(app, "speed.png").read_bytes()[:4] == b"\x89PNG"

        app.press("d")
        for mode in ("against", "repeats", "time"):
            app.choose(DRAWER, "##mode", f"###{mode}")
            app.settle()
        left, top, width, height = app.view()
        before = screen.picture()[top : top + height, left : left + width].copy()
        app.act(PANEL, ("item_open", "Landmark paths (trajectories)"))
        app.act(PANEL, ("item_click", "Landmark paths (trajectories)/paths/$$0/##traced"))
        app.settle()
        after = screen.picture()[top : top + height, left : left + width]
        assert (before != after).any(axis=2).sum() > 100
        check_saved_picture(app, tmp_path)
        for number in (1, 2, 3):
            app.act(PANEL, ("item_click", f"Landmark paths (trajectories)/paths/$${number}/##anchors"))
        app.act(PANEL, ("item_click", "Landmark paths (trajectories)/hold/##value"))
        app.settle()
        assert "Traceback" not in app.log()
