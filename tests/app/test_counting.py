"""Points are counted beside the window, once for each picture at rest."""

from __future__ import annotations

import time
from dataclasses import replace
from types import SimpleNamespace

import pytest
from scenes import sphere

from viewer.app.scene.counting import Counting, words
from viewer.app.scene.viewport import Viewport
from viewer.backends import backend as find_backend
from viewer.camera import Camera
from viewer.drawing.request import Request
from viewer.scan.pose import Pose

POSE = Pose(0, 0.0, "sphere", sphere(30_000))
# As motion shows it, so that the second of two pictures is no preview.
PARAMS = find_backend("surfels").params({"passes": "one", "surface": "nearest"})
REQUEST = Request(POSE, Camera.orbit(POSE.cloud.bounds()), "surfels", PARAMS)
SIZE = (60, 40)
LATER = 60.0  # seconds


def counting_of(viewport: Viewport) -> Counting:
    return Counting(viewport, SimpleNamespace(is_moving=False))  # type: ignore[arg-type]


def counted(counting: Counting) -> dict[str, int]:
    now = time.monotonic() + LATER
    while not counting.advance(now):
        time.sleep(0.001)
    assert counting.counts is not None
    assert not counting.advance(now), "no others"
    return counting.counts


def test_a_picture_at_rest_is_counted_once(viewport: Viewport) -> None:
    counting = counting_of(viewport)
    viewport.draw(REQUEST)
    now = time.monotonic()
    assert not counting.advance(now), "it has just been drawn"
    counting.activity.is_moving = True  # type: ignore[misc]
    assert not counting.advance(now + LATER)
    counting.activity.is_moving = False  # type: ignore[misc]
    assert viewport.surface is not None
    assert counted(counting) == viewport.surface.point_counts()

    turned = replace(REQUEST, camera=REQUEST.camera.orbited(30, 0))
    viewport.draw(turned)
    assert counting.advance(now), "those of the picture before are gone"
    assert counting.counts is None
    assert counted(counting) == viewport.surface.point_counts()


@pytest.mark.parametrize("backend", ["points", "voxels"])
def test_a_preview_says_how_many_of_the_points_are_drawn(viewport: Viewport, backend: str) -> None:
    request = replace(REQUEST, backend=backend, params=None)
    while not viewport.is_complete:
        viewport.draw(request)
        time.sleep(0.01)  # for workers
    viewport.took(1000.0, goal_ms=10.0)
    viewport.draw(replace(request, camera=REQUEST.camera.orbited(30, 0)), held=True)
    told = dict(words(viewport, None))
    drawn, left_out = (int(told[name].split()[0].replace(",", "")) for name in ("Drawn", "Preview"))
    assert 0 < drawn < len(POSE.cloud)
    assert drawn + left_out == len(POSE.cloud)


def test_a_preview_is_not_counted_and_a_count_that_is_overtaken_is_dropped(viewport: Viewport) -> None:
    counting = counting_of(viewport)
    viewport.draw(REQUEST)
    viewport.took(1000.0, goal_ms=10.0)
    later = time.monotonic() + LATER
    counting.advance(later)  # begins
    viewport.draw(replace(REQUEST, camera=REQUEST.camera.orbited(30, 0)), held=True)
    assert viewport.is_preview
    for _ in range(50):
        counting.advance(later)
        time.sleep(0.001)
    assert counting.counts is None
    viewport.finish()
    assert viewport.surface is not None
    assert counted(counting) == viewport.surface.point_counts()
