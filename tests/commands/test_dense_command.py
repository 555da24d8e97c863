"""`scan4d motion --dense`: what it writes beside the motions, and that both go on where they stopped."""

from __future__ import annotations

import csv
import errno
import json
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from hill_folders import TURN, turning_hills
from moving_hills import hills

from viewer.analysis.motion import dense, displacements
from viewer.analysis.motion.displacements import Displacements
from viewer.scan import formats
from viewer.scan.points import PointCloud

WORDS = ("motion", "seq", "--unit", "mm", "--region", "region.json", "--dense", "-o")
PATHS = ("--paths", "region.json", "side.json")
POINTS = 300


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory: three frames of a patch that turns, and a region in its middle."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))
    turning_hills("seq", POINTS)
    Path("region.json").write_text('{"spheres": [[0, 0, 0, 16]]}')
    Path("side.json").write_text('{"spheres": [[8, 0, 1, 6]]}')
    return tmp_path


def test_an_interrupted_command_goes_on(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = run(*WORDS, "whole", *PATHS)
    assert whole.code == 0, whole.err
    names = ("transforms.csv", "report.json", "region.json", "displacements.npz", "paths.csv")
    assert whole.out.endswith("".join(f"whole/{name}\n" for name in names))
    found = Displacements.read("whole/displacements.npz")
    assert found.displacement.shape == (3, POINTS, 3)
    assert found.reference.dtype == np.float64
    report = json.loads(Path("whole/report.json").read_text())
    assert report["rigid"]["states"]["gap"] == 0
    assert report["dense"]["states"]["seen"]["share"] > 0.9
    assert report["dense"]["same_points_in_file"] is False
    table = np.loadtxt("whole/paths.csv", delimiter=",", skiprows=1, usecols=range(1, 11))
    assert table.shape == (6, 10), "two regions in three frames"
    frames, _, *columns = table.T
    assert (frames == [1, 2, 3] * 2).all()
    path, stabilised, (sigma, seen) = np.transpose(columns[:3]), np.transpose(columns[3:6]), columns[6:]
    middle = np.array([8.0, 0.0, hills(np.array(8.0), np.array(0.0))])
    right_path = [np.add((TURN**frame).apply(middle), [0.5 * frame, 0, 0]) for frame in range(3)]
    assert np.allclose(path[3:] - path[3], right_path - middle, atol=0.3)
    assert np.allclose(stabilised, path[[0, 0, 0, 3, 3, 3]], atol=0.3)
    assert (sigma[[0, 3]] == 0).all()
    assert (sigma[[1, 2, 4, 5]] > 0).all()
    assert ((seen > 0.8) & (seen <= 1)).all()
    right, followed = dense.DensePoints.follow, []

    def interrupted(*args: object) -> dense.TrackedFrame:
        if followed:
            raise KeyboardInterrupt
        followed.append(args)
        return right(*args)  # type: ignore[arg-type]

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "")

    with monkeypatch.context() as patch:
        patch.setattr(dense.DensePoints, "follow", interrupted)
        stopped = run(*WORDS, "out", *PATHS)
    assert stopped.code != 0
    assert "out keeps the frames so far" in stopped.err
    assert not {path.name for path in Path("out").iterdir()} & set(names)
    with monkeypatch.context() as patch:
        patch.setattr(displacements, "_add", full)
        full_disk = run(*WORDS, "out", *PATHS)
    assert full_disk.code == 2
    assert "the motions of 3 of 3 frames are known" in full_disk.out
    assert "all points in 2 of 3 frames are known" in full_disk.out
    assert "out/displacements.npz: cannot be written: the disk is full" in full_disk.err
    assert not {path.name for path in Path("out").iterdir()} & set(names)
    done = run(*WORDS, "out", *PATHS)
    assert done.code == 0, done.err
    assert "all points in 3 of 3 frames are known" in done.out
    assert {path.name for path in Path("out").iterdir()} == set(names)
    for name in names:
        assert (Path("out") / name).read_bytes() == (Path("whole") / name).read_bytes()


def test_all_points_are_followed_where_nothing_stays_rigid(run: Run) -> None:
    for frame in range(3):
        anywhere = np.random.default_rng(frame).uniform(0, 20, (300, 3)) + 500 * frame
        formats.write(f"seq/f{frame}.npz", PointCloud.from_arrays(anywhere))
    words = ("motion", "seq", "--unit", "mm", "--force", "-o", "out")
    refused = run(*words)
    assert refused.code == 2
    assert "no region that stays rigid" in refused.err
    Path("out/region.json").write_text("of an earlier run")
    done = run(*words, "--dense")
    assert done.code == 0, done.err
    assert "no region that stays rigid" in done.err
    assert "Each frame in transforms.csv is a gap" in done.err
    with open("out/transforms.csv", newline="", encoding="utf-8") as stream:
        assert [(row["state"], row["qw"]) for row in csv.DictReader(stream)] == [("gap", "")] * 3
    report = json.loads(Path("out/report.json").read_text())
    assert report["rigid"]["region"] is None
    assert report["rigid"]["states"]["gap"] == 3
    assert {path.name for path in Path("out").iterdir()} == {
        "transforms.csv", "report.json", "displacements.npz",
    }  # fmt: skip
    assert Displacements.read("out/displacements.npz").displacement.shape == (3, 300, 3)


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (("--paths", "side.json"), "--paths needs the motions of all points. Add --dense"),
        (
            ("--dense", "--paths", "far.json"),
            "far.json: has no points of the reference. The reference extends",
        ),
        (("--dense", "--paths", "none.json"), "none.json"),
    ],
)
def test_mistakes_with_paths_are_reported(run: Run, words: tuple[str, ...], what: str) -> None:
    Path("far.json").write_text('{"spheres": [[0, 900, 0, 1]]}')
    done = run("motion", "seq", "--unit", "mm", "-o", "out", *words)
    assert done.code == 2
    assert what in done.err
    assert not Path("out").exists()
