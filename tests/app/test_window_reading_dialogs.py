"""The dialogs of tables and of folders in the window, by the mouse and by the keyboard alone."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from virtual_screen import PANEL, RunningApp, Screen, running_app, wait_until_stored

TABLE, FRAMES = "Read table", "Choose frames"
_MENU_ROW = 3  # of the two commands, the one that can be chosen


def open_by_keys(app: RunningApp) -> None:
    """Choose the dialog that suits the open scan in the menu File."""
    app.press("alt+f", *["Down"] * _MENU_ROW, "Return")
    app.see(lists=1)
    app.settle()


@pytest.fixture
def takes(tmp_path: Path) -> Path:
    """Two takes, with 300 and 200 points a frame."""
    folder = tmp_path / "takes"
    folder.mkdir()
    for take, count, points in (("anna", 3, 300), ("bert", 2, 200)):
        for number in range(count):
            np.save(folder / f"{take}_{number}.npy", np.random.default_rng(number).random((points, 3)))
    return folder


def numbered(path: Path) -> Path:
    """A table whose first column counts the points."""
    path.write_text("".join(f"{i} {i % 9}.5 {i // 9}.25 {i % 4}\n" for i in range(1, 81)))
    return path


def test_a_german_table_opens_at_once(screen: Screen, tmp_path: Path) -> None:
    path = tmp_path / "messung.csv"
    rows = "".join(f"{i % 9},5;{i // 9},25;{i % 4},0\n" for i in range(80))
    path.write_text(f"Messung vom 3. Mai\nx;y;z\n{rows}")
    with running_app(screen, tmp_path, path) as app:
        assert app.settle().points == 80
        assert not [note for note in app.notes if "Cannot open" in note]
    assert "Traceback" not in app.log()


def test_a_button_opens_another_take(screen: Screen, tmp_path: Path, takes: Path) -> None:
    with running_app(screen, tmp_path, takes) as app:
        app.told(r"holds 2 recordings \(takes\)\. Scan4D shows anna")
        assert app.settle().points == 300
        app.act("problems", ("item_click", "$$0/bert (2)"))
        app.see(points=200)
        assert not [note for note in app.settle().shown_notes if "takes" in note]
        app.press("ctrl+z")
        app.see(points=300)
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_all_takes_are_one_scan_and_the_dialog_goes_back_to_one(
    screen: Screen, tmp_path: Path, takes: Path
) -> None:
    with running_app(screen, tmp_path, takes) as app:
        app.press("Right")  # the frame stays
        app.act("problems", ("item_click", "$$0/All"))
        app.settle()
        app.press("End")
        app.see(points=200, frame=4)
        app.press("Escape")
        open_by_keys(app)
        app.choose(FRAMES, "##take", "###bert")
        app.act(FRAMES, ("item_click", "Open"))
        app.see(points=200, lists=0)
        app.press("Home", "End")
        assert app.settle().frame == 1
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_files_are_chosen_by_the_mouse(screen: Screen, tmp_path: Path, takes: Path) -> None:
    with running_app(screen, tmp_path, takes) as app:
        app.press("Escape")
        open_by_keys(app)
        app.act(FRAMES, ("item_click", "**/###anna_0.npy"), ("item_click", "**/###bert_1.npy"))
        app.act(FRAMES, ("item_click", "Open"))
        app.see(lists=0)
        app.settle()
        app.press("End")
        app.see(points=200, frame=2)
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_the_keyboard_alone_leaves_a_take_and_opens(screen: Screen, tmp_path: Path, takes: Path) -> None:
    with running_app(screen, tmp_path, takes) as app:
        app.press("Escape")
        open_by_keys(app)
        app.press("Tab", "Tab", "Tab")  # from Open past Reset and Cancel to the take
        app.press("space", "Down", "Return")
        app.press("shift+Tab", "shift+Tab", "shift+Tab", "Return")
        app.see(points=200, lists=0)
        open_by_keys(app)
        app.press("Escape")
        app.see(lists=0, points=200)
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_the_keyboard_alone_gives_a_role_and_skips_lines(screen: Screen, tmp_path: Path) -> None:
    path = numbered(tmp_path / "points.xyz")
    with running_app(screen, tmp_path, path) as app:
        app.press("Escape")
        assert app.settle().record["columns"]["value"] == ["number", "x", "y", "z"]
        open_by_keys(app)
        app.press("Tab", "Tab")  # from Open past Reset to Cancel
        app.press(*["Tab"] * 4)  # separator, decimal mark, encoding, lines to skip
        app.screen.do("key", "ctrl+a")
        app.screen.do("type", "--delay", "30", "2")
        app.press("Return")
        app.press("Tab", "Tab", "Tab")  # its buttons, and the role of the first column
        app.press("space")
        assert app.settle().lists == 2
        app.press("Escape")
        assert app.settle().lists == 1, "Escape closes the list alone"
        app.press("space", "End", "Return")  # the last role: not read
        app.press(*["shift+Tab"] * 9, "Return")  # back to Open
        app.see(points=78, lists=0)
        assert app.settle().document["reading"] == {"columns": "- x y z", "skip": "2"}
        open_by_keys(app)
        app.press("Tab", "Return")  # Reset
        app.press("shift+Tab", "Return")
        app.see(points=80, lists=0)
        app.press("ctrl+z")
        app.see(points=78)
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_the_keyboard_alone_leaves_a_file_aside(screen: Screen, tmp_path: Path, takes: Path) -> None:
    with running_app(screen, tmp_path, takes) as app:
        app.press("Escape")
        open_by_keys(app)
        app.press(*["Tab"] * 6, "space")  # Reset, Cancel, take, times, all files, the first file
        app.press(*["shift+Tab"] * 6, "Return")
        app.see(lambda state: state.document["reading"].get("frames") == "anna_1.npy;anna_2.npy;", lists=0)
        app.settle()
        app.press("End")
        assert app.settle().frame == 1
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_escape_leaves_the_scan_and_its_corrections_as_they_are(screen: Screen, tmp_path: Path) -> None:
    with running_app(screen, tmp_path, numbered(tmp_path / "points.xyz")) as app:
        app.press("Escape")
        open_by_keys(app)
        app.choose(TABLE, "rows/##role 0", "###x")
        app.press("Escape")
        state = app.see(lists=0)
        assert (state.document["reading"], state.undoes) == ({}, None)
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_files_left_aside_are_chosen_from_their_message(screen: Screen, tmp_path: Path) -> None:
    folder = tmp_path / "copies"
    folder.mkdir()
    for name in ("f001", "f002", "f003", "f002 - Copy"):
        np.save(folder / f"{name}.npy", np.random.default_rng(1).random((50, 3)))
    with running_app(screen, tmp_path, folder) as app:
        assert not re.search("--read", app.told("does not play f002 - Copy.npy")[0])
        app.act("problems", ("item_click", "$$0/Choose frames..."))
        app.see(lists=1)
        app.settle()
        app.act(FRAMES, ("item_click", "**/###f002 - Copy.npy"), ("item_click", "Open"))
        app.see(lambda state: state.document["reading"].get("frames", "").count(";") == 4, lists=0)
        app.settle()
        app.press("End")
        assert app.settle().frame == 3
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_a_role_is_given_by_the_mouse_and_applies(screen: Screen, tmp_path: Path) -> None:
    with running_app(screen, tmp_path, numbered(tmp_path / "points.xyz")) as app:
        wide = app.settle().camera["eye"]
        open_by_keys(app)
        app.choose(TABLE, "rows/##role 0", "###x")
        app.settle()
        app.act(TABLE, ("item_click", "Open"))
        app.see(lists=0)
        app.settle()
        app.press("f")
        assert app.settle().camera["eye"] != wide
        assert app.state.points == 80
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_a_refused_table_offers_its_dialog(screen: Screen, tmp_path: Path) -> None:
    path = tmp_path / "odd.csv"
    path.write_text("u,v,w\n" + "".join(f"{i % 9},{i // 9},{i % 4}\n" for i in range(80)))
    with running_app(screen, tmp_path, path) as app:
        app.told(r"Cannot open: \S+odd\.csv")
        app.act("problems", ("item_click", "$$0/Read table..."))
        app.see(lists=1)
        app.settle()
        for column, role in enumerate("xyz"):
            app.choose(TABLE, f"rows/##role {column}", f"###{role}")
            app.settle()
        app.act(TABLE, ("item_click", "Open"))
        app.see(points=80, lists=0)
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_a_recording_whose_scan_has_moved_asks_where_it_is(
    screen: Screen, tmp_path: Path, takes: Path
) -> None:
    with running_app(screen, tmp_path, takes) as app:
        app.press("Escape", "p")
        picture = app.told(r"Saved (.+)")[1]
    shutil.move(takes, tmp_path / "moved")
    with running_app(screen, tmp_path, "demo") as app:
        app.drop(picture)
        app.told(r"cannot find the scan .\S*takes. of this")
        app.settle()
        app.act("problems", ("item_click", "$$0/Locate scan..."))
        app.see(is_browser_open=True)
        app.settle()
        app.press("Tab")
        app.screen.do("type", "--delay", 15, tmp_path / "moved")
        app.settle()
        app.press("Return", "Return")  # into the folder, then all of it
        app.see(scan=str(tmp_path / "moved"), points=300, is_browser_open=False)
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_a_folder_of_another_camera_is_right_after_four_actions(screen: Screen, tmp_path: Path) -> None:
    """A folder of TUM, 320 x 180, of a wall at 1 m: its own camera is for 640 x 480."""
    from PIL import Image

    folder = tmp_path / "tum"
    (folder / "depth").mkdir(parents=True)
    Image.fromarray(np.full((180, 320), 5000, np.uint16)).save(folder / "depth" / "0.png")
    (folder / "depth.txt").write_text("0.0 depth/0.png\n")
    (folder / "groundtruth.txt").write_text("0.0 0 0 0 0 0 0 1\n")
    with running_app(screen, tmp_path, folder) as app:
        assert app.settle().record["camera"]["source"] == "assumed"
        app.act(PANEL, ("item_open", "How this was read"))
        app.choose(PANEL, "How this was read/camera/##value", "Other...")  # two actions
        app.settle()
        app.screen.do("key", "ctrl+a")
        app.screen.do("type", "--delay", "30", "--", "290,290,159.5,89.5")
        app.screen.do("key", "Return")
        app.see(lambda state: state.record["camera"]["source"] == "user")
        assert app.settle().extent[:2] == pytest.approx([319 / 290, 179 / 290], rel=0.02)
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_a_missing_scan_with_bookmarks_is_located(screen: Screen, tmp_path: Path, takes: Path) -> None:
    with running_app(screen, tmp_path, takes) as app:
        app.press("Escape", "ctrl+b")
        wait_until_stored(tmp_path, takes, app.settle())
    (tmp_path / "moved").mkdir()
    shutil.move(takes, tmp_path / "moved" / "takes")
    with running_app(screen, tmp_path, "demo") as app:
        app.press("ctrl+o", "Tab")
        app.screen.do("type", "--delay", 15, takes)
        app.settle()
        app.press("Return")
        app.told("cannot find the scan")
        app.settle()
        app.act("problems", ("item_click", "$$0/Locate scan..."))
        app.see(is_browser_open=True)
        app.settle()
        app.press("Tab")
        app.screen.do("type", "--delay", 15, tmp_path / "moved" / "takes")
        app.settle()
        app.press("Return", "Return")
        app.see(lambda state: state.document["bookmarks"], scan=str(tmp_path / "moved" / "takes"))
    assert "Traceback" not in app.log()
