"""The picture reads from the GPU what the mouse asks for, no more often than it can have changed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest
from scenes import sphere

from viewer.app import picture as picture_module
from viewer.app.picture import Picture
from viewer.camera import Camera
from viewer.frame import Request, shared_renderer
from viewer.gpu.surface import Surface
from viewer.scan.pose import Pose

POSE = Pose(0, 0.0, "sphere", sphere(3000))
REQUEST = Request(POSE, Camera.orbit(POSE.cloud.bounds()), "points")
SIZE = (60, 40)


@pytest.fixture
def picture() -> Iterator[Picture]:
    picture = Picture(shared_renderer().gpu)
    yield picture
    picture.release()


def test_a_pixel_is_read_once_until_mouse_or_picture_move(
    picture: Picture, monkeypatch: pytest.MonkeyPatch
) -> None:
    reads = []

    def counted(surface: Surface, x: int, y: int, **options: bool) -> object:
        reads.append((x, y))
        return picture_pick(surface, x, y, **options)

    picture_pick = picture_module.pick
    monkeypatch.setattr(picture_module, "pick", counted)
    assert picture.pick((30, 20)) is None, "before the first picture"
    picture.draw(REQUEST, SIZE, moving=False)
    first = picture.pick((30, 20))
    assert first is not None
    picture.draw(REQUEST, SIZE, moving=False)
    assert picture.pick((30, 20)) is first
    assert picture.pick((0, 0)) is picture.pick((0, 0)) is None
    assert reads == [(30, 20), (0, 0)]
    other = replace(REQUEST, camera=REQUEST.camera.orbited(40, 0))
    picture.pick((30, 20))
    picture.draw(other, SIZE, moving=False)
    turned = picture.pick((30, 20))
    assert turned is not None
    assert turned.row != first.row
    assert len(reads) == 4


def test_nothing_is_picked_where_there_is_no_picture(picture: Picture) -> None:
    picture.draw(REQUEST, SIZE, moving=False)
    assert picture.pick((30, 20)) is not None
    broken = replace(REQUEST, look=replace(REQUEST.look, color_by="missing"))
    picture.draw(broken, SIZE, moving=False)
    assert picture.problem is not None
    assert picture.pick((30, 20)) is None
    picture.draw(REQUEST, SIZE, moving=False)
    assert picture.pick((30, 20)) is not None
    picture.clear()
    assert picture.pick((30, 20)) is None
