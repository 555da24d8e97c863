"""Scenes with exactly known answers, for every backend or for one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scenes import (
    NOTHING,
    looking_down_z,
    of_variant,
    plane,
    sphere,
    sphere_hits,
    variants,
    zbuffer,
)  # fmt: skip

from viewer.backends import backend
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

Draw = Callable[..., Surface]
ways_of_surfels = pytest.mark.parametrize("way", [v for v in variants() if of_variant(v)[0] == "surfels"])
PROJECTIONS = ("perspective", "orthographic")


def test_one_point_on_its_pixel_with_its_depth(draw: Draw) -> None:
    # Half the height of the picture is tan(45 deg) = 1 at depth 1: 24 pixels a unit at depth 1.
    camera = looking_down_z(fov_y=90)
    cloud = PointCloud.from_arrays([[0.5, 0.25, -2.0]])
    surface = draw(cloud, camera, (64, 48))
    x, y = 32 + 0.5 * 24 / 2, 24 - 0.25 * 24 / 2
    assert np.argwhere(surface.id == 0).tolist() == [[int(y), int(x)]]
    assert (surface.id != NOTHING).sum() == 1
    assert surface.depth[int(y), int(x)] == 2.0
    assert np.isinf(surface.depth).sum() == 64 * 48 - 1


@pytest.mark.parametrize("size", [1, 2, 3, 8])
def test_a_point_is_a_square_of_its_size(draw: Draw, size: int) -> None:
    cloud = PointCloud.from_arrays([[0.01, -0.01, -2.0]])
    surface = draw(cloud, looking_down_z(fov_y=90), params={"point_size": size})
    rows, columns = np.nonzero(surface.id == 0)
    assert len(rows) == size * size
    assert np.ptp(rows) == np.ptp(columns) == size - 1
    assert abs(rows.mean() + 0.5 - 24.12) <= 0.51
    assert abs(columns.mean() + 0.5 - 32.12) <= 0.51


@ways_of_surfels
@pytest.mark.parametrize("projection", PROJECTIONS)
def test_surfels_close_a_plane(draw: Draw, way: str, projection: str) -> None:
    camera = looking_down_z(fov_y=40, projection=projection, height=2.0)
    assert (draw(plane(120, 3.0), camera, (64, 48), way).id != NOTHING).all()


@pytest.mark.parametrize("projection", PROJECTIONS)
@pytest.mark.parametrize("size", [(97, 61), (1, 1), (640, 3)])
def test_points_equal_the_plain_renderer(draw: Draw, projection: str, size: tuple[int, int]) -> None:
    cloud = sphere(4000)
    camera = Camera.orbit(cloud.bounds(), 30, 20, aspect=1.5, projection=projection)
    surface = draw(cloud, camera, size)
    depth, row = zbuffer(cloud, camera, size)
    # float32 may put a point that lies on the edge of two pixels into the other one.
    assert (surface.row != row).mean() <= 0.002
    same = (surface.row == row) & (row != NOTHING)
    np.testing.assert_allclose(surface.depth[same], depth[same], rtol=1e-6)


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_surfels_of_a_sphere(draw: Draw, projection: str) -> None:
    cloud, size = sphere(20_000), (160, 120)
    camera = Camera.orbit(cloud.bounds(), 40, 25, aspect=4 / 3, projection=projection)
    surface = draw(cloud, camera, size, "surfels", params={"passes": "one"})
    depth, normal = sphere_hits(camera, size)
    inside, covered = np.isfinite(depth), surface.id != NOTHING
    assert not (inside & ~covered).any(), "a hole"
    # Discs touch the sphere from outside: they pass its silhouette by their sagitta at most.
    assert (covered & ~inside).sum() <= 0.35 * np.count_nonzero(np.diff(inside, axis=1))
    both = inside & covered
    radius = float(cloud.radii[0])
    sagitta = 1 - np.sqrt(1 - radius**2)
    # A disc seen at a grazing angle is off by sagitta / cos; compare where it faces the eye.
    facing = both & (normal @ camera.rotation()[2] > 0.5)
    assert np.abs(surface.depth - np.where(inside, depth, 0))[facing].max() < 4 * sagitta
    expected = cloud.normals[surface.row[covered]]
    np.testing.assert_allclose(surface.normal[covered], expected, atol=2e-7)
    # The disc that a pixel shows belongs to a point within a radius of the true hit.
    assert np.einsum("ij,ij->i", surface.normal[facing], normal[facing]).min() > np.cos(1.5 * radius)


@pytest.mark.parametrize(
    "normal", [(0, 1, 0), (0, -1, 0), (1e-7, 1, 0), (0, 1, -1e-7), (0, 0, -1), (1, 0, 0)]
)
def test_a_surfel_is_a_whole_disc_for_every_normal(draw: Draw, normal: tuple[float, float, float]) -> None:
    """Slomp's template collapses where the normal is parallel to (0, 1, 0); ours must not."""
    axis = np.array(normal) / np.linalg.norm(normal)
    up = (0.0, 0.0, 1.0) if abs(axis[1]) > 0.5 else (0.0, 1.0, 0.0)
    camera = Camera(eye=tuple(axis * 4), target=(0, 0, 0), up=up, projection="orthographic", height=4.0)
    cloud = PointCloud.from_arrays([[0, 0, 0]], normals=[normal], radii=[1.0])
    covered = draw(cloud, camera, (200, 200), "surfels").id == 0
    assert covered.sum() * (4 / 200) ** 2 == pytest.approx(np.pi, rel=0.01)


@pytest.mark.parametrize("normal", [(0, 0, 0), (np.nan, 0, 0)])
def test_a_surfel_without_a_normal_faces_the_eye(draw: Draw, normal: tuple[float, float, float]) -> None:
    cloud = PointCloud.from_arrays([[0, 0, -3]], normals=[normal], radii=[0.5])
    surface = draw(cloud, looking_down_z(fov_y=40), (101, 101), "surfels", Look(light="head"))
    assert (surface.id == 0).sum() == pytest.approx(
        np.pi * (0.5 / 3 * 101 / 2 / np.tan(np.radians(20))) ** 2, rel=0.03
    )
    assert surface.image()[50, 50, :3].min() > 100, "lit as if facing the eye"


@pytest.mark.parametrize("radius", [0.0, -1.0, np.nan])
def test_an_unusable_radius_counts_as_unknown(draw: Draw, radius: float) -> None:
    cloud = sphere(2000)
    bad = PointCloud.from_arrays(cloud.positions, normals=cloud.normals, radii=np.full(2000, radius))
    none = PointCloud.from_arrays(cloud.positions, normals=cloud.normals)
    camera = Camera.orbit(cloud.bounds())
    one, other = (draw(c, camera, (80, 60), "surfels") for c in (bad, none))
    assert (one.id != NOTHING).mean() > 0.3
    np.testing.assert_array_equal(one.id, other.id)


def test_automatic_choices_do_not_depend_on_what_was_estimated_before(renderer: Renderer) -> None:
    bare = sphere(3000)
    pose = Pose(0, 0.0, "x", PointCloud.from_arrays(bare.positions))
    camera = Camera.orbit(bare.bounds())
    surface = Surface(renderer.gpu, (60, 60))

    def picture(name: str | None, look: Look, **params: object) -> np.ndarray:
        chosen = params and {"params": backend(name or "points").params(params)}
        render_frame(renderer, Request(pose, camera, name, look=look, **chosen), surface)
        return surface.image()

    before = picture(None, Look())
    uniform = picture("surfels", Look())
    picture("surfels", Look(light="head"), radius="own")
    assert pose.cloud.normals is None
    np.testing.assert_array_equal(picture(None, Look()), before)
    np.testing.assert_array_equal(picture("surfels", Look()), uniform)


def test_points_can_be_as_large_as_it_takes_to_touch(draw: Draw) -> None:
    cloud = plane(60, 3.0)
    camera = looking_down_z(fov_y=40)
    touching = draw(cloud, camera, (300, 300), params={"point_size": 0})
    assert touching.coverage.mean() > 0.97
    assert draw(cloud, camera, (300, 300)).coverage.mean() < 0.1
    far = draw(cloud, Camera(eye=(0, 0, 300), target=(0, 0, 0)), (300, 300), params={"point_size": 0})
    near = draw(cloud, Camera(eye=(0, 0, 300), target=(0, 0, 0)), (300, 300), params={"point_size": 1})
    np.testing.assert_array_equal(far.id, near.id)
