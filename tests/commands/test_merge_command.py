"""`scan4d merge`: range views whose overlap is resolved, with a report; and what it refuses."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from covering import bumpy_ball, scanned
from scenes import sphere

from viewer.scan import formats
from viewer.scan.formats import exr
from viewer.scan.open import open_scan
from viewer.scan.range_view import RangeView
from viewer.simulate.scanner import Faults

SIZE = (120, 90)
GOOD, OFF = Faults(noise=0.002), Faults(noise=0.002, calibration_error=1.0)


@pytest.fixture(scope="module")
def views() -> tuple[RangeView, ...]:
    return scanned(bumpy_ball(), SIZE, GOOD, OFF)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, views: tuple[RangeView, ...]) -> Path:
    """The working directory: a scan with a pod that is a degree off, once and as three frames; points."""
    monkeypatch.chdir(tmp_path)
    exr.write_views(Path("pods.exr"), views)
    Path("seq").mkdir()
    for number in range(3):
        exr.write_views(Path(f"seq/f{number}.exr"), views)
    formats.write("points.ply", sphere(100))
    exr.write_views(Path("alone.exr"), views[:1])
    return tmp_path


def test_views_are_merged_and_a_wrong_calibration_is_told(run: Run, views: tuple[RangeView, ...]) -> None:
    done = run("merge", "pods.exr", "-o", "out.exr", "--report", "report.json")
    assert done.code == 0
    assert "calibration of pod0 and pod1 is wrong by" in done.err
    assert "--refine corrects the error" in done.err
    assert "drifted" in done.out
    assert done.out.endswith("out.exr\n")
    (pose,) = json.loads(Path("report.json").read_text())["poses"]
    (pair,) = pose["pairs"]
    assert pair["views"] == ["pod0", "pod1"]
    assert pair["drift"]["is_significant"]
    assert pair["drift"]["rotation"] == pytest.approx(1.0, abs=3 * pair["drift"]["rotation_error"])
    for view, given, told in zip(exr.read(Path("out.exr")), views, pose["views"], strict=True):
        assert not (view.mask & ~given.mask).any()
        assert np.count_nonzero(view.valid()) == told["kept"] < told["pixels"]
        assert (view.world_to_camera == given.world_to_camera).all()
        assert (view.depth.view(np.uint32) == given.depth.view(np.uint32)).all()


def test_refine_corrects_it_and_tells_the_change(run: Run, views: tuple[RangeView, ...]) -> None:
    done = run("merge", "pods.exr", "-o", "out.exr", "--refine", "--report", "report.json")
    assert done.code == 0
    assert done.err == ""
    assert "refined" in done.out
    (pose,) = json.loads(Path("report.json").read_text())["poses"]
    (pair,) = pose["pairs"]
    assert pair["drift"]["is_significant"]
    assert not pair["drift_left"]["is_significant"]
    assert pose["overlap_after"] < 0.02 < pose["overlap_before"]
    motions = [np.array(view["motion"]) for view in pose["views"]]
    assert (motions[0] == np.eye(4)).all()
    for view, given, motion in zip(exr.read(Path("out.exr")), views, motions, strict=True):
        assert np.allclose(view.world_to_camera @ motion, given.world_to_camera, rtol=0, atol=1e-9)


def test_all_poses_of_a_sequence_are_merged(run: Run, folder: Path) -> None:
    assert run("merge", "seq", "-o", "merged/f%04d.exr").code == 2  # there is no such folder
    Path("merged").mkdir()
    assert run("merge", "seq", "-o", "merged/f%04d.exr", "--poses", "1:", "--report", "r.json").code == 0
    assert sorted(path.name for path in Path("merged").iterdir()) == ["f0001.exr", "f0002.exr", "times.csv"]
    with open_scan("merged") as timeline:
        assert len(timeline) == 2
    assert [pose["pose"] for pose in json.loads(Path("r.json").read_text())["poses"]] == [1, 2]


def test_points_are_those_that_are_kept(run: Run) -> None:
    assert run("merge", "pods.exr", "-o", "out.exr").code == 0
    assert run("merge", "pods.exr", "-o", "out.ply").code == 0
    cloud = formats.read_points("out.ply")
    assert len(cloud) == sum(np.count_nonzero(view.valid()) for view in exr.read(Path("out.exr")))
    assert cloud.normals is not None


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("points.ply", "-o", "out.exr"), "points.ply: has points, but no range views to merge"),
        (
            ("alone.exr", "-o", "out.exr"),
            "alone.exr: has only one range view, but merging needs at least two",
        ),
        (("pods.exr", "-o", "pods.exr"), "pods.exr: is an input of this command"),
        (("pods.exr", "-o", "points.ply"), "points.ply: exists already"),
        (("pods.exr", "-o", "nowhere/out.exr"), "there is no folder 'nowhere'"),
        (("pods.exr", "-o", "out.jpg"), "out.jpg: "),
        (("pods.exr", "-o", "out.exr", "--report", "out.txt"), "out.txt: "),
        (
            ("pods.exr", "-o", "out.exr", "--ties", "-1"),
            "the largest difference of tied weights must be 0 or more",
        ),
        (("seq", "-o", "out.exr"), "out.exr: is the name of one file, but this command writes several files"),
    ],
)
def test_what_cannot_be_is_told_in_one_line(
    run: Run, folder: Path, words: tuple[str, ...], message: str
) -> None:
    before = sorted(path.name for path in folder.rglob("*"))
    done = run("merge", *words)
    assert done.code == 2
    assert message in done.err
    assert done.err.count("\n") == 1
    assert sorted(path.name for path in folder.rglob("*")) == before


def test_a_frame_with_one_view_ends_it_and_frames_before_stay(run: Run, views: tuple[RangeView, ...]) -> None:
    exr.write_views(Path("seq/f1.exr"), [replace(views[0], name="alone")])
    Path("merged").mkdir()
    done = run("merge", "seq", "-o", "merged/f%04d.exr")
    assert done.code == 2
    assert "f1.exr: has only one range view" in done.err
    assert [path.name for path in Path("merged").iterdir()] == ["f0000.exr"]
