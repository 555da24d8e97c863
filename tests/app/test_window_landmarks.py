"""Landmarks in the window with real clicks and keys, on a scan whose points are known.

A click is right to the pixel: the places that it gives are those of the points to about that.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from virtual_screen import PANEL, PATIENCE, RunningApp, Screen, State, running_app, stored_of

from viewer.analysis.landmarks import Landmark, Template
from viewer.analysis.landmarks.files import read_landmarks, write_landmarks
from viewer.analysis.landmarks.landmark_set import LandmarkNotes, LandmarkSet
from viewer.analysis.landmarks.templates import read_template, save_template, templates
from viewer.camera import Camera
from viewer.document.landmarks import Landmarks

FACES = ((0, 1, 2), (1, 2, 3))
CLICK = 0.45  # scan units, more than a pixel of the view that is started with
GROWTH = (1.0, 1.25, 1.5)  # of the grid, in its frames
PAIR = (Landmark("right", partner="left"), Landmark("left", partner="right"))


def grid(scale: float) -> NDArray[np.float64]:
    """15 x 11 points on z = 0, (165, 3)."""
    x, y = np.meshgrid(np.arange(15) - 7, np.arange(11) - 5)
    return np.stack([x.ravel(), y.ravel(), np.zeros(165)], axis=1) * 8 * scale


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    """A grid that grows, of one topology."""
    frames = np.stack([grid(scale) for scale in GROWTH])
    np.savez(tmp_path / "scan.npz", positions=frames, faces=np.array(FACES))
    return tmp_path / "scan.npz"


def on_screen(app: RunningApp, point: NDArray[np.float64]) -> tuple[int, int]:
    """Where the screen shows a place."""
    left, top, width, height = app.view()
    place = Camera.from_json(app.state.camera).place_in_picture(tuple(point))
    assert place is not None
    return int(left + width / 2 + place[0] * height), int(top + height / 2 - place[1] * height)


def click(app: RunningApp, point: NDArray[np.float64]) -> State:
    app.do(("mousemove", *on_screen(app, point)), ("click", 1))
    return app.settle()


def part(state: State) -> dict[str, Any]:
    """What the document holds of landmarks."""
    held: dict[str, Any] = state.document["parts"]["landmarks"]
    return held


def keys_of(state: State, name: str) -> dict[int, list[float]]:
    """Where a landmark is set, by frame."""
    landmark = next(one for one in part(state)["all"] if one["name"] == name)
    return {key["frame"]: key["position"] for key in landmark["keys"]}


def is_at(found: list[float], point: NDArray[np.float64]) -> bool:
    return math.dist(found, point) < CLICK


def begin_with(app: RunningApp, name: str) -> None:
    """Choose a template, which takes up the tool."""
    app.choose(PANEL, "##template", f"###template {name}")
    app.see(clicking="landmarks")


@pytest.mark.slow
def test_21_landmarks_take_21_clicks_and_are_followed(screen: Screen, tmp_path: Path, scan: Path) -> None:
    names = [landmark.name for landmark in templates()["face-21"].landmarks]
    assert len(names) == 21
    numbers = [15 * row + column for row in (2, 5, 8) for column in range(1, 14, 2)]
    with running_app(screen, tmp_path, scan) as app:
        begin_with(app, "face-21")
        before = app.settle()
        assert {state for state, _ in before.landmarks.values()} == {"not placed"}
        for number in numbers:
            x, y = on_screen(app, grid(1)[number])
            app.do(("mousemove", x, y), ("click", 1))
        state = app.see(lambda state: all(one[0] == "placed" for one in state.landmarks.values()))
        assert list(state.landmarks) == names, "they are in the order of the template"
        for name, number in zip(names, numbers, strict=True):
            assert is_at(state.landmarks[name][1], grid(1)[number]), name
        app.press("period")
        state = app.see(lambda state: all(one[0] == "tracked" for one in state.landmarks.values()))
        for name, number in zip(names, numbers, strict=True):
            assert math.dist(state.landmarks[name][1], grid(1.25)[number]) < 1.25 * CLICK
        assert state.undoes == "Place landmark"
        assert "Traceback" not in app.log()


def test_the_window_is_at_rest_only_when_landmarks_are_followed(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    with running_app(screen, tmp_path, scan) as app:
        app.press("k")
        for number, name in ((34, "Landmark 1"), (60, "Landmark 2")):
            state = click(app, grid(1)[number])
            assert state.followed[name], "following begins a moment after the click, and has ended"
            assert len(state.followed) == len(state.landmarks)


@pytest.mark.slow
def test_landmarks_are_corrected_skipped_and_taken_back(screen: Screen, tmp_path: Path, scan: Path) -> None:
    points = [grid(scale) for scale in GROWTH]
    with running_app(screen, tmp_path, scan) as app:
        app.press("k")
        app.see(clicking="landmarks")
        click(app, points[0][34])
        click(app, points[0][60])
        state = click(app, points[0][128])
        assert list(state.landmarks) == ["Landmark 1", "Landmark 2", "Landmark 3"]

        assert "The arrow keys move Landmark 3." in state.prompt
        before = keys_of(state, "Landmark 3")[0]
        after = keys_of(app.press("Right", "Right", "Up"), "Landmark 3")[0]
        pixel = (after[0] - before[0]) / 2
        assert 0 < pixel < CLICK
        assert after[1] - before[1] == pytest.approx(pixel, rel=0.2), "arrows move it by a pixel each"
        state = app.press("ctrl+z", "ctrl+z", "ctrl+z")
        assert keys_of(state, "Landmark 3")[0] == before
        screen.do("keydown", "Right")
        app.see(lambda state: keys_of(state, "Landmark 3")[0][0] > before[0] + 3 * pixel)
        screen.do("keyup", "Right")
        app.settle()
        state = app.press("ctrl+z")
        assert keys_of(state, "Landmark 3")[0] == before, "what a held key does is one step"

        app.press("period")
        state = app.see(lambda state: state.landmarks["Landmark 1"][0] == "tracked")
        assert "The arrow keys" not in state.prompt
        state = app.press("Left", "Right", "Right", "Left")
        assert (state.frame, state.prompt.count("The arrow keys")) == (1, 0), "arrows go from frame to frame"
        assert keys_of(state, "Landmark 3") == {0: before}
        start, stop = on_screen(app, points[1][34]), on_screen(app, points[1][50])
        dragged = app.drag(start, stop)
        keys = keys_of(dragged, "Landmark 1")
        assert is_at(keys[0], points[0][34]), "the frame before stays as it was"
        assert math.dist(keys[1], points[1][50]) < 1.25 * CLICK, "the frame that is dragged in has a key"
        assert dragged.camera == state.camera, "the view stays"
        state = app.press("shift+Delete")
        assert list(keys_of(state, "Landmark 1")) == [0]

        state = app.press("shift+x")
        assert state.landmarks["Landmark 1"][0] == "not visible in this frame"
        state = app.press("ctrl+Home")
        assert state.landmarks["Landmark 1"][0] == "placed"

        app.act(PANEL, ("item_input_value", "##name", "mouth"))
        state = app.settle()
        assert "mouth" in state.landmarks
        state = app.press("Delete")
        assert list(state.landmarks) == ["Landmark 2", "Landmark 3"]
        state = app.press("ctrl+z", "ctrl+z")
        assert list(state.landmarks) == ["Landmark 1", "Landmark 2", "Landmark 3"]

        app.press("Escape")
        app.see(clicking=None)
        state = click(app, points[0][70])
        assert len(state.landmarks) == 3, "clicks place none any longer"
        state = app.press("Right")
        assert state.frame == 1, "arrows go from frame to frame again"
        assert "Traceback" not in app.log()


@pytest.mark.slow
def test_own_template_with_a_skipped_one_and_a_mirrored_one(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    points = grid(1)
    middle = [Landmark(f"middle {number}") for number in range(3)]
    other = (Landmark("far right", partner="far left"), Landmark("far left", partner="far right"))
    save_template(tmp_path / "own.json", Template("own", "Own", (*middle, *other, *PAIR)))
    with running_app(screen, tmp_path, scan) as app:
        app.drop(tmp_path / "own.json")
        app.see(clicking="landmarks")
        for number in (22, 67, 112):  # x = 0
            click(app, points[number])
        click(app, points[60])  # far right
        click(app, points[74])  # and its mirror image
        click(app, points[64])
        screen.do("mousemove", *on_screen(app, points[10]))
        app.settle()
        state = app.press("a")
        assert is_at(keys_of(state, "left")[0], points[70]), "the mirrored place is taken"
        state = app.press("ctrl+z", "x")
        assert state.landmarks["left"][0] == "skipped"
        assert "Traceback" not in app.log()


@pytest.mark.slow
def test_present_landmarks_become_a_template(screen: Screen, tmp_path: Path, scan: Path) -> None:
    with running_app(screen, tmp_path, scan) as app:
        app.press("k")
        for number in (60, 74):
            click(app, grid(1)[number])
        app.choose(PANEL, "##partner", "###partner Landmark 1")
        app.press("d")
        app.choose(PANEL, "##template", "###save template")
        app.settle()
        app.press("ctrl+a")
        screen.do("type", "--delay", 40, "pair")
        screen.do("key", "Return")
        app.told("Saved .*pair.json, 2 landmarks and 1 measures")
        saved = read_template(tmp_path / "pair.json")
        assert [(one.name, one.partner) for one in saved.landmarks] == [
            ("Landmark 1", "Landmark 2"), ("Landmark 2", "Landmark 1"),
        ]  # fmt: skip
        assert [measure.kind for measure in saved.measures] == ["distance"]
    with running_app(screen, tmp_path, "demo", home=tmp_path / "other") as app:
        app.choose(PANEL, "##template", "###template file")
        app.settle()
        screen.do("type", "--delay", 40, "pair.json")
        screen.do("key", "Return")
        app.see(clicking="landmarks")
        state = app.settle()
        assert [one[0] for one in state.landmarks.values()] == ["not placed", "not placed"]
        assert part(state)["template"] == "pair"
        assert "Traceback" not in app.log()


@pytest.mark.slow
def test_notes_are_pinned_and_kept(screen: Screen, tmp_path: Path, scan: Path) -> None:
    points = grid(1)
    with running_app(screen, tmp_path, scan) as app:
        app.press("j")
        state = click(app, points[34])
        screen.do("type", "--delay", 40, "scar")
        app.settle()
        app.act(PANEL, ("item_click", "Add frame note"))
        screen.do("type", "--delay", 40, "blink")
        state = app.settle()
        place, frame = part(state)["notes"]
        assert (place["text"], place["frame"], frame["text"], frame["position"]) == ("scar", 0, "blink", None)
        assert is_at(place["position"], points[34])
        app.press("Return")
        app.process.terminate()
        assert app.process.wait(PATIENCE) == 0
    assert len(stored_of(tmp_path, scan).document.part(Landmarks).notes) == 2
    with running_app(screen, tmp_path, scan, home=tmp_path) as app:
        app.act(PANEL, ("item_click", "$$0/\uf1f8"))
        state = app.settle()
        assert [note["text"] for note in part(state)["notes"]] == ["blink"]
        assert "Traceback" not in app.log()


@pytest.mark.slow
def test_files_are_read_and_saved_and_those_of_another_scan_told(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    points = grid(1)
    keys = tmp_path / "config" / "scan4d"
    keys.mkdir(parents=True)
    (keys / "keys.toml").write_text('[keys]\nsave_landmarks = "Ctrl+L"\n')
    for name, far in (("here", 0.0), ("elsewhere", 1e4)):
        found = LandmarkSet.of(
            ("A", "B"), np.array([points[34], points[60]]) + far, notes=LandmarkNotes("units")
        )
        write_landmarks(tmp_path / f"{name}.mrk.json", found)
    with running_app(screen, tmp_path, scan) as app:
        app.drop(tmp_path / "elsewhere.mrk.json")
        app.told("no landmark lies on the scan")
        app.drop(tmp_path / "here.mrk.json")
        app.told("Imported 2 landmarks from here.mrk.json")
        state = app.see(lambda state: "B" in state.landmarks)
        assert is_at(state.landmarks["A"][1], points[34])
        app.press("Right")
        state = app.see(lambda state: state.landmarks["A"][0] == "tracked")
        assert math.dist(state.landmarks["A"][1], 1.25 * points[34]) < 1.25 * CLICK
        for typed, frames in (("all.c3d", 3), ("one.mrk.json", 1)):
            app.press("ctrl+l", "ctrl+a")
            assert app.state.fields["##name"] == "scan_landmarks.mrk.json"
            screen.do("type", "--delay", 40, typed)
            screen.do("key", "Return")
            app.told(f"Saved .*{typed}")
            saved = read_landmarks(tmp_path / typed)
            assert len(saved) == frames
            assert saved.positions[frames // 2, 0] == pytest.approx(state.landmarks["A"][1], rel=1e-6)
        assert "Traceback" not in app.log()
