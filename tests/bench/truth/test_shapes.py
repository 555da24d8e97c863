"""Analytic scenes: hits lie on the surface, nothing of it lies before them, normals are exact."""

from __future__ import annotations

import numpy as np
import pytest
from demo_surface import DemoHead, surface_value
from numpy.typing import NDArray
from scenes import sphere_hits

from viewer.bench.truth.shapes import AnalyticScene, AnalyticSurface, Cuboid, Plane, Sphere, Torus
from viewer.camera import Camera
from viewer.mesh.reference import pixel_rays, trace
from viewer.mesh.scene import NOTHING

SIZE = (64, 48)


def value(shape: AnalyticSurface, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The signed distance to a shape, written apart from it."""
    if isinstance(shape, Sphere):
        return np.linalg.norm(points, axis=1) - shape.radius
    if isinstance(shape, Cuboid):
        beyond = np.abs(points) - np.array(shape.half)
        return np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)
    assert isinstance(shape, Torus)
    x, y, z = points.T
    return np.hypot(np.hypot(x, z) - shape.ring, y) - shape.tube


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize(
    "shape", [Sphere(), Cuboid(half=(0.5, 1, 0.7)), Torus()], ids=lambda s: type(s).__name__
)
def test_hits_are_first_and_on_the_surface(shape: AnalyticSurface, projection: str) -> None:
    scene = AnalyticScene((shape,))
    camera = Camera.orbit(scene.bounds, 25, 35, projection=projection)
    picture = trace(scene, camera, SIZE)
    hits = picture.positions()
    assert 0.1 < picture.covered.mean() < 0.9
    assert np.abs(value(shape, hits)).max() < 1e-12
    starts, steps = pixel_rays(picture.view, np.arange(SIZE[0] * SIZE[1]))
    depth = picture.depth.ravel()
    for t in np.linspace(camera.distance - 2, camera.distance + 2, 401):
        before = t < depth - 1e-9
        assert (value(shape, starts[before] + t * steps[before]) > -1e-7).all()


@pytest.mark.parametrize(
    "shape", [Sphere(), Cuboid(half=(0.5, 1, 0.7)), Torus()], ids=lambda s: type(s).__name__
)
def test_normals_are_the_gradient(shape: AnalyticSurface) -> None:
    scene = AnalyticScene((shape,))
    picture = trace(scene, Camera.orbit(scene.bounds, 25, 35), SIZE)
    hits, normals = picture.positions(), picture.normal[picture.covered]
    h = 1e-6
    gradient = np.stack(
        [(value(shape, hits + h * e) - value(shape, hits - h * e)) / (2 * h) for e in np.eye(3)], 1
    )
    smooth = np.linalg.norm(gradient, axis=1) > 0.999  # not at an edge of the box
    assert smooth.mean() > 0.99
    assert np.abs(normals - gradient)[smooth].max() < 1e-6


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_a_sphere_is_the_closed_form(projection: str) -> None:
    camera = Camera(eye=(3, 2, 4), projection=projection)
    picture = trace(AnalyticScene((Sphere(),)), camera, SIZE)
    depth, normal = sphere_hits(camera, SIZE)
    assert (np.isfinite(depth) == picture.covered).all()
    both = picture.covered
    assert np.abs(picture.depth[both] - depth[both]).max() < 1e-12
    assert np.abs(picture.normal[both] - normal[both]).max() < 1e-6


def test_a_plane_faces_where_it_says_and_ends_at_its_sides() -> None:
    camera = Camera(eye=(0, 0, 4), projection="orthographic", height=4.8)  # ten pixels a unit
    picture = trace(AnalyticScene((Plane(center=(0, 0, 0.5), right=(1, 0, 0), up=(0, 2, 0)),)), camera, SIZE)
    assert picture.covered.sum() == 20 * 40
    assert (picture.depth[picture.covered] == 3.5).all()
    assert (picture.normal[picture.covered] == [0, 0, 1]).all()


def test_nearer_shapes_hide_farther_ones() -> None:
    scene = AnalyticScene((Sphere(color="#ff0000"), Plane(center=(0, 0, 2), color="#00ff00")))
    picture = trace(scene, Camera(eye=(0, 0, 9), fov_y=30), SIZE)
    middle = SIZE[1] // 2, SIZE[0] // 2
    assert picture.id[middle] == 1
    assert picture.depth[middle] == pytest.approx(7)
    assert picture.color[middle].tolist() == [0, 1, 0]
    assert set(np.unique(picture.id)) == {1, NOTHING}  # the plane hides the sphere


def test_near_and_far_planes_cut() -> None:
    scene = AnalyticScene((Sphere(),))
    cut = trace(scene, Camera(eye=(0, 0, 4), near=4.0), SIZE)
    middle = SIZE[1] // 2, SIZE[0] // 2
    assert cut.depth[middle] == pytest.approx(5, abs=1e-3)  # the far side, from inside
    assert not trace(scene, Camera(eye=(0, 0, 4), far=2.5), SIZE).covered.any()


def test_a_scene_far_from_zero_is_seen_as_at_zero() -> None:
    far = np.array([3e6, -5e6, 1e6])
    here = trace(AnalyticScene((Torus(),)), Camera(eye=(0, 3, 4)), SIZE)
    there = trace(
        AnalyticScene((Torus(center=tuple(far)),)),
        Camera(eye=tuple(np.add(far, (0, 3, 4))), target=tuple(far)),
        SIZE,
    )
    assert (here.covered == there.covered).all()
    assert np.abs(here.depth[here.covered] - there.depth[here.covered]).max() < 1e-9


@pytest.mark.slow
def test_the_demo_head_is_hit_where_its_surface_is() -> None:
    scene = AnalyticScene((DemoHead(time=0.8),))
    camera = Camera(eye=(80, 20, 700), fov_y=20)
    picture = trace(scene, camera, (40, 40))
    hits = picture.positions() + picture.origin
    assert 0.2 < picture.covered.mean() < 0.8
    assert np.abs(surface_value(hits, 0.8)).max() < 1e-6
    assert np.abs(np.linalg.norm(picture.normal[picture.covered], axis=1) - 1).max() < 1e-6


def test_a_ray_that_enters_the_ball_on_the_surface_hits_it_there() -> None:
    torus = Torus(ring=1.0, tube=0.4)  # reaches 1.4 from its centre
    inwards = np.array([[-1.0, 0, 0], [-1, 0.3, 0], [-0.5, -0.2, 0.4]])
    starts = np.array([1.4, 0, 0]) - 3 * inwards
    np.testing.assert_allclose(torus.distance(starts, inwards), 3, rtol=1e-12)
