"""`scan4d deviation`: values, statistics and report, as recorded and stabilised, and what it refuses."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from hill_folders import turning_hills
from range_scenes import sphere_view

from viewer.errors import InputError
from viewer.scan.formats.exr import write_views
from viewer.scan.open import open_scan

FLOOR = "v -40 -40 0\nv 40 -40 0\nv 40 40 0\nv -40 40 0\nf 1 2 3 4\n"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory: three frames of a patch that turns, two of points above a floor, and the
    floor."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))
    turning_hills("seq", 2500)
    Path("floor.obj").write_text(FLOOR)
    Path("above").mkdir()
    for frame, height in enumerate((0.25, -2.0)):
        points = [(1, 2, height), (np.nan, 0, 0), (50, 0, height), (3, 4, height)]
        np.savetxt(f"above/{frame}.xyz", points)
    return tmp_path


def table(path: str) -> list[dict[str, str]]:
    with open(path, newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def test_distances_from_a_mesh_are_signed_and_in_the_order_of_the_file(run: Run) -> None:
    done = run("deviation", "above", "--to", "floor.obj", "-o", "out")
    assert done.code == 0, done.err
    names = ("deviation.csv", "report.json", "0001.npz", "0002.npz")
    assert done.out.endswith("".join(f"out/{name}\n" for name in names))
    value = np.load("out/0001.npz")["value"]
    assert value.dtype == np.float32
    np.testing.assert_array_equal(value, np.array([0.25, np.nan, np.nan, 0.25], np.float32))
    first, second = table("out/deviation.csv")
    assert [float(first[name]) for name in ("mean", "rms", "p95", "max")] == [0.25] * 4
    assert (second["frame"], second["mean"], second["max"]) == ("2", "-2.0", "2.0")
    assert float(second["share"]) == pytest.approx(2 / 3), "of the points; one row of the file is none"
    report = json.loads(Path("out/report.json").read_text())
    assert report["reference"]["outside_by"] == "faces"
    assert report["reach"] == 8.0
    near = run("deviation", "above", "--to", "floor.obj", "--reach", "1", "-o", "near")
    assert "Fewer than half of the points have a value in 1 of 2 frames" in near.err
    assert table("near/deviation.csv")[1]["mean"] == ""


def test_range_views_have_a_value_for_each_pixel(run: Run) -> None:
    views = [sphere_view((0, 0, 4)), sphere_view((0, 0, -4), name="right")]
    write_views(Path("ball.exr"), views)
    done = run("deviation", "ball.exr", "--to", "ball.exr", "-o", "out")
    assert done.code == 0, done.err
    value = np.load("out/0001.npz")["value"]
    seen = np.concatenate([(view.mask & np.isfinite(view.depth)).ravel() for view in views])
    assert value.shape == seen.shape
    assert not np.isfinite(value[~seen]).any()
    assert np.isfinite(value[seen]).mean() > 0.9
    assert np.nanmedian(np.abs(value)) < 0.01
    assert float(table("out/deviation.csv")[0]["share"]) > 0.9


def test_stabilised_frames_of_a_rigid_patch_do_not_deviate(run: Run) -> None:
    recorded = run("deviation", "seq", "--unit", "mm", "--to", "seq", "--to-pose", "1", "-o", "recorded")
    assert recorded.code == 0, recorded.err
    assert "Scan4D estimates which side is outside" in recorded.err
    Path("region.json").write_text('{"spheres": [[0, 0, 0, 16]]}')
    words = ("--to", "seq", "--to-pose", "1", "--stabilise", "--region", "region.json")
    done = run("deviation", "seq", "--unit", "mm", *words, "-o", "still")
    assert done.code == 0, done.err
    before, after = (
        [float(row["rms"]) for row in table(f"{name}/deviation.csv")] for name in ("recorded", "still")
    )
    assert before[1] == after[1] < 0.02
    assert min(before[0], before[2]) > 0.3
    assert max(after) < 0.1
    assert json.loads(Path("still/report.json").read_text())["rigid"]["states"]["gap"] == 0
    assert not Path("still/transforms.partial").exists()
    mean = run("deviation", "seq", "--unit", "mm", *words, "--to-pose", "0:3", "-o", "mean")
    assert mean.code == 0, mean.err
    assert json.loads(Path("mean/report.json").read_text())["reference"]["mean"]["frames"] == [1, 2, 3]


def test_a_reference_without_a_unit_is_taken_to_have_that_of_the_scan() -> None:
    with open_scan("demo") as scan, open_scan("floor.obj") as floor:
        assert scan.gives_unit_to(floor)
        assert not scan.gives_unit_to(scan)
        with pytest.raises(InputError, match="has the unit 'mm', but the scan has 'units'"):
            floor.gives_unit_to(scan)


def test_m3c2_tells_the_least_that_it_detects(run: Run) -> None:
    Path("region.json").write_text('{"spheres": [[0, 0, 0, 16]]}')
    words = ("deviation", "seq", "--unit", "mm", "--to", "seq", "--method", "m3c2", "--reach", "9")
    recorded = run(*words, "--cylinder", "3", "--whole-cylinder", "-o", "out")
    assert recorded.code == 0, recorded.err
    assert "with radii of 3 (--cylinder) and" in recorded.out
    moved = np.load("out/0003.npz")
    assert moved["value"].dtype == moved["detectable"].dtype == np.float32
    assert table("out/deviation.csv")[0]["detected"] == "0.0"
    assert float(table("out/deviation.csv")[2]["detected"]) > 0.5
    report = json.loads(Path("out/report.json").read_text())["m3c2"]
    assert (report["cylinder"], report["whole"]) == (3.0, True)
    still = run(
        *words, "--cylinder", "3", "--whole-cylinder", "--stabilise", "--region", "region.json", "-o", "still"
    )
    assert still.code == 0, still.err
    settled = np.load("still/0003.npz")
    known = np.isfinite(settled["value"]) & np.isfinite(moved["value"])
    assert np.abs(settled["value"][known]).mean() < 0.2 * np.abs(moved["value"][known]).mean()
    assert (settled["detectable"][known] > 0).all(), "the motion is not sure"


def test_a_frame_that_cannot_be_read_has_an_empty_row_and_a_reason(run: Run) -> None:
    Path("above/1.xyz").write_text("no numbers here\n")
    done = run("deviation", "above", "--to", "floor.obj", "-o", "out")
    assert done.code == 0, done.err
    assert table("out/deviation.csv")[1]["mean"] == ""
    assert "2" in json.loads(Path("out/report.json").read_text())["left_out"]
    assert "1 of 2 frames have no values, such as frame 2" in done.err
    assert not Path("out/0002.npz").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--to", "nowhere.ply"), "nowhere.ply"),
        (("--to", "floor.obj", "--to-pose", "3"), "3"),
        (("--to", "floor.obj", "--to-pose", "0:2"), "is not one frame of the reference"),
        (("--to", "above", "--to-pose", "0,1"), "needs --stabilise"),
        (("--to", "floor.obj", "--region", "region.json"), "Add --stabilise"),
        (("--to", "floor.obj", "--reach", "0"), "not a positive length"),
        (("--to", "floor.obj", "--reach", "far"), "not a positive length"),
        (("--to", "floor.obj", "--cylinder", "2"), "Add --method m3c2"),
        (("--to", "floor.obj", "--whole-cylinder"), "Add --method m3c2"),
        (("--to", "floor.obj", "--method", "m3c2", "--normal", "-1"), "not a positive length"),
        (("--to", "floor.obj", "--method", "c2c"), "m3c2"),
        ((), "--to"),
    ],
)
def test_what_cannot_be_done_is_one_message(run: Run, words: tuple[str, ...], message: str) -> None:
    done = run("deviation", "above", *words, "-o", "out")
    assert done.code != 0
    assert message in done.err
    assert "Traceback" not in done.err
    assert not Path("out").exists()


def test_results_are_replaced_only_where_that_is_wanted(run: Run) -> None:
    words = ("deviation", "above", "--to", "floor.obj", "-o", "out")
    assert run(*words).code == 0
    again = run(*words)
    assert again.code != 0
    assert "exists already" in again.err
    assert run(*words, "--force").code == 0
