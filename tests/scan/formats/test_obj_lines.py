"""Lines of OBJ files: compiled code and plain code find the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viewer.scan.formats import _obj_lines, read
from viewer.scan.formats._obj_lines import Keyword, ObjLines

ODD = [
    "0", "-0.0", "+1.5", ".5", "5.", "1e3", "-1.25E-2", "1e-30", "1e300", "123456789012345678901234567890",
    "0.000000000000000000000123", "9007199254740993", "0.1234567890123456789", "1e22", "1e23", "nan", "inf",
    "4.9e-324", "1.7976931348623157e308",
]  # fmt: skip


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_obj_lines, "_PAYS", 0)
    monkeypatch.setattr(_obj_lines, "_ROWS_AT_ONCE", 97)


@pytest.mark.usefixtures("compiled")
def test_compiled_numbers_are_those_that_python_reads() -> None:
    rng = np.random.default_rng(0)
    plain = rng.normal(size=300) * 10.0 ** rng.integers(-12, 12, 300)
    words = [*ODD, *(f"{number:.{digits}g}" for number in plain for digits in (3, 6, 9, 17))]
    words += ["0"] * (-len(words) % 3)
    rows = [words[at : at + 3] for at in range(0, len(words), 3)]
    text = "".join(f"v {'  '.join(row)} \r\n" for row in rows)
    found = ObjLines(text.encode()).table(Keyword.VERTEX)
    np.testing.assert_array_equal(found, [[float(word) for word in row] for row in rows])


@pytest.mark.usefixtures("compiled")
@pytest.mark.parametrize(
    "row",
    ["1 2", "1 2 3 4", "1,5 2 3", "1 2 three", "1 2 1_0", "1 2 3 # note", "1.#QNAN 2 3", "", "#", "1e 2 3"],
)
def test_odd_rows_are_read_as_without_compiled_code(
    row: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.obj"
    path.write_text(f"v 1 2 3\nv {row}\nv 4 5 6\n")

    def found() -> object:
        try:
            return read(path).world().tolist()
        except Exception as error:
            return str(error)

    fast = found()
    monkeypatch.setattr(_obj_lines, "_PAYS", 1 << 60)
    assert fast == found()


@pytest.mark.parametrize("corner", ["{0}", "{0}/{0}", "{0}//{0}", "{0}/{0}/{0}", "{0}/{0}/"])
def test_forms_of_corners_also_mixed_and_counted_back(corner: str) -> None:
    head = "v 0 0 0\nvt 0 0\nvn 0 0 1\n" * 4
    faces = ["1 2 3", "-1 -2 -3 -4", "2 3 4"]
    text = head + "".join(f"f {' '.join(corner.format(id) for id in face.split())}\n" for face in faces)
    for mixed in (text, text + "f 1/2/3 2 3//1\n"):
        rows = next(ObjLines(mixed.encode()).faces())
        assert rows.sizes.tolist()[:3] == [3, 4, 3]
        wanted = np.array([0, 1, 2, 3, 2, 1, 0, 1, 2, 3])
        has = [
            True,
            corner.count("/") > 0 and "//" not in corner,
            corner.endswith("/{0}") and corner.count("/") == 2,
        ]
        for column in range(3):
            np.testing.assert_array_equal(rows.corners[:10, column], wanted if has[column] else [-1] * 10)
    assert rows.corners[10:].tolist() == [[0, 1, 2], [1, -1, -1], [2, -1, 0]]


def test_continued_lines_comments_and_single_carriage_returns() -> None:
    text = "# a folder C:\\scans\\\nv 1 2 \\\n  3\nv 4 5 6\nv 7 8 9\nf 1 2 \\\r\n 3 # a triangle\n"
    for data in (text, text.replace("\\\n  ", "").replace("\\\r\n", "").replace("\n", "\r")):
        lines = ObjLines(data.encode())
        np.testing.assert_array_equal(lines.table(Keyword.VERTEX), [[1, 2, 3], [4, 5, 6], [7, 8, 9]])
        assert next(lines.faces()).corners[:, 0].tolist() == [0, 1, 2]
        assert [*lines.others(b"#")] == ["# a folder C:\\scans\\"]


def test_negative_numbers_count_back_from_where_they_stand() -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf -3 -2 -1\n"
    assert next(ObjLines(text.encode()).faces()).corners[:, 0].tolist() == [*range(6)]
