"""What is known of a view before it is drawn, against what is drawn."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.bench.scenes import catalog
from viewer.camera import Camera
from viewer.choice.seen import ScanInView
from viewer.drawing.request import Request, view_of
from viewer.gpu.chunks import in_coarse_order
from viewer.mesh.reference import trace
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.view import View

SIZE = (300, 200)


def view_from(pose: Pose, camera: Camera) -> View:
    return view_of(Request(pose, camera), SIZE)


@pytest.mark.parametrize("distance", [2.5, 4.0, 8.0])
@pytest.mark.parametrize("scene", ["sphere", "box"])
def test_what_a_view_shows_is_told_from_a_sample(scene: str, distance: float) -> None:
    moment = catalog.subject(scene, None).moment(0)
    camera = Camera(eye=(0.4 * distance, 0.3 * distance, distance), fov_y=30)
    view = view_from(moment.pose, camera)
    found = ScanInView.of(moment.pose, view)
    inside = view.contains(moment.pose.cloud.positions + (moment.pose.origin - view.origin))
    assert found.in_view == pytest.approx(inside.sum(), rel=0.1, abs=500)
    covered = trace(moment.truth, camera, SIZE).covered.sum()
    assert found.covered == pytest.approx(covered, rel=0.25)
    assert found.points == found.listed == 100_000
    assert found.footprint * view.scale == pytest.approx(np.linalg.norm(camera.eye), rel=0.35)


def test_how_rough_a_surface_is_goes_by_its_noise() -> None:
    rng = np.random.default_rng(0)
    square = np.column_stack([rng.random((20_000, 2)), np.zeros(20_000)])
    camera = Camera(eye=(0.5, 0.5, 2.0), target=(0.5, 0.5, 0.0))
    rough = []
    for noise in (0.0, 0.0005, 0.002):
        cloud = PointCloud.from_arrays(square + rng.normal(scale=noise, size=(20_000, 3)) * [0, 0, 1])
        pose = Pose(0, 0.0, "square", cloud)
        rough.append(pose.roughness)
        seen = ScanInView.of(pose, view_from(pose, camera))
        assert seen.rough == pytest.approx(pose.roughness / seen.footprint)
    assert rough[0] < 1e-6
    assert rough[1] == pytest.approx(0.0005, rel=0.25)
    assert rough[2] == pytest.approx(0.002, rel=0.25)


def test_a_file_in_no_order_is_told() -> None:
    moment = catalog.subject("sphere", None).moment(0)
    near = PointCloud.from_arrays(moment.pose.cloud.positions[in_coarse_order(moment.pose.cloud).rows])
    camera = Camera(eye=(0, 0, 4))
    apart = [
        ScanInView.of(pose, view_from(pose, camera)).scattered
        for pose in (moment.pose, Pose(0, 0.0, "near", near))
    ]
    assert apart[0] > 0.9
    assert apart[1] < 0.1


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_next_to_no_points_are_seen_as_well(count: int) -> None:
    cloud = PointCloud.from_arrays(np.arange(3.0 * count).reshape(count, 3))
    pose = Pose(0, 0.0, "few", cloud)
    found = ScanInView.of(pose, view_from(pose, Camera(eye=(0, 0, 5))))
    assert found.points == count
    assert all(np.isfinite(list(vars(found).values())))
    assert found.covered == 0


def test_nothing_in_view() -> None:
    moment = catalog.subject("sphere", None).moment(0)
    found = ScanInView.of(moment.pose, view_from(moment.pose, Camera(eye=(0, 0, 5), target=(0, 0, 9))))
    assert (found.in_view, found.covered) == (0, 0)
