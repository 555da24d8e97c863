from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from scenes import looking_down_z, plane

from viewer.backends import CHANGES, FrameView, points
from viewer.drawing.request import Request
from viewer.drawing.timing import call_ms, draw, new_views, pass_ms
from viewer.gpu.pose import GpuPose
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose

if TYPE_CHECKING:
    from viewer.drawing.renderer import Renderer


class Watched(points.PointSquares):
    """The points, and what each call was told has changed."""

    def __init__(self) -> None:
        super().__init__("watched")
        self.told: list[frozenset[str]] = []

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        self.told.append(frame.changed)
        return super().draw(pose, frame, surface)


def test_timed_pictures_are_drawn_as_if_they_were_the_first(renderer: Renderer) -> None:
    watched = Watched()
    request = Request(Pose(0, 0.0, "plane", plane(20, 2.0)), looking_down_z(), watched)
    surface = Surface(renderer.gpu, (40, 30))
    for _ in range(2):
        draw(renderer, request, surface)
    assert watched.told == [frozenset(CHANGES), frozenset()]
    assert len(call_ms(renderer, [request] * 2, surface)) == 2
    assert len(pass_ms(renderer, [request] * 2, surface)) == 2
    assert watched.told[2:] == 4 * [frozenset(CHANGES)]


def test_new_views_are_a_degree_apart_and_end_at_the_picture() -> None:
    camera = looking_down_z()
    request = Request(Pose(0, 0.0, "plane", plane(20, 2.0)), camera, "points")
    views = new_views(request, 3)
    assert views[-1].camera == camera
    arms = [np.subtract(each.camera.eye, each.camera.target) for each in [*new_views(request, 2, 3), *views]]
    turns = [np.dot(one, other) / np.dot(one, one) for one, other in pairwise(arms)]
    np.testing.assert_allclose(np.degrees(np.arccos(turns)), 1.0, rtol=1e-6)
    assert all(each.pose is request.pose and each.params is request.params for each in views)
