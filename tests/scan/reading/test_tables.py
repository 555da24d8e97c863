"""Heads of text tables: names, remarks, labels, counts; tables of no points; the preview of the dialog."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viewer.errors import EmptyFrame, InputError
from viewer.scan import formats
from viewer.scan.open import open_scan
from viewer.scan.reading.corrections import Corrections
from viewer.scan.reading.sequence import Decided
from viewer.scan.reading.tables import head_of, preview, split_names

ROWS = [[1, 2, 3], [4, 5, 6], [7, 8, 10]]


def save(path: Path, text: str, encoding: str = "utf-8") -> Path:
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.parametrize(
    "text",
    [
        "Scan of 2024\nUnits: mm\nx y z\n1 2 3\n4 5 6\n7 8 10\n",
        "Measured 2024 05 01\nby hand\n1 2 3\n4 5 6\n7 8 10\n",
        "nose 1 2 3\neye 4 5 6\nchin 7 8 10\n",
        "name,x,y,z\nleft eye,1,2,3\nnose,4,5,6\nchin,7,8,10\n",
        "id;label;x;y;z\n1;a;1,0;2,0;3,0\n2;b;4,0;5,0;6,0\n3;c;7,0;8,0;10,0\n",
        "//X Y Z\n3\n1 2 3\n4 5 6\n7 8 10\n",
        "640 480\n1 2 3\n4 5 6\n7 8 10\n",
        "1|2|3\n4|5|6\n7|8|10\n",
        "1,2,3;\n4,5,6;\n7,8,10;\n",
        "[1, 2, 3]\n[4, 5, 6]\n[7, 8, 10]\n",
        "; made by hand\n1 2 3\n! good\n4 5 6\n/* end */\n7 8 10\n",
        "1 2 3\n4 5 6\n7 8 10\nEND\n",
        "x y z\n1 1 2 3\n2 4 5 6\n3 7 8 10\n",  # of R, which writes no name for the rows
        '"x" "y" "z"\n"1" 1 2 3\n"2" 4 5 6\n"3" 7 8 10\n',
        "\tx\ty\tz\n0\t1\t2\t3\n1\t4\t5\t6\n2\t7\t8\t10\n",
        "x,y,z\na,1,2,3\nb,4,5,6\nc,7,8,10\n",
        "x [mm] y [mm] z [mm]\n1 2 3\n4 5 6\n7 8 10\n",
        '"x","y","z"\n"1","2","3"\n"4","5","6"\n"7","8","10"\n',
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "cp1252"])
def test_heads_of_other_programs(text: str, encoding: str, tmp_path: Path) -> None:
    cloud = formats.read(save(tmp_path / "scan.txt", text, encoding))
    np.testing.assert_allclose(cloud.world(), ROWS)
    assert cloud.colors is None


@pytest.mark.parametrize(
    "names",
    [
        "x(mm);y(mm);z(mm)", "x {mm};y {mm};z {mm}", "x / mm;y / mm;z / mm", "x-mm;y-mm;z-mm", "Xmm;Ymm;Zmm",
        "X_mm;Y_mm;Z_mm", "x in mm;y in mm;z in mm", "X [Millimeter];Y [Millimeter];Z [Millimeter]",
        "x;y;z\nmm;mm;mm", "x;y;z\n[mm];[mm];[mm]",
    ],
)  # fmt: skip
def test_units_in_the_names_and_below_them(names: str, tmp_path: Path) -> None:
    with open_scan(save(tmp_path / "scan.csv", f"{names}\n1;2;3\n4;5;6\n")) as timeline:
        np.testing.assert_allclose(timeline.pose(0).cloud.world(), ROWS[:2])
        assert timeline.unit == "mm"


def messages(file: Path) -> str:
    with open_scan(file) as timeline:
        timeline.pose(0)
        return " ".join(message.text for message in timeline.messages)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x [mm],y [mm],z [m]\n1,2,3\n", "different units (m, mm)"),
        ("x y z\n1 2 3 255 0 0\n4 5 6 0 255 0\n", "the table names 3 columns, but the rows have 6 values"),
        ("x y z r g b\n1 2 3\n4 5 6\n", "the table names 6 columns, but the rows have 3 values"),
        ("1 2 3\n4 5 6 7\n", "3 to 4 values"),
        ("0x10 2 3\n4 5 6\n7 8 9\n", "does not read line 1"),
        ("x,y,z\n1,2,3\n4,5,6\nTotal: 2 points\n", "1 lines of text below the rows"),
    ],
)
def test_what_does_not_fit_together_is_reported(text: str, words: str, tmp_path: Path) -> None:
    assert words in messages(save(tmp_path / "scan.csv", text))
    assert "values" not in messages(save(tmp_path / "plain.csv", "x,y,z,\n1,2,3,\n4,5,6,\n"))


def test_columns_of_text_are_in_the_record(tmp_path: Path) -> None:
    with open_scan(
        save(tmp_path / "scan.csv", "name,x,y,z,color\na,1,2,3,#ff0000\nb,4,5,6,#00ff00\n")
    ) as scan:
        scan.pose(0)
        texts = scan.reading.unused
    assert texts == ("the column 'name', which contains text", "the column 'color', which contains text")


@pytest.mark.parametrize("time", ["2024-05-01T12:30:0{}", "12:30:0{}.5"])
def test_clock_times_of_several_moments_are_reported(time: str, tmp_path: Path) -> None:
    rows = "".join(f"{time.format(frame)},{x},0,0\n" for frame in (1, 2) for x in range(3))
    assert "does not read frames or times from the column 'Time'" in messages(
        save(tmp_path / "scan.csv", f"Time,x,y,z\n{rows}")
    )


@pytest.mark.parametrize("text", ["x y z\n", "# nothing\n", "0\n", "\n\n"])
def test_a_table_without_rows_is_an_empty_frame_of_a_sequence(text: str, tmp_path: Path) -> None:
    for number, content in enumerate(["1 2 3\n", text, "4 5 6\n"]):
        save(tmp_path / f"f{number}.xyz", content)
    with open_scan(tmp_path) as timeline:
        with pytest.raises(EmptyFrame):
            timeline.pose(1)
        assert (list(timeline.empty), len(timeline.drawn(1).cloud)) == ([1], 0)
        assert "empty picture for frame 2" in timeline.messages[-1].text
    with pytest.raises(InputError, match="no rows of numbers"):
        formats.read(tmp_path / "f1.xyz")


def test_a_table_that_lacks_the_rows_it_promises_is_damaged(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="a line states 7 points") as refused:
        formats.read(save(tmp_path / "scan.pts", "7\n"))
    assert not isinstance(refused.value, EmptyFrame)


def test_numbers_that_are_not_finite_in_the_first_row(tmp_path: Path) -> None:
    cloud = formats.read(save(tmp_path / "scan.csv", "x,y,z,q\n1,2,3,1.#QNAN\n4,5,6,7\n1.#IND,2,3,4\n"))
    np.testing.assert_array_equal(cloud.world(), [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(cloud.scalars["q"], [np.nan, 7])
    assert cloud.dropped == 1


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("1 PINHOLE 640 480 525 525 319.5 239.5\n", "a list of cameras"),
        ("# IMAGE_ID, ...\n1 0.8 0.6 0 0 1 2 3 1 a.jpg\n10 20 -1 30 40 5\n", "a list of camera poses"),
        ("#   FRAME_ID, RIG_ID, ...\n1 1 1 0 0 0 .1 .2 .3 1 CAMERA 1 1\n", "a list of camera poses"),
        ("x y z qx qy qz qw\n1 2 3 0 0 0 1\n4 5 6 0 0 0 1\n", "camera poses"),
        ("ply\nformat ascii 1.0\nelement vertex 1\nend_header\n1 2 3\n", "a PLY file"),
        ("525.0 525.0 319.5 239.5\n", "intrinsics of a camera"),
        ("525.0 525.0 319.5 239.5 0.1 -0.2 0 0 0\n", "intrinsics of a camera"),
        ("640 480 525.0 525.0 319.5 239.5\n", "intrinsics of a camera"),
        ("fx fy cx cy\n525 525 319.5 239.5\n", "intrinsics of a camera"),
        ("1.0 0 0 0 0 0 0 1\n2.0 0 1 0 0 0 0.6 0.8\n", "a camera trajectory"),
        ("0 0 0 0 0 0 1\n0 1 0 0 0 0.6 0.8\n", "2 camera poses"),
        ("timestamp, frame, x, y, z, qx, qy, qz, qw\n1, 0, 0,0,0,0,0,0,1\n", "a camera trajectory"),
        ("ncols 3\nnrows 2\ncellsize 1\n1 2 3\n4 5 6\n", "a grid of heights"),
    ],
)
def test_tables_that_hold_no_points(text: str, what: str, tmp_path: Path) -> None:
    path = save(tmp_path / "table.txt", text)
    with pytest.raises(InputError, match=f"looks like {what}"):
        formats.read(path)


@pytest.mark.parametrize("tracks", ["16 65 15 73", "16 65"])
@pytest.mark.parametrize(
    "head", ["", "#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, IDX)\n"]
)
def test_sparse_points_with_tracks(head: str, tracks: str, tmp_path: Path) -> None:
    rows = f"63 1.5 0.25 0.5 115 121 122 1.3 {tracks} 6 67\n64 2.0 0.125 -0.25 102 209 250 1.7 16 19\n"
    cloud = formats.read(save(tmp_path / "points3D.txt", head + rows))
    np.testing.assert_allclose(cloud.world(), [[1.5, 0.25, 0.5], [2, 0.125, -0.25]])
    np.testing.assert_array_equal(cloud.colors[:, :3], [[115, 121, 122], [102, 209, 250]])


def test_unknown_names_are_no_remark(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"neither numbers nor the names x, y and z: 'a,b,c"):
        formats.read(save(tmp_path / "scan.csv", "a,b,c\n1,2,3\n"))


def test_commas_between_and_inside_numbers(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="decimal marks"):
        formats.read(save(tmp_path / "scan.csv", "1,25,2,50,-3,05\n4,50,5,25,6,12\n"))


def test_moments_of_a_table(tmp_path: Path) -> None:
    text = "time [ms];id;x;y;z\n0;1;1,5;2;3\n0;0;4;5;6\n50;0;4;5;6,5\n50;1;NaN;2;3\n"
    with open_scan(save(tmp_path / "scan.csv", text)) as timeline:
        assert len(timeline) == 2
        assert timeline.times.tolist() == [0, 0.05]
        first, second = (timeline.pose(index).cloud for index in range(2))
        assert timeline.reading["frames"].value == "by the column time [ms]"
    np.testing.assert_array_equal(first.world(), [[4, 5, 6], [1.5, 2, 3]])
    assert (first.ids.tolist(), second.ids.tolist()) == ([0, 1], [0])
    assert second.dropped == 1


def test_a_user_can_have_one_cloud_of_all_moments(tmp_path: Path) -> None:
    path = save(tmp_path / "scan.csv", "frame,x,y,z\n0,1,2,3\n0,4,5,6\n1,1,2,3\n1,4,5,6\n")
    with open_scan(path) as timeline:
        assert len(timeline) == 2
    with open_scan(path, read={"frames": "cloud"}) as timeline:
        assert len(timeline.pose(0).cloud) == 4


def test_columns_that_the_user_states(tmp_path: Path) -> None:
    path = save(tmp_path / "scan.txt", "a b c d e\nnose 9 1 2 3\nchin 8 4 5 6\n")
    decided = Decided(Corrections.parse({"columns": "label intensity x y z", "skip": "1"}))
    cloud = formats.read(path, decided=decided)
    np.testing.assert_array_equal(cloud.world(), [[1, 2, 3], [4, 5, 6]])
    assert cloud.scalars["intensity"].tolist() == [9, 8]
    assert (decided.reading["columns"].source, decided.reading["skip"].value) == ("user", 1)


def test_a_frame_of_other_columns_contradicts(tmp_path: Path) -> None:
    decided = Decided()
    formats.read(save(tmp_path / "a.xyz", "1 2 3 9.5\n4 5 6 8.5\n"), decided=decided)
    cloud = formats.read(save(tmp_path / "b.xyz", "1 2 3\n4 5 6\n"), decided=decided.at(1))
    assert len(cloud) == 2
    (found,) = decided.reading.contradictions
    assert (found.frame, found.key) == (1, "columns")


def test_names_by_their_own_separator() -> None:
    assert split_names('"Points:0","Points 1"\n') == ["Points:0", "Points 1"]
    assert split_names("// x [mm] y [mm]\n") == ["x [mm]", "y [mm]"]


def test_a_preview_of_a_table(tmp_path: Path) -> None:
    path = save(tmp_path / "scan.txt", "A remark\nnose 1,5 2,5 3,5\nchin 4,5 5,5 6,5\n")
    shown = preview(path)
    assert shown.cells == (("nose", "1,5", "2,5", "3,5"), ("chin", "4,5", "5,5", "6,5"))
    assert shown.roles == ("-", "x", "y", "z")
    assert (shown.separator, shown.decimal, shown.skip, shown.problem, shown.row_count) == (
        "blank",
        ",",
        1,
        "",
        2,
    )
    stated = preview(path, Corrections.parse({"columns": "label z y x"}))
    assert stated.roles == ("label", "z", "y", "x")


def test_a_preview_of_what_cannot_be_read(tmp_path: Path) -> None:
    shown = preview(save(tmp_path / "scan.csv", "a;b;c\n1;2;3\n"))
    assert "neither numbers nor the names" in shown.problem
    assert shown.lines == ("a;b;c", "1;2;3")
    assert shown.row_count == 0


def test_the_head_is_found_below_many_remarks() -> None:
    head = head_of([*(f"remark {number}\n" for number in range(60)), "1 2 3\n", "4 5 6\n"] + ["7 8 9\n"] * 60)
    assert (head.skip, head.columns) == (60, (0, 1, 2))


# --- point files in text ------------------------------------------------------------------------

PLY = "ply\nformat ascii 1.0\nelement vertex 2\n{}end_header\n"
PCD = (
    "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n"
)
XYZ = "property float x\nproperty float y\nproperty float z\n"


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.ply", PLY.format(XYZ) + "1,25 2,5 3,75\n4 5,5 6\n"),
        ("a.ply", PLY.format(XYZ + "property list uchar int q\n") + "1,25 2,5 3,75 1 7\n4 5,5 6 2 8 9\n"),
        ("a.ply", PLY.format(XYZ.replace(" x", " x_mm").replace(" y", " y_mm").replace(" z", " z_mm"))
         + "1.25 2.5 3.75\n4 5.5 6\n"),
        ("a.ply", PLY.format(XYZ.replace("x", "Points_0").replace("float y", "float Points_1")
         .replace("float z", "float Points_2")) + "1.25 2.5 3.75\n4 5.5 6\n"),
        ("a.pcd", PCD + "1,25 2,5 3,75\n4 5,5 6\n"),
        ("a.pcd", PCD + "1,25;2,5;3,75\n4;5,5;6\n"),
        ("a.pcd", PCD + "1.25,2.5,3.75\n4,5.5,6\n"),
        ("a.obj", "v 1,25 2,5 3,75\nv 4 5,5 6\n"),
    ],
)  # fmt: skip
def test_numbers_and_names_of_point_files(name: str, text: str, tmp_path: Path) -> None:
    with open_scan(save(tmp_path / name, text)) as timeline:
        np.testing.assert_array_equal(timeline.pose(0).cloud.world(), [[1.25, 2.5, 3.75], [4, 5.5, 6]])
        assert timeline.unit == ("mm" if "x_mm" in text else "units")


def test_signs_in_numbers_of_point_files(tmp_path: Path) -> None:
    text = PLY.format(XYZ + "property float q\n") + "1 2 3 1.#QNAN\n4 5 -1.#IND 7\n"
    cloud = formats.read(save(tmp_path / "a.ply", text))
    np.testing.assert_array_equal(cloud.world(), [[1, 2, 3]])
    assert np.isnan(cloud.scalars["q"]).all()
