"""The picture reads from the GPU what the mouse asks for, no more often than it can have changed."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from scenes import sphere

from viewer.app.scene import picture as picture_module
from viewer.app.scene.picture import Picture
from viewer.camera import Camera
from viewer.frame import Request, shared_renderer
from viewer.gpu.surface import Surface
from viewer.look import Look
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
    picture.draw(REQUEST, SIZE)
    first = picture.pick((30, 20))
    assert first is not None
    picture.draw(REQUEST, SIZE)
    assert picture.pick((30, 20)) is first
    assert picture.pick((0, 0)) is picture.pick((0, 0)) is None
    assert len(reads) == 2
    other = replace(REQUEST, camera=REQUEST.camera.orbited(40, 0))
    picture.pick((30, 20))
    picture.draw(other, SIZE)
    turned = picture.pick((30, 20))
    assert turned is not None
    assert turned.row != first.row
    assert len(reads) == 4


def test_nothing_is_picked_where_there_is_no_picture(picture: Picture) -> None:
    picture.draw(REQUEST, SIZE)
    assert picture.pick((30, 20)) is not None
    broken = replace(REQUEST, look=replace(REQUEST.look, color_by="missing"))
    picture.draw(broken, SIZE)
    assert picture.problem is not None
    assert picture.pick((30, 20)) is None
    picture.draw(REQUEST, SIZE)
    assert picture.pick((30, 20)) is not None
    picture.clear()
    assert picture.pick((30, 20)) is None
    assert picture.is_visible, "until another one is drawn"


def test_a_preview_is_drawn_in_full_at_rest_and_on_demand(picture: Picture) -> None:
    picture.draw(REQUEST, SIZE)
    full = shown(picture)
    assert not picture.is_preview
    assert picture.is_complete
    for _ in range(2):  # both are far too slow: all that can be left out is
        picture.took(1000.0, goal_ms=10.0)
        picture.draw(turned(REQUEST), SIZE, held=True)
    assert picture.is_preview
    assert picture.surface is not None
    assert picture.surface.size == (30, 20)
    assert picture.size == SIZE
    assert not picture.is_complete

    assert not picture.draw(picture.request or REQUEST, SIZE, playing=True), "other poses are to come"
    assert math.isinf(picture.better_at(playing=True))
    assert picture.better_at(playing=False) < time.monotonic() + 1
    picture.finish()
    assert not picture.is_preview
    assert picture.surface.size == SIZE
    picture.draw(REQUEST, SIZE)
    picture.finish()
    for before, after in zip(full, shown(picture), strict=True):
        np.testing.assert_array_equal(after, before)


def test_what_is_under_the_mouse_in_a_preview_is_about_what_it_is_in_full(picture: Picture) -> None:
    picture.draw(REQUEST, SIZE)
    whole = picture.pick((37, 12))
    picture.took(1000.0, goal_ms=10.0)
    picture.draw(replace(REQUEST, look=Look(light="flat")), SIZE, held=True)
    assert picture.is_preview
    rough = picture.pick((37, 12))
    assert whole is not None
    assert rough is not None
    assert np.linalg.norm(rough.position - whole.position) < 0.1
    exact = picture.pick_in_full()
    assert not picture.is_preview
    assert exact is not None
    np.testing.assert_array_equal(exact.position, whole.position)
    assert picture.pick((SIZE[0] - 1, SIZE[1] - 1)) is None


def shown(picture: Picture) -> tuple[np.ndarray, ...]:
    assert picture.surface is not None
    return picture.surface.image(), picture.surface.depth, picture.surface.id


def turned(request: Request) -> Request:
    return replace(request, camera=request.camera.orbited(10, 0))


@pytest.mark.parametrize("step", ["bring", "render_frame"])
def test_whatever_fails_is_a_problem_and_the_image_before_stays(
    picture: Picture, step: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    picture.draw(REQUEST, SIZE)
    before = shown(picture)[0]
    monkeypatch.setattr(picture_module, step, failing)
    assert picture.draw(turned(REQUEST), SIZE)
    assert str(picture.problem).startswith("Drawing frame 1 failed (ValueError: of a library)")
    assert not picture.is_there
    assert picture.is_visible
    np.testing.assert_array_equal(shown(picture)[0], before)
    assert not picture.draw(turned(REQUEST), SIZE), "it is not tried again and again"
    assert math.isinf(picture.better_at(playing=False))
    monkeypatch.undo()
    assert picture.draw(REQUEST, SIZE)
    assert picture.is_there


def test_a_surface_that_nothing_was_drawn_into_is_not_shown(
    picture: Picture, monkeypatch: pytest.MonkeyPatch
) -> None:
    picture.draw(REQUEST, SIZE)
    monkeypatch.setattr(picture_module, "render_frame", failing)
    picture.draw(REQUEST, (30, 20))
    assert not picture.is_visible


def failing(*args: object, **options: object) -> bool:
    raise ValueError("of a library")
