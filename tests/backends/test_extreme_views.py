"""Views that float32 offsets from one origin, or float32 depths from the eye, would not hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import every_backend, of_variant

import viewer
from viewer.analysis.pick import is_seen, pick
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.plan import Effort, Waiting, make_plan
from viewer.drawing.renderer import Renderer, shared_renderer
from viewer.drawing.request import Request
from viewer.errors import InputError
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.view import View, origin_near

SIZE = (160, 120)
PLACES = np.random.default_rng(4).uniform(-1, 1, (3000, 3))
MAP = np.array([5e5, 5.4e6, 0.0])  # where the scan's middle is
PART = MAP + np.array([4.1e6, -2.3e6, 1.7e6])
LENSES = (30.0, 0.1, 1e-3, 1e-6)  # degrees
OFF = 1 / 32  # of a pixel: what View.straightened allows, in float64


def of_all_scales(scale: float) -> PointCloud:
    """Points within a scale of PART, and a scan 10^7 across behind the eye that looks at it."""
    around = np.random.default_rng(5).uniform(-5e6, 5e6, (9000, 3)) + MAP + (0, 0, 2e7)
    return PointCloud.from_arrays(np.concatenate([PART + scale * PLACES, around]))


def at(center: NDArray[np.float64], scale: float, fov_y: float = 30.0) -> Camera:
    """A camera that sees what is within a scale of the centre."""
    distance = 1.5 * scale / np.tan(np.radians(fov_y) / 2)
    return Camera(tuple(center + np.array([0.3 * distance, 0, distance])), tuple(center), fov_y=fov_y)


def projected(camera: Camera, world: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Pixel coordinates (N, 2) and depths (N,), in float64 from the world's coordinates themselves."""
    right, up, back = camera.rotation() @ (world - camera.eye).T
    scale = SIZE[1] / 2 / np.tan(np.radians(camera.fov_y) / 2) / -back
    return np.stack([right * scale, -up * scale], axis=1) + np.array(SIZE) / 2, -back


def check_points(surface: Surface, camera: Camera, cloud: PointCloud) -> None:
    """Each pixel shows a point that is in it, as far from the eye as that is."""
    pixels, depths = projected(camera, cloud.world())
    y, x = np.nonzero(np.isfinite(surface.depth))
    rows = surface.row[y, x]
    assert len(rows) > 1000
    assert np.abs(pixels[rows] - np.stack([x, y], axis=1) - 0.5).max() < 0.5 + OFF
    assert np.abs(surface.depth[y, x] - depths[rows]).max() < OFF * camera.view_height / SIZE[1]


@pytest.mark.parametrize("scale", [1e3, 1.0, 1e-2])
def test_a_small_part_of_a_scan_is_where_float64_has_it(scale: float) -> None:
    cloud, camera = of_all_scales(scale), at(PART, scale)
    surface = viewer.render(cloud, camera, SIZE, "points", point_size=1)
    check_points(surface, camera, cloud)
    y, x = np.argwhere(np.isfinite(surface.depth))[500]
    picked = pick(surface, int(x), int(y))
    assert picked is not None
    assert picked.row is not None
    np.testing.assert_array_equal(picked.point, cloud.world(picked.row))
    assert np.abs(projected(camera, picked.position[None])[0] - (x + 0.5, y + 0.5)).max() < OFF
    assert is_seen(surface, picked.point, 1e-3 * scale)


@pytest.mark.parametrize("fov_y", LENSES)
def test_through_a_telephoto_lens_all_is_where_float64_has_it(fov_y: float) -> None:
    cloud = PointCloud.from_arrays(PLACES)
    camera = at(np.zeros(3), 1.0, fov_y)
    surface = viewer.render(cloud, camera, SIZE, "points", point_size=1)
    check_points(surface, camera, cloud)
    assert surface.depth.dtype == (np.float64 if surface.view.base else np.float32)
    by_depth = Look(color_by="depth")
    low, high = np.quantile(projected(camera, PLACES)[1], [0.02, 0.98])
    drawn = viewer.render(cloud, camera, SIZE, "points", look=by_depth, point_size=1)
    assert drawn.color_range == pytest.approx((low, high), abs=0.01)
    np.testing.assert_allclose(
        drawn.value, np.where(np.isfinite(drawn.depth), drawn.depth, np.nan), rtol=1e-6
    )
    assert len(np.unique(drawn.image()[np.isfinite(drawn.depth)], axis=0)) > 50


@every_backend
def test_a_telephoto_lens_shows_what_a_parallel_view_does(name: str) -> None:
    backend, setting = of_variant(name)
    turn = np.linspace(0, np.pi, 60)[:, None] * np.ones(60)
    around = np.linspace(0, 2 * np.pi, 60) * np.ones((60, 1))
    ball = np.stack([np.sin(turn) * np.cos(around), np.cos(turn), np.sin(turn) * np.sin(around)], axis=-1)
    ball = ball.reshape(-1, 3)
    cloud = PointCloud.from_arrays(ball, normals=ball, radii=np.full(len(ball), 0.06))
    far = at(np.zeros(3), 1.0, 1e-4)
    flat = at(np.zeros(3), 1.0).projected("orthographic")
    flat = replace(flat, height=far.view_height)
    one, other = (viewer.render(cloud, c, SIZE, backend, **setting) for c in (far, flat))
    seen = np.isfinite(one.depth) & np.isfinite(other.depth)
    assert (np.isfinite(one.depth) != np.isfinite(other.depth)).mean() < 2e-3
    gap = np.abs((one.depth[seen] - far.distance) - (other.depth[seen] - flat.distance))
    assert np.quantile(gap, 0.99) < OFF * far.view_height / SIZE[1]


def test_what_is_far_from_a_straight_line_keeps_its_perspective() -> None:
    """A stray halfway to the eye is where the lens shows it, and so all else is drawn by such rays too."""
    camera = at(np.zeros(3), 1.0, 1e-3)
    halfway = np.array(camera.eye) / 2 + camera.rotation()[0] * 0.5
    cloud = PointCloud.from_arrays(np.concatenate([PLACES, halfway[None]]))
    surface = viewer.render(cloud, camera, SIZE, "points", point_size=1)
    assert not surface.view.base
    y, x = np.argwhere(surface.row == len(PLACES))[0]
    assert np.abs(projected(camera, halfway[None])[0] - (x + 0.5, y + 0.5)).max() <= 0.5 + OFF


def test_the_origin_of_a_view_goes_by_the_camera_alone() -> None:
    """It is the pose's until offsets are worth another one, and stays while the camera moves a little."""
    origin, camera = np.array([3.0, 4.0, 5.0]), at(PART, 1.0)
    assert (origin_near(at(origin + 5, 1.0), SIZE, origin) == origin).all()
    near = origin_near(camera, SIZE, origin)
    pixel = camera.view_height / SIZE[1]
    assert np.abs(near - PART).max() <= 2**15 * pixel
    moved = [origin_near(camera.panned(right, 0), SIZE, origin) for right in np.linspace(0, 3, 40)]
    assert len(np.unique(moved, axis=0)) <= 2


def test_poses_count_from_the_view_that_is_drawn() -> None:
    """From near, from afar and from near again: the same pictures."""
    cloud = of_all_scales(1.0)
    views = [at(PART, 1.0), Camera.orbit(cloud.bounds()), at(PART, 1.0)]
    near, afar, again = (viewer.render(cloud, camera, SIZE, "points") for camera in views)
    assert near.view.origin.tolist() != afar.view.origin.tolist() == cloud.origin.tolist()
    np.testing.assert_array_equal(near.row, again.row)
    np.testing.assert_array_equal(near.depth, again.depth)


@pytest.mark.parametrize("fov_y", [170.1, 179.5, 1e-7])
def test_fields_of_view_that_cannot_be_drawn_are_refused(fov_y: float) -> None:
    with pytest.raises(InputError, match=r"must be 1e-06 to 170 degrees"):
        Camera(fov_y=fov_y)


@every_backend
def test_the_widest_view_shows_the_scan_and_nothing_else(name: str) -> None:
    """A body some pixels wide; beyond, splats as large as a pixel would reach the eye."""
    backend, setting = of_variant(name)
    cloud = PointCloud.from_arrays(PLACES, normals=PLACES, radii=np.full(len(PLACES), 0.05))
    camera = Camera((0.0, 0.0, 6.0), fov_y=170)
    surface = viewer.render(cloud, camera, SIZE, backend, **setting)
    seen = np.argwhere(np.isfinite(surface.depth))
    pixels = View.of(camera, SIZE, cloud.origin, cloud.bounds()).project(cloud.positions)[0][:, ::-1]
    assert len(seen)
    assert (seen + 1 >= pixels.min(axis=0) - 2).all()
    assert (seen <= pixels.max(axis=0) + 2).all()


def test_a_window_brings_positions_that_count_from_the_view() -> None:
    """Bit by bit before the picture, which then has nothing to wait for."""
    own, cloud, camera = Renderer(shared_renderer().gpu), of_all_scales(1.0), at(PART, 1.0)
    pose = Pose(0, 0.0, "x", cloud)
    request = Request(pose, camera, "points")
    while isinstance(make_plan(own, request, SIZE, Effort.BEGIN, upload_ms=0.01), Waiting):
        pass
    resident = own.resident(pose)
    assert (resident.origin == origin_near(camera, SIZE, cloud.origin)).all()
    held, brought = own.bytes_of(pose), resident.array("positions")
    surface = Surface(own.gpu, SIZE)
    render_frame(own, request, surface)
    assert resident.array("positions") is brought
    assert own.bytes_of(pose) == held == 12 * len(cloud)
    check_points(surface, camera, cloud)
    own.release()
