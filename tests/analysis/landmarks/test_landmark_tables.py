"""Tables of landmarks of other programs: 3D Slicer's CSV, MeshLab's picked points, decimal commas."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viewer.analysis.landmarks.files import is_landmark_file, read_landmarks
from viewer.analysis.track import Known
from viewer.errors import InputError


def save(path: Path, text: str, encoding: str = "utf-8") -> Path:
    path.write_bytes(text.encode(encoding))
    return path


SLICER = "label,{},defined,selected,visible,locked,description\nnose,1,2,3,1,1,1,0,tip\nchin,0,0,0,0,1,1,0,\n"


@pytest.mark.parametrize(("axes", "expected"), [("l,p,s", [1, 2, 3]), ("r,a,s", [-1, -2, 3])])
def test_a_table_of_slicer(axes: str, expected: list[float], tmp_path: Path) -> None:
    path = save(tmp_path / "points.csv", SLICER.format(axes))
    assert is_landmark_file(path)
    found = read_landmarks(path)
    assert (found.names, found.unit) == (("nose", "chin"), "mm")
    assert found.about == ("tip", "")
    np.testing.assert_array_equal(found.positions[0, 0], expected)
    assert np.isnan(found.positions[0, 1]).all()
    assert found.known[0].tolist() == [Known.PLACED, Known.PENDING]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("p.csv", "name;x;y;z\nnose;1,5;2,5;-3,25\nchin;4,0;5,0;6,5\n"),
        ("p.csv", 'name,x,y,z\nnose,"1,5","2,5","-3,25"\nchin,"4","5","6,5"\n'),
        ("p.csv", "name\tx\ty\tz\nnose\t1,5\t2,5\t-3,25\nchin\t4,0\t5,0\t6,5\n"),
        ("p.csv", "frame;nose_x;nose_y;nose_z;chin_x;chin_y;chin_z\n1;1,5;2,5;-3,25;4,0;5,0;6,5\n"),
        ("p.pts", "nose 1,5 2,5 -3,25\nchin 4,0 5,0 6,5\n"),
        ("p.lm", "2 landmarks:\nnose\n1,5 2,5 -3,25\nchin\n4,0 5,0 6,5\n"),
        ("p.pts", "nose 1.5 2.5 -3.25\nchin 4 5 6.5\n"),
    ],
)
def test_decimal_commas(name: str, text: str, encoding: str, tmp_path: Path) -> None:
    found = read_landmarks(save(tmp_path / name, text, encoding))
    assert found.names == ("nose", "chin")
    np.testing.assert_array_equal(found.positions[0], [[1.5, 2.5, -3.25], [4, 5, 6.5]])


@pytest.mark.parametrize(
    "text",
    [
        "name,x (mm),y (mm),z (mm)\nnose,1,2,3\nchin,4,5,6\n",
        "Landmark;X [mm];Y [mm];Z [mm]\nnose;1,0;2,0;3,0\nchin;4,0;5,0;6,0\n",
        "name,x_mm,y_mm,z_mm\nnose,1,2,3\nchin,4,5,6\n",
    ],
)
def test_units_in_the_names_of_columns(text: str, tmp_path: Path) -> None:
    path = save(tmp_path / "p.csv", text)
    found = read_landmarks(path)
    assert is_landmark_file(path)
    assert (found.names, found.unit) == (("nose", "chin"), "mm")
    np.testing.assert_array_equal(found.positions[0], [[1, 2, 3], [4, 5, 6]])


@pytest.mark.parametrize(
    "text",
    [
        "Punkt;X;Y;Z\nnose;1;2;3\nchin;4;5;6\n",
        "spot,x,y,z\nnose,1,2,3\nchin,4,5,6\n",  # a column of text has the names
        "name,pos_x,pos_y,pos_z\nnose,1,2,3\nchin,4,5,6\n",
        "nose,1,2,3\nchin,4,5,6\n",
        "nose;1,0;2,0;3,0\nchin;4,0;5,0;6,0\n",
        "# by hand\n\nsep=;\nname;x;y;z\nnose;1;2;3\nchin;4;5;6\n",
        "name x y z\nnose 1 2 3\nchin 4 5 6\n",
        '"name" "x" "y" "z"\n"1" "nose" 1 2 3\n"2" "chin" 4 5 6\n',
        "frame,nose X,nose Y,nose Z,chin X,chin Y,chin Z\n1,1,2,3,4,5,6\n",
        "frame,x_nose,y_nose,z_nose,x_chin,y_chin,z_chin\n1,1,2,3,4,5,6\n",
        "frame,noseX,noseY,noseZ,chinX,chinY,chinZ\n1,1,2,3,4,5,6\n",
    ],
)
def test_tables_as_people_write_them(text: str, tmp_path: Path) -> None:
    found = read_landmarks(save(tmp_path / "p.csv", text))
    assert found.names == ("nose", "chin")
    np.testing.assert_array_equal(found.positions[0], [[1, 2, 3], [4, 5, 6]])


@pytest.mark.parametrize("word", ["N/A", "-", "", "NaN", "1.#QNAN", "#VALUE!", "-9999", "9999"])
def test_landmarks_without_a_position_are_gaps(word: str, tmp_path: Path) -> None:
    found = read_landmarks(save(tmp_path / "p.csv", f"name,x,y,z\nnose,1,2,3\nchin,{word},{word},{word}\n"))
    assert np.isnan(found.positions[0, 1]).all()
    assert found.known[0].tolist() == [Known.PLACED, Known.PENDING]


@pytest.mark.parametrize(
    "text",
    [
        "frame,name,x,y,z\n0,nose,1,2,3\n1,nose,4,5,6\n",
        "Bild;Name;X;Y;Z\n0;nose;1;2;3\n1;nose;4;5;6\n",
        "frame,nose_x,nose_y,nose_z\n0,1,2,3\n1,4,5,6\n",
    ],
)
def test_frames_that_count_from_zero_are_reported(text: str, tmp_path: Path) -> None:
    found = read_landmarks(save(tmp_path / "p.csv", text))
    assert found.frames.tolist() == [0, 1]
    np.testing.assert_array_equal(found.positions[:, 0], [[1, 2, 3], [4, 5, 6]])
    assert "counts frames from 0" in found.remarks[0]


PICKED = """<!DOCTYPE PickedPoints>
<PickedPoints>
 <DocumentData><DateTime date="2024-05-01" time="12:00:00"/></DocumentData>
 <point x="1.5" y="2.5" z="-3.25" active="1" name="nose"/>
 <point x="0" y="0" z="0" active="0" name="chin"/>
 <point x="4" y="5" z="6" active="1" name=""/>
</PickedPoints>
"""


def test_picked_points_of_meshlab(tmp_path: Path) -> None:
    found = read_landmarks(save(tmp_path / "head_picked_points.pp", PICKED))
    assert found.names == ("nose", "chin", "3")
    np.testing.assert_array_equal(found.positions[0], [[1.5, 2.5, -3.25], [np.nan] * 3, [4, 5, 6]])
    assert found.axes is None


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("<PickedPoints>", "is not XML"),
        ("<PickedPoints/>", "holds no landmarks"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><PickedPoints/>', "defines XML entities"),
        ('<PickedPoints><point x="1" y="two" z="3"/></PickedPoints>', "'two' is not a number"),
    ],
)
def test_picked_points_that_cannot_be_read(text: str, reason: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=reason):
        read_landmarks(save(tmp_path / "a.pp", text))
