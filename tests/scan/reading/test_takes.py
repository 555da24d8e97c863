"""Several takes in a folder: how names split, which one opens, and the rows of the folder dialog."""

from __future__ import annotations

from pathlib import Path

import pytest

from viewer.errors import InputError
from viewer.scan.reading.corrections import Corrections
from viewer.scan.reading.takes import decide, message_of_takes, split, take_names, takes_in

TAKES = [f"take{take}_frame00{frame}.ply" for take in (1, 2) for frame in (1, 2, 3)]


@pytest.mark.parametrize(
    ("patterns", "names"),
    [
        (["take1_frame*.ply", "take2_frame*.ply"], ["take1", "take2"]),
        (["anna_*.ply", "bert_*.ply"], ["anna", "bert"]),
        (["f*_left.tif", "f*_right.tif"], ["left", "right"]),
        (["study/anna/f*.ply", "study/anne/f*.ply"], ["anna", "anne"]),
        (["smile.*.ply", "smile2.*.ply"], ["smile", "smile2"]),
        (["*.ply", "a*.ply"], ["*.ply", "a*.ply"]),
    ],
)
def test_a_take_is_named_by_what_differs(patterns: list[str], names: list[str]) -> None:
    assert take_names(patterns) == names


@pytest.mark.parametrize(
    "names",
    [
        ["f001.ply", "f002.ply", "f006.ply"],
        ["f-2.ply", "f-1.ply", "f0.ply", "f1.ply"],  # signs
        ["a_1.ply", "a_2.ply", "b_3.ply", "b_4.ply"],  # counts on
        ["a_1.ply", "a_2.ply", "b_1.ply"],
        ["2024-05-01.ply", "2024-05-02.ply", "2024-06-01.ply", "2024-06-02.ply"],
        ["12-30-01.ply", "12-30-02.ply", "12-31-01.ply", "12-31-02.ply"],
        ["0.01.ply", "0.02.ply", "1.01.ply", "1.02.ply"],
        ["smile.ply", "frown.ply", "rest.ply"],
        ["099.ply", "100.ply", "9.ply"],
    ],
)
def test_frames_of_one_scan_are_not_split(names: list[str]) -> None:
    assert takes_in(names) == {}
    assert decide(names).decision.value is None


def test_takes_have_numbers_in_common() -> None:
    found = takes_in(["b_2.ply", "a_1.ply", "b_1.ply", "a_2.ply", "a_10.ply"])
    assert found == {"a_*.ply": ["a_1.ply", "a_2.ply", "a_10.ply"], "b_*.ply": ["b_1.ply", "b_2.ply"]}


def test_cameras_and_times_since_1970_make_takes() -> None:
    cameras = [f"f{frame}_cam{camera}.ply" for frame in (1, 2, 3) for camera in (0, 1)]
    found = takes_in(cameras)
    assert [*found] == ["f*_cam0.ply", "f*_cam1.ply"]
    assert found["f*_cam0.ply"] == ["f1_cam0.ply", "f2_cam0.ply", "f3_cam0.ply"]
    assert len(takes_in([f"{take}_{1716383012310 + at}.ply" for at, take in enumerate("aaabbb")])) == 2
    clocks = [f"20240501_{clock}_00{frame}.ply" for clock in (123001, 140000) for frame in (1, 2, 3)]
    assert [*takes_in(clocks)] == ["20240501_123001_*.ply", "20240501_140000_*.ply"]


def test_the_first_take_opens_and_the_message_names_all() -> None:
    takes = decide(TAKES)
    assert takes.names == TAKES[:3]
    assert (takes.decision.value, takes.decision.source) == ("take1", "assumed")
    assert takes.decision.alternatives == ("take2", "all")
    assert [row.file for row in takes.aside] == TAKES[3:]
    assert all(
        words in message_of_takes(takes)
        for words in ("take1_frame*.ply (3)", "take2_frame*.ply (3)", "--take")
    )


@pytest.mark.parametrize("wanted", ["take2", "take2_", "take2_frame*.ply"])
def test_a_user_chooses_a_take(wanted: str) -> None:
    takes = decide(TAKES, Corrections.parse({"take": wanted}))
    assert takes.names == TAKES[3:]
    assert takes.decision.source == "user"
    assert message_of_takes(takes) == ""


def test_a_user_plays_all() -> None:
    takes = decide(TAKES, Corrections.parse({"take": "all"}))
    assert (takes.names, takes.aside, len(takes.takes)) == (TAKES, (), 2)


@pytest.mark.parametrize("wanted", ["take3", "take"])
def test_a_take_that_is_not_there_is_refused(wanted: str) -> None:
    with pytest.raises(InputError, match="take1, take2"):
        decide(TAKES, Corrections.parse({"take": wanted}))
    with pytest.raises(InputError, match="one scan"):
        decide(TAKES[:3], Corrections.parse({"take": wanted}))


def test_the_rows_of_the_folder_dialog(tmp_path: Path) -> None:
    found = split(tmp_path, [*TAKES, "take1_frame002 - Copy.ply"])
    rows = {row.name: row for row in found.files}
    assert [take.name for take in found.takes] == ["take1", "take2"]
    assert rows["take1_frame003.ply"] == ("take1_frame003.ply", "take1", 3, pytest.approx(0.08), True, "")
    assert rows["take2_frame001.ply"] == (
        "take2_frame001.ply",
        "take2",
        1,
        None,
        False,
        "another take: take2",
    )
    copy = rows["take1_frame002 - Copy.ply"]
    assert (copy.take, copy.is_used, copy.why) == ("", False, "copy of take1_frame002.ply")
    chosen = split(tmp_path, TAKES, Corrections.parse({"take": "take2"}))
    assert [row.is_used for row in chosen.files] == [False] * 3 + [True] * 3
