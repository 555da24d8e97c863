"""Which files of a folder are frames."""

from __future__ import annotations

import pytest

from viewer.errors import InputError
from viewer.scan.reading.corrections import Corrections
from viewer.scan.reading.frames import decide, is_no_scan, message_of_files

FRAMES = ["f001.ply", "f002.ply", "f003.ply"]


@pytest.mark.parametrize(
    "copy",
    [
        "f002 (1).ply", "f002(2).ply", "f002 - Copy.ply", "f002 - Copy (2).ply", "f002 - Kopie.ply",
        "f002 copy.ply", "f002 copie.ply", "f002_copy.ply", "Copy of f002.ply", "Kopie von f002.ply",
        "f002 (PC-7's conflicted copy 2024-05-01).ply", "f002 (Konfliktkopie).ply",
        "f002.sync-conflict-20240501-123456-ABCDEFG.ply", "f002~.ply", "f002.bak.ply",
        "f002_old.ply", "f002 backup.ply", "f002-DESKTOP-AB12C.ply", "f002-PC7.ply",
    ],
)  # fmt: skip
def test_a_copy_is_left_aside(copy: str) -> None:
    found = decide([*FRAMES, copy])
    assert found.names == FRAMES
    assert [(row.file, row.why) for row in found.aside] == [(copy, "copy of f002.ply")]
    assert (found.decision.source, found.decision.alternatives) == ("assumed", ("*",))
    assert copy in message_of_files(found)


@pytest.mark.parametrize(
    "names",
    [
        ["scan (1).ply", "scan (2).ply", "scan (3).ply"],  # as Windows numbers
        ["scan (1).ply", "scan (2).ply", "scan.ply"],
        ["f001.ply", "f002 - Copy.ply", "f003.ply"],  # nothing else is frame 2
        ["smile.ply", "frown.ply", "rest.ply", "open.ply"],
        ["f001.ply", "f002.ply", "reference.ply"],  # two frames are no pattern
        ["f1.ply", "f2.ply", "f3.ply", "a.ply", "b.ply", "c.ply"],
        ["take1_1.ply", "take1_2.ply", "take1_3.ply", "take2_1.ply"],
    ],
)
def test_other_names_are_frames(names: list[str]) -> None:
    found = decide(names)
    assert sorted(found.names) == sorted(names)
    assert found.aside == ()
    assert message_of_files(found) == ""


@pytest.mark.parametrize(
    "name",
    ["reference.ply", "mean.ply", "template.ply", "a.ply", "mean2.ply", "neutral_000.ply", "f001-003.ply"],
)
def test_a_file_without_a_number_among_numbered_ones_is_no_frame(name: str) -> None:
    found = decide([name, *FRAMES])
    assert found.names == FRAMES
    assert [(row.file, row.why) for row in found.aside] == [(name, "reference")]


def test_references_beside_several_takes_are_no_frames() -> None:
    takes = [f"{take}_{frame}.ply" for take in "ab" for frame in (1, 2, 3)]
    found = decide([*takes, "reference.ply"])
    assert (found.names, [row.file for row in found.aside]) == (takes, ["reference.ply"])
    named = ["mean.ply", "reference.ply", "template_all.ply"]
    assert sorted(row.file for row in decide([*FRAMES, *named]).aside) == named


@pytest.mark.parametrize("name", [".f1.ply", "._f1.ply", "~$f1.csv", "~f1.ply"])
def test_hidden_files_and_lock_files_are_no_scans(name: str) -> None:
    assert is_no_scan(name)
    assert not is_no_scan(name.lstrip("._~$"))


def test_a_user_chooses_by_a_pattern() -> None:
    names = [*FRAMES, "reference.ply", "f002 (1).ply"]
    found = decide(names, Corrections.parse({"frames": "*"}))
    assert sorted(found.names) == sorted(names)
    found = decide(names, Corrections.parse({"frames": "f00?.ply"}))
    assert found.names == FRAMES
    assert found.decision.source == "user"
    assert message_of_files(found) == ""
    with pytest.raises(InputError, match="no file matches"):
        decide(names, Corrections.parse({"frames": "g*.ply"}))


def test_words_for_arrays_choose_no_files() -> None:
    assert decide(FRAMES, Corrections.parse({"frames": "rows"})).names == FRAMES
