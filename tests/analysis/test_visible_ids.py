"""Which points a picture can show."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scenes import NOTHING, sphere

from viewer.analysis.visible_ids import visible_ids
from viewer.camera import Camera
from viewer.drawing.request import Request
from viewer.picture.surface import Surface
from viewer.rigid import Rigid
from viewer.scan.layers import Layers
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

Draw = Callable[..., Surface]
CLOUD = PointCloud.from_arrays(sphere(3000).positions)
POSE = Pose(0, 0.0, "", CLOUD)
CAMERA = Camera(eye=(0.4, 0.3, 4.0), target=(0.3, 0, 0), fov_y=20)


def test_they_are_what_points_show_that_hide_what_lies_behind(draw: Draw) -> None:
    """At so many pixels that nearly each point has its own."""
    size = (800, 600)
    surface = draw(CLOUD, CAMERA, size, params={"hide_hidden": True})
    shown = np.unique(surface.id[surface.id != NOTHING])
    found = visible_ids(Request(POSE, CAMERA), size)
    assert 200 < len(found) < 1400
    assert set(shown.tolist()) <= set(found.tolist())
    assert len(shown) > 0.95 * len(found)
    np.testing.assert_array_equal(found, np.unique(found))


def test_parallel_rays_see_a_half() -> None:
    camera = Camera(eye=(0, 0, 4), target=(0, 0, 0), projection="orthographic", height=3.0)
    found = visible_ids(Request(POSE, camera), (400, 300))
    towards = (CLOUD.positions + CLOUD.origin)[found][:, 2]
    assert (towards > -0.1).mean() > 0.97
    assert len(found) > 0.4 * len(CLOUD)


def test_a_pose_without_points_has_none() -> None:
    empty = Pose(0, 0.0, "", PointCloud.from_arrays(np.empty((0, 3))))
    assert len(visible_ids(Request(empty, CAMERA), (80, 60))) == 0


def test_the_scan_is_where_layers_have_it() -> None:
    """Moved together with the camera, the same is seen."""
    shift = np.array([10.0, 2.0, -3.0])
    eye, target = (tuple(np.array(place) + shift) for place in (CAMERA.eye, CAMERA.target))
    moved = Camera(eye=eye, target=target, fov_y=20)
    matrix = np.eye(4)
    matrix[:3, 3] = shift
    layers = Layers(world_from_pose=Rigid(matrix))
    found = visible_ids(Request(POSE, moved, layers=layers), (400, 300))
    np.testing.assert_array_equal(found, visible_ids(Request(POSE, CAMERA), (400, 300)))
