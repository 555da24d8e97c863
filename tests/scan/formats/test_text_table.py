"""Text tables: delimiters, names, comments, counts, and the guesses where no names stand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viewer.errors import InputError
from viewer.scan.formats import read
from viewer.scan.reading import columns
from viewer.scan.reading.sequence import Decided


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
    decided = Decided()
    cloud = read(save(path, "2\n1 2 3 200 10 20 30\n4 5 6 90 40 50 60\n7 8 9 1 1 1 1\n"), decided=decided)
    np.testing.assert_array_equal(cloud.scalars["intensity"], [200, 90, 1])
    np.testing.assert_array_equal(cloud.colors[:, :3], [[10, 20, 30], [40, 50, 60], [1, 1, 1]])
    (report,) = decided.reports()
    assert report.text == (
        "scan.pts: the line above the rows states 2 points, but there are 3 rows. Scan4D reads all rows"
    )
    assert len(read(save(path, "1000000000\n1 2 3\n"))) == 1


def test_several_blocks_of_a_pts_file(tmp_path: Path) -> None:
    decided = Decided()
    cloud = read(save(tmp_path / "scan.pts", "2\n1 2 3 9\n4 5 6 9\n1\n7 8 9 9\n"), decided=decided)
    np.testing.assert_array_equal(cloud.world(), [[1, 2, 3], [4, 5, 6], [7, 8, 9]])
    assert not decided.reports()


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
    assert columns.names_of(columns.decide(table).value) == ["x", "y", "z", *names.split()]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("This is a letter, not a scan.\n", "line 1 contains neither numbers nor the names x, y and z"),
        ("X,Y,X\n1,2,3\n", "line 1 names 'x' twice"),
        ("x y z\n", "contains no rows of numbers"),
        ("# only a remark\n", "contains no rows of numbers"),
        ("1 2\n3 4\n", "fewer than three numbers"),
        ("1 2 3\n4 5\n", "row 2 has only 2 values, but Scan4D needs column 3"),
        ("1 2 3\n4 5 six\n", "row 2, column 3: 'six' is not a number"),
        ("nan nan nan 1 2 3 4\n", "none of the 1 points has finite coordinates"),
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
    with pytest.raises(InputError, match="row 30,001, column 1: 'x' is not a number"):
        read(save(tmp_path / "scan.xyz", "".join([*lines[:30_000], "x 1 2\n", *lines[30_001:]])))
    with pytest.raises(InputError, match="row 30,001 has only 2 values"):
        read(save(tmp_path / "scan.xyz", "".join([*lines[:30_000], "1 2\n", *lines[30_001:]])))
    with open(tmp_path / "scan.ply", "w") as file:
        file.write("ply\nformat ascii 1.0\nelement vertex 40000\nproperty float x\nproperty float y\n")
        file.write("property float z\nend_header\n" + "".join(lines[:16384]) + "1 2 3 4\n" * 23_616)
    with pytest.raises(InputError, match="row 16,385 has 4 values, but the rows above have 3"):
        read(tmp_path / "scan.ply")


@pytest.mark.slow
def test_a_row_of_very_many_columns_is_refused(tmp_path: Path) -> None:
    """Guessing the names of half a million columns would take hours if it looked at all for each."""
    with pytest.raises(InputError, match="has 500,000 columns, but Scan4D reads at most 4,096"):
        read(save(tmp_path / "scan.xyz", "1 " * 500_000 + "\n"))
    wide = read(save(tmp_path / "scan.xyz", "1 2 3 " + "700 " * 4093 + "\n"))
    assert list(wide.scalars)[-1] == "column_4096"


def test_names_are_guessed_in_one_pass() -> None:
    looked_at = 0

    class Counting(np.ndarray):
        def __getitem__(self, key: object) -> object:
            nonlocal looked_at
            looked_at += isinstance(key, tuple)
            return super().__getitem__(key)

    roles = columns.decide(np.full((2, 3000), 7.5).view(Counting)).value
    assert len(roles) == 3000
    assert looked_at < 5 * 3000


@pytest.mark.parametrize("suffix", [".xyz", ".obj", ".ply", ".pcd"])
def test_a_line_without_an_end_is_refused(suffix: str, tmp_path: Path) -> None:
    head = {
        ".ply": "ply\nformat ascii 1.0\nelement vertex 1\n" + "".join(f"property float {n}\n" for n in "xyz"),
        ".pcd": "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n",
    }.get(suffix, "")
    head += "end_header\n" if suffix == ".ply" else "v " if suffix == ".obj" else ""
    with pytest.raises(InputError, match="line 1 has more than 1,048,576 characters"):
        read(save(tmp_path / f"scan{suffix}", head + "1 " * 600_000))


def test_names_that_stand_twice_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="line 1 names 'x' twice, and lacks x, y or z"):
        read(save(tmp_path / "scan.txt", "X,Y,X\n1,2,3\n"))
    with pytest.raises(InputError, match="two columns have the name 'x'"):
        read(save(tmp_path / "scan.csv", "X,Y,Z,x\n1,2,3,4\n"))


@pytest.mark.parametrize("line", ["\n", "# x y z\n", ",,,\n"])
def test_rows_far_below_are_not_looked_for(line: str, tmp_path: Path) -> None:
    assert len(read(save(tmp_path / "scan.csv", line * 60_000 + "1,2,3\n"))) == 1
    with pytest.raises(InputError, match="contains no rows of numbers in its first 65,536 lines"):
        read(save(tmp_path / "scan.csv", line * 70_000 + "1,2,3\n"))


def test_a_column_without_a_name_is_called_by_its_place(tmp_path: Path) -> None:
    assert set(read(save(tmp_path / "scan.csv", 'x;y;z;"";q\n1;2;3;4;5\n')).scalars) == {"column_4", "q"}


# --- camera matrices ----------------------------------------------------------------------

POSE = """\
 0.9093129 0.2726223 -0.3142243 -0.3404563
-0.2724862 0.9610498  0.0452796  0.0164698
 0.3143393 0.0444496  0.9482094  0.2965692
"""
LAST = "0 0 0 1\n"
INTRINSICS = "585 0 320\n0 585 240\n0 0 1\n"


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (POSE + LAST, r"a camera pose \(4 x 4\)"),
        ((POSE + LAST) * 5, r"5 camera poses \(4 x 4 each\)"),
        (POSE, r"a camera pose \(3 x 4\)"),
        ((POSE + "\n") * 3, r"3 camera poses \(3 x 4 each\)"),
        ("1 0 0 0\n0 1 0 0\n0 0 1 0\n" + LAST, r"a camera pose \(4 x 4\)"),
        (POSE.replace("\n", " ") + "\n", r"a camera pose \(3 x 4\)"),
        (INTRINSICS, r"a matrix of camera intrinsics \(3 x 3\)"),
        (INTRINSICS * 2, r"2 matrices of camera intrinsics \(3 x 3 each\)"),
        (INTRINSICS.replace("\n", " 0\n") + LAST, r"a matrix of camera intrinsics \(4 x 4\)"),
    ],
)
def test_camera_matrices_are_no_points(text: str, what: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=f"looks like {what}, not like points. If the numbers are points"):
        read(save(tmp_path / "frame.pose.txt", text))
    named = "x y z a b c d e f g h i\n" if text.count("\n") == 1 else "x y z w\n"
    if len(text.split()) % 4 == 0:
        assert len(read(save(tmp_path / "frame.pose.txt", named + text)))  # who says so means points


@pytest.mark.parametrize(
    "text",
    [
        "0 0 0\n1 0 0\n0 1 0\n",
        "1 0 0\n0 1 0\n0 0 1\n",
        "1 0 0 5\n0 1 0 6\n0 0 1 7\n",
        "0 0 0\n1 0 0\n0 1 0\n0 0 1\n",
        "0 0 0 1\n1 0 0 1\n0 1 0 1\n0 0 0 1\n",
        "585.1 0.3 320\n0.2 585 240\n0 0 1\n",
        "0.12 0.34 0.5 17\n0.13 0.36 0.5 18\n0.2 0.31 0.52 16\n",
        "-40 12 3\n12 -50 3\n0 0 1\n",
        "1 2 3 4 5 6 7 8 9 10 11 12\n",
    ],
)
def test_a_few_points_are_points(text: str, tmp_path: Path) -> None:
    assert len(read(save(tmp_path / "scan.txt", text))) == text.count("\n")


def test_the_matrices_beside_real_range_scans(data_dir: Path) -> None:
    files = sorted((data_dir / "range" / "sevenscenes_kinect_31").glob("*.txt"))
    assert len(files) == 32
    for file in files:
        with pytest.raises(InputError, match=r"looks like a (camera pose|matrix of camera intrinsics)"):
            read(file)


def test_a_count_of_very_many_digits_is_told_in_our_words(tmp_path: Path) -> None:
    path = tmp_path / "scan.pts"
    path.write_text("9" * 5000 + "\n1 2 3\n")
    with pytest.raises(
        InputError, match=r"the count of its points is '9+\.{3}', which is not a usable whole number"
    ):
        read(path)
