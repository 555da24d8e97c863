"""The panel's section on how Scan4D read the scan."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from virtual_screen import PANEL, PATIENCE, RunningApp, Screen, running_app, stored_of

from viewer import cli
from viewer.app.panel.reading import _AUTOMATIC, as_text, choices, explanation, other_facts, words_on_assumed
from viewer.document.document import Document
from viewer.document.saved_session import SavedSession
from viewer.scan.open import open_scan
from viewer.scan.points import ORIENTATIONS
from viewer.scan.reading.record import Aside, Decision, Reading, Take, words_of_value


def test_an_assumption_is_explained_with_its_alternatives() -> None:
    decision = Decision("unit", "units", "assumed", "", "The file states none", ("mm", "m"), True)
    lines = explanation(decision)
    assert lines[0] == "not known"
    assert "Source: assumed" in lines
    assert "The file states none" in lines
    assert [line for line in lines if "your measurements may be wrong" in line]
    assert lines[-1].endswith("for example: mm, m")
    assert len(explanation(Decision("format", "PLY"))) == 2


@pytest.mark.slow
def test_the_section_shows_every_decision(screen: Screen, tmp_path: Path) -> None:
    (tmp_path / "points.xyz").write_text("".join(f"{i % 9} {i // 9} {i % 4} {i}\n" for i in range(80)))
    with running_app(screen, tmp_path, tmp_path / "points.xyz") as app:
        before = screen.picture()
        app.act(PANEL, ("item_open", "How this was read"))
        app.settle()
        after = screen.picture()
        assert (before != after).any()
    assert "Traceback" not in app.log()


def test_a_list_offers_the_alternatives_first_and_no_value_twice() -> None:
    columns = Decision("columns", ["x", "y", "z"], "assumed", "", "", ("x y z r g b",), True)
    assert choices(columns, Reading()) == ["x y z r g b"]
    take = Decision("take", "anna", "assumed", "", "", ("bert", "all"))
    record = Reading(takes=(Take("anna", "anna*", 2), Take("bert", "bert*", 2)))
    assert choices(take, record) == ["bert", "all"]
    assert choices(Decision("normals", "stored"), Reading()) == ["none"]


def test_the_list_of_normal_orientations_begins_all_names_alike() -> None:
    decision = Decision("orientation", "quick", "assumed", alternatives=ORIENTATIONS[1:])
    texts = choices(decision, Reading())
    assert set(texts) == set(ORIENTATIONS) - {"auto", "quick"}
    names = [words_of_value("orientation", text) for text in texts]
    assert names == ["Fine", *(f"{name}, flipped" for name in (_AUTOMATIC, "Quick", "Fine"))]
    assert words_of_value("orientation", "auto") == _AUTOMATIC


def test_values_are_shown_in_words_and_typed_as_the_command_line_takes_them() -> None:
    for decision, words, text in (
        (Decision("times", "fps:25", "assumed"), "25 frames per second", "fps:25"),
        (Decision("times", "stored"), "stored", "stored"),
        (Decision("decimal", ","), "comma", ","),
        (Decision("columns", ["x", "y", "z"]), "x y z", "x y z"),
        (Decision("frames", "3 files, a.ply to c.ply", "folder"), "3 files, a.ply to c.ply", "*"),
        (Decision("frames", "a.ply;b.ply", "user", "--read"), "a.ply;b.ply", "a.ply;b.ply"),
        (Decision("normals", "dropped"), "dropped", ""),
        (
            Decision("camera", {"fx": 290.0, "fy": 291.0, "cx": 1.5, "cy": 2.5, "kind": "z"}),
            "fx 290, fy 291, cx 1.5, cy 2.5",
            "290,291,1.5,2.5",
        ),
    ):
        assert (decision.shown, as_text(decision)) == (words, text)


def test_many_files_left_aside_are_a_few_facts() -> None:
    takes = tuple(Aside(f"bert_{i}.ply", "another take: bert") for i in range(900))
    copies = tuple(Aside(f"a{i} - Copy.ply", f"copy of a{i}.ply") for i in range(9))
    facts = other_facts(Reading(aside=takes + copies))
    assert [fact.text for fact in facts] == [
        "900 files (another take: bert)",
        "a0 - Copy.ply (copy of a0.ply)",
        "a1 - Copy.ply (copy of a1.ply)",
        "and 7 more",
    ]
    assert facts[0].help.splitlines()[-1] == "and 880 more"
    assert len(facts[-1].help.splitlines()) == 7


def test_only_assumptions_that_change_numbers_are_marked() -> None:
    assert words_on_assumed(Reading.of(Decision("axes", "unknown", "assumed"))) == ""
    unit = Decision("unit", "units", "assumed", changes_numbers=True)
    assert "unit not known" in words_on_assumed(Reading.of(unit))


@pytest.fixture
def depth_folder(tmp_path: Path) -> Path:
    """Two depth pictures, 40 x 30, of a wall at 1 m, whose camera nothing states."""
    from PIL import Image

    folder = tmp_path / "wall"
    (folder / "depth").mkdir(parents=True)
    for number in range(2):
        depth = np.full((30, 40), 1000, np.uint16)
        Image.fromarray(depth).save(folder / "depth" / f"{number}.png")
    return folder


@pytest.fixture
def table(tmp_path: Path) -> Path:
    """Four columns without names: the last three are the positions, which nothing says."""
    rows = np.random.default_rng(0).uniform(0, (1, 2, 3, 4), (300, 4))
    np.savetxt(tmp_path / "points.txt", rows)
    return tmp_path / "points.txt"


@pytest.mark.slow
def test_unnamed_columns_are_corrected_undone_and_stored(screen: Screen, tmp_path: Path, table: Path) -> None:
    with running_app(screen, tmp_path, table) as app:
        assert app.settle().extent == pytest.approx([1, 2, 3], rel=0.1)
        app.act(PANEL, ("item_open", "How this was read"))
        type_into(app, "columns", "- x y z")
        corrected = app.see(lambda state: state.extent and state.extent[0] > 1.5)
        assert corrected.extent == pytest.approx([2, 3, 4], rel=0.1)
        assert corrected.record["columns"]["source"] == "user"
        app.screen.do("key", "ctrl+z")
        app.see(lambda state: state.extent[0] < 1.5)
        assert app.settle().document["reading"] == {}
        app.screen.do("key", "ctrl+y")
        app.see(lambda state: state.extent[0] > 1.5)
        app.settle()
        app.screen.do("key", "ctrl+q")
        app.process.wait(PATIENCE)
    assert stored_of(tmp_path, table).document.reading == {"columns": "- x y z"}
    with running_app(screen, tmp_path, table) as app:
        assert app.settle().extent == pytest.approx([2, 3, 4], rel=0.1)
        app.act(PANEL, ("item_click", "How this was read/columns/\uf0e2"))
        app.see(lambda state: state.extent[0] < 1.5)


def type_into(app: RunningApp, key: str, text: str) -> None:
    """Choose "Other..." in the list of a decision, and type a value."""
    app.choose(PANEL, f"How this was read/{key}/##value", "Other...")
    app.settle()
    app.screen.do("key", "ctrl+a")
    app.screen.do("type", "--delay", "30", "--", text)
    app.screen.do("key", "Return")


@pytest.mark.slow
def test_a_camera_is_corrected_and_one_that_fails_is_taken_back(
    screen: Screen, tmp_path: Path, depth_folder: Path
) -> None:
    with running_app(screen, tmp_path, depth_folder) as app:
        before = app.settle()
        app.act(PANEL, ("item_open", "How this was read"))
        picture = screen.picture()
        type_into(app, "camera", "20,20,19.5,14.5")
        state = app.see(lambda state: state.record["camera"]["source"] == "user")
        assert app.settle().extent[:2] == pytest.approx([39 / 20, 29 / 20], rel=0.02)
        assert state.extent != before.extent
        assert (screen.picture() != picture).any()
        type_into(app, "camera", "none.txt")
        app.see(lambda state: any("with this correction" in note for note in state.shown_notes))
        after = app.settle()
        assert after.document["reading"] == {"camera": "20,20,19.5,14.5"}
        assert after.extent == state.extent
        assert "Traceback" not in app.log()


@pytest.mark.slow
def test_columns_are_corrected_with_the_keyboard_alone(screen: Screen, tmp_path: Path, table: Path) -> None:
    with running_app(screen, tmp_path, table) as app:
        app.press("F6", "Home", "Return", "Tab", "Return")  # closes the section Scan, opens the next one
        app.press(
            *["Tab"] * 6, "Return"
        )  # the button, encoding, separator, decimal mark, lines to skip, columns
        assert app.settle().lists == 1
        app.press("End", "Return")  # "Other..."
        app.screen.do("key", "ctrl+a", "type", "--delay", "30", "--", "- x y z")
        app.screen.do("key", "Return")
        app.see(lambda state: state.extent[0] > 1.5)
        assert app.settle().undoes == "Correct the columns"
        app.press("ctrl+z")
        app.see(lambda state: state.extent[0] < 1.5)


@pytest.mark.slow
def test_a_replay_reads_the_scan_as_its_picture_did(screen: Screen, tmp_path: Path, table: Path) -> None:
    picture = tmp_path / "corrected.png"
    small = ("--size", "64x48", "--backend", "points")
    assert cli.main(["render", str(table), *small, "--read", "columns=- x y z", "-o", str(picture)]) == 0
    with running_app(screen, tmp_path, table) as app:
        assert app.settle().extent[0] < 1.5
        app.drop(picture)
        app.see(lambda state: state.extent[0] > 1.5)
        app.see(is_replaying=False)
        assert app.settle().document["reading"] == {"columns": "- x y z"}
        app.screen.do("key", "ctrl+z")
        app.see(lambda state: state.extent[0] < 1.5)


@pytest.fixture
def sequence(tmp_path: Path) -> Path:
    """Four frames of a surface, as tables whose last three columns are the positions."""
    x, y = (side.ravel() for side in np.meshgrid(np.linspace(0, 2, 20), np.linspace(0, 3, 20)))
    folder = tmp_path / "frames"
    folder.mkdir()
    for number in range(4):
        z = 0.3 * np.sin(x + y + 0.1 * number)
        rows = np.stack([0.5 * np.sin(5 * x), x, y, z], axis=1)
        np.savetxt(folder / f"f{number}.txt", np.random.default_rng(7).permutation(rows))
    return folder


@pytest.mark.slow
def test_the_work_on_a_scan_survives_corrections_and_their_undo(
    screen: Screen, tmp_path: Path, sequence: Path
) -> None:
    """The frames become fewer than those that the work is on, and a correction fails."""
    with running_app(screen, tmp_path, sequence) as app:
        app.act(PANEL, ("item_open", "How this was read"))
        type_into(app, "columns", "- x y z")
        app.see(lambda state: state.extent and state.extent[0] > 1.9)
        app.settle()
        app.press("End", "ctrl+b", "m")
        left, top, width, height = app.view()
        for right in (0, 60):
            app.do(("mousemove", left + width // 2 + right, top + height // 2, "click", 1))
            app.settle()
        app.press("Escape")
        work = app.see(lambda state: state.distances and not state.works)
        type_into(app, "frames", "f0.txt;f1.txt")
        app.see(lambda state: state.record["frames"]["source"] == "user")
        for state in (app.settle(), app.press("ctrl+z"), app.press("ctrl+y")):
            assert state.document["bookmarks"] == work.document["bookmarks"]
            assert state.document["parts"] == work.document["parts"]
        type_into(app, "frames", "gone.txt")
        app.told("with this correction, and removes the correction: no file matches")
        state = app.settle()
        assert state.document["reading"] == {"columns": "- x y z", "frames": "f0.txt;f1.txt"}
        assert state.document["parts"] == work.document["parts"]
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_corrections_in_a_row_while_it_plays_all_apply_and_fit_the_view(
    screen: Screen, tmp_path: Path, sequence: Path
) -> None:
    with running_app(screen, tmp_path, sequence) as app:
        app.settle()
        app.act(PANEL, ("item_open", "How this was read"))
        app.screen.do("key", "space")
        app.see(is_playing=True)
        app.choose(PANEL, "How this was read/columns/##value", "Other...")
        app.take_in()
        app.take_in()
        app.screen.do("key", "ctrl+a", "type", "--delay", "30", "--", "- x y z")
        app.screen.do("key", "Return")
        app.choose(PANEL, "How this was read/times/##value", "###fps:50")
        app.choose(PANEL, "How this was read/axes/##value", "###RAS")
        app.see(lambda state: state.record["axes"]["source"] == "user")
        state = app.settle()
        assert state.document["reading"] == {"columns": "- x y z", "times": "fps:50", "axes": "RAS"}
        assert state.camera["target"][:2] == pytest.approx([1, 1.5], rel=0.1)
        assert state.scan_rate == 50
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_a_correction_is_stored_though_another_scan_opens_at_once(
    screen: Screen, tmp_path: Path, sequence: Path, table: Path
) -> None:
    with running_app(screen, tmp_path, sequence) as app:
        app.settle()
        app.act(PANEL, ("item_open", "How this was read"))
        app.choose(PANEL, "How this was read/axes/##value", "###RAS")
        app.drop(table)
        app.see(scan=str(table))
        assert app.settle().document["reading"] == {}
        app.drop(sequence)
        app.see(scan=str(sequence))
        assert app.settle().record["axes"]["value"] == "RAS"
        record = app.state.record
        app.screen.do("key", "ctrl+q")
        app.process.wait(PATIENCE)
    with running_app(screen, tmp_path, sequence) as app:
        assert app.settle().record == record
    assert "Traceback" not in app.log()


def test_the_command_line_reads_as_the_window_does(tmp_path: Path, sequence: Path) -> None:
    """A correction in a stored document, and the same as `--read`."""
    texts = {"columns": "- x y z", "times": "fps:50", "axes": "RAS"}
    stated = open_scan(sequence, read=texts)
    document = Document(reading=texts)
    saved = SavedSession.from_json(SavedSession(str(sequence), None, 0, document).to_json(), "x")
    stored = open_scan(sequence, read=saved.document.reading)
    for timeline in (stated, stored):
        timeline.pose(0)
    assert stored.reading == stated.reading


@pytest.mark.slow
def test_normals_are_turned_round_and_the_record_says_how_they_were_found(
    screen: Screen, tmp_path: Path
) -> None:
    points = np.random.default_rng(0).normal(size=(600, 3))
    ball = tmp_path / "ball.xyz"
    np.savetxt(ball, points / np.linalg.norm(points, axis=1, keepdims=True))
    with running_app(screen, tmp_path, ball) as app:
        while app.settle().backend != "surfels":
            app.screen.do("key", "b")
        found = app.see(lambda state: state.record["orientation"]["value"] == "quick")
        assert "doubtful" in found.record["orientation"]["why"]
        app.act(PANEL, ("item_open", "How this was read"))
        app.choose(PANEL, "How this was read/orientation/##value", "###auto-flipped")
        app.see(lambda state: state.record["orientation"]["source"] == "user")
        stated = app.see(lambda state: "doubtful" in state.record["orientation"]["why"])
        assert stated.undoes == "Correct the normal orientation"
        app.screen.do("key", "ctrl+z")
        app.see(lambda state: state.record["orientation"]["source"] == "assumed")
        app.settle()
        app.screen.do("key", "ctrl+y")
        app.see(lambda state: state.record["orientation"]["value"] == "auto-flipped")
        app.settle()
        app.screen.do("key", "ctrl+q")
        app.process.wait(PATIENCE)
    assert stored_of(tmp_path, ball).document.reading == {"orientation": "auto-flipped"}
    assert "Traceback" not in app.log()
