"""Half-axes of elliptical splats: the five columns of files, and what does not describe an ellipse."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viewer.errors import InputError
from viewer.scan.formats import read, write
from viewer.scan.points import PointCloud

COLUMNS = "x y z radius_u radius_v tangent_x tangent_y tangent_z"


def table(path: Path, names: str, rows: list[list[float]]) -> PointCloud:
    """A CSV file with these columns, read."""
    lines = [",".join(names.split()), *(",".join(map(str, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return read(path)


def elliptical(count: int = 40) -> PointCloud:
    """Ellipses of all sizes; every third splat is round."""
    rng = np.random.default_rng(3)
    axes = np.column_stack([rng.normal(size=(count, 3)), rng.uniform(0.1, 2, count)])
    axes[::3] = 0
    normals = rng.normal(size=(count, 3))
    points = rng.random((count, 3)) + np.array([665187.25, 5648349.5, 241.75])
    return PointCloud.from_arrays(points, normals=normals, radii=rng.random(count), axes=axes)


@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".npz"])
def test_what_is_written_comes_back(suffix: str, tmp_path: Path) -> None:
    cloud, path = elliptical(), tmp_path / f"scan{suffix}"
    write(path, cloud)
    again = read(path)
    assert again.axes is not None
    np.testing.assert_allclose(again.axes, cloud.axes, rtol=1e-6, atol=1e-7)  # type: ignore[arg-type]
    np.testing.assert_allclose(again.radii, cloud.radii, rtol=1e-6)  # type: ignore[arg-type]
    assert not again.scalars


def test_lengths_and_a_tangent_of_any_length(tmp_path: Path) -> None:
    cloud = table(tmp_path / "a.csv", COLUMNS, [[0, 0, 0, 2, 0.5, 0, 0, 7], [1, 1, 1, 0.5, 3, 0.6, -0.8, 0]])
    assert cloud.axes is not None
    np.testing.assert_allclose(cloud.axes, [[0, 0, 2, 0.5], [0.3, -0.4, 0, 3]], rtol=1e-6)
    np.testing.assert_allclose(cloud.radii, np.sqrt([1, 1.5]), rtol=1e-6)
    assert not cloud.scalars


@pytest.mark.parametrize("radius", [True, False])
def test_rows_that_describe_no_ellipse_are_round(radius: bool, tmp_path: Path) -> None:
    """With the radius that the file has, else that of the same area."""
    bad = [
        [2, 0.5, 0, 0, 0],
        [2, 0.5, np.nan, 0, 1],
        [2, 0, 0, 0, 1],
        [0.5, 2, np.inf, 0, 0],
        [2, -1, 0, 0, 1],
    ]
    area = [1, 1, 0, 1, 0]
    rows = [[i, 0, 0, *row, *[9] * radius] for i, row in enumerate([*bad, [2, 8, 1, 0, 0]])]
    cloud = table(tmp_path / "a.csv", COLUMNS + " radius" * radius, rows)
    assert cloud.axes is not None
    np.testing.assert_array_equal(cloud.axes[:-1], 0)
    np.testing.assert_array_equal(cloud.axes[-1], [2, 0, 0, 8])
    np.testing.assert_array_equal(cloud.radii, [*([9] * 5 if radius else area), 4])


def test_a_scan_whose_splats_all_are_round_has_no_half_axes(tmp_path: Path) -> None:
    cloud = table(tmp_path / "a.csv", COLUMNS, [[0, 0, 0, 2, 0.5, 0, 0, 0], [1, 0, 0, 1, 3, 0, 0, 0]])
    assert cloud.axes is None
    np.testing.assert_allclose(cloud.radii, np.sqrt([1, 3]), rtol=1e-6)


def test_columns_without_all_of_a_tangent_stay_scalars(tmp_path: Path) -> None:
    cloud = table(tmp_path / "a.csv", "x y z radius_u radius_v tangent_x", [[0, 0, 0, 2, 0.5, 1]] * 2)
    assert cloud.axes is None
    assert cloud.radii is None
    assert set(cloud.scalars) == {"radius_u", "radius_v", "tangent_x"}


@pytest.mark.parametrize("shared", [False, True])
def test_half_axes_of_a_sequence(shared: bool, tmp_path: Path) -> None:
    rng, path = np.random.default_rng(0), tmp_path / "scan.npz"
    axes = rng.uniform(0.1, 1, (10, 4) if shared else (3, 10, 4))
    np.savez(path, positions=rng.random((3, 10, 3)), axes=axes)
    for frame in range(3):
        expected = axes if shared else axes[frame]
        np.testing.assert_allclose(read(path, frame).axes, expected, rtol=1e-6)  # type: ignore[arg-type]


def test_points_that_are_dropped_take_their_half_axes_along() -> None:
    axes = np.column_stack([np.eye(3), [4.0, 5.0, 6.0]])
    cloud = PointCloud.from_arrays([[0, 0, 0], [np.nan, 0, 0], [1, 1, 1]], axes=axes)
    np.testing.assert_array_equal(cloud.axes, axes[[0, 2]])  # type: ignore[arg-type]
    np.testing.assert_allclose(cloud.radii, [2, np.sqrt(6)], rtol=1e-6)
    assert cloud.nbytes == 2 * 4 * (3 + 1 + 4 + 1)


@pytest.mark.parametrize("length", [1e-30, 1e30, 1e200])
def test_lengths_that_float32_cannot_square_are_none(length: float) -> None:
    axes = [[length, 0, 0, 1.0], [1.0, 0, 0, 1.0], [1.0, 0, 0, length]]
    cloud = PointCloud.from_arrays(np.eye(3), radii=[0.1, 0.2, 0.3], axes=axes)
    np.testing.assert_array_equal(cloud.axes, [[0, 0, 0, 0], axes[1], [0, 0, 0, 0]])  # type: ignore[arg-type]
    np.testing.assert_allclose(cloud.radii, [0.1, 1.0, 0.3], rtol=1e-6)  # type: ignore[arg-type]


def test_how_far_splats_reach() -> None:
    cloud = PointCloud.from_arrays(
        np.eye(3), radii=[7.0, 8.0, 9.0], axes=[[3, 4, 0, 1], [0, 0, 0, 0], [1, 0, 0, 6]]
    )
    np.testing.assert_array_equal(cloud.splat_reach(), [5, 8, 6])  # type: ignore[arg-type]


def test_half_axes_have_four_columns() -> None:
    with pytest.raises(InputError, match=r"axes have shape \(3, 3\)"):
        PointCloud.from_arrays(np.eye(3), axes=np.eye(3))
