"""`scan4d motion --dense`: what it writes beside the motions, and that both go on where they stopped."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from hill_folders import turning_hills

from viewer.analysis.motion import dense
from viewer.analysis.motion.displacements import Displacements
from viewer.scan import formats
from viewer.scan.points import PointCloud

WORDS = ("motion", "seq", "--unit", "mm", "--region", "region.json", "--dense", "-o")
POINTS = 300


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory: three frames of a patch that turns, and a region in its middle."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))
    turning_hills("seq", POINTS)
    Path("region.json").write_text('{"spheres": [[0, 0, 0, 16]]}')
    return tmp_path


def test_an_interrupted_command_goes_on(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = run(*WORDS, "whole")
    assert whole.code == 0, whole.err
    names = ("transforms.csv", "report.json", "region.json", "displacements.npz")
    assert whole.out.endswith("".join(f"whole/{name}\n" for name in names))
    found = Displacements.read("whole/displacements.npz")
    assert found.displacement.shape == (3, POINTS, 3)
    assert found.reference.dtype == np.float64
    report = json.loads(Path("whole/report.json").read_text())
    assert report["rigid"]["states"]["gap"] == 0
    assert report["dense"]["states"]["seen"]["share"] > 0.9
    assert report["dense"]["same_points_in_file"] is False
    right, followed = dense.DensePoints.follow, []

    def interrupted(*args: object) -> dense.TrackedFrame:
        if followed:
            raise KeyboardInterrupt
        followed.append(args)
        return right(*args)  # type: ignore[arg-type]

    with monkeypatch.context() as patch:
        patch.setattr(dense.DensePoints, "follow", interrupted)
        stopped = run(*WORDS, "out")
    assert stopped.code != 0
    assert "out keeps the frames so far" in stopped.err
    assert not {path.name for path in Path("out").iterdir()} & set(names)
    done = run(*WORDS, "out")
    assert done.code == 0, done.err
    assert "the motions of 3 of 3 frames are known" in done.out
    assert "all points in 2 of 3 frames are known" in done.out
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
