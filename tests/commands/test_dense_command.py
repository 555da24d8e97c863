"""`scan4d motion --dense`: what it writes, what it refuses, and that it goes on where it stopped."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from moving_hills import SIDE, hills, moved

from viewer.analysis.motion import dense
from viewer.analysis.motion.displacements import Displacements
from viewer.scan import formats
from viewer.scan.points import PointCloud

WORDS = ("motion", "seq", "--dense", "-o")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory: three frames of a patch that moves."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))
    Path("seq").mkdir()
    for frame in range(3):
        x, y = np.random.default_rng(frame).uniform(-SIDE / 2, SIDE / 2, (2, 800))
        points = moved(np.column_stack([x, y, hills(x, y)]), frame)
        formats.write(f"seq/f{frame}.npz", PointCloud.from_arrays(points))
    return tmp_path


def test_an_interrupted_command_goes_on(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = run(*WORDS, "whole")
    assert whole.code == 0, whole.err
    assert whole.out.endswith("whole/displacements.npz\nwhole/report.json\n")
    found = Displacements.read("whole/displacements.npz")
    assert found.displacement.shape == (3, 800, 3)
    assert found.reference.dtype == np.float64
    report = json.loads(Path("whole/report.json").read_text())
    assert report["states"]["seen"]["share"] > 0.9
    assert report["same_points_in_file"] is False
    right, followed = dense.DensePoints.follow, []

    def interrupted(*args: object) -> dense.TrackedFrame:
        if followed:
            raise KeyboardInterrupt
        followed.append(args)
        return right(*args)  # type: ignore[arg-type]

    with monkeypatch.context() as patch:
        patch.setattr(dense.DensePoints, "follow", interrupted)
        assert run(*WORDS, "out").code != 0
    assert not Path("out/displacements.npz").exists()
    done = run(*WORDS, "out")
    assert done.code == 0, done.err
    assert "2 of 3 frames are known" in done.out
    assert not Path("out/displacements.partial").exists()
    again = Displacements.read("out/displacements.npz")
    for name in ("reference", "displacement", "sigma", "state"):
        assert np.array_equal(getattr(again, name), getattr(found, name))


def test_a_region_is_refused(run: Run) -> None:
    done = run(*WORDS, "out", "--region", "region.json")
    assert done.code == 2
    assert "--dense follows all points" in done.err
    assert not Path("out").exists()
