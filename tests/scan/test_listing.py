"""What a folder offers, and what a user's names and drops stand for."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from viewer.errors import InputError
from viewer.scan import formats
from viewer.scan.listing import as_one_scan, list_folder, named_scans, scans_beside
from viewer.scan.open import find_source


def put(folder: Path, *names: str) -> Path:
    """Files by these names that can be scans; none is ever read."""
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        np.save(path, np.eye(3)) if path.suffix == ".npy" else path.write_text("0 0 0\n")
    return folder


def rows(folder: Path) -> list[tuple[str, str, int]]:
    return [(one.kind, Path(one.path).name, one.frames) for one in list_folder(folder)]


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Three subjects as folders, one as two numbered sequences beside each other, and what is no scan."""
    put(tmp_path, "s2/1.npy", "s2/2.npy", "s10/frames/a.npy", "s1/a.npy", "s1/a.ply", "empty/notes.md")
    put(tmp_path, *(f"left_{n:03d}.ply" for n in (1, 2, 3)), "right_9.ply", "right_10.ply", "single.ply")
    return put(tmp_path, "readme.txt", "times.csv", ".hidden.ply", "picture.png")


def test_a_folder_lists_folders_sequences_and_files(study: Path) -> None:
    assert rows(study) == [
        ("whole", study.name, 5),
        ("folder", "empty", 0), ("folder", "s1", 0), ("folder", "s2", 2), ("folder", "s10", 1),
        ("sequence", "left_%03d.ply", 3), ("sequence", "right_%d.ply", 2),
        *(("file", name, 1) for name in (
            "left_001.ply", "left_002.ply", "left_003.ply", "right_9.ply", "right_10.ply", "single.ply",
        )),
    ]  # fmt: skip


def test_all_that_is_listed_as_a_scan_opens_with_so_many_frames(study: Path) -> None:
    for folder in (study, study / "s1", study / "s2"):
        for one in list_folder(folder):
            if one.frames:
                assert len(find_source(one.path)) == one.frames, one


def test_listing_reads_no_file(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("read", "frame_count", "read_times", "read_unit"):
        monkeypatch.setattr(formats, name, lambda *_: pytest.fail("a file was read"))
    list_folder(study)
    scans_beside(str(study / "s2"))


def test_one_sequence_that_is_the_whole_folder_is_listed_once(tmp_path: Path) -> None:
    put(tmp_path, *(f"f{n}.npy" for n in range(3)))
    assert [row[0] for row in rows(tmp_path)] == ["whole", "file", "file", "file"]


def test_a_sequence_whose_numbers_outgrow_their_zeros(tmp_path: Path) -> None:
    put(tmp_path, *(f"f{n:02d}.npy" for n in (8, 9, 10, 100)), "other.npy")
    assert ("sequence", "f%02d.npy", 4) in rows(tmp_path)
    assert len(find_source(tmp_path / "f%02d.npy")) == 4


def test_names_that_a_pattern_cannot_hold_are_files_alone(tmp_path: Path) -> None:
    put(tmp_path, "5%d_1.npy", "5%d_2.npy", "x.npy")
    assert {row[0] for row in rows(tmp_path)} == {"whole", "file"}


def test_a_folder_with_odd_characters(tmp_path: Path) -> None:
    folder = put(tmp_path / "a[1] *?", "f1.npy", "f2.npy", "x.npy")
    (sequence,) = [one for one in list_folder(folder) if one.kind == "sequence"]
    assert len(find_source(sequence.path)) == 2


def test_a_folder_that_cannot_be_listed(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be listed"):
        list_folder(tmp_path / "none")


def test_beside_a_folder_are_scans_of_its_folder(study: Path) -> None:
    names = [Path(name).name for name in scans_beside(str(study / "s2"))]
    assert names == [
        "left_001.ply", "left_002.ply", "left_003.ply", "right_9.ply", "right_10.ply", "s2", "s10",
        "single.ply",
    ]  # fmt: skip


def test_beside_a_pattern_are_patterns(study: Path) -> None:
    names = scans_beside(str(study / "right_%d.ply"))
    assert [Path(name).name for name in names] == ["left_%03d.ply", "right_%d.ply"]


def test_a_scan_is_always_beside_itself_as_the_user_named_it(
    study: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(study)
    assert "s2" in scans_beside("s2")
    assert str(study / "s2") not in scans_beside("s2")
    assert str(study / "s10") in scans_beside("s2")
    assert scans_beside("demo") == ["demo"]
    assert scans_beside(str(study / "gone" / "x.ply")) == [str(study / "gone" / "x.ply")]
    assert "le*.ply" in scans_beside("le*.ply")


def test_names_of_a_user(study: Path) -> None:
    scans, problems = named_scans(["demo", str(study / "s2"), str(study / "nine.ply")])
    assert scans == ["demo", str(study / "s2")]
    assert len(problems) == 1
    assert "nine.ply" in str(problems[0])


def test_a_folder_of_scans_stands_for_them(study: Path) -> None:
    """It holds two kinds of files, so it is no scan itself."""
    assert named_scans([str(study / "s1")]) == (
        [str(study / "s1" / "a.npy"), str(study / "s1" / "a.ply")],
        [],
    )
    only_folders = put(study / "more", "x/1.npy", "y/1.npy").resolve()
    assert named_scans([str(only_folders)])[0] == [str(only_folders / "x"), str(only_folders / "y")]
    scans, problems = named_scans([str(study / "empty")])
    assert scans == []
    assert "no scan files" in str(problems[0])


def test_what_is_broken_in_a_folder_of_scans_is_told(study: Path) -> None:
    (study / "s1" / "0.npz").write_bytes(b"none")
    scans, problems = named_scans([str(study / "s1")])
    assert [Path(scan).name for scan in scans] == ["a.npy", "a.ply"]
    assert len(problems) == 1
    assert "0.npz" in str(problems[0])


def test_dropped_frames_are_one_scan_where_they_are_all_of_a_sequence(study: Path) -> None:
    left = [str(study / f"left_00{n}.ply") for n in (1, 2, 3)]
    assert as_one_scan(left) == str(study / "left_%03d.ply")
    assert as_one_scan(left[::-1]) == str(study / "left_%03d.ply")
    assert as_one_scan(left[:2]) is None, "a pattern would bring the third as well"
    assert as_one_scan(left[:1]) is None
    assert as_one_scan([*left, str(study / "single.ply")]) is None
    assert as_one_scan([str(study / "s2" / "1.npy"), left[0]]) is None
    assert as_one_scan([os.path.join(study, "s1"), os.path.join(study, "s2")]) is None


@given(st.text(st.characters(exclude_characters="\0*", codec="utf-8"), min_size=1, max_size=12))
@example("%99999999999d.ply")
@example("[")
@example("x" * 5000)
@example("~nobody/..")
def test_whatever_a_user_types_is_a_scan_or_one_message(text: str) -> None:
    scans, problems = named_scans([text])
    assert len(scans) == 0 or text in scans or Path(text).is_dir()
    assert len(problems) <= 1
    assert scans or problems
    assert scans_beside(text)


def test_a_folder_of_range_images_is_one_scan(tmp_path: Path) -> None:
    folder = tmp_path / "bunny"
    folder.mkdir()
    (folder / "bun.conf").write_text("bmesh a.ply 0 0 0 0 0 0 1\nbmesh b.ply 0 0 0 0 0 0 1\n")
    for name in ("a", "b"):
        np.savez(folder / f"{name}.npz", xyz=np.zeros((2, 2, 3)))
    np.save(folder / "model.npy", np.zeros((2, 3)))
    (folder / "README.txt").write_text("notes\n")
    assert rows(tmp_path) == [("folder", "bunny", 1)]
    assert rows(folder) == [("whole", "bunny", 1), ("file", "model.npy", 1)]
    (folder / "b.npz").unlink()
    assert rows(tmp_path) == [("folder", "bunny", 0)]


def test_sizes_and_dates_are_told(tmp_path: Path) -> None:
    for number in range(3):
        np.save(tmp_path / f"f{number}.npy", np.zeros((10 * number + 1, 3)))
        os.utime(tmp_path / f"f{number}.npy", (0, 1000 + number))
    np.save(tmp_path / "other.npy", np.zeros((5, 3)))
    (tmp_path / "inner").mkdir()
    told = {one.title: (one.size, one.changed) for one in list_folder(tmp_path)}
    sizes = [os.path.getsize(tmp_path / f"f{number}.npy") for number in range(3)]
    assert told["f0.npy to f2.npy"] == (sum(sizes), 1002)
    assert told["f1.npy"] == (sizes[1], 1001)
    assert told["inner"][0] is None
    assert told["inner"][1] == os.path.getmtime(tmp_path / "inner")


def test_a_folder_of_scans_that_are_no_frames_of_one_is_a_list(tmp_path: Path) -> None:
    sizes = {"bunny.npy": 3000, "dragon_1.npy": 9000, "horse_48.npy": 1000}
    for name, count in sizes.items():
        np.save(tmp_path / name, np.ones((count, 3)))
    files = [str(tmp_path / name) for name in sizes]
    assert named_scans([str(tmp_path)]) == (files, [])
    assert rows(tmp_path) == [("file", name, 1) for name in sizes]
    assert ("folder", tmp_path.name, 0) in rows(tmp_path.parent), "gone into, not played"
    assert named_scans([str(tmp_path / "*.npy")]) == ([str(tmp_path / "*.npy")], []), "as its user says"


@pytest.mark.parametrize(
    "names",
    [
        {"f1.npy": 10, "f2.npy": 9000, "f10.npy": 100},  # alike but for numbers, whatever their sizes
        {"before.npy": 1000, "after.npy": 1200},  # not alike, of about one size
        {"f1.npy": 10, "f2.npy": 900, "f3.npy": 10, "other.npy": 10},
        {"alone.npy": 10},
    ],
)
def test_frames_are_a_film_where_names_or_sizes_are_alike(names: dict[str, int], tmp_path: Path) -> None:
    for name, count in names.items():
        np.save(tmp_path / name, np.ones((count, 3)))
    assert named_scans([str(tmp_path)]) == ([str(tmp_path)], [])


@pytest.mark.parametrize("kind", ["sequences", "range"])
def test_real_folders_are_films_or_range_scans(kind: str, data_dir: Path) -> None:
    for folder in sorted(path for path in (data_dir / kind).iterdir() if path.is_dir()):
        try:
            find_source(folder)
        except InputError:
            continue
        assert named_scans([str(folder)])[0] == [str(folder)]


def test_links_that_lead_in_circles_add_nothing(tmp_path: Path) -> None:
    """Two of them would double the folders to search at each of forty levels."""
    (tmp_path / "bad.npz").write_bytes(b"no archive")
    for name in ("one", "other"):
        (tmp_path / name).symlink_to(tmp_path, target_is_directory=True)
    scans, problems = named_scans([str(tmp_path)])
    assert not scans
    assert [problem.where for problem in problems] == [tmp_path / "bad.npz"]
