"""`scan4d motion`: the table and the report, what it refuses, and that it goes on where it stopped."""

from __future__ import annotations

import csv
import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from disks import small_disk
from hill_folders import TURN, turning_hills
from moving_hills import SIDE
from scipy.spatial.transform import Rotation

from viewer.analysis.landmarks import Landmark
from viewer.analysis.surface_point import SurfacePoint
from viewer.document.document import Document
from viewer.document.landmarks import Landmarks
from viewer.document.saved_session import SavedSession, known_as, store
from viewer.scan import formats
from viewer.scan.points import PointCloud


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory: three frames of a patch that turns, and a region in its middle."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))
    turning_hills("seq", 2500)
    Path("region.json").write_text('{"spheres": [[0, 0, 0, 16]]}')
    return tmp_path


def test_the_table_and_the_report_are_written(run: Run) -> None:
    done = run("motion", "seq", "--unit", "mm", "--region", "region.json", "--reference", "1", "-o", "out")
    assert done.code == 0, done.err
    assert done.out.endswith("out/transforms.csv\nout/report.json\nout/region.json\n")
    with open("out/transforms.csv", newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["frame"] for row in rows] == ["1", "2", "3"]
    assert [row["state"] for row in rows] == ["ok"] * 3
    assert (rows[1]["qw"], rows[1]["tx"]) == ("1.0", "0.0")
    turn = Rotation.from_quat([float(rows[2][name]) for name in ("qx", "qy", "qz", "qw")])
    assert np.degrees((turn * TURN.inv()).magnitude()) < 0.1
    shift = np.array([float(rows[2][name]) for name in ("tx", "ty", "tz")])
    assert np.allclose(shift, [1, 0, 0] - TURN.apply([0.5, 0, 0]), atol=0.05)
    report = json.loads(Path("out/report.json").read_text())
    assert report["reference"]["frame"] == 2
    report = report["rigid"]
    assert report["region"]["source"] == "region.json"
    assert report["within"]["mean"] > 0.99
    assert report["states"] == {"ok": 3, "weak": 0, "gap": 0}
    again = run("motion", "seq", "--unit", "mm", "--region", "out/region.json", "--reference", "1", "-o", "b")
    assert again.code == 0, again.err
    assert Path("b/transforms.csv").read_bytes() == Path("out/transforms.csv").read_bytes()
    assert not Path("out/transforms.partial").exists()


def test_a_scan_can_be_the_reference_of_another(run: Run) -> None:
    done = run("motion", "seq", "--unit", "mm", "--reference", "seq/f1.npz", "-o", "out")
    assert done.code == 0, done.err
    report = json.loads(Path("out/report.json").read_text())
    assert report["reference"]["scan"] == "seq/f1.npz"
    assert report["rigid"]["region"]["source"] == "found"
    assert report["rigid"]["states"]["gap"] == 0


def test_the_mean_of_frames_can_be_the_reference(run: Run) -> None:
    words = ("motion", "seq", "--unit", "mm", "--region", "region.json", "--reference")
    done = run(*words, "1,0:2", "-o", "out")
    assert done.code == 0, done.err
    assert "The reference is the mean of 2 frames; on average, of 2.0 frames a point" in done.out
    report = json.loads(Path("out/report.json").read_text())
    assert report["reference"]["frame"] == 2
    assert report["reference"]["mean"]["frames"] == [2, 1]
    assert report["rigid"]["states"]["ok"] == 3
    one = run(*words, "1:2", "-o", "one")
    assert one.code == 0, one.err
    tables = [
        np.loadtxt(f"{name}/transforms.csv", delimiter=",", skiprows=1, usecols=range(2, 9))
        for name in ("out", "one")
    ]
    assert np.allclose(*tables, atol=0.02)
    assert (tables[0] != tables[1]).any()


def test_an_interrupted_command_goes_on(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from viewer.analysis.motion import stabilise

    words = ("motion", "seq", "--unit", "mm", "--region", "region.json", "-o")
    assert run(*words, "whole").code == 0
    right = stabilise.register_region
    registered: list[object] = []

    def interrupted(*args: object) -> object:
        if len(registered) == 2:
            raise KeyboardInterrupt
        registered.append(args)
        return right(*args)  # type: ignore[arg-type]

    with monkeypatch.context() as patch:
        patch.setattr(stabilise, "register_region", interrupted)
        stopped = run(*words, "out")
    assert stopped.code != 0
    assert "out keeps the frames so far" in stopped.err
    partial = Path("out/transforms.partial")
    whole = partial.read_text()
    assert len(json.loads(whole)["frames"]) == 2
    assert not Path("out/transforms.csv").exists()
    for damaged in (
        whole[:-9],
        "[]",
        whole.replace("covariance", "spread"),
        whole.replace("frames", "times"),
    ):
        partial.write_text(damaged)
        refused = run(*words, "out")
        assert refused.code == 2, refused.err
        assert "does not hold motions" in refused.err
        assert "Delete the file to begin anew" in refused.err
    for folder, unit in (("same", "mm"), ("other", "cm")):
        Path(folder).mkdir()
        (Path(folder) / "transforms.partial").write_text(whole)
        said = run("motion", "seq", "--unit", unit, "--region", "region.json", "-o", folder).out
        assert ("are known" in said) == (folder == "same")
    partial.write_text(whole)
    done = run(*words, "out")
    assert done.code == 0, done.err
    assert "2 of 3 frames are known" in done.out
    assert Path("out/transforms.csv").read_bytes() == Path("whole/transforms.csv").read_bytes()


def test_without_a_known_unit_a_point_spacing_counts_as_close(run: Run) -> None:
    done = run("motion", "seq", "--region", "region.json", "-o", "out")
    assert done.code == 0, done.err
    assert "State it with --unit" in done.err
    spacing = json.loads(Path("out/report.json").read_text())["rigid"]["limits"]["length"]
    assert 0.5 * SIDE / 50 < spacing < 1.5 * SIDE / 50


def test_a_frame_without_points_is_a_gap(run: Run) -> None:
    formats.write("seq/f1.npz", PointCloud.from_arrays(np.full((5, 3), np.nan)))
    done = run("motion", "seq", "--unit", "mm", "--region", "region.json", "-o", "out")
    assert done.code == 0, done.err
    assert "Scan4D finds no motion in 1 of 3 frames, such as frame 2: " in done.err
    assert json.loads(Path("out/report.json").read_text())["rigid"]["states"] == {
        "ok": 2,
        "weak": 0,
        "gap": 1,
    }


@pytest.mark.skipif(sys.platform == "win32", reason="no small disk can be mounted")
def test_a_found_region_is_not_looked_for_again(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from viewer.commands import _rigid

    words = ("motion", "seq", "--unit", "mm", "-o")
    whole = run(*words, "whole")
    assert "looks for a region" in whole.out

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(_rigid, "stabilise", interrupted)
        assert run(*words, "out").code != 0
    done = run(*words, "out")
    assert done.code == 0, done.err
    assert "looks for a region" not in done.out
    for name in ("transforms.csv", "region.json"):
        assert (Path("out") / name).read_bytes() == (Path("whole") / name).read_bytes()


def test_a_full_disk_is_one_message_and_the_command_continues_elsewhere(run: Run, tmp_path: Path) -> None:
    words = ("motion", "seq", "--unit", "mm", "--region", "region.json", "-o")
    with small_disk(tmp_path / "disk", 4) as disk:
        done = run(*words, disk)
        assert (done.code, done.out) == (2, "")
        assert done.err.splitlines() == [
            f"scan4d: {disk / 'transforms.partial'}: cannot be written: the disk is full. "
            "Free some space, or use another disk"
        ]
        (tmp_path / "out").mkdir()
        shutil.copy(disk / "transforms.partial", tmp_path / "out")
    assert "the motions of 1 of 3 frames are known" in run(*words, "out").out


def test_a_region_lies_around_landmarks_of_the_session(run: Run) -> None:
    key = SurfacePoint(frame=1, time=0.04, position=(0.5, 0.0, 1.0), id=None, spacing=None, level=0)
    landmarks = Landmarks(all=(Landmark("nose", (key,)),))
    store(SavedSession(known_as("seq"), None, 0, Document().with_part(landmarks)))
    Path("nose.json").write_text('{"landmarks": ["nose"], "radius": 16}')
    words = ("motion", "seq", "--unit", "mm", "--region", "nose.json", "-o", "out", "--reference")
    done = run(*words, "1")
    assert done.code == 0, done.err
    report = json.loads(Path("out/report.json").read_text())["rigid"]
    assert report["states"]["ok"] == 3
    assert np.allclose(report["region"]["middle"][:2], [0.5, 0.0], atol=1.5)
    Path("near.json").write_text('{"landmarks": ["nose"]}')
    near = run("motion", "seq", "--unit", "mm", "--region", "near.json", "-o", "near", "--reference", "1")
    assert "near.json: points count up to 2.8" in near.out
    assert "which is too few" in near.err
    elsewhere = run(*words, "0", "--force")
    assert elsewhere.code == 2
    assert "nose.json: the reference frame has no landmark 'nose'. Place it there" in elsewhere.err


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (("seq", "--unit", "mm", "--reference", "7", "-o", "out"), "no pose 7"),
        (("seq", "--unit", "mm", "--reference", "-1", "-o", "out"), "no pose -1"),
        (("seq", "--unit", "mm", "--reference", "0,7", "-o", "out"), "no pose 7"),
        (("seq", "--unit", "mm", "--reference", "5:7", "-o", "out"), "no frame in the range 5:7"),
        (("seq", "--unit", "mm", "--reference", "0,,1", "-o", "out"), "not a valid range of frames"),
        (("seq", "--unit", "mm", "--region", "none.json", "-o", "out"), "none.json"),
        (
            ("seq", "--unit", "mm", "--region", "points.json", "-o", "out"),
            "points.json: the reference frame has",
        ),
        (("seq", "--unit", "mm", "--region", "far.json", "-o", "out"), "far.json: has no points"),
        (("seq", "--dense", "--region", "far.json", "-o", "out"), "far.json: has no points"),
        (("seq/f0.npz", "--unit", "mm", "--region", "region.json", "-o", "out"), "has only one frame"),
        (("seq", "--unit", "mm", "-o", "region.json"), "a part of the path is not a folder"),
    ],
)
def test_mistakes_are_reported(run: Run, words: tuple[str, ...], what: str) -> None:
    Path("points.json").write_text('{"points": [9999]}')
    Path("far.json").write_text('{"spheres": [[0, 900, 0, 1]]}')
    done = run("motion", *words)
    assert done.code == 2
    assert what in done.err
    assert not Path("out").exists()
