"""Files of landmarks as other programs write them."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import c3d
import numpy as np
import pytest

from viewer.analysis.landmarks.files import is_landmark_file, read_landmarks
from viewer.analysis.landmarks.landmark_set import LandmarkSet
from viewer.analysis.track import Known

URL = "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/"


def read(folder: Path, name: str, text: str, **scan: Any) -> LandmarkSet:
    (folder / name).write_bytes(text.encode())
    assert is_landmark_file(folder / name)
    return read_landmarks(folder / name, **scan)


def markups(version: str = "1.0.3", **markup: Any) -> str:
    """A file as 3D Slicer writes it, with two points and one that is not placed yet."""

    def point(number: int, **more: Any) -> dict[str, Any]:
        return {
            "id": f"{number}", "label": f"F-{number}", "description": "", "associatedNodeID": "",
            "position": [10.0 * number, -2.5, 30.0],
            "orientation": [-1.0, -0.0, -0.0, -0.0, -1.0, -0.0, 0.0, 0.0, 1.0],
            "selected": True, "locked": False, "visibility": True, "positionStatus": "defined",
        } | more  # fmt: skip

    points = [point(1), point(2), point(3, position=[0.0, 0.0, 0.0], positionStatus="undefined")]
    one = {
        "type": "Fiducial", "coordinateSystem": "LPS", "locked": False, "labelFormat": "%N-%d",
        "controlPoints": points, "measurements": [], "display": {"visibility": False, "opacity": 1.0},
    } | markup  # fmt: skip
    return json.dumps({"@schema": f"{URL}markups-schema-v{version}.json#", "markups": [one]}, indent=4)


@pytest.mark.parametrize("version", ["1.0.0", "1.0.1", "1.0.2", "1.0.3", "1.0.4"])
def test_markups_of_each_schema(version: str, tmp_path: Path) -> None:
    found = read(tmp_path, "m.mrk.json", markups(version, coordinateUnits="mm"))
    assert found.names == ("F-1", "F-2", "F-3")
    assert (found.axes, found.unit, found.is_framed) == ("LPS", "mm", False)
    np.testing.assert_array_equal(found.positions[0, :2], [[10, -2.5, 30], [20, -2.5, 30]])
    np.testing.assert_array_equal(found.known[0], [Known.PLACED, Known.PLACED, Known.PENDING])
    assert np.isnan(found.positions[0, 2]).all()


@pytest.mark.parametrize("axes", ["LPS", "RAS", "lps", "0", "1", 0, 1])
def test_axes_of_markups(axes: str | int, tmp_path: Path) -> None:
    """Numbers stand for them in old files: 0 for RAS, 1 for LPS."""
    is_ras = axes in ("RAS", "0", 0)
    text = markups(coordinateSystem=axes)
    turned = [-10, 2.5, 30]
    for of_scan in ("LPS", "RAS"):
        found = read(tmp_path, "m.mrk.json", text, axes=of_scan)
        flipped = is_ras != (of_scan == "RAS")
        np.testing.assert_array_equal(found.positions[0, 0], turned if flipped else [10, -2.5, 30])


@pytest.mark.parametrize("unit", ["um", "µm", ["um", "UCUM", "micrometer"]])
def test_units_of_markups(unit: Any, tmp_path: Path) -> None:
    found = read(tmp_path, "m.mrk.json", markups(coordinateUnits=unit), unit="mm")
    np.testing.assert_allclose(found.positions[0, 0], [0.01, -0.0025, 0.03])
    found = read(tmp_path, "m.mrk.json", markups(), unit="m")  # 1.0.0 tells no unit: 3D Slicer has mm
    np.testing.assert_allclose(found.positions[0, 0], [0.01, -0.0025, 0.03])


@pytest.mark.parametrize("unit", ["survey foot", "%s%s", "mm\n", "mm##x", "m" * 100_000])
@pytest.mark.parametrize("of_scan", [None, "mm"])
def test_a_unit_that_is_none_is_not_passed_over_in_silence(
    unit: str, of_scan: str | None, tmp_path: Path
) -> None:
    found = read(tmp_path, "m.mrk.json", markups(coordinateUnits=unit), unit=of_scan)
    assert found.unit == of_scan
    np.testing.assert_array_equal(found.positions[0, 0], [10, -2.5, 30])
    (remark,) = found.remarks
    assert remark.startswith(f"The lengths are in '{unit[:5]}")
    assert len(remark) < 200


def test_states_of_markups(tmp_path: Path) -> None:
    points: list[dict[str, Any]] = [
        {"label": "a", "position": [1, 2, 3]},
        {"label": "b", "position": [1, 2, 3], "positionStatus": "preview"},
        {"label": "c", "position": "", "positionStatus": "undefined"},
        {"label": "d", "positionStatus": "defined"},
        {"label": "e", "position": [1, 2, 3], "positionStatus": 2},
        {"label": "f", "position": [1, float("nan"), 3], "positionStatus": "defined"},
    ]
    found = read(tmp_path, "m.mrk.json", markups(controlPoints=points))
    placed, pending = Known.PLACED, Known.PENDING
    np.testing.assert_array_equal(found.known[0], [placed, pending, pending, pending, placed, pending])
    np.testing.assert_array_equal(found.positions[0, 1], [1, 2, 3])  # a preview
    assert found.remarks == (
        "The file marks 2 points as defined, but gives them no position, such as 'd'",
        "1 point is a preview that nobody has confirmed in 3D Slicer, such as 'b'",
    )


def test_several_markups_in_one_file(tmp_path: Path) -> None:
    data = json.loads(markups())
    line = {
        "type": "Line",
        "name": "width",
        "coordinateSystem": "LPS",
        "controlPoints": [{"position": [1, 2, 3]}],
    }
    data["markups"].append(line)
    found = read(tmp_path, "m.mrk.json", json.dumps(data))
    assert found.names == ("F-1", "F-2", "F-3", "width")


def test_fiducials_of_slicer_itself() -> None:
    found = read_landmarks(Path(__file__).parent / "slicer" / "L1.fcsv", axes="RAS")
    assert found.names == ("L1-P1", "L1-P2")
    assert (found.axes, found.unit) == ("RAS", "mm")
    np.testing.assert_array_equal(found.positions[0], [[43.3769, 23.1343, 0], [49.8834, -4.33769, 0]])


FCSV = """# Markups fiducial file version = {version}
# CoordinateSystem = {axes}
# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID
vtkMRMLMarkupsFiducialNode_0,1.5,-2,3,0,0,0,1,1,1,1,"nose, tip","a ""quoted"" text",
vtkMRMLMarkupsFiducialNode_1,4,5,6,0.000,0.000,0.000,1.000,1,1,0,chin,,vtkMRMLScalarVolumeNode2,2,0
vtkMRMLMarkupsFiducialNode_2,0,0,0,0,0,0,1,1,1,0,later,,\r,0,0
"""


@pytest.mark.parametrize(("axes", "is_ras"), [("0", True), ("RAS", True), ("1", False), ("LPS", False)])
def test_fiducials(axes: str, is_ras: bool, tmp_path: Path) -> None:
    found = read(tmp_path, "m.fcsv", FCSV.format(version="4.11", axes=axes))
    assert found.names == ("nose, tip", "chin", "later")
    assert found.about[0] == 'a "quoted" text'
    np.testing.assert_array_equal(found.positions[0, 0], [-1.5, 2, 3] if is_ras else [1.5, -2, 3])
    assert found.known[0].tolist() == [Known.PLACED, Known.PLACED, Known.PENDING]


def test_fiducials_of_slicer_3(tmp_path: Path) -> None:
    text = "# Fiducial List file\n# columns = label,x,y,z,sel,vis\na,1,2,3,1,1\nb,4,5,6,1,1\n"
    found = read(tmp_path, "m.fcsv", text, axes="RAS")
    assert found.names == ("a", "b")
    np.testing.assert_array_equal(found.positions[0], [[1, 2, 3], [4, 5, 6]])


TPS = """LM=2
1 2
NA NA
CURVES=1
POINTS=3
1 2
3 4
5 6
IMAGE=a.jpg
ID=0
SCALE=0.5
lm3=2
1.0\t2.0\t3.0
4e0 -5 +6.
ID=1
COMMENT=by hand
VARIABLES=sex=f
"""


def test_tps_of_other_programs(tmp_path: Path) -> None:
    found = read(tmp_path, "m.tps", TPS.replace("\n", "\r\n"))
    assert found.names == ("1", "2")
    np.testing.assert_array_equal(found.positions[0, 0], [0.5, 1, 0])
    assert np.isnan(found.positions[0, 1]).all()
    np.testing.assert_array_equal(found.positions[1], [[1, 2, 3], [4, -5, 6]])
    assert [text.split()[0:2] for text in found.remarks] == [["Scan4D", "does"], ["The", "landmarks"]]


MORPHOLOGIKA = """[Individuals]
2
[landmarks]
2
[Dimensions]
3
[names]
one
two
[labels]
sex
[labelvalues]
F
M
[rawpoints]
'#1
1 2 3
4 5 6

'#2
7,8,9
-1 -2 -3
[wireframe]
1 2
"""


def test_morphologika_of_other_programs(tmp_path: Path) -> None:
    for name in ("m.txt", "m.morphologika"):
        found = read(tmp_path, name, MORPHOLOGIKA)
        np.testing.assert_array_equal(found.positions[1], [[7, 8, 9], [-1, -2, -3]])
        assert len(found) == 2
        assert found.remarks == ("Scan4D leaves out these parts of the file: labels and lines",)
    flat = read(
        tmp_path, "m.txt", "[individuals]\n1\n[landmarks]\n1\n[dimensions]\n2\n[rawpoints]\n'a\n1 2\n"
    )
    np.testing.assert_array_equal(flat.positions, [[[1, 2, 0]]])


LISTS = {
    "idav.pts": "Version 1.0\n3\nS000 1 2 3\nS001 4 5 6\nC000 9999 9999 9999\n",
    "ibug.pts": "version: 1\nn_points:  2\n{\n1.5 2.5\n3.5 4.5\n}\n",
    "lddmm.lm": "Landmarks-1.0\n2\nnose\n1 2 3 1 1\nchin\n4 5 6 0 1\n",
    "bosphorus.lm3": "# of a face\n2 landmarks:\n\nOuter left eyebrow\n1 2 3\nNose tip\n4 5 6\n",
    "named.lm": "nose tip, 1, 2, 3\nch-L, 4, 5, 6\n",
    "numbered.lm": "1 1 2 3\n2 4 5 6\n3 7 8 9\n",
}


@pytest.mark.parametrize(
    ("name", "names", "places"),
    [
        ("idav.pts", ("S000", "S001", "C000"), [[1, 2, 3], [4, 5, 6], None]),
        ("ibug.pts", ("1", "2"), [[1.5, 2.5, 0], [3.5, 4.5, 0]]),
        ("lddmm.lm", ("nose", "chin"), [[1, 2, 3], None]),
        ("bosphorus.lm3", ("Outer left eyebrow", "Nose tip"), [[1, 2, 3], [4, 5, 6]]),
        ("named.lm", ("nose tip", "ch-L"), [[1, 2, 3], [4, 5, 6]]),
        ("numbered.lm", ("1", "2", "3"), [[1, 2, 3], [4, 5, 6], [7, 8, 9]]),
    ],
)
def test_lists_of_points(name: str, names: tuple[str, ...], places: list[Any], tmp_path: Path) -> None:
    (tmp_path / name).write_text(LISTS[name])
    found = read_landmarks(tmp_path / name)
    assert found.names == names
    assert is_landmark_file(tmp_path / name) == (name != "numbered.lm")
    wanted = np.array([place or [np.nan] * 3 for place in places])
    np.testing.assert_array_equal(found.positions[0], wanted)


def test_tables_of_other_programs(tmp_path: Path) -> None:
    found = read(tmp_path, "m.csv", "Label;X;Y;Z\r\nnose;1;2;3\r\nchin;4;5;6\r\n")
    assert (found.names, found.is_framed) == (("nose", "chin"), False)
    found = read(tmp_path, "m.csv", "Frame,Time,nose.x,nose.y,nose.z\n3,0.1,1,2,3\n5,0.2,,,\n")
    np.testing.assert_array_equal(found.frames, [2, 4])
    assert found.known[:, 0].tolist() == [Known.PLACED, Known.GAP]
    text = (
        "kind,frame,name,x,y,z,unit\nlandmark,1,a,1,2,3,cm\nmeasure,1,width,,,,mm\nlandmark,2,a,10,20,30,mm\n"
    )
    found = read(tmp_path, "m.csv", text)
    assert found.unit == "cm"
    np.testing.assert_allclose(found.positions[:, 0], [[1, 2, 3], [1, 2, 3]])


def test_c3d_in_whole_numbers_beside_analog_channels(tmp_path: Path) -> None:
    """Coordinates of 16 bit with a scale, a unit for each point, force plates, as motion capture has them."""
    rng = np.random.default_rng(6)
    places = np.round(rng.normal(size=(7, 3, 3)) * 400)
    writer = c3d.Writer(point_rate=100.0, analog_rate=200.0, point_scale=0.5)
    writer.set_start_frame(31)
    writer.set_point_labels(["LASI ", "RASI ", "STRN "])
    writer.set_analog_labels(["Fx", "Fy"])
    writer.point_group.add_str("UNITS", "", "cm  " * 3, 4, 3)
    for number, row in enumerate(places):
        points = np.hstack([row, np.zeros((3, 2))]).astype(np.float32)
        points[2, 3] = -1 if number % 2 else 0
        writer.add_frames((points, np.ones((2, 2), np.float32)))
    with open(tmp_path / "m.c3d", "wb") as stream:
        writer.write(stream)
    found = read_landmarks(tmp_path / "m.c3d", "mm")
    assert found.names == ("LASI", "RASI", "STRN")
    np.testing.assert_array_equal(found.frames, np.arange(30, 37))
    np.testing.assert_allclose(found.times, np.arange(30, 37) / 100)
    there = found.is_defined
    assert there[:, :2].all()
    np.testing.assert_array_equal(there[:, 2], [True, False] * 3 + [True])
    np.testing.assert_allclose(found.positions[there], 10 * places[there], rtol=1e-6)


@pytest.mark.filterwarnings("ignore:No analog data")
@pytest.mark.parametrize("rate", [-5.0, np.inf])
def test_c3d_with_an_unusable_rate_has_no_times(rate: float, tmp_path: Path) -> None:
    """Its frames keep their numbers."""
    writer = c3d.Writer(point_rate=80.0)
    writer.set_point_labels(["a"])
    for _ in range(3):
        writer.add_frames((np.ones((1, 5), np.float32), np.empty((0, 0), np.float32)))
    with open(tmp_path / "m.c3d", "wb") as stream:
        writer.write(stream)
    data = (tmp_path / "m.c3d").read_bytes()
    np.testing.assert_allclose(read_landmarks(tmp_path / "m.c3d", "mm").times, np.arange(3) / 80)
    (tmp_path / "m.c3d").write_bytes(data.replace(struct.pack("<f", 80), struct.pack("<f", rate)))
    found = read_landmarks(tmp_path / "m.c3d", "mm")
    assert np.isnan(found.times).all()
    np.testing.assert_array_equal(found.frames, np.arange(3))
