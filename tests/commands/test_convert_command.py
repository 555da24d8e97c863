"""`scan4d convert`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from small_scans import cloud_at, names

from viewer.scan import formats
from viewer.scan.open import open_scan


@pytest.mark.parametrize("suffix", formats.writable_suffixes())
def test_convert_keeps_everything(suffix: str, run: Run, scans: Path, tmp_path: Path) -> None:
    out = tmp_path / f"a{suffix}"
    assert run("convert", scans / "ball.npz", out) == (0, f"{out}\n", "")
    assert names(tmp_path) == [out.name]
    before, after = formats.read(scans / "ball.npz"), formats.read(out)
    # Half a float32 step: PCD has float64 only where that matters, since few programs read it.
    slack = 2**-25 if suffix == ".pcd" else 1e-15
    assert np.abs(before.world() - after.world()).max() <= slack
    for name in ("normals", "colors", "radii"):
        assert np.array_equal(getattr(before, name), getattr(after, name)), name
    assert np.array_equal(before.scalars["height"], after.scalars["height"])


@pytest.mark.parametrize(
    ("choice", "indices"),
    [([], [0, 1, 2, 3, 4]), (["--all"], [0, 1, 2, 3, 4]), (["--poses", "1:5:2"], [1, 3])],
)
def test_convert_of_a_sequence_keeps_its_times(
    choice: list[str], indices: Sequence[int], run: Run, scans: Path, tmp_path: Path
) -> None:
    done = run("convert", scans / "sequence", tmp_path / "out%03d.ply", "--fps", 12, *choice)
    assert done.code == 0
    assert names(tmp_path) == [*(f"out{index:03d}.ply" for index in indices), "times.csv"]
    with open_scan(tmp_path) as timeline:
        assert np.array_equal(timeline.times, np.array(indices) / 12)
        for place, index in enumerate(indices):
            assert np.array_equal(timeline.pose(place).cloud.positions, cloud_at(index).positions)
    again = run("convert", scans / "sequence", tmp_path / "out%03d.ply", "--fps", 12, "--force", *choice)
    assert again.code == 0


def test_convert_of_one_pose_of_several(
    run: Run, refused: Callable[..., str], scans: Path, tmp_path: Path
) -> None:
    assert run("convert", scans / "sequence", tmp_path / "a.pcd", "--pose", 2).code == 0
    assert np.array_equal(formats.read(tmp_path / "a.pcd").positions, cloud_at(2).positions)
    assert run("convert", scans / "sequence", tmp_path / "b.pcd", "--time", 0.08).code == 0
    assert (tmp_path / "a.pcd").read_bytes() == (tmp_path / "b.pcd").read_bytes()
    message = refused("convert", scans / "sequence", tmp_path / "c.pcd")
    assert "c%04d.pcd" in message
    assert ".mp4" not in message
    assert names(tmp_path) == ["a.pcd", "b.pcd"]


def test_convert_leaves_broken_frames_out(run: Run, scans: Path, tmp_path: Path) -> None:
    done = run("convert", scans / "broken", tmp_path / "f%d.npz")
    assert done.code == 0
    assert "f02.npz" in done.err
    assert names(tmp_path) == ["f0.npz", "f1.npz", "f3.npz", "f4.npz", "times.csv"]
    with open_scan(tmp_path) as timeline:
        assert np.allclose(timeline.times, [0, 0.04, 0.12, 0.16])


def test_convert_spares_the_times_of_other_files(
    refused: Callable[..., str], scans: Path, tmp_path: Path
) -> None:
    (tmp_path / "times.csv").write_text("mine.ply,0\nmine2.ply,1\n")
    message = refused("convert", scans / "sequence", tmp_path / "f%d.ply")
    assert "times.csv" in message
    assert names(tmp_path) == ["times.csv"]


def test_convert_refuses_what_it_cannot_write(
    refused: Callable[..., str], scans: Path, tmp_path: Path
) -> None:
    message = refused("convert", scans / "ball.npz", tmp_path / "a.obj")
    assert all(suffix in message for suffix in formats.writable_suffixes())
    assert "Create it" in refused("convert", scans / "ball.npz", tmp_path / "missing" / "a.ply")
