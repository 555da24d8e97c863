"""A scan is first shown from where its pods look."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from range_scenes import shape_view, sphere_view

from viewer.bounds import Bounds
from viewer.camera import Camera
from viewer.geometry import up_vector
from viewer.scan.pods import first_camera, subject_of
from viewer.scan.range_view import RangeView
from viewer.scan.upright import Upright
from viewer.view import View

BALL = Bounds(np.full(3, -1.0), np.full(3, 1.0))


def from_aside(degrees: float) -> RangeView:
    angle = np.radians(degrees)
    return sphere_view((4 * np.sin(angle), 0.0, 4 * np.cos(angle)))


@pytest.mark.parametrize("aspect", [0.5, 4 / 3, 3.0])
@pytest.mark.parametrize("center", [(20.0, 30.0), (24.0, 20.0), (40.0, 3.0)])
def test_one_pod_is_looked_through_and_all_that_it_measured_is_in_the_picture(
    aspect: float, center: tuple[float, float]
) -> None:
    pod = replace(sphere_view((1.0, 2.0, 3.0)), cx=center[0], cy=center[1])
    camera = first_camera([pod], BALL, aspect)
    assert camera.eye == pytest.approx(pod.eye)
    np.testing.assert_allclose(camera.rotation(), pod.world_to_camera[:3, :3], atol=1e-9)
    size = (round(600 * aspect), 600)
    pixels, _ = View.of(camera, size, np.zeros(3), BALL).project(pod.positions())
    assert (pixels > 0).all()
    assert (pixels < size).all()
    reached = np.abs(pixels / np.array(size) - 0.5).max()
    assert reached > 0.2


def test_it_turns_about_what_is_in_the_middle() -> None:
    pod = sphere_view((1.0, 2.0, 3.0))
    far = pod.depth.copy()
    far[:13], far[-13:], far[:, :16], far[:, -16:] = 1e4, 1e4, 1e4, 1e4
    camera = first_camera([replace(pod, depth=far, mask=np.ones_like(pod.mask))], BALL, 1.0)
    assert np.linalg.norm(camera.target) == pytest.approx(0.95, abs=0.05), "on the ball"
    empty = pod.depth.copy()
    empty[10:-10, 10:-10] = np.nan
    camera = first_camera([replace(pod, depth=empty)], BALL, 1.0)
    assert camera.distance == np.median(empty[pod.valid() & np.isfinite(empty)])


def test_the_subject_of_one_pod_is_without_the_background() -> None:
    pod = sphere_view((1.0, 2.0, 3.0))
    depth = np.where(pod.valid(), pod.depth, 40.0).astype(np.float32)
    pod = replace(pod, depth=depth, mask=np.ones_like(pod.mask))
    points = pod.positions()
    whole = Bounds(points.min(axis=0), points.max(axis=0))
    found = subject_of([pod], points, whole)
    assert found is not None
    is_ball = np.linalg.norm(points, axis=1) < 1.01
    np.testing.assert_array_equal(found, points[is_ball])
    assert whole.radius > 5
    others = [from_aside(-27.5), from_aside(27.5)]
    for views in ([], others, [shape_view("plane", "height")[0]]):
        assert subject_of(views, points, whole) is None, "such a scan is shown whole"
    assert subject_of([pod], points + 1e4, whole) is None, "without a point there"


def test_several_are_looked_between_and_the_scan_is_shown_whole() -> None:
    camera = first_camera([from_aside(-27.5), from_aside(27.5)], BALL, 1.5)
    expected = Camera.orbit(BALL, aspect=1.5)
    np.testing.assert_allclose(camera.eye, expected.eye, atol=1e-9)
    assert camera.target == expected.target
    aside = first_camera([from_aside(10.0), from_aside(50.0)], BALL, 1.5)
    np.testing.assert_allclose(aside.eye, Camera.orbit(BALL, 30, aspect=1.5).eye, atol=1e-9)


def told(up: str) -> Upright:
    return Upright(up, "told", 1.0)


def test_from_all_around_or_nowhere_it_looks_from_the_front() -> None:
    around = [from_aside(24.0 * number) for number in range(15)]
    for views in ([], around, [from_aside(0), from_aside(180)], [from_aside(-60), from_aside(60)]):
        assert first_camera(views, BALL, 1.5, told("+z")) == Camera.orbit(BALL, aspect=1.5, up="+z")


def test_what_is_up_in_the_pods_picture_is_up_unless_another_axis_is_told() -> None:
    pod = sphere_view((1.0, 2.0, 3.0))
    turn = np.eye(4)
    turn[:2, :2] = [[0.8, -0.6], [0.6, 0.8]]
    pod = replace(pod, world_to_camera=turn @ pod.world_to_camera)
    assert first_camera([pod], BALL, 1.0, told("+y")).up == pytest.approx(pod.world_to_camera[1, :3])
    for up in ("-y", "+x"):
        assert first_camera([pod], BALL, 1.0, told(up)).up == up_vector(up)


def test_between_several_it_is_level_unless_it_looks_up_or_down() -> None:
    pair = [from_aside(-20.0), from_aside(20.0)]
    assert first_camera(pair, BALL, 1.0, told("+x")).up == up_vector("+x")
    assert first_camera(pair, BALL, 1.0, told("+z")).up == pytest.approx(
        (0, pair[0].world_to_camera[1, 1], 0)
    )


def test_heights_are_looked_at_along_their_direction() -> None:
    view = shape_view("plane", "height")[0]
    positions = view.positions()
    bounds = Bounds(positions.min(axis=0), positions.max(axis=0))
    camera = first_camera([view], bounds, 1.2)
    np.testing.assert_allclose(camera.rotation()[2], view.world_to_camera[2, :3], atol=1e-9)
    pixels, _ = View.of(camera, (600, 500), np.zeros(3), bounds).project(positions)
    assert ((pixels > 0) & (pixels < (600, 500))).all()
