"""Exporting from the window, with a real mouse and keyboard."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from range_scenes import sphere_view
from scenes import sphere
from virtual_screen import (
    PANEL,
    PATIENCE,
    ROOT,
    SIZE,
    RunningApp,
    Screen,
    running_app,
    virtual_screen,
    wait_until,
)
from written import film

from viewer.document.recording import Recording
from viewer.look import color_table
from viewer.output.legend import MARKS, marks_of
from viewer.output.marks import INK
from viewer.scan import formats
from viewer.scan.formats.exr import write_views

COUNT = 6  # frames
LEFT = (SIZE[0] - 34 * 16) // 2  # of the dialog


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The working directory, with the scan jane_doe/."""
    folder = tmp_path_factory.mktemp("app")
    (folder / "jane_doe").mkdir()
    for index in range(COUNT):
        formats.write(folder / "jane_doe" / f"{index}.npz", sphere(3000, radius=1 + 0.1 * index))
    return folder


@pytest.fixture(scope="module")
def app(tmp_path_factory: pytest.TempPathFactory, folder: Path) -> Iterator[RunningApp]:
    """The window on the scan, coloured by height."""
    with (
        virtual_screen(tmp_path_factory.mktemp("screen"), SIZE) as screen,
        running_app(screen, folder, "jane_doe") as app,
    ):
        app.choose(PANEL, "color_by/##value", "###height")
        app.settle()
        yield app


def press_with_ctrl(app: RunningApp, key: str) -> None:
    app.screen.do("key", f"ctrl+{key}")


class Dialog:
    """The export dialog, by the names of its fields."""

    def __init__(self, app: RunningApp) -> None:
        self._app = app
        press_with_ctrl(app, "e")
        app.see(is_export_open=True)

    def choose(self, field: str, item: str) -> None:
        """An item of a field's list."""
        self._app.choose("Export", f"##{field}", item)

    def open_list(self, field: str) -> None:
        """Without choosing."""
        self._app.act("Export", ("item_click", f"##{field}"))

    def enter(self, field: str, value: object) -> None:
        """A value in a field."""
        self._app.act("Export", ("item_input_value", f"##{field}", value))

    def tick(self, box: str) -> None:
        """The box of this name."""
        self._app.act("Export", ("item_click", box))

    def export(self, button: str = "Export") -> None:
        """Press the button that does it."""
        self._app.act("Export", ("item_click", button))


def replayed(folder: Path, *arguments: object) -> None:
    command = [sys.executable, "-m", "viewer.cli", "render", *map(str, arguments)]
    done = subprocess.run(command, cwd=folder, env={"PYTHONPATH": str(ROOT)}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def listed(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()} - {"jane_doe", "config", "state", "log"}


def corner(app: RunningApp, right: bool) -> NDArray[np.uint8]:
    """A lower corner of the view."""
    left, top, width, height = app.view()
    view = app.screen.picture()[top : top + height, left : left + width]
    return view[-60:, -110:] if right else view[-60:, :90]


@pytest.mark.slow
def test_marks_are_shown_and_hidden(app: RunningApp) -> None:
    for key, right in (("s", False), ("c", True)):
        shown = corner(app, right)
        assert (shown == INK[:3]).all(axis=2).any(), "there is text or a line"
        app.screen.do("key", key)
        app.settle()
        hidden = corner(app, right)
        assert (hidden == hidden[0, 0]).all()
        app.screen.do("key", key)
        app.settle()
        assert (corner(app, right) == shown).all()


def test_the_colour_bar_shows_the_map(app: RunningApp) -> None:
    stripes = corner(app, right=True).astype(int)
    table = color_table("batlow")[:, :3].astype(int)
    column = max(stripes.swapaxes(0, 1), key=lambda column: np.ptp(column, axis=1).sum())
    colored = column[np.ptp(column, axis=1) > 40]
    places = [np.abs(table - color).sum(axis=1).argmin() for color in colored]
    assert len(places) > 30
    assert (np.diff(places) <= 0).all(), "high is at the top"
    assert all(np.abs(table[place] - color).max() <= 8 for place, color in zip(places, colored, strict=True))


@pytest.mark.slow
def test_what_was_recorded_becomes_a_film_by_one_click(app: RunningApp, folder: Path) -> None:
    """With the marks of the view; the recording is saved before that."""
    app.screen.do("key", "r")
    app.see(is_recording=True)
    for key in ("Right", "Right"):
        app.screen.do("key", key)
        app.settle()
    app.screen.do("key", "r")
    recording = Path(app.told(r"Recorded .* s\.  Saved (.+\.json)$")[1])
    entries = Recording.load(recording).entries
    assert [entry.pose for entry in entries] == [0, 1, 2]
    assert {entry.marks for entry in entries} == {replace(marks_of(MARKS), stamp=False)}
    app.act("problems", ("item_click", "$$0/Save as film"))
    out = Path(app.told(r"Saved (.+\.mp4)")[1])
    frames, _ = film(out)
    width, height = app.view()[2:]
    assert frames[0].shape[:2] == (height + height % 2, width + width % 2)
    assert (np.abs(frames[0][-60:, :90].astype(int) - INK[:3]).max(axis=2) < 60).any(), "the scale bar"
    app.screen.do("key", "ctrl+Home", "key", "Escape")
    app.settle()
    for path in (recording, out):
        path.unlink()


@pytest.mark.slow
def test_the_chosen_frames_are_played_and_offered_for_export(app: RunningApp, folder: Path) -> None:
    app.screen.do(
        "key", "ctrl+Home", "key", "Right", "key", "i", "key", "Right", "key", "Right", "key", "shift+i"
    )
    assert app.settle().document["span"] == [1, 3]
    before = app.state.pictures
    app.screen.do("key", "e", "key", "space")
    app.see(lambda _: len(app.pictures(before)) > 6)
    app.screen.do("key", "space", "key", "e")
    app.settle()
    assert {state.frame for state in app.pictures(before)} == {1, 2, 3}
    dialog = Dialog(app)
    dialog.choose("what", "###frames")
    dialog.enter("width", 96)
    dialog.enter("height", 64)
    dialog.enter("name", "chosen")
    dialog.export()
    app.told(r"Saved 3 pictures, .*chosen_0002.png to chosen_0004.png")
    for path in folder.glob("chosen_*.png"):
        path.unlink()
    app.screen.do("key", "alt+i", "key", "ctrl+Home", "key", "Escape")
    assert app.settle().document["span"] is None


@pytest.mark.slow
def test_a_turntable_becomes_pictures_that_replay(app: RunningApp, folder: Path) -> None:
    dialog = Dialog(app)
    dialog.choose("what", "###turntable")
    dialog.enter("pictures", 3)
    dialog.enter("width", 96)
    dialog.enter("height", 64)
    dialog.tick("Scale bar")
    dialog.enter("name", "round")
    dialog.export()
    app.told(r"Saved 3 pictures, .*round_0001.png to round_0003.png")
    names = [f"round_{number:04d}.png" for number in (1, 2, 3)]
    assert listed(folder) == set(names)
    entries = [Recording.load(folder / name).entries[0] for name in names]
    assert {(entry.scan, entry.size, entry.pose) for entry in entries} == {("jane_doe", (96, 64), 0)}
    assert all(entry.marks.scale_bar and not entry.marks.stamp for entry in entries)
    eyes = np.array([entry.camera.eye for entry in entries]) - entries[0].camera.target
    assert np.allclose(eyes.sum(axis=0), 3 * np.array([0, eyes[0, 1], 0]), atol=1e-6)
    replayed(folder, "--replay", names[1], "-o", "again.png")
    assert (folder / "again.png").read_bytes() == (folder / names[1]).read_bytes()
    (folder / "again.png").unlink()


@pytest.mark.slow
def test_frames_become_a_film(app: RunningApp, folder: Path) -> None:
    dialog = Dialog(app)
    dialog.choose("what", "###frames")
    dialog.enter("width", 96)
    dialog.enter("height", 64)
    dialog.enter("first", 2)
    dialog.enter("last", 5)
    dialog.choose("format", "###mp4")
    dialog.enter("name", "frames")
    dialog.export()
    app.told(r"Saved .*frames.mp4")
    images, rate = film(folder / "frames.mp4")
    assert (len(images), rate, images[0].shape) == (4, 25, (64, 96, 3))
    sizes = [(image > 80).sum() for image in images]
    assert sizes == sorted(sizes), "the sphere grows"


@pytest.mark.slow
def test_an_anonymous_film_draws_no_names(tmp_path: Path, screen: Screen) -> None:
    scan = tmp_path / "ball.npz"
    ball = sphere(3000)
    formats.write(scan, replace(ball, scalars={"janedoe": ball.positions[:, 1].copy()}))
    with running_app(screen, tmp_path, scan) as app:
        app.choose(PANEL, "color_by/##value", "###janedoe")
        app.settle()
        corners = []
        for name in ("named", "anonymous"):
            dialog = Dialog(app)
            dialog.choose("what", "###turntable")
            dialog.enter("pictures", 2)
            dialog.choose("format", "###mp4")
            dialog.tick("##anonymous" if name == "anonymous" else "Colour bar")
            dialog.enter("width", 640)
            dialog.enter("height", 480)
            dialog.enter("name", name)
            dialog.export()
            app.told(rf"Saved .*{name}.mp4")
            (image, *_), _ = film(tmp_path / f"{name}.mp4")
            corners.append(image[240:, 480:].astype(int))
        assert np.abs(corners[0] - corners[1]).max() > 100, "the name of the scalar"


@pytest.mark.slow
def test_an_anonymous_surface_tells_no_name(app: RunningApp, folder: Path) -> None:
    dialog = Dialog(app)
    dialog.choose("format", "###exr")
    dialog.choose("what", "###view")
    dialog.tick("##anonymous")
    dialog.enter("name", "view")
    dialog.export()
    app.told(r"Saved .*view.exr")
    data = (folder / "view.exr").read_bytes()
    assert b"jane" not in data
    assert str(folder).encode() not in data
    replayed(folder, "jane_doe", "--replay", "view.exr", "--anonymous", "-o", "again.exr")
    assert (folder / "again.exr").read_bytes() == data
    (folder / "again.exr").unlink()


@pytest.mark.slow
def test_what_is_there_is_replaced_only_when_told(app: RunningApp, folder: Path) -> None:
    there = folder / "there.exr"
    there.write_bytes(b"as before")
    dialog = Dialog(app)
    dialog.choose("format", "###exr")
    dialog.choose("what", "###view")
    dialog.open_list("what")
    app.screen.do("key", "Escape")  # closes the list alone
    dialog.enter("name", "there")
    dialog.export()
    app.settle()
    assert there.read_bytes() == b"as before"
    dialog.export("Replace")
    app.told(r"Saved .*there.exr")
    assert there.stat().st_size > len(b"as before")


def begin_a_long_one(app: RunningApp, folder: Path) -> None:
    dialog = Dialog(app)
    dialog.choose("what", "###turntable")
    dialog.enter("pictures", 3600)
    dialog.choose("format", "###png")
    dialog.choose("size", "###1920x1080")
    dialog.enter("name", "long")
    dialog.export()
    app.see(is_exporting=True)
    wait_until(lambda: list(folder.glob(".scan4d_*/made/long*")))


@pytest.mark.slow
def test_a_cancelled_export_leaves_nothing_and_closing_asks(app: RunningApp, folder: Path) -> None:
    before = listed(folder)
    begin_a_long_one(app, folder)
    screen = app.screen
    screen.do("key", "Escape")  # that is for something else
    app.act("timeline", ("item_click", "###cancel"))
    app.told("Cancelled: Exporting long")
    app.see(is_exporting=False)
    assert listed(folder) == before

    begin_a_long_one(app, folder)
    press_with_ctrl(app, "q")
    app.see(asks_before_closing=True)
    screen.do("key", "Escape")  # on second thoughts, no
    app.see(asks_before_closing=False)
    assert app.process.poll() is None
    press_with_ctrl(app, "q")
    app.see(asks_before_closing=True)
    app.act("Close Scan4D?", ("item_click", "Cancel the export and close"), ends=True)
    assert app.process.wait(PATIENCE) == 0
    assert listed(folder) == before
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_an_export_never_replaces_the_scan(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    scan, config = tmp_path / "range.exr", tmp_path / "config" / "scan4d"
    write_views(scan, [sphere_view((0, 0, 4))])
    config.mkdir(parents=True)
    export = {"format": "exr", "folder": str(tmp_path)}
    (config / "settings.json").write_text(json.dumps({"format": 1, "exporting": {"choices": export}}))
    before = scan.read_bytes()
    with (
        virtual_screen(tmp_path_factory.mktemp("screen"), SIZE) as screen,
        running_app(screen, tmp_path, scan) as app,
    ):
        dialog = Dialog(app)
        dialog.enter("name", "range")
        for _ in range(2):
            dialog.export()
            app.settle()
        assert not any(state.is_exporting for state in app.states)
        dialog.enter("name", "other")
        dialog.export()
        app.told(r"Saved .*other.exr")
    assert scan.read_bytes() == before


@pytest.mark.slow
def test_a_signal_cancels_an_export_without_asking(
    tmp_path_factory: pytest.TempPathFactory, folder: Path
) -> None:
    before = listed(folder)
    with (
        virtual_screen(tmp_path_factory.mktemp("screen"), SIZE) as screen,
        running_app(screen, folder, "jane_doe") as app,
    ):
        begin_a_long_one(app, folder)
        app.process.terminate()
        assert app.process.wait(PATIENCE) == 0
        assert not any(state.asks_before_closing for state in app.states)
        assert "Traceback" not in app.log()
    assert listed(folder) == before
    assert list(folder.glob(".scan4d_*")) == []
