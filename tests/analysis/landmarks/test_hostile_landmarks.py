"""Damaged files of landmarks: each is one message with the place, or what can be used of it."""

from __future__ import annotations

import json
from pathlib import Path
from random import Random

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from landmark_sets import moving

from viewer.analysis.landmarks.files import read_landmarks, write_landmarks
from viewer.analysis.landmarks.landmark_set import LandmarkNotes, LandmarkSet
from viewer.errors import InputError

NAMES = ("m.mrk.json", "m.tps", "m.morphologika", "m.csv", "m.wide.csv", "m.c3d")
POINT = '{"markups": [{"type": "Fiducial", "controlPoints": [%s]}]}'
LONG = "kind,frame,time,name,x,y,z,state\n"
BAD = {
    ("m.mrk.json", "{"): "is not JSON",
    ("m.mrk.json", "[" * 100_000): "nested too deeply",
    ("m.mrk.json", "[]"): "contains no list 'markups'",
    ("m.mrk.json", '{"markups": []}'): "holds no landmarks",
    ("m.mrk.json", '{"markups": 3}'): "contains no list 'markups'",
    ("m.mrk.json", '{"markups": [3]}'): "markup 1: is not a JSON object",
    ("m.mrk.json", '{"@schema": "x/annotations-v2.json", "markups": []}'): "has the schema",
    ("m.mrk.json", POINT % '{"position": [1, 2]}'): "markup 1, control point 1: position is",
    ("m.mrk.json", POINT % '{"position": [1, 2, "3"]}'): "but must be three numbers",
    ("m.mrk.json", POINT % '{"position": [1, 2, true]}'): "but must be three numbers",
    ("m.mrk.json", POINT % '{"positionStatus": "lost"}'): "unknown positionStatus 'lost'",
    ("m.mrk.json", POINT % "7"): "is not a JSON object",
    ("m.mrk.json", '{"markups": [{"coordinateSystem": "IJK"}]}'): "unknown coordinateSystem",
    ("m.fcsv", "# CoordinateSystem = 7\n"): "line 1: unknown coordinate system '7'",
    ("m.fcsv", "# nothing\n"): "holds no landmarks",
    ("m.fcsv", "id,1,2\n"): "line 1: has only 3 values",
    ("m.fcsv", "id,1,two,3\n"): "line 1: 'two' is not a number",
    ("m.tps", "LM3=1000000000\n1 2 3\n"): "is not a whole number",
    ("m.tps", "LM3=100000000\n1 2 3\n"): "announces 100000000 landmarks, but the file has only 1 more lines",
    ("m.tps", "LM3=-1\n"): "not a whole number",
    ("m.tps", "LM3=2\n1 2 3\nID=0\n"): "line 1: announces 2 landmarks, but only 1 follow",
    ("m.tps", "LM3=1\n1 2\n"): "line 2: has 2 coordinates",
    ("m.tps", "LM3=1\n1 2 3\n4 5 6\n"): "line 3: the line is neither",
    ("m.tps", "LM3=1\n1 2 3\nSCALE=0\n"): "the scale is '0'",
    ("m.tps", "LM3=1\n1 2 3\nLM3=2\n1 2 3\n4 5 6\n"): "specimen 1 has 1 landmarks",
    ("m.tps", "ID=3\n"): "holds no specimen",
    ("m.txt", "hello\n"): "does not belong to any section",
    ("m.txt", "[individuals]\n1\n[landmarks]\n3\n[dimensions]\n3\n[rawpoints]\n1 2 3\n"): "contains 1 pos",
    ("m.txt", "[individuals]\n9\n[individuals]\n9\n"): "appears twice",
    ("m.txt", "[individuals]\n1\n[landmarks]\n1\n[dimensions]\n4\n"): "has 4 dimensions",
    ("m.txt", "[individuals]\n1\n"): r"the section \[landmarks\] contains no number",
    ("m.pts", "Version 1.0\n5\nS000 1 2 3\n"): "line 2: announces 5 landmarks, but the file contains 1",
    ("m.lm", "nose\nchin\n1 2 3\n"): "line 1: the landmark 'nose' has no coordinates",
    ("m.lm", "nose\n"): "'nose' has no coordinates",
    ("m.lm", "# nothing\n"): "holds no landmarks",
    ("m.csv", "a,b\n1,2\n"): "line 1: the table has neither",
    ("m.csv", "name,x,y,z\n"): "holds no landmarks",
    ("m.csv", "name,x,y,z\na,1,2\n"): "line 2: has 3 values for 4 columns",
    ("m.csv", 'name,x,y,z\n"a,1,2,3\n'): "cannot read this row of the table",
    ("m.csv", "name,x,y,z\na,1,2,3\na,1,2,3\n"): "line 3: the landmark 'a' appears twice",
    ("m.csv", "name,x,y,z\na,1,2,0x10\n"): "'0x10' is not a number",
    ("m.csv", "name;x;y;z\na;1,5;2.5;3\n"): "Use a decimal point",
    ("m.csv", f"{LONG}landmark,0,0,a,1,2,3,placed\n"): "count frames from 1",
    ("m.csv", "where,x,y,z\n1,two,3,4\n"): "'two' is not a number",
    ("m.csv", f"{LONG}landmark,1.5,0,a,1,2,3,placed\n"): "the frame is '1.5'",
    ("m.csv", f"{LONG}landmark,1,0,a,1,2,3,lost\n"): "unknown state 'lost'",
    ("m.csv", "name,x,y,z,unit\na,1,2,3,mm\nb,1,2,3,feet\n"): "lengths in this row are in 'feet'",
    ("m.csv", "frame,a_x,a_y,a_z\n2,1,2,3\n1,1,2,3\n"): "the frame of this row is 1, but the frame of",
    ("m.csv", "name,x,y,z\na,1e308,1e308,1e308\n"): "line 2: '1e308' is larger than",
    ("m.csv", "name,x,y,z\na,1e999,0,0\n"): "line 2: '1e999' is larger than",
    ("m.csv", "name,x,y,z\na,1e100,0,0\n"): "has coordinates larger",
    ("m.csv", "name,x,y,z,sigma\na,1,2,3,1e100\n"): "has standard deviations larger",
    ("m.mrk.json", POINT % '{"position": [1e200, 2, 3]}'): "has coordinates larger",
    ("m.mrk.json", POINT % '{"position": [1, 2, 3], "scan4d": {"sigma": 1e200}}'): "deviations larger",
    ("m.tps", "LM3=1\n1e200 2 3\nSCALE=1e200\n"): "line 2: '1e200' is larger than",
    ("m.tps", "LM3=1\n1e100 2 3\nSCALE=1e100\n"): "has coordinates larger",
    ("m.c3d", "C3D" * 400): "is not a C3D file",
    ("m.c3d", "\x02P"): "is not a C3D file",
    ("m.c3d", "\x02P" * 600): "parameters or frames of the file are damaged",
    ("m.stl", "solid"): "does not read landmarks from '.stl' files",
    ("m.tps", ""): "is empty",
    ("m.tps", "LM3=1\n1 2 3\0\n"): "is not text",
}  # fmt: skip


@pytest.mark.parametrize(("file", "words"), BAD.items(), ids=lambda value: str(value)[:50])
def test_bad_files_are_one_message(file: tuple[str, str], words: str, tmp_path: Path) -> None:
    path = tmp_path / file[0]
    path.write_bytes(file[1].encode())
    with pytest.raises(InputError, match=words) as caught:
        read_landmarks(path)
    assert str(caught.value).startswith(str(path))
    assert len(str(caught.value)) < 700


MORPHOLOGIKA = "[individuals]\n2\n[landmarks]\n1\n[dimensions]\n3\n[rawpoints]\n1 2 3\n4 5 6\n'scan4d %s\n"
TWO_TPS = "LM3=1\n1 2 3\nCOMMENT=scan4d %s\nLM3=1\n4 5 6\nCOMMENT=scan4d %s\n"


@pytest.mark.parametrize(
    ("first", "last", "is_framed"),
    [("2", "4", True), ("1.2", "1.7", False), ("2", "2", False), ("0", "1", False), ("1", "1e18", False)],
)
def test_frames_are_whole_numbers_that_increase(
    tmp_path: Path, first: str, last: str, is_framed: bool
) -> None:
    (tmp_path / "m.txt").write_text(MORPHOLOGIKA % f'{{"frames": [{first}, {last}]}}')
    (tmp_path / "m.tps").write_text(TWO_TPS % (f'{{"frame": {first}}}', f'{{"frame": {last}}}'))
    for name in ("m.txt", "m.tps"):
        found = read_landmarks(tmp_path / name)
        assert found.is_framed == is_framed
        assert found.frames.tolist() == ([1, 3] if is_framed else [0, 1])


def test_a_sparse_table_is_no_large_one(tmp_path: Path) -> None:
    rows = "".join(f"landmark,{n},0,name {n},1,2,3,placed\n" for n in range(1, 3000))
    (tmp_path / "m.csv").write_text(LONG + rows)
    with pytest.raises(InputError, match="2,999 landmarks in 2,999 frames"):
        read_landmarks(tmp_path / "m.csv")


def test_missing_files_and_folders(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_landmarks(tmp_path / "m.csv")
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(InputError):
        read_landmarks(tmp_path / "folder.csv")


def test_names_that_cannot_stay(tmp_path: Path) -> None:
    names = ["twice", "twice", "", "line\nbreak", "x" * 300, " kept "]
    points = [{"label": name, "position": [1, 2, 3]} for name in names]
    data = {"markups": [{"type": "Fiducial", "controlPoints": points}]}
    (tmp_path / "m.mrk.json").write_text(json.dumps(data))
    found = read_landmarks(tmp_path / "m.mrk.json")
    assert found.names == ("twice", "twice (2)", "3", "line break", "x" * 200, "kept")
    assert len(found.remarks) == 3


def test_old_encodings_are_read(tmp_path: Path) -> None:
    (tmp_path / "m.csv").write_bytes("name,x,y,z\nNäse,1,2,3\n".encode("latin-1"))
    assert read_landmarks(tmp_path / "m.csv").names == ("Näse",)
    (tmp_path / "m.csv").write_bytes("name,x,y,z\nNäse,1,2,3\n".encode("utf-8-sig"))
    assert read_landmarks(tmp_path / "m.csv").names == ("Näse",)


def whole(folder: Path) -> dict[str, bytes]:
    wanted = moving(3)
    for name in NAMES:
        write_landmarks(folder / name, wanted.at(0) if name.endswith("json") else wanted)
    return {name: (folder / name).read_bytes() for name in NAMES}


@pytest.mark.parametrize("name", NAMES)
def test_cut_and_changed_files_do_no_harm(name: str, tmp_path: Path) -> None:
    data, rng = whole(tmp_path)[name], Random(5)
    outcomes = {"read": 0, "refused": 0}
    for number in range(150):
        damaged = bytearray(data[: rng.randrange(len(data))] if number % 3 == 0 else data)
        for _ in range(number % 3 * rng.choice((1, 8))):
            damaged[rng.randrange(min(len(damaged), 1500))] = rng.choice(
                (rng.randrange(256), 0x2C, 0x39, 0xFF)
            )
        (tmp_path / name).write_bytes(damaged)
        try:
            found = read_landmarks(tmp_path / name)
        except InputError:
            outcomes["refused"] += 1
        else:
            outcomes["read"] += 1
            assert np.isfinite(found.positions[found.is_defined]).all()
            assert len(set(found.names)) == len(found.names)
    assert min(outcomes.values()) > 5, outcomes


TEXTS = st.text(st.characters(exclude_categories=["Cs"]), min_size=0, max_size=30)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(names=st.lists(TEXTS, min_size=1, max_size=5), numbers=st.data())
def test_any_name_and_number_comes_back(names: list[str], numbers: st.DataObject, tmp_path: Path) -> None:
    value = st.floats(-1e12, 1e12)
    values = numbers.draw(st.lists(value, min_size=3 * len(names), max_size=3 * len(names)))
    wanted = LandmarkSet.of(names, np.array(values).reshape(1, -1, 3), frames=[0], notes=LandmarkNotes("mm"))
    for name in NAMES[:-1]:
        write_landmarks(tmp_path / name, wanted)
        found = read_landmarks(tmp_path / name)
        assert found.names == wanted.names
        np.testing.assert_array_equal(found.positions, wanted.positions)


@pytest.mark.parametrize("names", [["'"], ["#", "nose"], ["nose", "*_"], ["//", "%", "!;"], [""], ["x", "#"]])
def test_names_of_marks_alone_come_back(names: list[str], tmp_path: Path) -> None:
    places = np.arange(3.0 * len(names)).reshape(1, -1, 3)
    wanted = LandmarkSet.of(names, places, frames=[0], notes=LandmarkNotes("mm"))
    for name in NAMES[:-1]:
        write_landmarks(tmp_path / name, wanted)
        assert read_landmarks(tmp_path / name).names == wanted.names
