"""Saving in the window: Ctrl+S, and the dialogs that name a file, by real keys."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from virtual_screen import RunningApp, Screen, running_app

from viewer.app.file_dialog import files_of
from viewer.app.session import named_like
from viewer.document.document import Document
from viewer.document.saved_session import SavedSession


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    scan = tmp_path / "scan.npy"
    np.save(scan, np.random.default_rng(0).random((300, 3)))
    (tmp_path / "work" / "b sub").mkdir(parents=True)
    return scan


@pytest.fixture
def app(screen: Screen, tmp_path: Path, scan: Path) -> Iterator[RunningApp]:
    other = tmp_path / "other.npy"
    np.save(other, np.random.default_rng(1).random((300, 3)))
    with running_app(screen, tmp_path / "work", scan, other, home=tmp_path / "home") as app:
        yield app
    assert "Traceback" not in app.log()


def write(app: RunningApp, text: str) -> None:
    app.screen.do("type", "--delay", 40, text)
    app.settle()


def test_ctrl_s_asks_once_and_then_saves_to_that_file(app: RunningApp, tmp_path: Path) -> None:
    file = tmp_path / "work" / "b sub" / "one.scan4d.json"
    app.press("p")
    app.told("Saved .*scan4d_0001.png")
    app.press("ctrl+s")
    assert app.state.fields["##name"] == "scan.scan4d.json", "as the scan is named, not the picture"
    app.press("Up", "Return")  # into the folder, the only row
    app.act("Save session", ("item_click", "##name"))
    app.press("ctrl+a")
    write(app, "one")
    app.press("Return")
    assert app.told("Saved (.*)")[1] == str(file)
    first = SavedSession.load(file)
    app.press("ctrl+4", "ctrl+s")
    assert app.settle().lists == 0, "nothing is asked"
    assert app.told("Saved (.*)")[1] == str(file)
    assert SavedSession.load(file).document.camera != first.document.camera
    assert app.settle().latest_note.startswith("Saved")
    app.press("Next")
    app.see(lambda state: state.scan.endswith("other.npy"))
    assert not app.settle().latest_note, "which is about the scan before"


@pytest.mark.parametrize(
    ("scan", "name"),
    [
        ("demo", "demo"), ("/a/face.ply", "face"), ("/a/f%04d.ply", "f"), ("/a/*.xyz", "scan"),
        ("/a/patient 7.v2.ply", "patient 7.v2"), ("/a/b.scan", "b"),
    ],
)  # fmt: skip
def test_a_file_for_the_session_is_named_like_the_scan(scan: str, name: str, tmp_path: Path) -> None:
    assert named_like(scan, tmp_path, ".x") == tmp_path / f"{name}.x"
    (tmp_path / f"{name}.x").write_text("")
    assert named_like(scan, tmp_path, ".x") == tmp_path / f"{name}_2.x"
    (tmp_path / "set.1").mkdir()
    assert named_like(str(tmp_path / "set.1"), tmp_path, ".x") == tmp_path / "set.1.x"


@pytest.mark.slow
def test_the_dialog_opens_a_session_of_the_open_scan_and_closes_and_ctrl_s_saves_to_its_file(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    file = tmp_path / "mine.scan4d.json"
    SavedSession(str(scan), None, 0, Document()).export(file)
    with running_app(screen, tmp_path / "work", scan, home=tmp_path / "home") as app:
        app.press("ctrl+4")
        changed = app.settle().document
        app.press("ctrl+o", "Tab")
        assert app.state.is_browser_open
        write(app, str(file))
        app.press("Return")
        assert app.told("Opened the session (.*)")[1] == str(file)
        state = app.see(is_browser_open=False, undoes="Open session")
        assert state.document != changed
        assert state.lists == 0
        app.press("ctrl+z", "ctrl+o")
        assert app.see(is_browser_open=True).refusal == ""
        write(app, "mine")  # narrows the rows to the session alone
        app.press("Return")
        assert app.told("Opened the session (.*)")[1] == str(file)
        app.see(is_browser_open=False, undoes="Open session")
        before = file.read_bytes()
        app.press("ctrl+4", "ctrl+s")
        assert app.told("Saved (.*)")[1] == str(file)
        assert file.read_bytes() != before
        assert "Traceback" not in app.log()


def test_a_file_is_replaced_only_after_a_question(app: RunningApp, tmp_path: Path) -> None:
    file = tmp_path / "work" / "kept.scan4d.json"
    file.write_text("kept")
    app.press("ctrl+s")
    write(app, "kept")
    app.press("Return")
    assert app.state.lists == 2, "the question stands over the dialog"
    app.press("Escape")
    assert app.state.lists == 1, "Escape ends the question alone"
    assert file.read_text() == "kept"
    app.press("Return")
    app.act("Replace the file?", ("item_click", "Replace"))
    assert app.told("Saved (.*)")[1] == str(file)
    assert app.settle().lists == 0
    SavedSession.load(file)


def test_a_folder_lists_its_folders_and_the_newest_files_first(tmp_path: Path) -> None:
    for number, name in enumerate(("10 b", "9 a", ".hidden")):
        (tmp_path / name).mkdir()
        for suffix in (".csv", ".txt"):
            file = tmp_path / f"{number}{suffix}"
            file.write_text("x" * number)
            os.utime(file, (number, number))
    rows = files_of(tmp_path, (".csv",))
    assert [row.title for row in rows] == ["9 a", "10 b", "2.csv", "1.csv", "0.csv"]
    assert [(row.frames, row.size) for row in rows] == [(0, None), (0, None), (1, 2), (1, 1), (1, 0)]


@pytest.mark.slow
def test_the_folder_of_an_export_is_gone_to_and_escape_ends_one_dialog(
    app: RunningApp, tmp_path: Path
) -> None:
    app.press("ctrl+e")
    app.act("Export", ("item_click", "\uf07c"))
    assert app.settle().lists == 2
    app.press("Escape")
    assert app.state.lists == 1
    app.act("Export", ("item_click", "\uf07c"))
    app.press("Up", "Return")  # into the folder, the only row
    app.act("Choose a folder", ("item_click", "###take"))
    assert app.settle().fields["##folder"] == str(tmp_path / "work" / "b sub")
    app.press("Escape")
    assert app.state.lists == 0
