"""`scan4d measure`: landmarks of a file through all frames, measures of them, and what it refuses."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest
from command_line import Run

from viewer.scan import formats
from viewer.scan.points import PointCloud

FRAMES = 4
MEASURES = {
    "measures": [
        {"name": "öffnung", "kind": "distance", "landmarks": ["a", "Ж"]},
        {"name": "way", "kind": "path", "landmarks": ["a", "Ж"]},
        {"name": "winkel", "kind": "angle", "landmarks": ["a", "c", "Ж"]},
    ]
}


def write_ball(path: Path, radius: float, topology: int = 0) -> np.ndarray:
    """A ball of faces as PLY that grows with the radius; its points. topology: which points are left out."""
    rows, columns = 24, 48
    turn, rise = np.meshgrid(2 * np.pi * np.arange(columns) / columns, np.pi * (np.arange(rows) + 0.5) / rows)
    points = radius * np.stack(
        [np.sin(rise) * np.cos(turn), np.cos(rise), np.sin(rise) * np.sin(turn)], axis=2
    )
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b = number[:-1], np.roll(number[:-1], -1, axis=1)
    c, d = np.roll(number[1:], -1, axis=1), number[1:]
    faces = np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(-1, 3)
    faces = faces[: len(faces) - topology]
    flat = points.reshape(-1, 3)
    lines = [
        "ply", "format ascii 1.0", f"element vertex {len(flat)}",
        *(f"property float {axis}" for axis in "xyz"),
        f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header",
        *(" ".join(f"{value:.9g}" for value in point) for point in flat),
        *(f"3 {i} {j} {k}" for i, j, k in faces),
    ]  # fmt: skip
    path.write_text("\n".join(lines) + "\n")
    return flat


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory: a ball that grows over frames of one topology, landmarks on it, measures."""
    monkeypatch.chdir(tmp_path)
    Path("seq").mkdir()
    for number in range(FRAMES):
        points = write_ball(Path(f"seq/f{number}.ply"), 10.0 + number)
        if not number:
            first = points
    places = dict(zip(("a", "Ж", "c"), first[[500, 512, 700]].tolist(), strict=True))
    write_landmarks(Path("landmarks.csv"), places)
    Path("measures.json").write_text(json.dumps(MEASURES), encoding="utf-8")
    return tmp_path


def write_landmarks(path: Path, places: dict[str, list[float]]) -> None:
    rows = [("name", "x", "y", "z"), *((name, *place) for name, place in places.items())]
    path.write_text("\n".join(",".join(map(str, row)) for row in rows) + "\n", encoding="utf-8")


def table(path: Path) -> list[dict[str, str]]:
    with open(path, encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def test_landmarks_are_followed_and_measured_in_all_frames(run: Run) -> None:
    words = ("measure", "seq", "--landmarks", "landmarks.csv", "--measures", "measures.json")
    done = run(*words, "-o", "out.csv", "--unit", "mm")
    assert done.code == 0, done.err
    assert done.out.endswith("out.csv\nout_numbers.csv\n")
    assert [row["measure"] for row in table(Path("out_numbers.csv"))] == ["öffnung", "way", "winkel"]
    rows = table(Path("out.csv"))
    assert list(rows[0]) == [
        "kind", "frame", "time", "name", "x", "y", "z", "state", "value", "sigma", "unit", "note"
    ]  # fmt: skip
    landmarks = [row for row in rows if row["kind"] == "landmark"]
    assert [(row["frame"], row["name"]) for row in landmarks] == [
        (str(frame), name) for frame in range(1, FRAMES + 1) for name in ("a", "Ж", "c")
    ]
    assert [row["state"] for row in landmarks[:6]] == 3 * ["placed"] + 3 * ["tracked"]
    for row in landmarks:
        place = np.array([float(row[axis]) for axis in "xyz"])
        assert np.linalg.norm(place) == pytest.approx(9 + int(row["frame"]), rel=5e-3)
        assert row["unit"] == "mm"
    values = {(row["name"], row["frame"]): row for row in rows if row["kind"] == "measure"}
    assert len(values) == 3 * FRAMES
    for name, unit in (("öffnung", "mm"), ("way", "mm"), ("winkel", "deg")):
        at = [float(values[name, str(frame)]["value"]) for frame in range(1, FRAMES + 1)]
        growth = at[-1] / at[0]
        assert growth == pytest.approx(1.0 if unit == "deg" else 1.3, rel=2e-2)
        assert all(float(values[name, str(frame)]["sigma"]) > 0 for frame in range(1, FRAMES + 1))
        assert values[name, "1"]["unit"] == unit
        assert values[name, "1"]["x"] == ""
    assert float(values["way", "1"]["value"]) > float(values["öffnung", "1"]["value"])


def test_json_holds_the_same_of_chosen_poses(run: Run) -> None:
    words = (
        "measure",
        "seq",
        "--landmarks",
        "landmarks.csv",
        "--measures",
        "measures.json",
        "--poses",
        "1::2",
    )
    assert run(*words, "-o", "out.csv").code == 0
    assert run(*words, "-o", "out.json").code == 0
    held = json.loads(Path("out.json").read_text(encoding="utf-8"))
    rows = table(Path("out.csv"))
    assert {row["frame"] for row in rows} == {"2", "4"}
    assert len(held["rows"]) == len(rows) == 12
    for one, other in zip(held["rows"], rows, strict=True):
        assert {name: "" if value is None else str(value) for name, value in one.items()} == other


def test_landmarks_are_put_onto_the_surface_and_it_is_said(run: Run) -> None:
    write_landmarks(Path("off.csv"), {"on": [0, 0, 10.3], "high": [0, 0, 15.5]})
    done = run("measure", "seq", "--landmarks", "off.csv", "-o", "out.csv")
    assert done.code == 0, done.err
    assert re.search("moves landmarks onto the surface, by .* on average and by at most 0.3", done.out)
    assert "no surface near 1 positions of landmarks, such as 'high'" in done.err
    assert float(table(Path("out.csv"))[0]["z"]) == pytest.approx(10, abs=0.05)
    done = run("measure", "seq", "--landmarks", "off.csv", "-o", "out.csv", "--no-snap", "--force")
    assert done.code == 0, done.err
    assert float(table(Path("out.csv"))[0]["z"]) == 10.3


def test_the_scanners_noise_adds_to_all_deviations(run: Run) -> None:
    words = ("measure", "seq", "--landmarks", "landmarks.csv", "--measures", "measures.json", "--pose", "0")
    assert run(*words, "-o", "quiet.csv").code == 0
    assert run(*words, "-o", "noisy.csv", "--noise", "0.5").code == 0
    for quiet, noisy in zip(table(Path("quiet.csv")), table(Path("noisy.csv")), strict=True):
        assert float(noisy["sigma"]) > float(quiet["sigma"])
    assert float(noisy["sigma"]) > 0.5


def test_a_scan_of_one_frame_is_measured(run: Run) -> None:
    done = run("measure", "seq/f2.ply", "--landmarks", "landmarks.csv", "-o", "out.csv", "--no-snap")
    assert done.code == 0, done.err
    assert [row["state"] for row in table(Path("out.csv"))] == 3 * ["placed"]


def test_previews_are_told_and_not_measured(run: Run) -> None:
    def write(*states: str) -> None:
        points = [
            {"label": name, "position": [0, 0, 10.3], "positionStatus": status}
            for name, status in zip("ab", states, strict=True)
        ]
        markup = {"type": "Fiducial", "coordinateSystem": "LPS", "controlPoints": points}
        Path("m.mrk.json").write_text(json.dumps({"markups": [markup]}))

    write("preview", "defined")
    done = run("measure", "seq", "--landmarks", "m.mrk.json", "-o", "out.csv")
    assert done.code == 0, done.err
    assert "m.mrk.json: 1 point is a preview that nobody has confirmed in 3D Slicer, such as 'a'" in done.err
    assert {row["name"] for row in table(Path("out.csv")) if row["state"]} == {"b"}
    write("preview", "preview")
    done = run("measure", "seq", "--landmarks", "m.mrk.json", "-o", "none.csv")
    assert done.code == 2
    assert "2 points are previews that nobody has confirmed" in done.err
    assert "has no placed landmark" in done.err
    assert not Path("none.csv").exists()


def test_measures_are_read_as_toml_and_those_without_landmarks_are_left_out(run: Run) -> None:
    Path("m.toml").write_text(
        '[[measures]]\nname = "there"\nkind = "curve"\nlandmarks = ["a", "Ж", "c"]\n'
        'options = {shape = "straight"}\n'
        '[[measures]]\nname = "not"\nkind = "distance"\nlandmarks = ["a", "z"]\n',
        encoding="utf-8",
    )
    done = run("measure", "seq", "--landmarks", "landmarks.csv", "--measures", "m.toml", "-o", "o.csv")
    assert done.code == 0, done.err
    assert "Scan4D leaves out 'not': landmarks.csv has no landmark 'z'" in done.err
    assert {row["name"] for row in table(Path("o.csv")) if row["kind"] == "measure"} == {"there"}


def test_what_is_written_is_read_as_landmarks_again(run: Run) -> None:
    assert run("measure", "seq", "--landmarks", "landmarks.csv", "-o", "one.csv").code == 0
    done = run("measure", "seq", "--landmarks", "one.csv", "-o", "two.csv", "--no-snap")
    assert done.code == 0, done.err
    for one, other in zip(table(Path("one.csv")), table(Path("two.csv")), strict=True):
        assert [float(one[axis]) for axis in "xyz"] == pytest.approx([float(other[axis]) for axis in "xyz"])


@pytest.mark.slow
def test_a_topology_that_changes_midway_is_no_error(run: Run) -> None:
    write_ball(Path("seq/f2.ply"), 12.0, topology=40)
    done = run(
        "measure", "seq", "--landmarks", "landmarks.csv", "--measures", "measures.json", "-o", "out.csv"
    )
    assert done.code == 0, done.err
    assert len(table(Path("out.csv"))) == 6 * FRAMES


def test_points_without_faces_are_measured(run: Run) -> None:
    points = write_ball(Path("ball.ply"), 10.0)
    rng = np.random.default_rng(0)
    more = rng.standard_normal((3000, 3))
    more *= 10 / np.linalg.norm(more, axis=1)[:, None]
    formats.write(Path("points.ply"), PointCloud.from_arrays(np.concatenate([points, more])))
    done = run(
        "measure", "points.ply", "--landmarks", "landmarks.csv", "--measures", "measures.json", "-o", "o.csv"
    )
    assert done.code == 0, done.err
    values = {row["name"]: float(row["value"]) for row in table(Path("o.csv")) if row["kind"] == "measure"}
    straight = values["öffnung"]
    assert values["way"] == pytest.approx(20 * np.arcsin(straight / 20), rel=5e-3)


@pytest.mark.slow
def test_measures_without_an_axis_in_a_picture_are_told(run: Run) -> None:
    kinds = {"breite": "distance", "winkel": "angle", "fläche": "area", "raum": "volume"}
    takes = {"distance": ["a", "c"]}
    measures = [
        {"name": name, "kind": kind, "landmarks": takes.get(kind, ["a", "c", "Ж"])}
        for name, kind in kinds.items()
    ]
    Path("measures.json").write_text(json.dumps({"measures": measures}), encoding="utf-8")
    words = ("measure", "seq", "--landmarks", "landmarks.csv", "--measures", "measures.json", "--unit", "mm")
    done = run(*words, "-o", "out.csv", "--plot", "plot.svg", "--pose", "0")
    assert done.code == 0, done.err
    assert "plot.svg does not show 'raum': the axes of the plot are in mm, °, mm², not in mm³" in done.err
    assert run(*words, "-o", "o.csv", "--plot", "plot.csv", "--pose", "0").err.count("plot.csv") == 0
    assert "raum [mm³]" in table(Path("plot.csv"))[0]


@pytest.mark.parametrize(
    ("places", "words", "told"),
    [
        ({"a": [5000, 0, 0]}, (), "landmarks.csv: no landmark lies on the scan"),
        ({"a": [0, 0, 10000.0], "b": [0, 9900.0, 0]}, (), "have different units"),
        ({"a": ["nan", 0, 0]}, (), "landmarks.csv"),
        ({}, (), "landmarks.csv"),
        ({"a": [0, 0, 10]}, ("--noise", "-1"), "'-1' is not a length from 0 to"),
        ({"a": [0, 0, 10]}, ("--noise", "1e200"), "'1e200' is not a length from 0 to 1e+15"),
        ({"a": [0, 0, 10]}, ("--placed-in", "9"), "there is no pose 9"),
        ({"a": [0, 0, 10]}, ("--measures", "landmarks.csv"), "is neither a JSON nor a TOML file"),
        ({"a": [0, 0, 10]}, ("--measures", "measures.json"), "does not contain all landmarks of any measure"),
        ({"a": [0, 0, 10]}, ("--poses", "9:"), "the scan has no frame in the range 9:"),
    ],
)  # fmt: skip
def test_what_cannot_be_measured_is_told(run: Run, places: dict, words: tuple[str, ...], told: str) -> None:
    write_landmarks(Path("landmarks.csv"), places)
    done = run("measure", "seq", "--landmarks", "landmarks.csv", "-o", "out.csv", *words)
    assert done.code == 2
    assert told in done.err
    assert not Path("out.csv").exists()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[]", "must contain 'measures'"),
        ('{"measures": [3]}', "measures[0]: is not a JSON object"),
        ('{"measures": [{"name": "m", "kind": "distance", "landmarks": "ab"}]}', "is not a list of names"),
        ('{"measures": [{"name": "m", "kind": "distance", "landmarks": ["a"]}]}', "takes 2 landmarks, not 1"),
        (
            '{"measures": [{"name": "m", "kind": "dist", "landmarks": ["a", "c"]}]}',
            "unknown kind of measure 'dist'",
        ),
        ('{"measures": [{"name": "m", "kinds": 1}]}', "has an unknown field 'kinds'"),
        (json.dumps({"measures": 2 * MEASURES["measures"]}), "two measures have the name 'öffnung'"),
        ('{"measures": [', "is neither a JSON nor a TOML file"),
    ],
)
def test_measures_that_are_none_are_told_with_their_place(run: Run, text: str, told: str) -> None:
    Path("measures.json").write_text(text, encoding="utf-8")
    done = run(
        "measure", "seq", "--landmarks", "landmarks.csv", "--measures", "measures.json", "-o", "out.csv"
    )
    assert done.code == 2
    assert told in done.err
    assert "measures.json" in done.err


def asymmetric_cloud(path: Path, remark: str) -> np.ndarray:
    """300 points on one side of the y axis as PLY, PCD or OBJ with a remark; the points."""
    points = np.round(np.random.default_rng(2).random((300, 3)) * 20 + (5, 30, 0), 3)
    rows = "".join("{} {} {}\n".format(*point) for point in points.tolist())
    heads = {
        ".ply": f"ply\nformat ascii 1.0\ncomment {remark}\nelement vertex 300\nproperty double x\n"
        "property double y\nproperty double z\nend_header\n",
        ".pcd": f"# {remark}\nVERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 300\n"
        "HEIGHT 1\nPOINTS 300\nDATA ascii\n",
        ".obj": f"# {remark}\n",
    }
    if path.suffix == ".obj":
        rows = "".join(f"v {row}\n" for row in rows.splitlines())
    path.write_text(heads[path.suffix] + rows)
    return points


def save_markups(path: Path, position: np.ndarray) -> None:
    point = {"label": "tip", "position": position.tolist(), "positionStatus": "defined"}
    markup = {"type": "Fiducial", "coordinateSystem": "LPS", "controlPoints": [point]}
    path.write_text(json.dumps({"markups": [markup]}))


@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".obj"])
@pytest.mark.parametrize(
    ("remark", "options", "turned"),
    [
        ("SPACE=RAS", [], True),
        ("SPACE=LPS", [], False),
        ("made by hand", [], False),
        ("made by hand", ["--axes", "RAS"], True),
        ("made by hand", ["--read", "axes=RAS"], True),
        ("SPACE=RAS", ["--read", "axes=LPS"], False),
        ("SPACE=RAS", ["--axes", "LPS"], False),
    ],
)
def test_landmarks_are_read_in_the_axes_of_the_scan(
    suffix: str, remark: str, options: list[str], turned: bool, run: Run
) -> None:
    points = asymmetric_cloud(Path(f"cloud{suffix}"), remark)
    save_markups(Path("tip.mrk.json"), points[7] * ((-1, -1, 1) if turned else (1, 1, 1)))
    done = run(
        "measure", f"cloud{suffix}", "--landmarks", "tip.mrk.json", "-o", "out.csv", "--no-snap", *options
    )
    assert done.code == 0, done.err
    with open("out.csv", newline="", encoding="utf-8-sig") as stream:
        (row,) = [row for row in csv.DictReader(stream) if row["kind"] == "landmark"]
    np.testing.assert_allclose([float(row[axis]) for axis in "xyz"], points[7], atol=1e-3)
