from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from viewer.bench.scenes import samples
from viewer.bench.truth import tessellation
from viewer.bench.truth.shapes import AnalyticSurface, Cuboid, Plane, Sphere, Torus
from viewer.mesh.triangles import Mesh
from viewer.scan.points import PointCloud

SHAPES = [
    pytest.param(samples.on_sphere, Sphere(), tessellation.sphere_mesh, id="sphere"),
    pytest.param(samples.on_square, Plane(), tessellation.square_mesh, id="square"),
    pytest.param(samples.on_cube, Cuboid(), tessellation.cube_mesh, id="cube"),
    pytest.param(samples.on_torus, Torus(), tessellation.torus_mesh, id="torus"),
]


@pytest.mark.parametrize(("sampler", "shape", "mesh"), SHAPES)
def test_points_are_on_the_shape_and_normals_are_its_own(
    sampler: samples.Sampler, shape: AnalyticSurface, mesh: Callable[[], Mesh]
) -> None:
    for points, normals in (
        (sampler(3000, slice(None))["positions"], sampler(3000, slice(None))["normals"]),
        (mesh().points.positions[::37].astype(np.float64), mesh().points.normals[::37]),
    ):
        # A ray that meets a torus where it touches the ball around it starts on the surface.
        apart = np.abs(np.linalg.norm(points, axis=1) - shape.reach) > 1e-6
        if isinstance(shape, Torus):
            points, normals = points[apart], normals[apart]
        steps = -(normals + 0.1 * np.roll(normals, 1, axis=1)).astype(np.float64)
        np.testing.assert_allclose(shape.distance(points - 0.25 * steps, steps), 0.25, atol=1e-6)
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)
        edges = (
            np.sort(np.abs(points), axis=1)[:, -2] > 0.999 if isinstance(shape, Cuboid) else 0 * points[:, 0]
        )
        kept = ~edges.astype(bool)
        np.testing.assert_allclose(shape.normal(points[kept]), normals[kept], atol=1e-5)


@pytest.mark.parametrize(("sampler", "shape", "mesh"), SHAPES)
def test_points_are_even(sampler: samples.Sampler, shape: AnalyticSurface, mesh: Callable[[], Mesh]) -> None:
    from scipy.spatial import cKDTree

    arrays = sampler(6000, slice(None))
    spacing = arrays["radii"][0] / 1.5
    tree = cKDTree(arrays["positions"])
    nearest = tree.query(arrays["positions"], 2)[0][:, 1]
    assert np.median(nearest) > 0.6 * spacing
    # Nowhere is a hole that the discs would not close.
    probes = samples.on_mesh(mesh(), 20_000).positions
    assert tree.query(probes)[0].max() < 1.5 * spacing


def test_rows_are_those_of_the_whole() -> None:
    for sampler in (samples.on_sphere, samples.on_square, samples.on_cube, samples.on_torus):
        whole, part = sampler(1000, slice(None)), sampler(1000, slice(300, 310))
        np.testing.assert_array_equal(whole["positions"][300:310], part["positions"])


@pytest.mark.parametrize(("sampler", "shape", "mesh"), SHAPES)
def test_tessellations_are_near_and_face_outwards(
    sampler: samples.Sampler, shape: AnalyticSurface, mesh: Callable[[], Mesh]
) -> None:
    made = mesh()
    corners = made.points.positions[made.faces].astype(np.float64)
    middles, areas = corners.mean(axis=1)[::13], made.areas()[::13]
    facing = (areas * made.points.normals[made.faces[::13, 0]]).sum(axis=1)
    assert (facing >= 0).all()
    size = np.linalg.norm(areas, axis=1)
    outward = areas[size > 0] / size[size > 0, None]
    np.testing.assert_allclose(shape.distance(middles[size > 0] + 0.1 * outward, -outward), 0.1, atol=6e-5)


def test_points_of_a_mesh_follow_its_area() -> None:
    # Two triangles of areas 1 and 3.
    corners = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0], [10, 0, 0], [16, 0, 0], [10, 1, 0]], np.float32)
    colors = np.array([[0, 0, 0], [0, 0, 0], [0, 0, 0], [255, 0, 0], [255, 0, 0], [255, 0, 0]], np.uint8)
    points = PointCloud.from_arrays(corners + np.array([1000, 0, 0]), colors=colors)
    mesh = Mesh(points, np.array([[0, 1, 2], [3, 4, 5]], np.uint32))
    cloud = samples.on_mesh(mesh, 400, seed=3)
    right = cloud.world()[:, 0] > 1005
    assert np.count_nonzero(right) == 300
    assert (cloud.colors[right, 0] == 255).all()
    assert (cloud.colors[~right, 0] == 0).all()
    np.testing.assert_allclose(cloud.normals, np.tile([0, 0, 1], (400, 1)))
    np.testing.assert_allclose(cloud.radii, 1.5 * np.sqrt(4 / 400), rtol=1e-6)
    np.testing.assert_allclose(cloud.world()[~right].mean(axis=0), [1000 + 2 / 3, 1 / 3, 0], atol=0.02)
    assert not np.array_equal(cloud.positions, samples.on_mesh(mesh, 400, seed=4).positions)
    np.testing.assert_array_equal(cloud.positions, samples.on_mesh(mesh, 400, seed=3).positions)
