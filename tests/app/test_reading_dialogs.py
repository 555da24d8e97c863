"""What the dialogs of tables and of folders make of the user's choices, without a window."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viewer.app.files.frames_dialog import FrameChoices, files_of_scan
from viewer.app.files.table_dialog import TableChoices, is_table
from viewer.errors import InputError
from viewer.scan.open import open_scan


def read(choices: TableChoices) -> TableChoices:
    """The same, once the table was read."""
    assert choices._reading is not None
    choices._reading.exception()
    choices.advance()
    return choices


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "points.csv"
    path.write_text("".join(f"{i},{i % 9}.5,{i // 9}.25,{i % 4}\n" for i in range(80)))
    return path


@pytest.fixture
def takes(tmp_path: Path) -> Path:
    folder = tmp_path / "takes"
    folder.mkdir()
    for take, count in (("anna", 3), ("bert", 2)):
        for number in range(count):
            np.save(folder / f"{take}_{number}.npy", np.random.default_rng(number).random((50, 3)))
    return folder


def test_a_role_for_each_column_becomes_a_correction_that_opens(table: Path) -> None:
    choices = read(TableChoices(table, {}))
    assert choices.roles == ["number", "x", "y", "z"]
    assert choices.can_open
    assert choices.corrections == {}
    choices.state_role(0, "x")  # so that no column is x twice
    assert read(choices).can_open
    assert choices.corrections == {"columns": "x - y z"}
    pose = open_scan(table, read=choices.corrections).pose(0)
    assert (pose.origin + pose.cloud.positions)[:, 0].max() == 79


def test_roles_that_lack_an_axis_cannot_open_and_say_why(table: Path) -> None:
    choices = read(TableChoices(table, {}))
    choices.state_role(1, "-")
    read(choices)
    assert not choices.can_open
    assert choices.problem == "Choose a column for x."
    assert choices.shown is not None
    assert choices.shown.cells, "the rows stay"
    choices.reset()
    assert read(choices).can_open


def test_another_separator_takes_the_roles_with_it(table: Path) -> None:
    choices = read(TableChoices(table, {"columns": "x y z -"}))
    assert choices.roles == ["x", "y", "z", "-"]
    choices.state("separator", "semicolon")
    assert not read(choices).can_open
    assert choices.corrections == {"columns": "", "separator": "semicolon"}
    choices.state("separator", "")
    assert read(choices).corrections == {"columns": ""}, "an empty text ends what held before"


def test_lines_above_the_rows_are_skipped(tmp_path: Path) -> None:
    path = tmp_path / "points.txt"
    path.write_text("7 7 7\n" + "".join(f"{i % 9} {i // 9} {i % 4}\n" for i in range(40)))
    choices = read(TableChoices(path, {}))
    choices.state("skip", "1")
    read(choices)
    assert choices.shown is not None
    assert choices.shown.cells[0] == ("0", "0", "0")
    assert open_scan(path, read=choices.corrections).pose(0).count == 40


def test_a_refused_table_shows_its_columns_and_opens_with_roles(tmp_path: Path) -> None:
    path = tmp_path / "odd.csv"
    path.write_text("u,v,w\n" + "".join(f"{i % 9},{i // 9},{i % 4}\n" for i in range(80)))
    choices = read(TableChoices(path, {}))
    assert "neither numbers nor the names x, y and z" in choices.problem
    assert choices.problem.endswith("Choose a column for x, y and z.")
    assert choices.roles == ["-", "-", "-"]
    for column, role in enumerate("xyz"):
        choices.state_role(column, role)
        assert read(choices).can_open == (role == "z")
    assert choices.names == ["u", "v", "w"]
    assert choices.summary == "Scan4D reads x, y, z. You change: columns."
    assert open_scan(path, read=choices.corrections).pose(0).count == 80


def test_tables_are_known_by_their_names() -> None:
    assert is_table("a.CSV")
    assert is_table(Path("b.txt"))
    assert not is_table("c.ply")


def names_of(choices: FrameChoices) -> list[str]:
    return [row.name for row in choices.rows if row.name in choices.used]


def test_a_take_becomes_a_correction(takes: Path) -> None:
    found = files_of_scan(open_scan(takes))
    assert found is not None
    choices = FrameChoices(*found, {})
    assert choices.takes == {"anna": "anna (3)", "bert": "bert (2)", "all": "all, as one scan"}
    assert choices.take == "anna"
    assert names_of(choices) == ["anna_0.npy", "anna_1.npy", "anna_2.npy"]
    choices.state_take("bert")
    assert choices.corrections == {"take": "bert"}
    assert names_of(choices) == ["bert_0.npy", "bert_1.npy"]
    choices.state_take("all")
    assert len(choices.used) == 5


def test_chosen_files_play_in_the_order_of_the_rows(takes: Path) -> None:
    found = files_of_scan(open_scan(takes))
    assert found is not None
    choices = FrameChoices(*found, {"take": "anna"})
    choices.use("bert_1.npy", True)
    choices.use("anna_1.npy", False)
    at = [row.name for row in choices.rows].index("anna_2.npy")
    choices.move(at, -1)  # past anna_1, which is no frame
    assert choices.rows[0].name == "anna_2.npy"
    choices.move(0, -1)
    wanted = ["anna_2.npy", "anna_0.npy", "bert_1.npy"]
    assert names_of(choices) == wanted
    assert choices.take == ""
    assert set(choices.takes) == {"anna", "bert", "all"}
    assert choices.corrections["take"] == ""
    texts = {key: text for key, text in choices.corrections.items() if text}
    timeline = open_scan(takes, read=texts)
    assert [file.name for file in timeline.files] == wanted
    assert (np.diff(timeline.times) > 0).all()
    again = files_of_scan(timeline)
    assert again is not None
    assert names_of(FrameChoices(*again, texts)) == wanted, "the dialog shows what holds"


def test_at_least_one_file_plays(takes: Path) -> None:
    choices = FrameChoices(takes, ["anna_0.npy", "anna_1.npy"], {})
    choices.use("anna_0.npy", False)
    assert not choices.problem
    assert len(open_scan(takes, read=choices.corrections)) == 1
    choices.use("anna_1.npy", False)
    assert "at least one" in choices.problem
    choices.reset()
    assert not choices.problem
    assert len(choices.used) == 2


def test_several_files_are_chosen_at_once(takes: Path) -> None:
    names = sorted(path.name for path in takes.iterdir())
    choices = FrameChoices(takes, names, {})
    choices.use("anna_1.npy", False)
    choices.use("bert_0.npy", False, reaches=True)
    assert names_of(choices) == ["anna_0.npy"]
    choices.use_all(True)
    assert names_of(choices) == names
    choices.use_all(False)
    assert "at least one" in choices.problem
    choices.use("bert_1.npy", True)
    assert not choices.problem


def test_the_dialog_shows_the_times_that_scan4d_finds(takes: Path) -> None:
    names = [f"anna_{number}.npy" for number in range(3)]
    choices = FrameChoices(takes, names, {})
    assert choices.time_titles[""] == "automatic: 25 frames per second, assumed"
    assert choices.summary == "3 of 3 files are frames of the scan, from 0 to 0.08 s. No changes."
    choices.state_times("fps:10")
    assert choices.time_titles[""] == "automatic: 25 frames per second, assumed"
    assert choices.summary.endswith("from 0 to 0.2 s. You change: times.")


def test_a_table_of_times_that_is_broken_is_shown_as_a_problem(takes: Path) -> None:
    (takes / "times.csv").write_text("nothing;here\n")
    choices = FrameChoices(takes, ["anna_0.npy", "anna_1.npy"], {"times": "fps:10"})
    assert not choices.problem
    choices.state_times("")
    assert "times.csv" in choices.problem
    choices.state_times("index")
    assert not choices.problem


def test_too_many_lines_to_skip_are_a_problem(table: Path) -> None:
    choices = read(TableChoices(table, {"skip": "99999999"}))
    assert "not a possible value of skip" in choices.problem
    assert not choices.can_open
    choices.state("skip", "500")
    assert not read(choices).can_open
    choices.state("skip", "0")
    assert read(choices).can_open


def test_times_become_a_correction(takes: Path) -> None:
    choices = FrameChoices(takes, ["anna_0.npy", "anna_1.npy", "anna_2.npy"], {})
    assert choices.times == ""
    choices.state_times("fps:10")
    assert choices.times == "fps"
    assert choices.rate == 10
    assert [row.time for row in choices.rows] == pytest.approx([0, 0.1, 0.2])
    choices.state_times("gone.csv")
    assert "gone.csv" in choices.problem
    choices.state_times("")
    assert not choices.problem
    assert choices.corrections == {}


def test_a_listed_file_that_is_missing_is_refused(takes: Path) -> None:
    with pytest.raises(InputError, match=r"no file 'gone\.npy'"):
        open_scan(takes, read={"frames": "gone.npy;anna_0.npy"})
    with pytest.raises(InputError, match="the list of frames is empty"):
        open_scan(takes, read={"frames": ";"})
