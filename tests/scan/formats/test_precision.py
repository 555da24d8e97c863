"""Coordinates of any size, through every format that points can be written in."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import open3d
import pytest
from command_line import Run
from numpy.typing import NDArray

from viewer.scan import formats
from viewer.scan.formats._precision import decimals, is_enough
from viewer.scan.points import PointCloud

RNG = np.random.default_rng(8)
UTM = np.array([512_345.0, 5_412_345.678, 101.5])
# What float32 offsets from one origin lose: (coordinates, whether float32 holds them as the file has them).
SCANS = {
    "millimetres in a room": (np.round(RNG.uniform(-5, 5, (900, 3)), 3), True),
    "millimetres over 10 km": (np.round(RNG.uniform(0, 1e4, (900, 3)), 3), False),
    "millimetres over 10 km, UTM": (np.round(RNG.uniform(0, 1e4, (900, 3)), 3) + UTM, False),
    "a house, UTM": (np.round(RNG.uniform(0, 20, (900, 3)), 3) + UTM, False),
    "centimetres over 10 km": (np.round(RNG.uniform(0, 1e4, (900, 3)), 2), True),
    "all digits, one unit": (RNG.uniform(0, 1, (900, 3)), False),
    "all digits at 10^7": (RNG.uniform(0, 1, (900, 3)) + 1e7, False),
    "float32": (RNG.uniform(-1, 1, (900, 3)).astype(np.float32).astype(np.float64), True),
    "float32 as 9 digits": (np.round(RNG.random((900, 3), np.float32).astype(float), 9), True),
}
every_scan = pytest.mark.parametrize(("points", "fits"), SCANS.values(), ids=SCANS)


@every_scan
@pytest.mark.parametrize("suffix", formats.writable_suffixes())
def test_coordinates_are_written_as_precisely_as_they_were_read(
    points: NDArray[np.float64], fits: bool, suffix: str, tmp_path: Path
) -> None:
    path = tmp_path / f"points{suffix}"
    remark = formats.write(path, PointCloud.from_arrays(points))
    back = formats.read_points(path).world()
    digits, bits48 = decimals(points), 2**-47 * np.ptp(points) + 2 * np.spacing(np.abs(points).max())
    is_fine = fits or (suffix == ".pcd" and np.abs(points).max() < 8)  # right to 1e-6 units
    as_float32 = 1e-6 * is_fine if digits is None else 10.0 ** -min(digits, 8) / 4
    np.testing.assert_allclose(back, points, rtol=0, atol=max(bits48, as_float32))
    if digits is not None:
        np.testing.assert_array_equal(np.round(back, digits), np.round(points, digits))
    assert (remark is not None) == (suffix == ".pcd" and not is_fine)


@every_scan
def test_open3d_reads_what_is_written(points: NDArray[np.float64], fits: bool, tmp_path: Path) -> None:
    """PLY always; PCD where nothing was told of it."""
    for suffix in (".ply", ".pcd"):
        path = tmp_path / f"points{suffix}"
        remark = formats.write(path, PointCloud.from_arrays(points))
        read = np.asarray(open3d.io.read_point_cloud(str(path)).points)
        if remark is None:
            np.testing.assert_allclose(
                read, points, rtol=2**-24 if fits else 1e-15, atol=2e-11 if suffix == ".ply" else 1e-6
            )
        else:
            assert "read float64 coordinates as zeros" in remark
            assert not read.any(), "else the remark is out of date"


def test_convert_tells_of_coordinates_that_others_do_not_read(run: Run, tmp_path: Path) -> None:
    source = tmp_path / "house.xyz"
    np.savetxt(source, SCANS["a house, UTM"][0], fmt="%.3f")
    told = run("convert", source, tmp_path / "house.pcd")
    assert told.code == 0
    assert told.err.count("Open3D and PCL read float64 coordinates as zeros") == 1
    assert not run("convert", source, tmp_path / "house.ply").err


def test_decimals_of_coordinates() -> None:
    for digits in range(9):
        values = np.round(RNG.uniform(-9, 9, (500, 3)), digits)
        values[0, 0] = 3 + 10.0**-digits
        assert decimals(values) == digits
    assert decimals(RNG.random((500, 3))) is None
    late = np.zeros((300_000, 3))
    late[200_001, 1] = 0.001
    assert decimals(late) == 3, "which no sample has seen"
    assert decimals(np.full((5, 3), 1e15) + 0.25) is None, "float64 does not tell"
    assert is_enough(np.float32(late), late)
    assert not is_enough(np.float32(late + 1e5), late + 1e5)
