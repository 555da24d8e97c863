"""The turntable goes by the clock."""

from __future__ import annotations

import math

import numpy as np
import pytest

from viewer.app.scene.turntable import Turntable
from viewer.camera import Camera

CAMERA = Camera(eye=(0, 1, 5), target=(0, 0.5, 0))


def azimuth(camera: Camera) -> float:
    back = camera.rotation()[2]
    return math.degrees(math.atan2(back[0], back[2])) % 360


def test_it_turns_as_far_as_time_has_gone_whatever_the_pictures() -> None:
    for moments in ([3.0], np.arange(0.02, 3.001, 0.02), [0.5, 0.6, 2.9, 3.0]):
        table, camera = Turntable(), CAMERA
        table.start(100.0)
        for moment in moments:
            camera = table.turned(camera, None, 100 + moment)
        assert azimuth(camera) == pytest.approx(90, abs=1e-6), "a quarter of a turn of 12 s"
        assert camera.target == pytest.approx(CAMERA.target)
        assert camera.distance == pytest.approx(CAMERA.distance)


def test_a_turn_comes_back() -> None:
    table, camera = Turntable(), CAMERA
    table.seconds = 6.0
    table.start(0)
    for moment in np.arange(0.1, 6.01, 0.1):
        camera = table.turned(camera, (1, 2, 3), moment)
    assert camera.eye == pytest.approx(CAMERA.eye)
    assert camera.target == pytest.approx(CAMERA.target)


def test_it_turns_about_the_pivot() -> None:
    table, pivot = Turntable(), (0.4, 0.1, 0.3)
    table.start(0)
    turned = table.turned(CAMERA, pivot, 2.0)
    for camera in (CAMERA, turned):
        assert camera.rotation() @ np.subtract(pivot, camera.eye) == pytest.approx(
            CAMERA.rotation() @ np.subtract(pivot, CAMERA.eye)
        )
    assert azimuth(turned) == pytest.approx(60)


def test_it_asks_for_no_more_pictures_than_can_be_seen_and_none_while_it_stands() -> None:
    table = Turntable()
    assert table.next_change(0) == math.inf
    assert table.turned(CAMERA, None, 1) is CAMERA
    table.start(0)
    assert 0 < table.next_change(0) <= 1 / 60
    assert table.turned(CAMERA, None, 0.001) is CAMERA
    assert table.turned(CAMERA, None, 1 / 60 + 1e-6) is not CAMERA
    table.stop()
    assert not table.is_on
    assert table.next_change(0) == math.inf


def test_of_the_times_offered_the_chosen_one_is_ticked() -> None:
    table = Turntable()
    ticked = {title: is_on for title, _, is_on in table.items()}
    assert [title for title, on in ticked.items() if on] == ["12 s"]
    next(act for title, act, _ in table.items() if title == "60 s")()
    assert table.seconds == 60
