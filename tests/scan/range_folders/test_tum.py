"""TUM's RGB-D folders: what belongs together is found by time."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from depth_folders import (
    CAMERA,
    colors,
    depth_numbers,
    metres,
    seen_points,
    write_camera,
    write_color,
    write_depth,
)

from viewer.errors import InputError
from viewer.scan.open import find_source, open_scan
from viewer.scan.range_folders.tum import nearest_once

HALF = np.sqrt(0.5)


def put(folder: Path, depth: list[float], color: list[float], poses: str | None = None) -> Path:
    """Pictures taken at these times; their contents count them."""
    for n, time in enumerate(depth):
        write_depth(folder / f"depth/{time:.6f}.png", depth_numbers(n))
    for n, time in enumerate(color):
        write_color(folder / f"rgb/{time:.6f}.png", colors(n))
    for name, kind, times in (("depth.txt", "depth", depth), ("rgb.txt", "rgb", color)):
        rows = "".join(f"{time:.6f} {kind}/{time:.6f}.png\n" for time in times)
        (folder / name).write_text(f"# {kind} maps\n# timestamp filename\n{rows}")
    if poses is not None:
        (folder / "groundtruth.txt").write_text(poses)
    return folder


def test_pictures_and_poses_belong_together_by_time(tmp_path: Path) -> None:
    # Times as the data set has them. A quarter turn about x: the camera's z, ahead, is the world's -y.
    start = 1305031453.36
    poses = f"# timestamp tx ty tz qx qy qz qw\n{start + 0.051} 1 2 3 {HALF} 0 0 {HALF}\n"
    poses += f"{start + 0.011} 1 2 4 {HALF} 0 0 {HALF}\n{start + 5} 9 9 9 0 0 0 1\n"  # out of order
    put(tmp_path, [start + 0.05, start + 0.01], [start, start + 0.06], poses)
    write_camera(tmp_path)
    with open_scan(tmp_path) as scan:
        assert (len(scan), scan.unit) == (2, "m")
        np.testing.assert_allclose(scan.times, [0, 0.04], atol=1e-5)
        views = [scan.pose(index).views[0] for index in range(2)]
        assert {file.name for file in scan.files} >= {"depth.txt", "rgb.txt", "groundtruth.txt"}
    for frame, (view, z) in enumerate(zip(views, (4, 3), strict=True)):
        pose = np.array([[1, 0, 0, 1], [0, 0, -1, 2], [0, 1, 0, z], [0, 0, 0, 1]], float)
        expected = seen_points(metres(depth_numbers(1 - frame), 5000), [*CAMERA.values()], pose)
        np.testing.assert_allclose(view.positions(), expected, rtol=1e-5, atol=1e-5)
        np.testing.assert_array_equal(view.color, colors(frame))


def test_commas_may_separate_the_values_of_lists(tmp_path: Path) -> None:
    put(tmp_path, [1, 1.1], [1, 1.1], "1.0 0 0 0 0 0 0 1\n1.1 1 0 0 0 0 0 1\n")
    write_camera(tmp_path)
    for name, separator in (("depth.txt", ","), ("rgb.txt", ", "), ("groundtruth.txt", ",")):
        rows = (tmp_path / name).read_text().splitlines()
        text = "".join((row if row[0] == "#" else row.replace(" ", separator)) + "\n" for row in rows)
        (tmp_path / name).write_text(text)
    with open_scan(tmp_path) as scan:
        np.testing.assert_allclose(scan.times, [0, 0.1], atol=1e-5)
        np.testing.assert_array_equal(scan.pose(1).views[0].color, colors(1))
        np.testing.assert_allclose(scan.pose(1).views[0].eye, [1, 0, 0], atol=1e-6)


def test_each_partner_belongs_to_one_at_most() -> None:
    times, others = np.array([0.0, 0.01, 0.1, 0.5]), np.array([0.008, 0.119, 0.121, 0.479])
    np.testing.assert_array_equal(nearest_once(times, others, 0.02), [-1, 0, 1, -1])
    assert not len(nearest_once(np.empty(0), others, 0.02))
    np.testing.assert_array_equal(nearest_once(times, np.empty(0), 0.02), [-1] * 4)


def test_partners_are_those_that_trying_all_pairs_finds() -> None:
    rng = np.random.default_rng(0)
    times, others = np.sort(rng.uniform(0, 1, 60)), np.sort(rng.uniform(0, 1, 50))
    found = np.full(60, -1)
    apart = np.abs(times[:, None] - others)
    while (least := np.unravel_index(apart.argmin(), apart.shape)) and apart[least] <= 0.02:
        found[least[0]] = least[1]
        apart[least[0]] = apart[:, least[1]] = np.inf
    np.testing.assert_array_equal(nearest_once(times, others, 0.02), found)


def test_a_frame_may_lack_colours_and_not_its_pose(tmp_path: Path) -> None:
    put(tmp_path, [1, 2], [1], "1.0 0 0 0 0 0 0 1\n")
    with open_scan(tmp_path) as scan:
        assert scan.pose(0).views[0].color is not None
        with pytest.raises(InputError, match=r"no pose in groundtruth\.txt is within"):
            scan.pose(1)
    (tmp_path / "groundtruth.txt").unlink()
    with open_scan(tmp_path) as scan:
        assert scan.pose(1).views[0].color is None
        np.testing.assert_array_equal(scan.pose(1).views[0].world_to_camera, np.eye(4))


def test_a_camera_beside_them_counts(tmp_path: Path) -> None:
    put(tmp_path, [1], [1])
    write_camera(tmp_path)
    (view,) = find_source(tmp_path).load(0)
    np.testing.assert_allclose(
        view.positions(), seen_points(metres(depth_numbers(), 5000), (5, 4, 2.5, 1.5)), rtol=1e-5
    )


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("depth.txt", "# nothing\n", "lists no depth"),
        ("depth.txt", "soon depth/1.png\n", r"depth\.txt, line 1: 'soon depth/1\.png' is not a row of data"),
        ("depth.txt", "1.0\n", "is not a row of data"),
        ("rgb.txt", "# a\nnan rgb/1.png\n", r"rgb\.txt, line 2"),
        ("groundtruth.txt", "1.0 0 0 0\n", "'0 0 0' is not a pose"),
        ("groundtruth.txt", "1.0 0 0 0 0 0 0 0\n", "not a rotation"),
        ("groundtruth.txt", "1.0 0 0 inf 0 0 0 1\n", "not a rotation and a translation"),
    ],
)
def test_wrong_rows_are_told(tmp_path: Path, name: str, text: str, told: str) -> None:
    put(tmp_path, [1], [1], "1.0 0 0 0 0 0 0 1\n")
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=told):
        find_source(tmp_path).load(0)


def test_a_picture_that_is_listed_and_not_there_is_left_out(tmp_path: Path) -> None:
    put(tmp_path, [1, 2], [1, 2])
    (tmp_path / "depth/1.000000.png").unlink()
    with open_scan(tmp_path) as scan:
        assert [pose.index for pose in scan] == [1]
        assert "no such file" in str(scan.broken[0])


def test_a_real_frame(tmp_path: Path, data_dir: Path) -> None:
    stored = data_dir / "range/open3d_rgbd/other_formats"
    for kind, name in (("depth", "TUM_depth.png"), ("rgb", "TUM_color.png")):
        (tmp_path / kind).mkdir()
        shutil.copy(stored / name, tmp_path / kind / "1.png")
        (tmp_path / f"{kind}.txt").write_text(f"1305031453.3 {kind}/1.png\n")
    with open_scan(tmp_path) as scan:
        (view,) = scan.pose(0).views
    depth = view.depth[view.valid()]
    assert np.count_nonzero(view.valid()) == 248_250
    assert 0.5 < depth.min() < 1.5 < depth.max() < 9.5  # metres: a desk, and the wall behind it
    assert view.color is not None
