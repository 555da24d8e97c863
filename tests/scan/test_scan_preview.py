from __future__ import annotations

import numpy as np
import pytest
from scenes import sphere

from viewer.camera import Camera
from viewer.errors import InputError
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.preview import preview_picture
from viewer.task import Cancelled, Task

SIZE = 160, 120


def pose_of(cloud: PointCloud) -> Pose:
    return Pose(0, 0.0, "x", cloud)


def test_a_sphere_is_a_full_disc_brightest_in_its_middle() -> None:
    picture = preview_picture(pose_of(PointCloud.from_arrays(sphere(20_000).positions)), SIZE)
    assert picture.shape == (120, 160, 4)
    seen = picture[..., 3] == 255
    assert (seen | (picture[..., 3] == 0)).all()
    lines, columns = np.nonzero(seen)
    middle = np.array([lines.mean(), columns.mean()])
    np.testing.assert_allclose(middle, (60, 80), atol=1.5)
    radius = (np.ptp(lines) + np.ptp(columns) + 2) / 4
    assert radius == pytest.approx(50, abs=4), "it fits the picture"
    assert seen.sum() == pytest.approx(np.pi * radius**2, rel=0.02), "without holes"
    distance = np.hypot(*(np.indices(seen.shape) - middle[:, None, None]))
    inner, outer = picture[..., 0][distance < 0.3 * radius], picture[..., 0][seen & (distance > 0.9 * radius)]
    assert inner.min() > outer.mean() + 40


def test_the_nearest_point_is_seen_in_its_own_colour() -> None:
    grid = np.stack(np.meshgrid(np.linspace(-1, 1, 60), np.linspace(-1, 1, 60)), -1).reshape(-1, 2)
    layers = [np.column_stack([grid, np.full(len(grid), depth)]) for depth in (0.0, -0.2)]
    colors = np.repeat(np.array([[200, 30, 30], [30, 30, 200]], np.uint8), len(grid), axis=0)
    for order in (1, -1):  # from the front, +z, the first layer hides the other
        points, of_points = np.concatenate(layers)[::order], colors[::order]
        picture = preview_picture(pose_of(PointCloud.from_arrays(points, colors=of_points)), SIZE)
        red, _, blue, alpha = picture[40:80, 60:100].reshape(-1, 4).T
        assert (alpha == 255).all()
        assert (red > 4 * blue.astype(int)).all()


def test_one_point_and_range_images_have_pictures_too() -> None:
    one = preview_picture(pose_of(PointCloud.from_arrays(np.ones((1, 3)))), SIZE)
    assert 0 < np.count_nonzero(one[..., 3]) < 200
    with open_scan("demo") as demo:
        picture = preview_picture(demo.pose(0), SIZE)
    assert np.ptp(picture[picture[..., 3] > 0][:, :3].astype(int).sum(axis=1)) > 200


def test_it_ends_where_it_is_cancelled() -> None:
    task = Task("Preview")
    task.cancel()
    with task.current(), pytest.raises(Cancelled):
        preview_picture(pose_of(sphere(1000)), SIZE)
    with pytest.raises(InputError):
        preview_picture(pose_of(PointCloud.from_arrays(np.empty((0, 3)))), SIZE)


def test_a_camera_of_ones_own_sees_its_side() -> None:
    points = sphere(20_000).positions
    halves = np.where(points[:, :1] > 0, [[200, 30, 30]], [[30, 30, 200]]).astype(np.uint8)
    pose = pose_of(PointCloud.from_arrays(points, colors=halves))
    for x, channel in ((4, 0), (-4, 2)):
        camera = Camera(eye=(x, 0, 0), target=(0, 0, 0))
        picture = preview_picture(pose, SIZE, camera.projected("orthographic"))
        seen = picture[picture[..., 3] == 255]
        assert (seen[:, :3].argmax(axis=1) == channel).mean() > 0.99


def test_what_is_right_and_above_is_right_and_above_in_the_picture() -> None:
    points = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    colors = np.array([[200, 30, 30], [30, 200, 30], [30, 30, 200], [200, 200, 200]], np.uint8)
    camera = Camera(eye=(0, 0, 6), target=(0, 0, 0))
    picture = preview_picture(pose_of(PointCloud.from_arrays(points, colors=colors)), SIZE, camera)
    shares = picture[..., :3] / np.maximum(picture[..., :3].max(axis=2, keepdims=True), 1)
    focal = SIZE[1] / 2 / np.tan(np.radians(camera.fov_y) / 2)
    for (x, y, _), color in zip(points, colors / colors.max(), strict=True):
        lines, columns = np.nonzero((abs(shares - color) < 0.05).all(axis=2))
        assert np.mean(columns) == pytest.approx(SIZE[0] / 2 + focal * x / 6, abs=1.5)
        assert np.mean(lines) == pytest.approx(SIZE[1] / 2 - focal * y / 6, abs=1.5)
