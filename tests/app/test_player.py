"""Playback follows the frames' own times."""

from __future__ import annotations

import math

import numpy as np
import pytest

from viewer.app.player import Player

TIMES = np.array([2.0, 2.1, 2.2, 2.5])  # the last frame lasts 0.3 s, as the gap before it


def playing(index: int = 0, loop: bool = True) -> Player:
    player = Player(TIMES)
    player.loop = loop
    player.play(index, 100.0)
    return player


@pytest.mark.parametrize(
    ("elapsed", "frame"),
    [(0, 0), (0.09, 0), (0.11, 1), (0.49, 2), (0.51, 3), (0.79, 3), (0.81, 0), (1.72, 1)],
)
def test_a_frame_is_due_at_its_time_and_round_the_end(elapsed: float, frame: int) -> None:
    assert playing().due(0, 100 + elapsed) == frame


def test_late_frames_are_passed_over() -> None:
    assert playing().due(0, 100.45) == 2


def test_the_next_frame_comes_when_its_time_has_come() -> None:
    player = playing(index=1)
    assert player.until_next(100.0) == pytest.approx(0.1)
    assert player.until_next(100.25) == pytest.approx(0.15)
    wait = player.until_next(100.25)
    assert player.due(2, 100.25 + wait + 1e-6) == 3


def test_without_loop_it_stops_at_the_end_and_starts_anew_from_there() -> None:
    player = playing(loop=False)
    assert player.due(0, 100.79) == 3
    assert player.playing
    assert player.due(3, 100.81) == 3
    assert not player.playing
    assert player.play(3, 200.0) == 0


def test_paused_nothing_is_due() -> None:
    player = playing()
    player.pause()
    assert player.due(1, 105.0) == 1
    assert math.isinf(player.until_next(105.0))


def test_steps_go_round_the_end_only_with_loop() -> None:
    player = Player(TIMES)
    assert [player.step(3, 1), player.step(0, -1)] == [0, 3]
    player.loop = False
    assert [player.step(3, 1), player.step(0, -1), player.step(1, 1)] == [3, 0, 2]


def test_times_outside_belong_to_the_first_and_the_last_frame() -> None:
    player = Player(TIMES)
    assert [player.frame_at(t) for t in (-5, 0.0, 0.15, 0.6, 99)] == [0, 0, 1, 3, 3]


def test_a_single_frame_does_not_play() -> None:
    player = Player(np.array([0.0]))
    player.play(0, 1.0)
    assert not player.playing
    assert player.frame_at(7.0) == 0
