"""Files of landmarks, written and read again, by us and by others."""

from __future__ import annotations

import json
import re
import warnings
from dataclasses import replace
from pathlib import Path

import ezc3d
import jsonschema
import numpy as np
import pytest
from landmark_sets import NAMES, assert_same, moving

from viewer.analysis.landmarks.files import (
    holds_one_moment,
    is_landmark_file,
    landmark_suffixes,
    read_landmarks,
    write_landmarks,
)
from viewer.analysis.landmarks.landmark_set import LandmarkNotes, LandmarkSet
from viewer.analysis.track import Known
from viewer.errors import InputError
from viewer.scan.formats import known_suffixes

SCHEMA = json.loads((Path(__file__).parent / "slicer" / "markups-schema-v1.0.3.json").read_text("utf-8"))
FILES = {
    "m_%04d.mrk.json": 0.0,
    "m.tps": 0.0,
    "m.morphologika": 0.0,
    "m.csv": 0.0,
    "m.wide.csv": 0.0,
    "m.c3d": 1e-5,
}
WITH_STATES = {"m_%04d.mrk.json", "m.csv"}


@pytest.mark.parametrize("name", FILES)
def test_what_is_written_is_read_again(name: str, tmp_path: Path) -> None:
    wanted = moving()
    remark = write_landmarks(tmp_path / name, wanted)
    found = read_landmarks(tmp_path / name, "mm")
    assert_same(found, wanted, off=FILES[name])
    assert (remark is None) == (name in WITH_STATES)
    assert not found.remarks
    if name in WITH_STATES:
        np.testing.assert_array_equal(found.known, wanted.known)
        np.testing.assert_array_equal(found.sigmas, wanted.sigmas)
    first = next(path for path in sorted(tmp_path.iterdir()))
    assert is_landmark_file(first)


def test_every_format_that_is_written_is_tried() -> None:
    tried = {suffix for suffix in landmark_suffixes(written=True) for name in FILES if name.endswith(suffix)}
    assert tried | {".txt"} == set(landmark_suffixes(written=True))


def test_the_docs_name_every_format() -> None:
    page = Path(__file__).parents[3] / "docs" / "reference" / "formats.md"
    section = page.read_text("utf-8").split("\n## Landmarks\n")[1].split("\n## ")[0]
    rows = [line.split("|") for line in section.splitlines() if line.startswith("| ")][1:]
    read = {suffix: row for row in rows for suffix in re.findall(r"`(\.[\w.]+)`", row[2])}
    assert set(read) == set(landmark_suffixes())
    written = {suffix for suffix, row in read.items() if row[4].strip() != "\u2013"}
    assert written == set(landmark_suffixes(written=True))


@pytest.mark.parametrize("name", FILES)
def test_units_are_converted(name: str, tmp_path: Path) -> None:
    wanted = moving()
    write_landmarks(tmp_path / name, wanted)
    found = read_landmarks(tmp_path / name, "m")
    assert found.unit == "m"
    there = wanted.is_defined
    np.testing.assert_allclose(found.positions[there], wanted.positions[there] / 1000, atol=FILES[name])


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("unit", [None, "furlongs", "m"])
def test_any_unit_comes_back(name: str, unit: str | None, tmp_path: Path) -> None:
    wanted = replace(moving(), unit=unit)
    write_landmarks(tmp_path / name, wanted)
    found = read_landmarks(tmp_path / name, unit)
    assert_same(found, wanted, off=max(FILES[name], 1e-13))
    assert not found.remarks
    if unit == "furlongs":
        (told,) = read_landmarks(tmp_path / name, "mm").remarks
        assert "'furlongs'" in told


@pytest.mark.parametrize("name", FILES)
def test_axes_are_turned_where_a_file_tells_them(name: str, tmp_path: Path) -> None:
    wanted = moving()
    write_landmarks(tmp_path / name, wanted, axes="RAS")
    assert_same(read_landmarks(tmp_path / name, "mm", axes="RAS"), wanted, off=FILES[name])
    other = read_landmarks(tmp_path / name, "mm", axes="LPS")
    turned = wanted.turned() if name.endswith("json") else wanted
    assert_same(other, turned, off=FILES[name])


def test_markups_pass_the_validator_of_the_schema(tmp_path: Path) -> None:
    jsonschema.Draft7Validator.check_schema(SCHEMA)
    for unit in ("mm", None, "furlongs"):
        write_landmarks(tmp_path / "m_%04d.mrk.json", replace(moving(), unit=unit))
        for path in tmp_path.glob("*.json"):
            data = json.loads(path.read_text("utf-8"), parse_constant=pytest.fail)  # NaN is no JSON
            jsonschema.validate(data, SCHEMA, jsonschema.Draft7Validator)
            assert data["markups"][0]["type"] == "Fiducial"
            assert len(data["markups"][0]["controlPoints"]) == len(NAMES)
    point = data["markups"][0]["controlPoints"][0] | {"positionStatus": "lost"}
    with pytest.raises(jsonschema.ValidationError):  # so it can fail
        jsonschema.validate({**data, "markups": [{"type": "Fiducial", "controlPoints": [point]}]}, SCHEMA)


def test_a_second_library_reads_the_same_c3d(tmp_path: Path) -> None:
    wanted = moving(frames=40)
    write_landmarks(tmp_path / "m.c3d", wanted)
    other = ezc3d.c3d(str(tmp_path / "m.c3d"))
    points = other["data"]["points"]  # x, y, z, 1; points; frames
    positions = np.moveaxis(points[:3], (0, 1, 2), (2, 1, 0))
    there = wanted.is_defined
    np.testing.assert_array_equal(positions[there], wanted.positions[there].astype(np.float32))
    residuals = other["data"]["meta_points"]["residuals"][0].T
    assert (residuals[~there] == -1).all()
    assert (residuals[there] == 0).all()
    parameters = other["parameters"]["POINT"]
    assert parameters["RATE"]["value"][0] == 25
    assert parameters["UNITS"]["value"] == ["mm"]
    assert tuple(parameters["LABELS"]["value"]) == wanted.names
    assert other["header"]["points"]["first_frame"] == 0  # which that library counts from 0


def test_c3d_of_many_points_and_long_names(tmp_path: Path) -> None:
    names = tuple(f"{n} " + "long " * (n % 40) + "é" * (n % 30) for n in range(600))
    wanted = moving(3, names)
    remark = write_landmarks(tmp_path / "m.c3d", wanted)
    assert remark is not None
    assert "cuts names after 50 bytes" in remark
    found = read_landmarks(tmp_path / "m.c3d", "mm")
    assert len(set(found.names)) == 600
    np.testing.assert_allclose(found.positions[0, :-1], wanted.positions[0, :-1], atol=1e-5)
    other = ezc3d.c3d(str(tmp_path / "m.c3d"))
    assert other["data"]["points"].shape == (4, 600, 3)


def test_c3d_tells_what_it_rounds(tmp_path: Path) -> None:
    few = moving(4)
    uneven = replace(few, times=np.array([0, 0.1, 0.5, 0.6]))
    assert "evenly spaced times" in str(write_landmarks(tmp_path / "m.c3d", uneven))
    at_once = replace(few, times=np.zeros(4))  # no rate comes of these
    assert "evenly spaced times" in str(write_landmarks(tmp_path / "m.c3d", at_once))
    assert np.ptp(np.diff(read_landmarks(tmp_path / "m.c3d").times)) == pytest.approx(0, abs=1e-9)
    far = replace(few, positions=few.positions + 4e6)
    assert "rounds" in str(write_landmarks(tmp_path / "m.c3d", far))
    later = LandmarkSet.of(
        ["a"], np.ones((2, 1, 3)), frames=[10, 13], times=np.array([0.5, 0.65]), notes=LandmarkNotes("mm")
    )
    assert write_landmarks(tmp_path / "m.c3d", later) is None
    found = read_landmarks(tmp_path / "m.c3d")
    np.testing.assert_array_equal(found.frames, [10, 11, 12, 13])
    np.testing.assert_allclose(found.times, np.arange(10, 14) / 20, rtol=1e-6)
    np.testing.assert_array_equal(found.is_defined[:, 0], [True, False, False, True])


def test_lines_are_where_geomorph_looks_for_them(tmp_path: Path) -> None:
    """It takes so many lines behind [rawpoints], drops what stands behind a quotation mark, and comments."""
    wanted = moving(3)
    count = len(wanted.names)
    write_landmarks(tmp_path / "m.txt", wanted)
    lines = [line.split('"')[0] for line in (tmp_path / "m.txt").read_text("utf-8").splitlines()]
    assert sum("names" in line for line in lines) == sum("landmarks" in line for line in lines) == 1
    start = lines.index("[rawpoints]") + 1
    raw = [line for line in lines[start : start + 3 * count + 3] if "'" not in line]
    assert [len(line.split()) for line in raw] == [3] * 3 * count
    write_landmarks(tmp_path / "m.tps", wanted)
    lines = (tmp_path / "m.tps").read_text("utf-8").splitlines()
    kept = [line for line in lines if not line.startswith("COMMENT=")]
    assert [line for line in kept if "=" in line] == [
        text for number in range(1, 4) for text in (f"LM3={count}", f"ID=frame_{number:04d}")
    ]


def test_one_moment_is_one_file(tmp_path: Path) -> None:
    wanted = moving()
    with pytest.raises(InputError, match=r"m_%04d\.mrk\.json"):
        write_landmarks(tmp_path / "m.mrk.json", wanted)
    assert write_landmarks(tmp_path / "m.mrk.json", wanted.at(4)) is None
    found = read_landmarks(tmp_path / "m.mrk.json", "mm")
    assert_same(found, wanted.at(4))
    assert found.about == wanted.about


def test_a_series_with_a_file_that_is_gone(tmp_path: Path) -> None:
    wanted = moving()
    write_landmarks(tmp_path / "m_%04d.mrk.json", wanted)
    names = ("m_%04d.mrk.json", "m.mrk.json", "m.c3d", "m.csv")
    assert [holds_one_moment(name) for name in names] == [False, True, False, False]
    (tmp_path / "m_0003.mrk.json").unlink()
    found = read_landmarks(tmp_path / "m_%04d.mrk.json", "mm")
    np.testing.assert_array_equal(found.frames, [0, 1, 3, 4, 5])
    with pytest.raises(InputError, match="no file matches this name"):
        read_landmarks(tmp_path / "other_%04d.mrk.json")


def test_previews_stay_previews(tmp_path: Path) -> None:
    wanted = LandmarkSet.of(
        ["seen", "guessed"],
        np.ones((1, 2, 3)),
        known=np.array([[Known.PLACED, Known.PENDING]]),
        notes=LandmarkNotes("mm"),
    )
    for name in ("m.mrk.json", "m.csv"):
        write_landmarks(tmp_path / name, wanted)
        found = read_landmarks(tmp_path / name)
        np.testing.assert_array_equal(found.known, wanted.known)
        np.testing.assert_array_equal(found.positions, wanted.positions)
    points = json.loads((tmp_path / "m.mrk.json").read_text())["markups"][0]["controlPoints"]
    assert [point["positionStatus"] for point in points] == ["defined", "preview"]


def test_reading_changes_no_warnings_and_is_quiet(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    write_landmarks(tmp_path / "m.c3d", moving())
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        read_landmarks(tmp_path / "m.c3d")
    assert not said
    assert capfd.readouterr() == ("", "")


def test_scans_are_told_from_landmarks(tmp_path: Path) -> None:
    texts = {
        "scan.csv": "x,y,z,intensity\n1,2,3,4\n",
        "scan.txt": "1 2 3\n4 5 6\n",
        "scan.pts": "2\n1 2 3\n4 5 6\n",
        "scan.json": "{}",
        "times.csv": "file,time\nf0.ply,0\n",
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
        assert not is_landmark_file(tmp_path / name), name
    assert not is_landmark_file(tmp_path / "nothing.csv")
    assert set(landmark_suffixes()) & set(known_suffixes()) == {".csv", ".pts", ".txt"}


def test_what_cannot_be_written(tmp_path: Path) -> None:
    for name, words in {"m.fcsv": "Known: .c3d", "m.xyz": "Known: .c3d", "no/m.csv": "no folder"}.items():
        with pytest.raises(InputError, match=words):
            write_landmarks(tmp_path / name, moving())
    assert not list(tmp_path.iterdir())
