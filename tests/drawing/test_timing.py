from __future__ import annotations

from typing import TYPE_CHECKING

from scenes import looking_down_z, plane

from viewer.backends import CHANGES, FrameView, points
from viewer.drawing.request import Request
from viewer.drawing.timing import call_ms, draw, pass_ms
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
    assert len(call_ms(renderer, request, surface, 2)) == 2
    assert len(pass_ms(renderer, request, surface, 2)) == 2
    assert watched.told[2:] == 4 * [frozenset(CHANGES)]
