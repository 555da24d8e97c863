"""`scan4d convert`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from scenes import sphere
from small_scans import cloud_at, names

from viewer.drawing.request import backend_for
from viewer.scan import formats
from viewer.scan.estimate import estimate
from viewer.scan.octree.stored import octree_of
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.visibility.search import visible_points


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


def bare_at(index: int) -> PointCloud:
    """A sphere of positions alone."""
    return PointCloud.from_arrays(sphere(400 + index).positions)


@pytest.mark.parametrize("suffix", formats.writable_suffixes())
def test_convert_stores_what_it_estimates(suffix: str, run: Run, tmp_path: Path) -> None:
    before, after = tmp_path / "before", tmp_path / "after"
    for folder in (before, after):
        folder.mkdir()
    for number in range(2):
        formats.write(before / f"{number}.npz", bare_at(number))
    assert run("convert", before, after / f"%d{suffix}", "--normals", "--radii").code == 0
    with open_scan(after) as timeline:
        for number in range(2):
            pose = timeline.pose(number)
            expected = estimate(Pose(0, 0.0, "x", bare_at(number)), ("normals", "radii"))
            for name, values in expected.arrays.items():
                np.testing.assert_array_equal(getattr(pose.cloud, name), values, err_msg=name)
            assert backend_for(pose)[0] == "surfels", "it opens with what needs them"


def test_convert_estimates_no_more_than_is_asked_for_and_lacking(
    run: Run, scans: Path, tmp_path: Path
) -> None:
    formats.write(tmp_path / "bare.npz", bare_at(0))
    assert run("convert", tmp_path / "bare.npz", tmp_path / "a.ply", "--radii").code == 0
    assert formats.read_points(tmp_path / "a.ply").normals is None
    assert run("convert", scans / "ball.npz", tmp_path / "b.npz", "--normals", "--radii").code == 0
    kept, had = formats.read_points(tmp_path / "b.npz"), formats.read_points(scans / "ball.npz")
    np.testing.assert_array_equal(kept.normals, had.normals)
    np.testing.assert_array_equal(kept.radii, had.radii)


def test_convert_puts_estimates_into_octrees(run: Run, tmp_path: Path) -> None:
    formats.write(tmp_path / "bare.npz", bare_at(0))
    assert run("convert", tmp_path / "bare.npz", tmp_path / "a.svo", "--normals", "--radii").code == 0
    with open_scan(tmp_path / "a.svo") as timeline:
        leaves = timeline.pose(0).cloud
    assert leaves.normals is not None
    outward = (leaves.normals * leaves.world()).sum(axis=1) / np.linalg.norm(leaves.world(), axis=1)
    assert np.median(np.abs(outward)) > 0.95
    octree = octree_of(leaves)
    assert octree is not None
    assert octree.attributes[-1].own_radii is not None


@pytest.mark.parametrize(("out", "flag"), [("a.exr", "normals"), ("a.exr", "radii")])
def test_convert_refuses_estimates_that_a_format_does_not_hold(
    out: str, flag: str, refused: Callable[..., str], scans: Path, tmp_path: Path
) -> None:
    message = refused("convert", tmp_path / "not-even-there.ply", tmp_path / out, f"--{flag}")
    assert f"'{out[1:]}' files cannot store {flag}" in message
    assert f"or leave out --{flag}" in message
    assert not names(tmp_path)


@pytest.mark.slow
def test_convert_keeps_what_an_eye_sees(run: Run, scans: Path, tmp_path: Path) -> None:
    """Of all poses, with all that the points have."""
    eye = (0.5, 0.25, 9.0)
    done = run("convert", scans / "sequence", tmp_path / "out%03d.ply", "--visible-from", "0.5,0.25,9")
    assert done.code == 0
    kept, total = 0, 0
    for index in range(5):
        before, after = cloud_at(index), formats.read(tmp_path / f"out{index:03d}.ply")
        rows = visible_points(before.world(), eye)
        assert 0 < len(rows) < len(before)
        np.testing.assert_array_equal(after.world(), before.world(rows))
        kept, total = kept + len(rows), total + len(before)
    assert done.out.startswith(f"{kept:,} of {total:,} points are visible, ")
    one = run("convert", scans / "ball.npz", tmp_path / "a.npz", "--visible-from=0,0,5")
    ball, seen = formats.read(scans / "ball.npz"), formats.read(tmp_path / "a.npz")
    rows = visible_points(ball.world(), (0, 0, 5))
    assert one.out == f"{len(rows):,} of {len(ball):,} points are visible\n{tmp_path / 'a.npz'}\n"
    for name in ("normals", "colors", "radii"):
        np.testing.assert_array_equal(getattr(seen, name), getattr(ball, name)[rows])
    np.testing.assert_array_equal(seen.scalars["height"], ball.scalars["height"][rows])


@pytest.mark.parametrize("text", ["1,2", "1,2,x", "1,2,nan"])
def test_convert_refuses_what_is_no_place_of_an_eye(text: str, run: Run, scans: Path, tmp_path: Path) -> None:
    done = run("convert", scans / "ball.npz", tmp_path / "a.ply", "--visible-from", text)
    assert done.code == 2
    assert "not a position" in done.err
