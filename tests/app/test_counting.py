"""Points are counted beside the window, once for each picture at rest."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace

import pytest
from scenes import sphere

from viewer.app.scene.counting import Counting, words
from viewer.app.scene.picture import Picture
from viewer.camera import Camera
from viewer.frame import Request, shared_renderer
from viewer.scan.pose import Pose

POSE = Pose(0, 0.0, "sphere", sphere(30_000))
REQUEST = Request(POSE, Camera.orbit(POSE.cloud.bounds()), "surfels")
SIZE = (60, 40)
LATER = 60.0  # seconds


@pytest.fixture
def picture() -> Iterator[Picture]:
    picture = Picture(shared_renderer().gpu)
    yield picture
    picture.release()


def counted(counting: Counting, picture: Picture) -> dict[str, int]:
    now = time.monotonic() + LATER
    while not counting.advance(picture, at_rest=True, now=now):
        time.sleep(0.001)
    assert counting.counts is not None
    assert not counting.advance(picture, at_rest=True, now=now), "no others"
    return counting.counts


def test_a_picture_at_rest_is_counted_once(picture: Picture) -> None:
    counting = Counting()
    picture.draw(REQUEST, SIZE)
    now = time.monotonic()
    assert not counting.advance(picture, at_rest=True, now=now), "it has just been drawn"
    assert not counting.advance(picture, at_rest=False, now=now + LATER)
    assert picture.surface is not None
    assert counted(counting, picture) == picture.surface.point_counts()

    turned = replace(REQUEST, camera=REQUEST.camera.orbited(30, 0))
    picture.draw(turned, SIZE)
    assert counting.advance(picture, at_rest=False, now=now), "those of the picture before are gone"
    assert counting.counts is None
    assert counted(counting, picture) == picture.surface.point_counts()


@pytest.mark.parametrize("backend", ["points", "voxels"])
def test_a_preview_says_how_many_of_the_points_are_drawn(picture: Picture, backend: str) -> None:
    request = replace(REQUEST, backend=backend)
    while not picture.is_complete:
        picture.draw(request, SIZE)
    picture.took(1000.0, goal_ms=10.0)
    picture.draw(replace(request, camera=REQUEST.camera.orbited(30, 0)), SIZE, held=True)
    told = dict(words(SimpleNamespace(picture=picture, counting=Counting())))  # type: ignore[arg-type]
    drawn, left_out = (int(told[name].split()[0].replace(",", "")) for name in ("Drawn", "Preview"))
    assert 0 < drawn < len(POSE.cloud)
    assert drawn + left_out == len(POSE.cloud)


def test_a_preview_is_not_counted_and_a_count_that_is_overtaken_is_dropped(picture: Picture) -> None:
    counting = Counting()
    picture.draw(REQUEST, SIZE)
    picture.took(1000.0, goal_ms=10.0)
    later = time.monotonic() + LATER
    counting.advance(picture, at_rest=True, now=later)  # begins
    picture.draw(replace(REQUEST, camera=REQUEST.camera.orbited(30, 0)), SIZE, held=True)
    assert picture.is_preview
    for _ in range(50):
        counting.advance(picture, at_rest=True, now=later)
        time.sleep(0.001)
    assert counting.counts is None
    picture.finish()
    assert picture.surface is not None
    assert counted(counting, picture) == picture.surface.point_counts()
