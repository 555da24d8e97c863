"""Playback follows the frames' own times."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from viewer.app.playing.player import SPEEDS, Pace, Player

TIMES = np.array([2.0, 2.1, 2.2, 2.5])  # the last frame lasts 0.3 s, as the gap before it


def playing(index: int = 0, **pace: object) -> Player:
    player = Player(TIMES, replace(Pace(), **pace))  # type: ignore[arg-type]
    player.play(index, 100.0)
    return player


def shown(player: Player, *elapsed: float) -> list[int | None]:
    """The frame that is shown anew at each moment, None where the one before stays."""
    return [(player.due(100 + seconds) or [None])[-1] for seconds in elapsed]


@pytest.mark.parametrize(
    ("elapsed", "frame"),
    [(0, None), (0.09, None), (0.11, 1), (0.49, 2), (0.51, 3), (0.79, 3), (0.81, 0), (1.72, 1)],
)
def test_a_frame_is_due_at_its_time_and_round_the_end(elapsed: float, frame: int | None) -> None:
    assert shown(playing(), elapsed) == [frame]


@pytest.mark.parametrize(
    ("elapsed", "frame"),
    [(0.09, None), (0.11, 0), (0.19, 0), (0.21, 3), (0.49, 3), (0.51, 2), (0.81, 1), (1.72, 0)],
)
def test_in_reverse_every_frame_lasts_as_long_as_forward(elapsed: float, frame: int | None) -> None:
    assert shown(playing(1, reverse=True), elapsed) == [frame]


def test_all_frames_that_have_come_are_named() -> None:
    player = playing()
    assert player.due(100.45) == [1, 2]
    assert player.due(100.46) == []
    assert player.due(100.95) == [3, 0, 1]  # the next round begins at 0.8
    assert playing(2, reverse=True).due(101.15) == [1, 0, 3, 2, 1]
    assert playing(loop=False).due(109.0) == [1, 2, 3]


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("speed", SPEEDS)
def test_the_next_frame_comes_when_its_time_has_come(reverse: bool, speed: float) -> None:
    player, now = playing(1, reverse=reverse, speed=speed), 100.0
    for frame in [0, 3, 2, 1, 0] if reverse else [2, 3, 0, 1, 2]:
        wait = player.until_next(now)
        assert player.due(now + wait * 0.999) == []
        now += wait * 1.001
        assert player.due(now) == [frame]


def test_speed_divides_the_times() -> None:
    assert playing(1, speed=2.0).until_next(100.0) == pytest.approx(0.05)
    assert playing(1, speed=0.5).until_next(100.05) == pytest.approx(0.15)
    assert playing(speed=2.0).rate == pytest.approx(2 * 4 / 0.8)


def test_without_loop_it_stops_at_the_end_and_starts_anew_from_there() -> None:
    player = playing(loop=False)
    assert player.due(100.79) == [1, 2, 3]
    assert player.playing
    assert player.due(100.81) == []
    assert not player.playing
    assert player.play(3, 200.0) == 0


def test_without_loop_reverse_stops_at_the_beginning_and_starts_anew_from_there() -> None:
    player = playing(1, loop=False, reverse=True)
    assert player.due(100.19) == [0]
    assert player.playing
    assert player.due(100.21) == []
    assert not player.playing
    assert player.play(0, 200.0) == 3


def test_the_first_frame_plays_on_its_own_time_without_loop() -> None:
    player = playing(loop=False)
    assert player.due(100.0) == []
    assert player.playing
    player = playing(3, loop=False, reverse=True)
    assert player.due(100.0) == []
    assert player.playing


@pytest.mark.parametrize("change", [{"speed": 5.0}, {"speed": 0.1}, {"loop": False}, {"every_frame": True}])
def test_a_change_keeps_the_moment(change: dict[str, object]) -> None:
    """The part of frame 2 that is left takes its time at the new speed, and no frame is skipped."""
    player = playing()
    assert shown(player, 0.1001, 0.2001, 0.41) == [1, 2, None]
    player.change(replace(player.pace, **change), 100.41)  # type: ignore[arg-type]
    assert player.due(100.41) == []
    assert player.until_next(100.41) == pytest.approx(0.09 / player.pace.speed)


@pytest.mark.parametrize("moment", [0.001, 0.05, 0.0999, 0.15, 0.3, 0.65, 0.79, 0.85, 4.13])
def test_reversing_goes_back_through_the_time_that_has_passed(moment: float) -> None:
    player = playing()
    player.due(100 + moment)
    frame, entered = 0, 0.0
    while (end := entered + float(np.diff(player.edges)[frame % 4])) <= moment:
        frame, entered = frame + 1, end
    player.change(replace(player.pace, reverse=True), 100 + moment)
    assert player.due(100 + moment) == []
    assert player.until_next(100 + moment) == pytest.approx(moment - entered)
    assert player.due(100 + moment + (moment - entered) + 1e-6) == [(frame - 1) % 4]


def test_reversing_while_late_continues_from_the_frame_that_is_shown() -> None:
    player = playing()
    assert player.due(100.15) == [1]
    player.change(replace(player.pace, reverse=True), 101.0)  # frame 1 of the next round would be due
    assert player.due(101.0) == []
    assert player.due(101.09) == []  # it lasts its time again,
    assert player.due(101.11) == [0]  # then comes the one before it


def test_changing_speed_while_late_leaves_out_no_more() -> None:
    player = playing()
    assert player.due(100.15) == [1]
    player.change(replace(player.pace, speed=2.0), 101.0)
    assert player.due(101.0) == [2]
    assert player.until_next(101.0) == pytest.approx(0.15)


def test_ten_minutes_of_playing_drift_by_nothing() -> None:
    """25 frames a second at clock ticks that fit nothing; every frame within one tick of its time."""
    player = Player(np.arange(64) / 25)
    player.play(0, 7.0)
    count, tick = 0, 1 / 59.7
    for number in range(int(600 / tick)):
        now = 7.0 + number * tick
        count += len(player.due(now))
        exact = (now - 7.0) * 25
        assert math.floor(exact - 1e-9) <= count <= math.floor(exact + 1e-9)
    assert count == pytest.approx(600 * 25, abs=1)


def test_every_frame_on_time_drifts_by_nothing_either() -> None:
    player = Player(np.arange(64) / 25, Pace(every_frame=True))
    player.play(0, 7.0)
    frames = [frame for number in range(600 * 60) for frame in player.due(7.0 + number / 60)]
    assert frames == [n % 64 for n in range(1, len(frames) + 1)]
    assert len(frames) == pytest.approx(600 * 25, abs=1)


def test_every_frame_lets_time_slip_where_drawing_is_late() -> None:
    player = playing(every_frame=True)
    assert shown(player, 0.45, 0.54, 0.5501) == [1, None, 2]  # 1 begins at 0.45 and lasts its 0.1
    assert shown(player, 5.0, 5.29, 5.31, 9.0) == [3, None, 0, 1]


def test_every_frame_is_shown_at_the_end_without_loop() -> None:
    player = playing(every_frame=True, loop=False)
    assert shown(player, 1, 2) == [1, 2]
    assert player.playing
    assert shown(player, 3) == [3]
    assert not player.playing


def test_a_frame_that_is_entered_lasts_its_time() -> None:
    player = playing()
    assert shown(player, 0.11) == [1]
    player.enter(1, 100.9)
    assert shown(player, 0.99, 1.01) == [None, 2]
    player.change(replace(player.pace, loop=False), 101.05)
    player.enter(3, 105.0)
    assert shown(player, 5.29) == [None]
    assert player.playing
    assert shown(player, 5.31) == [None]
    assert not player.playing


def test_paused_nothing_is_due() -> None:
    player = playing()
    player.pause()
    assert player.due(105.0) == []
    assert math.isinf(player.until_next(105.0))


def test_a_change_while_paused_counts_when_it_plays() -> None:
    player = Player(TIMES)
    player.change(Pace(speed=2.0, reverse=True), 50.0)
    assert not player.playing
    assert player.play(2, 100.0) == 2
    assert player.due(100.16) == [1]


def test_steps_go_round_the_end_only_with_loop() -> None:
    player = Player(TIMES)
    assert [player.step(3, 1), player.step(0, -1)] == [0, 3]
    player.change(Pace(loop=False), 0.0)
    assert [player.step(3, 1), player.step(0, -1), player.step(1, 1)] == [3, 0, 2]


def test_times_outside_belong_to_the_first_and_the_last_frame() -> None:
    player = Player(TIMES)
    assert [player.frame_at(t) for t in (-5, 0.0, 0.15, 0.6, 99)] == [0, 0, 1, 3, 3]


@pytest.mark.parametrize("pace", [Pace(), Pace(reverse=True, loop=False), Pace(every_frame=True)])
def test_a_single_frame_does_not_play(pace: Pace) -> None:
    player = Player(np.array([0.0]), pace)
    assert player.play(0, 1.0) == 0
    assert not player.playing
    assert player.due(9.0) == []
    assert player.frame_at(7.0) == 0


def test_speeds_go_step_by_step_to_their_ends() -> None:
    assert [Pace(speed).next_speed(1) for speed in SPEEDS] == [*SPEEDS[1:], 10.0]
    assert [Pace(speed).next_speed(-1) for speed in SPEEDS] == [0.1, *SPEEDS[:-1]]
    assert [Pace(0.3).next_speed(step) for step in (-1, 1)] == [0.2, 0.5]
