from __future__ import annotations

import numpy as np

from viewer.bench.truth.isosurface import grid_values, isosurface
from viewer.mesh.triangles import Mesh
from viewer.scan.points import PointCloud

# Uneven lines, finer near the middle of x.
LINES = (
    np.concatenate([np.arange(-1.5, -0.3, 0.05), np.arange(-0.3, 0.3, 0.02), np.arange(0.3, 1.5, 0.05)]),
    np.arange(-1.5, 1.5, 0.05),
    np.arange(-1.4, 1.6, 0.05),
)


def ball(points: np.ndarray) -> np.ndarray:
    return (np.linalg.norm(points, axis=1) - 1).astype(np.float32)


def dense() -> np.ndarray:
    points = np.stack(np.meshgrid(*LINES, indexing="ij"), axis=-1).reshape(-1, 3)
    return ball(points).reshape([len(line) for line in LINES])


def test_a_ball_comes_out_round_and_outside_out() -> None:
    vertices, faces = isosurface(dense(), LINES)
    assert np.abs(np.linalg.norm(vertices, axis=1) - 1).max() < 0.005
    areas = Mesh(PointCloud.from_arrays(vertices), faces).areas()
    assert ((areas * vertices[faces[:, 0]]).sum(axis=1) > 0).all()
    assert abs(np.linalg.norm(areas, axis=1).sum() / 2 / (4 * np.pi) - 1) < 0.01


def test_there_is_no_surface_where_nothing_is_known() -> None:
    grid = dense()
    grid[len(LINES[0]) // 2 :] = np.nan
    vertices, _ = isosurface(grid, LINES)
    assert vertices[:, 0].max() <= LINES[0][len(LINES[0]) // 2]
    assert vertices[:, 0].min() < -0.99


def test_coarse_to_fine_misses_nothing() -> None:
    asked: list[int] = []

    def values(points: np.ndarray) -> np.ndarray:
        asked.append(len(points))
        return ball(points)

    grid = grid_values(values, LINES, reach=0.4)
    assert sum(asked) < 0.7 * grid.size
    vertices, faces = isosurface(grid, LINES)
    expected, expected_faces = isosurface(dense(), LINES)
    np.testing.assert_array_equal(vertices, expected)
    np.testing.assert_array_equal(faces, expected_faces)
