"""Stanford's laser scans: placed by their .conf file, each a height field that keeps what was measured."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from viewer.errors import InputError
from viewer.scan.formats.npz import read_arrays
from viewer.scan.open import find_source, open_scan
from viewer.scan.range_view import RangeView

HALF = np.sqrt(0.5)
STEP = 0.5


def grid(rows: int = 4, columns: int = 5) -> np.ndarray:
    """Points of a slanted plane, (rows, columns, 3), the lowest row first; one is not there."""
    y, x = np.mgrid[:rows, :columns] * STEP
    points = np.stack([x, y, 0.2 * x], axis=2).astype(np.float32)
    points[0, 1] = np.nan
    return points


def put(folder: Path, conf: str | None, **grids: np.ndarray) -> Path:
    if conf is not None:
        (folder / "scans.conf").write_text(conf)
    for name, xyz in grids.items():
        np.savez(folder / f"{name}.npz", xyz=xyz)
    return folder


def views_of(folder: Path) -> tuple[RangeView, ...]:
    views = find_source(folder).load(0)
    assert isinstance(views, tuple)
    return views


def test_scans_are_placed_by_the_inverse_of_their_rotation(tmp_path: Path) -> None:
    # A quarter turn about z: the rotation brings x to y, its inverse y to x.
    conf = f"camera 0 0 -1 0 0 0 1\nbmesh a.ply 10 0 0 0 0 {HALF} {HALF}\nbmesh b.ply 0 0 0 0 0 0 1\n"
    put(tmp_path, conf, a=grid(), b=grid())
    with open_scan(tmp_path) as scan:
        assert (len(scan), scan.unit, scan.name) == (1, "m", tmp_path.name)
        pose = scan.pose(0)
    assert [view.name for view in pose.views] == ["a", "b"]
    points = grid()[::-1]  # the top row is the first
    points = points[np.isfinite(points).all(axis=2)]
    x, y, z = points.T
    np.testing.assert_allclose(pose.views[0].positions(), np.stack([10 + y, -x, z], axis=1), atol=1e-6)
    np.testing.assert_allclose(pose.views[1].positions(), points, atol=1e-6)
    np.testing.assert_array_equal(pose.cloud.scalars["view"], np.repeat([0, 1], len(points)))


def test_the_calibration_of_a_regular_grid_is_exact(tmp_path: Path) -> None:
    put(tmp_path, "bmesh a.ply 1 2 3 0 0 0 1\n", a=grid())
    (view,) = views_of(tmp_path)
    assert view.kind == "height"
    pixels, depths = view.project(view.positions())
    row, column = np.nonzero(view.valid())
    np.testing.assert_allclose(pixels, np.stack([column, row], axis=1) + 0.5, atol=1e-5)
    np.testing.assert_allclose(depths, view.depth[row, column], atol=1e-6)


def test_the_camera_looks_along_slanted_columns(tmp_path: Path) -> None:
    # Two planes, one before the other; the columns of the front one are moved by what it is nearer.
    y, column = np.mgrid[:6, :8] * STEP
    z = np.where(column < 2, 0.0, 1.0)
    points = np.stack([column + 0.5 * z, y, z], axis=2)
    put(tmp_path, "bmesh a.ply 0 0 0 0 0 0 1\n", a=points.astype(np.float32))
    (view,) = views_of(tmp_path)
    back = view.world_to_camera[2, :3]
    np.testing.assert_allclose(back, [1 / np.sqrt(5), 0, 2 / np.sqrt(5)], atol=1e-4)
    pixels, _ = view.project(view.positions())
    rows, columns = np.nonzero(view.valid())
    np.testing.assert_allclose(pixels, np.stack([columns, rows], axis=1) + 0.5, atol=1e-4)


@pytest.mark.parametrize(
    ("conf", "told"),
    [
        ("bmesh a.ply 0 0 zero 0 0 0 1\n", "does not describe a scan"),
        ("bmesh a.ply 0 0 0 1\n", "does not describe a scan"),
        ("bmesh a.ply 0 0 nan 0 0 0 1\n", "does not describe a scan"),
        ("bmesh\n", "does not describe a scan"),
        ("bmesh a.ply 0 0 0 0 0 0 0\n", "not a rotation"),
        ("bmesh a.ply 0 0 0 0 0 0 1\nbmesh c.ply 0 0 0 0 0 0 1\n", "c.ply is missing"),
    ],
)
def test_a_wrong_placement_is_told_at_opening(tmp_path: Path, conf: str, told: str) -> None:
    put(tmp_path, conf, a=grid())
    with pytest.raises(InputError, match=told):
        find_source(tmp_path)


@pytest.mark.parametrize(
    ("xyz", "told"),
    [
        (np.zeros((3, 4), np.float32), "xyz"),
        (np.zeros((3, 4, 3), np.int32), "xyz"),
        (np.full((3, 4, 3), np.nan, np.float32), "0 points"),
        (np.stack([np.arange(9.0).reshape(3, 3)] * 3, axis=2), "along a line"),
        (np.zeros((3, 4, 3)), "along a line"),
    ],
)
def test_a_grid_that_is_no_surface_is_told(tmp_path: Path, xyz: np.ndarray, told: str) -> None:
    put(tmp_path, "bmesh a.ply 0 0 0 0 0 0 1\n", a=xyz)
    with open_scan(tmp_path) as scan, pytest.raises(InputError, match=told) as caught:
        scan.pose(0)
    assert "a.npz" in str(caught.value)


def write_range_grid(path: Path, xyz: np.ndarray, places: list[str] | None = None, size: str = "") -> None:
    """Write a scan as the Stanford repository has it."""
    valid = np.isfinite(xyz).all(axis=2)
    points = xyz[valid]
    numbers = iter(range(len(points)))
    places = places or [f"1 {next(numbers)}" if is_there else "0" for is_there in valid.ravel()]
    size = size or f"obj_info num_cols {xyz.shape[1]}\nobj_info num_rows {xyz.shape[0]}\n"
    path.write_text(
        f"ply\nformat ascii 1.0\n{size}element vertex {len(points)}\nproperty float x\nproperty float y\n"
        f"property float z\nelement range_grid {len(places)}\nproperty list uchar int vertex_indices\n"
        "end_header\n" + "".join(f"{x} {y} {z} \n" for x, y, z in points) + "\n".join(places) + "\n"
    )


def test_range_grids_are_read_as_arrays_are(tmp_path: Path) -> None:
    put(tmp_path, "bmesh a.ply 0 0 0 0 0 0 1\nbmesh b.ply 0 0 0 0 0 0 1\n", a=grid())
    write_range_grid(tmp_path / "b.ply", grid())
    one, other = views_of(tmp_path)
    np.testing.assert_array_equal(one.depth, other.depth)
    np.testing.assert_array_equal(one.xy, other.xy)


@pytest.mark.parametrize(
    ("places", "size"),
    [
        (["0"] * 19, ""),
        (["1 0"] * 19 + ["1 99"], ""),
        (["2 0 1"] * 20, ""),
        (["0"] * 20, "obj_info num_cols 5\n"),
        (["0"] * 20, "obj_info num_cols 0\nobj_info num_rows 4\n"),
        (["0"] * 20, "obj_info num_cols 999999999\nobj_info num_rows 999999999\n"),
    ],
)
def test_a_range_grid_that_is_none_is_told(tmp_path: Path, places: list[str], size: str) -> None:
    put(tmp_path, "bmesh a.ply 0 0 0 0 0 0 1\n")
    write_range_grid(tmp_path / "a.ply", grid(), places, size)
    with pytest.raises(InputError, match=r"a\.ply: .*range grid"):
        views_of(tmp_path)


def test_a_conf_file_of_something_else_makes_no_scans(tmp_path: Path) -> None:
    np.save(tmp_path / "points.npy", np.zeros((4, 3)))
    (tmp_path / "nginx.conf").write_text("server { listen 80; }\n")
    (tmp_path / "binary.conf").write_bytes(b"\xff\xfe\0")
    assert len(find_source(tmp_path)) == 1


@pytest.mark.parametrize(
    ("folder", "scans", "samples"),
    [("stanford_bunny_scans", 10, 362_272), ("stanford_dragon_stand_scans", 15, 469_193)],
)
def test_real_scans_keep_every_sample(folder: str, scans: int, samples: int, data_dir: Path) -> None:
    place = data_dir / "range" / folder
    views = views_of(place)
    assert len(views) == scans
    assert sum(np.count_nonzero(view.valid()) for view in views) == samples
    for view in views:
        (stored,) = read_arrays(place / f"{view.name}.npz", "xyz")
        assert view.depth.shape == stored.shape[:2]
        # The columns and rows of the laser's grids are some pixels beside those of a parallel camera.
        pixels, _ = view.project(view.positions())
        row, column = np.nonzero(view.valid())
        off = np.abs(pixels - np.stack([column, row], axis=1) - 0.5)
        assert np.median(off) < 2
        assert np.quantile(off, 0.95) < 4.5


@pytest.mark.slow
def test_the_repository_has_the_same_scans(tmp_path: Path, data_dir: Path) -> None:
    stored = data_dir / "range" / "stanford_bunny_scans"
    (tmp_path / "bun.conf").write_text((stored / "bun.conf").read_text().splitlines()[1] + "\n")
    shutil.copy(stored / "original" / "bun000.ply", tmp_path)
    (view,) = views_of(tmp_path)
    expected = views_of(stored)[0]
    # The original's decimals are finer than the float32 that the arrays were rounded to.
    np.testing.assert_allclose(view.depth, expected.depth, rtol=0, atol=1e-8)
    np.testing.assert_allclose(view.world_to_camera, expected.world_to_camera, rtol=0, atol=1e-8)
