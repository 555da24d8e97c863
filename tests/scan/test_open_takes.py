"""Opening folders of several takes, of copies, and of names that are times."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viewer.errors import InputError
from viewer.scan.listing import list_folder
from viewer.scan.open import open_scan
from viewer.scan.timeline import Timeline

SUFFIXES = ["npy", "xyz"]


def written(folder: Path, *stems: str, suffix: str = "npy") -> Path:
    for number, stem in enumerate(stems):
        points = np.eye(3) + number
        if suffix == "npy":
            np.save(folder / f"{stem}.npy", points)
        else:
            np.savetxt(folder / f"{stem}.{suffix}", points)
    return folder


def labels(timeline: Timeline) -> list[str]:
    return [timeline.label(index) for index in range(len(timeline))]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_the_first_take_opens_and_the_others_are_reported(suffix: str, tmp_path: Path) -> None:
    written(tmp_path, "anna_1", "anna_2", "bert_1", "bert_2", "bert_3", suffix=suffix)
    with open_scan(tmp_path) as timeline:
        assert labels(timeline) == [f"anna_1.{suffix}", f"anna_2.{suffix}"]
        timeline.pose(0)
        (message,) = [one.text for one in timeline.messages if one.kind == "take"]
        assert "bert_" in message
        assert not [one for one in timeline.messages if one.kind == "beside"], "they are reported once"
        assert [(take.name, take.frames) for take in timeline.reading.takes] == [("anna", 2), ("bert", 3)]
        assert {row.file for row in timeline.reading.aside} == {f"bert_{n}.{suffix}" for n in (1, 2, 3)}
    with open_scan(tmp_path, take="bert") as timeline:
        assert len(timeline) == 3
    with open_scan(tmp_path, take="all") as timeline:
        assert len(timeline) == 5
    with pytest.raises(InputError, match="anna, bert"):
        open_scan(tmp_path, take="carl")


def test_takes_in_folders_of_a_pattern(tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        written(tmp_path / name, "f1", "f2")
    with open_scan(f"{tmp_path}/*/f*.npy", take="two") as timeline:
        assert labels(timeline) == ["f1.npy", "f2.npy"]
        assert timeline.files[0].parent.name == "two"


def test_a_pattern_of_one_take_opens_it(tmp_path: Path) -> None:
    written(tmp_path, "anna_1", "anna_2", "bert_1", "bert_2")
    with open_scan(f"{tmp_path}/bert_*.npy") as timeline:
        assert labels(timeline) == ["bert_1.npy", "bert_2.npy"]
        assert timeline.reading.takes == ()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_copies_and_a_reference_are_left_aside_and_can_be_used(suffix: str, tmp_path: Path) -> None:
    written(tmp_path, "f1", "f2", "f3", "f2 (1)", "mean", suffix=suffix)
    with open_scan(tmp_path) as timeline:
        assert len(timeline) == 3
        timeline.pose(0)
        assert [one.kind for one in timeline.messages] == ["aside"]
    with open_scan(tmp_path, read={"frames": "*"}) as timeline:
        assert len(timeline) == 5
    assert list_folder(tmp_path)[0].frames == 3, "as many as open"


def test_negative_numbers_come_first(tmp_path: Path) -> None:
    with open_scan(written(tmp_path, "f0", "f-1", "f1", "f-2")) as timeline:
        assert labels(timeline) == ["f-2.npy", "f-1.npy", "f0.npy", "f1.npy"]
        assert timeline.times == pytest.approx([0, 0.04, 0.08, 0.12])


@pytest.mark.parametrize(
    ("stems", "seconds", "source"),
    [
        (["1716383012345678", "1716383012378678"], [0, 0.033], "folder"),
        (["12-30-01", "12-30-02"], [0, 1], "folder"),
        (["0.040", "0.080"], [0, 0.04], "folder"),
        (["20240501", "20240601"], [0, 0.04], "assumed"),
        (["7", "9"], [0, 0.08], "assumed"),
    ],
)
def test_names_that_are_times(stems: list[str], seconds: list[float], source: str, tmp_path: Path) -> None:
    written(tmp_path, *stems)
    with open_scan(tmp_path) as timeline:
        assert timeline.times == pytest.approx(seconds, abs=1e-6)
        assert timeline.reading["times"].source == source
        assert timeline.reading["times"].is_marked == (source == "assumed")
    with open_scan(tmp_path, fps=10) as timeline:
        assert timeline.reading["times"].source == "user"
    with open_scan(tmp_path, read={"times": "index"}) as timeline:
        assert timeline.times == pytest.approx([0, 0.04])


def test_times_that_a_user_states_outweigh_a_table(tmp_path: Path) -> None:
    written(tmp_path, "f1", "f2")
    (tmp_path / "times.csv").write_text("0,0\n1,5\n")
    with open_scan(tmp_path) as timeline:
        assert timeline.reading["times"].where == "times.csv"
    with open_scan(tmp_path, read={"times": "fps:50"}) as timeline:
        assert timeline.times == pytest.approx([0, 0.02])
        assert not timeline.is_measured
