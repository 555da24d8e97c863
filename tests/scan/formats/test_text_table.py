"""Text tables: delimiters, names, comments, counts, and the guesses where no names stand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viewer.errors import InputError
from viewer.scan.formats import read
from viewer.scan.formats.text import guess_names


def save(path: Path, text: str) -> Path:
    path.write_bytes(text.encode())
    return path


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("delimiter", [" ", "   ", "\t", ",", ", ", " ; "])
@pytest.mark.parametrize(
    "header", ["", "# a remark\n", '"X",Y,"Z"\n', "//X Y Z\n", "x\ty\tz\n", "\ufeffx;y;z\n"]
)
def test_delimiters_headers_and_line_ends(header: str, delimiter: str, end: str, tmp_path: Path) -> None:
    rows = ["665187.522 5648349.895 241.767", "", "665188.001 5648350.003 242.009"]
    text = header + "\n".join(row.replace(" ", delimiter) for row in rows) + "\n"
    cloud = read(save(tmp_path / "scan.csv", text.replace("\n", end)))
    expected = [[665187.522, 5648349.895, 241.767], [665188.001, 5648350.003, 242.009]]
    np.testing.assert_allclose(cloud.world(), expected, rtol=0, atol=1e-6)
    assert not cloud.scalars


def test_named_columns(tmp_path: Path) -> None:
    text = "id,Z,Y,X,red,green,blue,nx,ny,nz,GPS Time\n5,3,2,1,255,0,51,0,0,1,1e9\n"
    cloud = read(save(tmp_path / "scan.csv", text))
    np.testing.assert_array_equal(cloud.world(), [[1, 2, 3]])
    np.testing.assert_array_equal(cloud.colors, [[255, 0, 51, 255]])
    np.testing.assert_array_equal(cloud.normals, [[0, 0, 1]])
    assert {name: values.tolist() for name, values in cloud.scalars.items()} == {"id": [5], "GPS Time": [1e9]}


def test_columns_of_words_are_left_out(tmp_path: Path) -> None:
    cloud = read(save(tmp_path / "scan.csv", "x,y,z,class,height\n1,2,3,ground,9\n4,5,6,tree,8\n"))
    assert {name: values.tolist() for name, values in cloud.scalars.items()} == {"height": [9, 8]}


def test_a_remark_names_columns_only_where_the_count_fits(tmp_path: Path) -> None:
    cloud = read(save(tmp_path / "scan.txt", "# x y z of the upper jaw\n1 2 3 4\n"))
    assert set(cloud.scalars) == {"intensity"}
    cloud = read(save(tmp_path / "scan.txt", "// x y z depth\n1 2 3 4\n"))
    assert set(cloud.scalars) == {"depth"}


def test_comments_among_the_rows(tmp_path: Path) -> None:
    text = "1 2 3 # first\n# between\n// too\n4 5 6\n"
    np.testing.assert_array_equal(read(save(tmp_path / "scan.xyz", text)).world(), [[1, 2, 3], [4, 5, 6]])


def test_the_count_of_a_pts_file(tmp_path: Path) -> None:
    path = tmp_path / "scan.pts"
    cloud = read(save(path, "2\n1 2 3 200 10 20 30\n4 5 6 90 40 50 60\n7 8 9 1 1 1 1\n"))
    np.testing.assert_array_equal(cloud.scalars["intensity"], [200, 90])
    np.testing.assert_array_equal(cloud.colors[:, :3], [[10, 20, 30], [40, 50, 60]])
    with pytest.raises(InputError, match="holds 1 of the 1000000000 points"):
        read(save(path, "1000000000\n1 2 3\n"))


ROW = [5.0, 6.0, 7.0]
COLOR = [255, 0, 10]
UNITS = [0.5, 0.25, 1.0]
NORMAL = [0.0, -0.6, 0.8]


@pytest.mark.parametrize(
    ("values", "names"),
    [
        ([], ""),
        ([0.3], "intensity"),
        ([0.3, -4], "intensity column_5"),
        (COLOR, "red green blue"),
        (UNITS, "red green blue"),
        (NORMAL, "nx ny nz"),
        ([3, -4.5, 8], "nx ny nz"),
        ([*COLOR, 255], "red green blue alpha"),
        ([*COLOR, 17], "red green blue intensity"),
        ([*NORMAL, 0.3], "nx ny nz intensity"),
        ([-1613, *COLOR], "intensity red green blue"),
        ([*COLOR, *NORMAL], "red green blue nx ny nz"),
        ([*NORMAL, *COLOR], "nx ny nz red green blue"),
        ([*COLOR, 255, *NORMAL, 9, 8], "red green blue alpha nx ny nz intensity column_12"),
    ],
)
def test_guesses_without_names(values: list[float], names: str) -> None:
    table = np.array([[*ROW, *values], [1, 2, 3, *values], [np.nan] * (3 + len(values))])
    assert guess_names(table) == ["x", "y", "z", *names.split()]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("This is a letter, not a scan.\n", "line 1 is neither numbers nor names with x, y, z"),
        ("X,Y,X\n1,2,3\n", "line 1 names 'x' twice"),
        ("x y z\n", "holds no rows of numbers"),
        ("# only a remark\n", "holds no rows of numbers"),
        ("1 2\n3 4\n", "fewer than three numbers"),
        ("1 2 3\n4 5\n", "invalid column index 2 at row 2"),
        ("1 2 3\n4 5 six\n", "could not convert string 'six' to float64 at row 1"),
        ("nan nan nan 1 2 3 4\n", "none of its 1 points has finite coordinates"),
    ],
)
def test_files_that_cannot_be_used(text: str, reason: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=reason):
        read(save(tmp_path / "scan.txt", text))


def test_tables_longer_than_what_is_parsed_at_once(tmp_path: Path) -> None:
    """Read part by part, with the same numbers and the same words for what is wrong."""
    rows = np.random.default_rng(0).integers(-1000, 1000, (40_000, 3))
    text = "".join(f"{x} {y} {z}\n" for x, y, z in rows.tolist())
    np.testing.assert_array_equal(read(save(tmp_path / "scan.xyz", text)).world(), rows)
    lines = text.splitlines(keepends=True)
    with pytest.raises(InputError, match=r"could not convert string 'x' to float64 at row 30000, column 1"):
        read(save(tmp_path / "scan.xyz", "".join([*lines[:30_000], "x 1 2\n", *lines[30_001:]])))
    with pytest.raises(InputError, match=r"at row 30001 with 2 columns"):
        read(save(tmp_path / "scan.xyz", "".join([*lines[:30_000], "1 2\n", *lines[30_001:]])))
    with open(tmp_path / "scan.ply", "w") as file:
        file.write("ply\nformat ascii 1.0\nelement vertex 40000\nproperty float x\nproperty float y\n")
        file.write("property float z\nend_header\n" + "".join(lines[:16384]) + "1 2 3 4\n" * 23_616)
    with pytest.raises(InputError, match=r"the number of columns changed from 3 to 4 at row 16385 of the"):
        read(tmp_path / "scan.ply")
