"""Estimated normals and radii against analytic surfaces, a brute-force twin and real meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.errors import InputError
from viewer.scan import formats
from viewer.scan.estimate import cloud_normals, cloud_radii, fake_color
from viewer.scan.points import PointCloud


def sphere(count: int = 20_000) -> NDArray[np.float64]:
    """Points at random on the unit sphere; each is its own normal."""
    points = np.random.default_rng(1).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def grid(side: int = 40, spacing: float = 1.0) -> NDArray[np.float64]:
    """A square of points in z = 0, row by row."""
    x, y = np.meshgrid(np.arange(side), np.arange(side))
    return spacing * np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)


def cosines(a: NDArray, b: NDArray) -> NDArray:
    return np.einsum("ij,ij->i", a, b)


def test_normals_of_a_sphere_are_the_analytic_ones_and_point_out() -> None:
    points = sphere()
    normals = cloud_normals(PointCloud.from_arrays(points))
    assert normals.dtype == np.float32
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1, abs=1e-6)
    angles = np.degrees(np.arccos(np.clip(cosines(normals, points), -1, 1)))
    assert angles.max() < 5  # signed: one that points in would be near 180
    assert np.median(angles) < 0.5


def test_normals_face_a_viewpoint_given_in_absolute_units() -> None:
    center = np.array([1000, 0, 0])
    points = sphere() + center
    normals = cloud_normals(PointCloud.from_arrays(points), viewpoint=center)
    assert cosines(normals, points - center).max() < -0.99


def test_normals_of_a_sheet_face_the_front() -> None:
    x, y = np.random.default_rng(2).uniform(-1, 1, (2, 20_000))
    wave = np.stack([x, y, 0.2 * np.sin(4 * x) * np.cos(3 * y)], axis=1)
    assert cloud_normals(PointCloud.from_arrays(wave))[:, 2].min() > 0
    flat = cloud_normals(PointCloud.from_arrays(grid()))
    assert flat == pytest.approx(np.tile([0, 0, 1], (1600, 1)), abs=1e-6)


@pytest.mark.parametrize("model", ["stanford_bunny_35947.ply", "stanford_armadillo_43243.ply"])
def test_normals_of_real_bodies_point_out(data_dir: Path, model: str) -> None:
    from open3d import io

    mesh = io.read_triangle_mesh(str(data_dir / "models" / model))
    mesh.compute_vertex_normals()
    agreement = cosines(
        cloud_normals(formats.read(data_dir / "models" / model)), np.array(mesh.vertex_normals)
    )
    assert np.mean(agreement[np.abs(agreement) > 0.7] > 0) > 0.998


def test_real_noisy_hands(data_dir: Path) -> None:
    cloud = formats.read(data_dir / "sequences" / "hands_knot_5" / "00001.ply")
    normals, radii = cloud_normals(cloud), cloud_radii(cloud)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1, abs=1e-6)
    assert 0.0005 < radii.min() < np.median(radii) < 0.003  # metres, of points about a millimetre apart
    assert radii.max() < 0.05
    facing = cloud_normals(cloud, viewpoint=(0, 0, 1))
    assert cosines(facing, np.array([0, 0, 1]) - cloud.world()).min() >= -1e-6


def test_normals_far_from_the_origin_are_those_at_the_origin() -> None:
    points = np.round(sphere(2000) * 2**12) / 2**12  # exact after the shift
    here = cloud_normals(PointCloud.from_arrays(points))
    there = cloud_normals(PointCloud.from_arrays(points + np.array([2**19, 2**22, 0])))
    assert there == pytest.approx(here, abs=1e-3)


def test_radii_of_a_grid_follow_its_spacing() -> None:
    radii = cloud_radii(PointCloud.from_arrays(grid(spacing=0.25))).reshape(40, 40)
    assert radii[2:-2, 2:-2] == pytest.approx(0.25 * np.sqrt(2))


def test_radii_are_the_brute_force_ones() -> None:
    points = np.random.default_rng(3).uniform(size=(500, 3)).astype(np.float32)
    cloud = PointCloud.from_arrays(points)
    distances = np.linalg.norm(points[:, None].astype(np.float64) - points[None], axis=2)
    nearest = np.argsort(distances, axis=1)[:, :8]
    radii = np.take_along_axis(distances, nearest, axis=1)[:, 7]
    usual = np.median(radii[nearest], axis=1)
    assert cloud_radii(cloud, k=7) == pytest.approx(np.clip(radii, usual / 2, usual * 2), rel=1e-6)


def test_duplicates_change_nothing() -> None:
    points = sphere(1000).astype(np.float32)
    many = np.repeat(points, 20, axis=0)
    for estimate in (cloud_normals, cloud_radii):
        once, often = estimate(PointCloud.from_arrays(points)), estimate(PointCloud.from_arrays(many))
        assert often == pytest.approx(np.repeat(once, 20, axis=0), abs=1e-6)


def test_a_stray_point_gets_no_huge_splat() -> None:
    radii = cloud_radii(PointCloud.from_arrays(np.vstack([grid(), [[20, 20, 500]]])))
    assert radii.max() < 10


@pytest.mark.parametrize("viewpoint", [None, (0.0, 0.0, -5.0)])
@pytest.mark.parametrize(
    "points",
    [
        np.zeros((0, 3)),
        np.zeros((1, 3)),
        [[0, 0, 0], [1, 2, 3]],
        np.full((50, 3), 7.0),
        np.repeat([[0, 0, 0], [0, 0, 1]], 30, axis=0),
        np.outer(np.arange(30), [1, 2, 3]),
        np.outer(np.linspace(0, 1e-6, 30), [1, 0, 0]) + 1,
        grid(5),
        grid(5, spacing=1e-12),
        np.vstack([grid(5), [[1e15, 0, 0]]]),
    ],
    ids=["none", "one", "two", "copies", "two places", "line", "short line", "plane", "tiny", "outlier"],
)
def test_degenerate_clouds_give_unit_normals_and_positive_radii(
    points: NDArray, viewpoint: tuple[float, float, float] | None
) -> None:
    cloud = PointCloud.from_arrays(np.asarray(points, np.float64))
    normals, radii = cloud_normals(cloud, viewpoint=viewpoint), cloud_radii(cloud)
    assert normals.shape == (len(points), 3)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1, abs=1e-5)
    assert radii.shape == (len(points),)
    assert np.isfinite(radii).all()
    assert (radii > 0).all()


def test_normals_across_a_line() -> None:
    direction = np.array([1, 2, 3]) / np.sqrt(14)
    normals = cloud_normals(PointCloud.from_arrays(np.outer(np.arange(30.0), direction)))
    assert normals @ direction == pytest.approx(0, abs=1e-3)


@pytest.mark.parametrize("viewpoint", [(0, 0), (0, 0, np.nan)])
def test_an_unusable_viewpoint(viewpoint: tuple[float, ...]) -> None:
    with pytest.raises(InputError, match="is not a viewpoint"):
        cloud_normals(PointCloud.from_arrays(grid(3)), viewpoint=viewpoint)


def test_fake_color_tells_the_direction() -> None:
    normals = np.array([[1, 0, 0], [0, 1, 0], [0, 0, -1], [np.nan, 0, 0], [2, 0, 0]], np.float32)
    assert fake_color(normals).tolist() == [
        [255, 128, 128, 255],
        [128, 255, 128, 255],
        [128, 128, 0, 255],
        [128, 128, 128, 255],
        [255, 128, 128, 255],
    ]
