"""Tables: no text of theirs is a formula, all of them read back as they were, and one function writes all."""

from __future__ import annotations

import ast
import csv
import io
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from source_code import modules, syntax_of

from viewer.analysis.landmarks.files import read_landmarks, write_landmarks
from viewer.analysis.landmarks.landmark_set import LandmarkSet
from viewer.csv_text import save_rows, text_of_cell, to_text
from viewer.scan.reading.times_table import read_times_csv

FORMULAS = ("=1+1", "+1+1", "-1-cmd", "@SUM(A1)", "\t=1", "\r=1", "\n=1", "=cmd|' /C calc'!A0", "-", "+")
WIDE_FORMULAS = ("\uff1d1+1", "\uff0b1", "\uff0d1", "\uff20SUM(A1)", "'\uff1d1")
NUMBERS = ("-1", "+2.5", "-3e-7", "-.5")


def cells(rows: list[list[object]], separator: str = ",") -> list[list[str]]:
    """The cells of a table as a spreadsheet has them."""
    return list(csv.reader(io.StringIO(to_text(rows, separator), newline=""), delimiter=separator))


@pytest.mark.parametrize("separator", [",", "\t"])
def test_no_text_begins_like_a_formula(separator: str) -> None:
    texts = [*FORMULAS, *WIDE_FORMULAS]
    (row,) = cells([texts], separator)
    assert all(cell == f"'{text}" for cell, text in zip(row, texts, strict=True))
    assert [text_of_cell(cell) for cell in row] == texts


def test_numbers_and_other_texts_stay_as_they_are() -> None:
    told: list[object] = [
        *NUMBERS,
        -2,
        -0.5,
        np.float64(-1.25),
        np.int64(-3),
        None,
        "chin",
        "a=b",
        "'quoted'",
    ]
    (row,) = cells([told])
    assert row == [*NUMBERS, "-2", "-0.5", "-1.25", "-3", "", "chin", "a=b", "'quoted'"]


@given(st.text(st.sampled_from("'=+-@\t\r\n1.e x"), max_size=6))
def test_every_text_reads_back_as_it_was(text: str) -> None:
    ((cell,),) = cells([[text]]) or [[""]]
    assert text_of_cell(cell) == text


def test_names_of_landmarks_come_back_from_tables(tmp_path: Path) -> None:
    names = ["=1+1", "'=1+1", "-nose", "@lip", "+chin", "\tear", "plain"]
    positions = np.arange(2 * len(names) * 3, dtype=float).reshape(2, len(names), 3) - 7
    for name in ("long.csv", "wide.wide.csv"):
        file = tmp_path / name
        landmarks = LandmarkSet.of(names, positions, times=np.array([0.0, 1.0]))
        write_landmarks(file, landmarks)
        assert not [cell for cell in first_cells(file) if cell[:1] in "=+@\t"], name
        read = read_landmarks(file)
        assert read.names == landmarks.names
        assert read.names[:5] == tuple(names[:5])
        np.testing.assert_array_equal(read.positions, positions)


def first_cells(file: Path) -> list[str]:
    with file.open(newline="", encoding="utf-8") as stream:
        return [cell for row in csv.reader(stream) for cell in row if cell]


def test_names_of_frames_come_back(tmp_path: Path) -> None:
    names = ["=1+1.ply", "=1+2.ply"]
    save_rows(tmp_path / "times.csv", [("file", "time"), *((name, n / 2) for n, name in enumerate(names))])
    assert "\n=" not in (tmp_path / "times.csv").read_text()
    np.testing.assert_array_equal(read_times_csv(tmp_path / "times.csv", names).seconds, [0, 0.5])


def test_one_function_writes_all_tables() -> None:
    found = [
        path.name
        for path in modules()
        if "csv" in path.read_text(encoding="utf-8")
        for node in ast.walk(syntax_of(path))
        if isinstance(node, ast.Attribute) and node.attr in ("writer", "DictWriter")
        if ast.unparse(node.value) == "csv"
    ]
    assert found == ["csv_text.py"]
