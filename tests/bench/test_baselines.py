"""The floor and the ceiling: GL_POINTS draws what a z-buffer does, the mesh what rays see."""

from __future__ import annotations

import numpy as np
import pytest
from hardware import allowed_points
from scenes import NOTHING, sphere, sphere_mesh, zbuffer

from viewer.bench import baselines
from viewer.bench.truth.surface import reference_surface
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.look import Look
from viewer.mesh.reference import trace
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose

SIZE = (160, 120)
LOOK = Look(light="head")


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_the_mesh_is_what_rays_see(renderer: Renderer, projection: str) -> None:
    mesh = sphere_mesh()
    camera = Camera((2.0, 1.0, 3.0)).projected(projection)
    surface = Surface(renderer.gpu, SIZE)
    request = Request(Pose(0, 0.0, "mesh", mesh.points), camera, baselines.mesh(mesh), look=LOOK)
    render_frame(renderer, request, surface)
    truth = trace(mesh, camera, SIZE)

    same = surface.id == truth.id
    # Drivers move vertices to a grid of 1/256 pixel: edges move, and depths by as much as they lean.
    assert same.mean() > 0.998
    inside = same & truth.covered
    assert inside.mean() > 0.1
    # View space is float32: 2e-7 at this distance, on edges of 0.03.
    np.testing.assert_allclose(surface.depth[inside], truth.depth[inside], atol=0.0165 / 256 * 3)
    np.testing.assert_allclose(surface.normal[inside], truth.normal[inside], atol=1e-4)
    np.testing.assert_allclose(surface.color[inside], truth.color[inside], atol=0.006)  # 8 bits
    picture = reference_surface(truth, renderer.gpu, LOOK).image().astype(int)
    assert np.abs(surface.image().astype(int) - picture)[inside].max() <= 1


def test_a_picture_of_rows_forgets_what_the_last_backend_wrote(renderer: Renderer) -> None:
    mesh, surface = sphere_mesh(), Surface(renderer.gpu, SIZE)
    pose, camera = Pose(0, 0.0, "mesh", mesh.points), Camera((2.0, 1.0, 3.0))
    alone = Surface(renderer.gpu, SIZE)
    render_frame(renderer, Request(pose, camera, "surfels", look=LOOK), alone)
    render_frame(renderer, Request(pose, camera, baselines.mesh(mesh), look=LOOK), surface)
    assert not np.array_equal(surface.image(), alone.image())
    render_frame(renderer, Request(pose, camera, "surfels", look=LOOK), surface)
    assert np.array_equal(surface.image(), alone.image())
    assert np.array_equal(surface.normal, alone.normal)


def test_gl_points_are_a_z_buffer(renderer: Renderer) -> None:
    cloud, camera = sphere(3000), Camera((1.0, 0.5, 3.0))
    surface = Surface(renderer.gpu, SIZE)
    request = Request(Pose(0, 0.0, "points", cloud), camera, baselines.gl_points(), look=LOOK)
    render_frame(renderer, request, surface)
    depth, row = zbuffer(cloud, camera, SIZE)
    assert allowed_points(renderer.gpu, cloud, camera, surface.row).all()
    same = (surface.row == row) & np.isfinite(depth)
    np.testing.assert_allclose(surface.depth[same], depth[same], rtol=1e-5)


def test_pictures_that_no_opengl_draws_are_not_allowed(renderer: Renderer) -> None:
    """Of those moved by a pixel, with a point left out, or with one that is behind."""
    cloud, camera = sphere(3000), Camera((1.0, 0.5, 3.0))
    _, row = zbuffer(cloud, camera, SIZE)
    assert allowed_points(renderer.gpu, cloud, camera, row).all()
    shown, behind = np.flatnonzero(row.ravel() != NOTHING), np.setdiff1d(np.arange(3000), row)
    for changed, at_least in (
        (np.roll(row, 1, axis=1), 0.9),
        (np.where(np.arange(row.size).reshape(row.shape) == shown[100], NOTHING, row), 1 / len(shown)),
        (np.where(row == NOTHING, row, np.resize(behind, row.shape)), 0.9),
    ):
        assert (~allowed_points(renderer.gpu, cloud, camera, changed)).sum() >= at_least * len(shown)


def test_a_mesh_without_faces_in_view_is_nothing(renderer: Renderer) -> None:
    mesh = sphere_mesh()
    surface = Surface(renderer.gpu, (16, 16))
    away = Camera((0.0, 0.0, 3.0), (0.0, 0.0, 6.0))
    pose = Pose(0, 0.0, "mesh", mesh.points)
    render_frame(renderer, Request(pose, away, baselines.mesh(mesh), look=LOOK), surface)
    assert not surface.coverage.any()
    assert not surface.normal.any()
    assert not surface.color.any()
