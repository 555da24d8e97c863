"""A picture that is drawn in slices to be saved."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import sphere

import viewer
from viewer.app.output.unsaved_picture import UnsavedPicture
from viewer.camera import Camera
from viewer.drawing.renderer import shared_renderer
from viewer.drawing.request import Request
from viewer.errors import InputError
from viewer.look import SAMPLES, Look
from viewer.scan.pose import Pose

SIZE = (96, 64)
POSE = Pose(0, 0.0, "ball", sphere(3000))
CAMERA = Camera.orbit(POSE.cloud.bounds(), 20, 10, aspect=SIZE[0] / SIZE[1])


@pytest.mark.parametrize("quality", SAMPLES)
def test_it_becomes_the_picture_that_is_rendered_in_a_slice_for_each_sample(quality: str) -> None:
    look = Look(quality=quality, light="head")
    unsaved = UnsavedPicture(shared_renderer(), Request(POSE, CAMERA, "points", None, look), SIZE)
    surface, progress = None, [0.0]
    while surface is None:
        surface = unsaved.advance()
        progress.append(unsaved.task.progress or 0.0)
    assert progress == sorted(progress)
    assert progress[-1] == 1.0
    assert len(set(progress)) == SAMPLES[quality] + 1, "none draws several"
    whole = viewer.render(POSE.cloud, CAMERA, SIZE, "points", look)
    np.testing.assert_array_equal(surface.image(), whole.image())
    unsaved.release()


def test_what_cannot_be_drawn_says_why_and_lets_go() -> None:
    request = Request(POSE, CAMERA, "points", None, Look(color_by="missing"))
    unsaved = UnsavedPicture(shared_renderer(), request, SIZE)
    with pytest.raises(InputError):
        unsaved.advance()
    unsaved.release()
