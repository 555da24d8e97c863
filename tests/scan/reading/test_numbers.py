"""Numbers in text: encodings, separators, decimal marks, and what programs write for numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from viewer.errors import InputError
from viewer.scan.reading import numbers
from viewer.scan.reading.numbers import Dialect, dialect_of, parse_numbers

ROWS = [[1.25, -2.5, 1000.75], [4.5, 5.25, 6.125]]


def written(separator: str, decimal: str = ".") -> list[str]:
    return [separator.join(str(number).replace(".", decimal) for number in row) + "\n" for row in ROWS]


@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize("separator", [" ", "   ", "\t", ";", " ; ", ", "])
@pytest.mark.parametrize("head", ["", "x;y;z\n", "x y z\n", "# a remark, with commas\n", "Scan of 2024\n"])
def test_separators_and_decimal_marks(separator: str, decimal: str, head: str) -> None:
    lines = written(separator, decimal)
    dialect = dialect_of([head, *lines] if head else lines)
    np.testing.assert_array_equal(parse_numbers(lines, dialect=dialect), ROWS)
    assert dialect.decimal == decimal
    assert dialect.is_certain


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("1,2,3", Dialect("comma")),
        ("10,20,30,40,50,60", Dialect("comma")),
        ("1.5,2,3", Dialect("comma")),
        ("1.5, 2.5, 3.5", Dialect("comma")),
        ("1 2 3", Dialect()),
        ("1,\t2,\t3", Dialect("comma")),
        ("nose,1,2,3", Dialect("comma")),
        ("left eye\t1\t2\t3", Dialect("tab")),
        ("f001.ply;0,033", Dialect("semicolon", ",")),
        ('"1,25","2,5","-3,75"', Dialect("comma", ",")),
        ("1.234,56;2;3", Dialect("semicolon", ",")),
        ("1,234.56;2;3", Dialect("semicolon")),
        ("1,234,567;2;3", Dialect("semicolon")),
        ("0,033;0,066;1", Dialect("semicolon", ",")),
    ],
)
def test_dialects_of_a_line(line: str, expected: Dialect) -> None:
    assert dialect_of([line + "\n"]) == expected


def test_commas_that_could_be_of_thousands_are_an_assumption() -> None:
    dialect = dialect_of(["1,234;2,345;3,456\n"])
    _, decimal = dialect.decisions()
    assert (decimal.value, decimal.source, decimal.alternatives) == (",", "assumed", (".",))
    assert decimal.is_marked


def test_the_user_states_the_separator_and_the_decimal_mark() -> None:
    dialect = dialect_of(["1,2 3,4\n"], separator="blank", decimal=",")
    assert dialect == Dialect("blank", ",")
    assert [one.source for one in dialect.decisions(["decimal"])] == ["file", "user"]


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("1.5", 1.5), ("-1e-3", -1e-3), ("1.5D+03", 1500), ("-2.5d-1", -0.25), ("1.#QNAN", math.nan),
        ("-1.#IND00", math.nan), ("1.#INF", math.inf), ("-1.#INF00", -math.inf), ("nan(ind)", math.nan),
        ("-nan(ind)", math.nan), ("NaN", math.nan), ("1.#J", math.nan), ("1,234.5", 1234.5),
    ],
)  # fmt: skip
def test_numbers_as_programs_write_them(word: str, expected: float) -> None:
    np.testing.assert_equal(numbers.value(word), expected)


@pytest.mark.parametrize(
    ("word", "expected"),
    [("1,5", 1.5), ("-,5", -0.5), ("1,5e3", 1500), ("7", 7), ("1.234,5", 1234.5), ("1,#QNAN", math.nan)],
)
def test_numbers_with_decimal_commas(word: str, expected: float) -> None:
    np.testing.assert_equal(numbers.value(word, ","), expected)


@pytest.mark.parametrize(
    ("word", "decimal"), [("1,5", "."), ("1.5", ","), ("six", "."), ("", "."), ("1,2,3", ",")]
)
def test_words_that_are_no_numbers(word: str, decimal: str) -> None:
    assert not numbers.is_numeral(word, decimal)
    with pytest.raises(ValueError, match="is not a number"):
        numbers.value(word, decimal)


def test_a_sign_inside_a_number_begins_no_comment() -> None:
    lines = ["1 2 1.#QNAN # missing\n", "4 5 -1.#IND // too\n", "# between\n", "\n", "7 8 9\n"]
    np.testing.assert_array_equal(parse_numbers(lines), [[1, 2, np.nan], [4, 5, np.nan], [7, 8, 9]])


def test_cells_that_are_absent() -> None:
    table = parse_numbers(["1,,3\n", "NA,5,#N/A\n"], dialect=Dialect("comma"))
    np.testing.assert_array_equal(table, [[1, np.nan, 3], [np.nan, 5, np.nan]])


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("1 2 3\n4 5\n", "row 2 has 2 values, but the rows above have 3"),
        ("1 2 3\n4 5 six\n", "row 2, column 3: 'six' is not a number"),
        (
            "1 2 3\n4 5 6,5\n",
            r"'6,5' is not a number. If this is a number, read the file with --read decimal=,",
        ),
    ],
)
def test_rows_that_cannot_be_read(text: str, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        parse_numbers(text.splitlines(keepends=True))


def test_counts_between_rows() -> None:
    loose = numbers.LooseLines()
    table = parse_numbers(["1 2 3\n", "2\n", "4 5 6\n", "7 8 9\n"], (0, 1, 2), loose=loose)
    assert len(table) == 3
    assert loose.counts == [2]


@pytest.mark.parametrize("text", ["END", "];", "\x1a", "\0\0\0", "Total: 2 points"])
def test_text_below_the_rows_is_left_out_and_counted(text: str) -> None:
    loose = numbers.LooseLines()
    rows = ["1,2,3\n"] * 5000
    assert len(parse_numbers([*rows, text, "\n"], (0, 1, 2), Dialect("comma"), loose=loose)) == 5000
    assert [line for line, _ in loose.behind] == [text]
    for more in (["4,5,6\n"], rows):  # in the same part of the table, and in a later one
        with pytest.raises(InputError, match="row 5,001"):
            parse_numbers(
                [*rows, f"{text}\n", *more], (0, 1, 2), Dialect("comma"), loose=numbers.LooseLines()
            )


def test_a_damaged_row_is_no_text() -> None:
    for last in ("7,8\n", "7,8,nine\n"):
        with pytest.raises(InputError, match="row 3"):
            parse_numbers(
                ["1,2,3\n", "4,5,6\n", last], (0, 1, 2), Dialect("comma"), loose=numbers.LooseLines()
            )


def test_empty_cells_that_lack_at_the_end_are_absent() -> None:
    table = parse_numbers(["1,2,3\n", "4,5,6,7\n"], (0, 1, 2, 3), Dialect("comma"))
    np.testing.assert_array_equal(table, [[1, 2, 3, np.nan], [4, 5, 6, 7]])


@pytest.mark.parametrize(
    ("word", "decimal", "number"),
    [
        ("1'000.5", ".", 1000.5), ("1 000,5", ",", 1000.5), ("-12 345", ".", -12345),
        ("1.234.567,5", ",", 1234567.5), ("1,000.5", ".", 1000.5),
    ],
)  # fmt: skip
def test_marks_of_thousands(word: str, decimal: str, number: float) -> None:
    assert numbers.value(word, decimal) == number


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("\u22121.5;2", ["-1.5", "2"]), ("1\u202f000,5;2", ["1000,5", "2"]), ("1\u00a02", ["1 2"]),
        ("[1; 2]", ["1", "2"]), ("(-1;2),", ["-1", "2"]), ("x [mm];y [mm]", ["x [mm]", "y [mm]"]),
    ],
)  # fmt: skip
def test_signs_and_brackets_around_rows(line: str, words: list[str]) -> None:
    assert numbers.split_line(line, Dialect("semicolon")) == words


@pytest.mark.parametrize("line", ["; text", "! text", "* text", "/* text */", "REM text", "-- text", "# 1"])
def test_comments_of_other_programs(line: str) -> None:
    assert numbers.is_comment(line)


@pytest.mark.parametrize("line", [";abc;1;2", ";1;2", "-1 2 3", "* 2 3", "--;2;3", "remark,1,2"])
def test_rows_that_look_like_comments(line: str) -> None:
    assert not numbers.is_comment(line)


def test_a_stated_decimal_point_makes_commas_marks_of_thousands() -> None:
    lines = ["1,234 2,345 -3,456\n", "4,567 5,678 6,789\n"]
    assert not dialect_of(lines).is_certain
    dialect = dialect_of(lines, decimal=".")
    np.testing.assert_array_equal(parse_numbers(lines, None, dialect)[0], [1234, 2345, -3456])


def test_bars_separate_values() -> None:
    assert numbers.dialect_of(["x|y|z\n", "1,5|2|3\n", "4|5|6\n"]) == Dialect("bar", ",")


def test_commas_that_are_both() -> None:
    rows = [line.split(",") for line in ("1,25,2,50,-3,75", "4,50,5,25,6,12", "1000,50,-0,50,7,00")]
    with pytest.raises(InputError, match="decimal marks"):
        numbers.check_commas(rows)
    numbers.check_commas([["1", "2", "3", "255", "0", "0"], ["4", "5", "6", "10", "20", "30"]])
    numbers.check_commas([["1.5", "00"] * 2])


@pytest.mark.parametrize(
    ("codec", "name"),
    [
        ("utf-8", "utf-8"), ("utf-8-sig", "utf-8"), ("utf-16", "utf-16"), ("utf-16-le", "utf-16"),
        ("utf-16-be", "utf-16"), ("utf-32", "utf-32"), ("cp1252", "latin-1"),
    ],
)  # fmt: skip
def test_encodings(codec: str, name: str) -> None:
    text = "Höhe x y z\n1 2 3\n"
    data = text.encode(codec)
    assert numbers.encoding_decision(data).value == name
    assert numbers.decoded(data) == text
    assert numbers.codec_of(numbers.encoding_decision(data, "latin-1"), data) == "cp1252"


def test_a_character_cut_at_the_end_of_the_head() -> None:
    assert numbers.encoding_of("x ä".encode()[:-1]) == "utf-8-sig"


def test_cells_of_a_table_of_times() -> None:
    found = list(numbers.cells(["file;time\n", "\n", "f001.ply;0,000\n", "f002.ply;0,033\n"]))
    assert [row.words for row in found] == [["file", "time"], ["f001.ply", "0.000"], ["f002.ply", "0.033"]]
    assert [row.line for row in found] == [1, 3, 4]
