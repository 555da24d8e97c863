"""Views that glide: from where they were to where they are to be, evenly and in time."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from viewer.app.scene.glide import SECONDS, Glide, between
from viewer.camera import Camera

FRONT = Camera(eye=(1, 2, 8), target=(1, 2, 3), up=(0, 1, 0))


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize(
    ("azimuth", "elevation"), [(90, 0), (180, 0), (-120, 40), (0, 89.999), (1e-7, 0), (0, 0), (179.9999, -3)]
)
def test_it_begins_and_ends_where_it_should_and_turns_evenly(
    projection: str, azimuth: float, elevation: float
) -> None:
    start = FRONT.projected(projection)
    end = replace(start.orbited(azimuth, elevation), target=(1, 2, 3)).zoomed(2)
    shown = [between(start, end, share) for share in np.linspace(0, 1, 9)]
    for camera, wanted in ((shown[0], start), (shown[-1], end)):
        np.testing.assert_allclose(camera.eye, wanted.eye, atol=1e-9)
        np.testing.assert_allclose(camera.rotation(), wanted.rotation(), atol=1e-7)
        assert camera.view_height == pytest.approx(wanted.view_height)
    turns = [
        math.acos(min(1.0, (np.trace(after.rotation() @ before.rotation().T) - 1) / 2))
        for before, after in itertools.pairwise(shown)
    ]
    np.testing.assert_allclose(turns, turns[0], atol=1e-6)
    assert sum(turns) < math.pi + 1e-6, "the shortest way"
    assert (np.diff([camera.view_height for camera in shown]) <= 1e-12).all()


def test_a_jump_glides_and_a_drag_does_not() -> None:
    glide, side = Glide(), FRONT.orbited(90, 0)
    assert glide.follow(FRONT, True, 0.0) == FRONT, "the first is shown at once"
    glide.follow(side, True, 1.0)
    assert glide.is_on
    half = glide.follow(side, True, 1.0 + SECONDS / 2)
    assert half not in (FRONT, side)
    assert glide.seen(side) == half
    assert glide.follow(side, True, 1.01 + SECONDS) == side
    assert (glide.is_on, glide.seen(side)) == (False, side)
    dragged = side.orbited(5, 0)
    assert glide.follow(dragged, False, 2.0) == dragged
    glide.follow(FRONT, True, 3.0)
    caught = FRONT.orbited(1, 0)
    assert glide.follow(caught, False, 3.1) == caught, "a drag ends it"
    assert not glide.is_on


def test_what_shows_the_same_and_other_projections_do_not_glide() -> None:
    glide = Glide()
    glide.follow(FRONT, True, 0.0)
    for camera in (FRONT.focused((1, 2, 5)), FRONT.projected("orthographic")):
        assert glide.follow(camera, True, 1.0) == camera
        assert not glide.is_on
    glide.begin_scan(None)
    assert glide.follow(FRONT.orbited(50, 0), True, 2.0) == FRONT.orbited(50, 0), "of another scan"
    glide.toggle()
    assert glide.follow(FRONT, True, 3.0) == FRONT
