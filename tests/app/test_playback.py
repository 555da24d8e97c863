"""Playing never waits for the disk."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from viewer.app.playing.playback import Playback
from viewer.app.playing.player import Pace
from viewer.app.session import Session
from viewer.errors import InputError
from viewer.scan.points import PointCloud
from viewer.scan.timeline import Timeline


class Frames:
    """A source that reads a frame whenever the test lets it."""

    name = "frames"

    def __init__(self, count: int, broken: int | None = None) -> None:
        self.count, self.broken = count, broken
        self.gate = threading.Semaphore(0)
        self.loads: list[int] = []  # begun

    def __len__(self) -> int:
        return self.count

    def label(self, index: int) -> str:
        return f"{index}.fake"

    def times(self) -> None:
        return None

    def load(self, index: int) -> PointCloud:
        self.loads.append(index)
        self.gate.acquire()
        if index == self.broken:
            raise InputError("is broken")
        return PointCloud.from_arrays(np.full((10, 3), float(index)), origin=np.zeros(3))


@pytest.fixture
def started() -> Iterator[Callable[..., tuple[Playback, Frames]]]:
    opened: list[tuple[Playback, Frames]] = []

    def start(
        count: int = 10, broken: int | None = None, all_read: bool = False, **pace: Any
    ) -> tuple[Playback, Frames]:
        source = Frames(count, broken)
        timeline = Timeline(source, np.arange(count) / 10)
        playback = Playback(timeline, Session("scan", pace=Pace(**pace)))
        opened.append((playback, source))
        if all_read:
            source.gate.release(1000)
            timeline.prefetch(0)
            until(lambda: [*map(len, timeline.cached())] == [count])
            assert shown(playback, 0.0) == 0
        return opened[-1]

    yield start
    for playback, source in opened:
        source.gate.release(1000)
        playback.close()


def until(condition: Callable[[], bool]) -> None:
    """Wait for a worker; a minute without it is a failure."""
    for _ in range(60_000):
        if condition():
            return
        time.sleep(0.001)
    raise AssertionError("did not come about")


def shown(playback: Playback, now: float) -> int | None:
    playback.advance(now)
    return playback.pose.index if playback.pose else None


def test_the_first_pose_is_waited_for_without_blocking(started: Callable) -> None:
    playback, source = started()
    assert shown(playback, 0.0) is None
    assert playback.waiting
    source.gate.release()
    until(lambda: shown(playback, 0.0) == 0)
    assert not playback.waiting


def test_a_slow_disk_shows_the_latest_pose_there_is(started: Callable) -> None:
    playback, source = started()
    source.gate.release()
    until(lambda: shown(playback, 0.0) == 0)
    playback.toggle(0.0)
    until(lambda: source.loads == [0, 1])
    assert shown(playback, 0.55) == 0  # frame 5 is due, only the first is read
    source.gate.release()
    until(lambda: shown(playback, 0.58) == 1)
    source.gate.release()
    until(lambda: shown(playback, 0.59) == 5)  # the next that it reads is the one that is due


def test_a_broken_frame_keeps_the_one_before_and_playing_goes_on(started: Callable) -> None:
    playback, source = started(broken=1)
    source.gate.release(1000)
    until(lambda: shown(playback, 0.0) == 0)
    playback.toggle(0.0)
    until(lambda: 1 in playback.timeline.broken)
    assert shown(playback, 0.15) == 0
    assert "broken" in str(playback.problem)
    assert not playback.waiting
    until(lambda: shown(playback, 0.25) == 2)
    assert playback.player.playing
    assert playback.problem is None


def test_stepping_pauses_and_asks_for_the_frame(started: Callable) -> None:
    playback, source = started()
    source.gate.release(1000)
    playback.toggle(0.0)
    playback.step(1, 0.0)
    assert not playback.player.playing
    until(lambda: shown(playback, 5.0) == 1)


def test_seeking_while_playing_plays_on_from_there(started: Callable) -> None:
    playback, source = started()
    source.gate.release(1000)
    playback.toggle(0.0)
    playback.seek(6, 0.0)
    until(lambda: shown(playback, 0.05) == 6)
    until(lambda: shown(playback, 0.15) == 7)


def test_the_loop_begins_anew_at_the_latest_pose_behind(started: Callable) -> None:
    playback, source = started(count=4)
    source.gate.release(1000)
    playback.toggle(0.0)
    until(lambda: len(playback.timeline.cached()) == 1 and len(playback.timeline.cached()[0]) == 4)
    assert [shown(playback, t) for t in (0.05, 0.15, 0.25, 0.35, 0.45)] == [0, 1, 2, 3, 0]


def test_frames_that_drawing_is_too_late_for_are_counted(started: Callable) -> None:
    playback, _ = started(all_read=True)
    playback.toggle(0.0)
    assert [shown(playback, t) for t in (0.05, 0.11, 0.21)] == [0, 1, 2]
    assert playback.dropped == 0
    assert [shown(playback, t) for t in (0.55, 0.61, 0.85)] == [5, 6, 8]  # 3, 4 and 7 were late
    assert playback.dropped == 3
    assert shown(playback, 2.15) == 1  # 9, all of the next round and 0
    assert playback.dropped == 3 + 12
    playback.toggle(2.2)
    playback.toggle(3.0)
    assert playback.dropped == 0


def test_frames_that_were_not_read_in_time_are_counted_broken_ones_not(started: Callable) -> None:
    playback, source = started(broken=3)
    source.gate.release()
    until(lambda: shown(playback, 0.0) == 0)
    playback.toggle(0.0)
    assert shown(playback, 0.11) == 0
    assert playback.dropped == 0  # 1 is late, but may still come
    assert shown(playback, 0.21) == 0
    assert playback.dropped == 1
    source.gate.release(1000)
    until(lambda: shown(playback, 0.22) == 2)
    until(lambda: [*map(len, playback.timeline.cached())] == [3, 6])
    assert [shown(playback, t) for t in (0.35, 0.45, 0.65)] == [2, 4, 6]
    assert playback.dropped == 2


def test_every_frame_waits_for_the_disk_and_drops_none(started: Callable) -> None:
    playback, source = started(every_frame=True)
    source.gate.release()
    until(lambda: shown(playback, 0.0) == 0)
    playback.toggle(0.0)
    assert [shown(playback, t) for t in (0.11, 0.5, 7.0)] == [0, 0, 0]
    source.gate.release()
    until(lambda: shown(playback, 8.0) == 1)
    source.gate.release(1000)
    until(lambda: [*map(len, playback.timeline.cached())] == [10])
    assert [shown(playback, t) for t in (8.09, 8.11, 8.9, 9.9)] == [1, 2, 3, 4]
    assert playback.dropped == 0


def test_every_frame_goes_on_past_a_broken_one(started: Callable) -> None:
    playback, source = started(broken=2, every_frame=True)
    source.gate.release(1000)
    playback.timeline.prefetch(0)
    until(lambda: playback.timeline.broken and sum(map(len, playback.timeline.cached())) == 9)
    shown(playback, 0.0)
    playback.toggle(0.0)
    assert [shown(playback, t) for t in (0.15, 0.25, 0.35, 0.45)] == [1, 1, 3, 4]
    assert playback.dropped == 0


def test_reverse_reads_ahead_backwards_and_shows_the_latest_pose_behind(started: Callable) -> None:
    playback, source = started(reverse=True)
    source.gate.release()
    until(lambda: shown(playback, 0.0) == 0)
    playback.toggle(0.0)
    until(lambda: source.loads == [0, 9])
    source.gate.release()
    until(lambda: shown(playback, 0.15) == 9)
    until(lambda: source.loads == [0, 9, 8])
    assert shown(playback, 0.35) == 9  # 7 is due
    assert playback.dropped == 1
    playback.change(0.35, reverse=False)
    source.gate.release(1000)
    until(lambda: shown(playback, 0.36) == 7)
    until(lambda: shown(playback, 0.41) == 8)


def test_a_change_outlives_the_scan(started: Callable) -> None:
    playback, _ = started(all_read=True)
    playback.change(0.0, speed=2.0, loop=False)
    playback.toggle(0.0)
    until(lambda: shown(playback, 0.0) == 0)
    playback.close()
    playback.begin(Timeline(Frames(3), np.arange(3) / 10), first=2)
    assert (playback.player.pace.speed, playback.player.pace.loop) == (2.0, False)
    assert (playback.pose, playback.player.playing, playback.session.index) == (None, False, 2)


def test_the_rate_is_what_was_shown_lately(started: Callable) -> None:
    playback, _ = started(all_read=True, speed=2.0)
    playback.toggle(0.0)
    assert playback.rate == 0
    for step in range(1, 60):
        shown(playback, step / 20 + 0.001)
    assert playback.rate == pytest.approx(20)
    assert playback.player.rate == pytest.approx(20)
    for step in range(1, 20):
        shown(playback, 3 + step / 5 + 0.002)  # drawn late: five pictures a second
    assert playback.rate == pytest.approx(5)
    assert playback.dropped == 4 + 18 * 3


def test_playing_keeps_to_the_chosen_frames_round_their_ends(started: Callable) -> None:
    playback, _ = started(all_read=True)
    for index, is_last in ((3, False), (5, True)):
        playback.set_end(is_last, index)
    assert playback.session.document.span == (3, 5)
    assert shown(playback, 0.0) == 0, "what is shown stays"
    playback.toggle(1.0)
    assert [shown(playback, 1.05 + step / 10) for step in range(7)] == [3, 4, 5, 3, 4, 5, 3]
    assert [playback.after(5, step) for step in range(4)] == [5, 3, 4, 5]
    playback.change(1.66, reverse=True)
    assert [shown(playback, 1.75 + step / 10) for step in range(4)] == [5, 4, 3, 5]
    playback.change(2.06, reverse=False, loop=False)
    seen = [shown(playback, 2.15 + step / 10) for step in range(4)]
    assert seen[-1] == 5
    assert not playback.player.playing, "it ends with the last of them"
    playback.step(1, 3.0)
    assert playback.session.index == 6, "steps go anywhere"
    playback.clear_span()
    playback.change(3.0, loop=True)
    playback.toggle(3.0)
    assert [shown(playback, 3.05 + step / 10) for step in range(6)] == [6, 7, 8, 9, 0, 1]


def test_an_end_that_passes_the_other_takes_it_along(started: Callable) -> None:
    playback, _ = started(all_read=True)
    playback.set_end(True, 4)
    shown(playback, 0.0)
    playback.set_end(False, 7)
    assert playback.session.document.span == (7, 7)
    shown(playback, 0.1)
    playback.set_end(True, 2)
    assert playback.session.document.span == (2, 2)
    shown(playback, 0.2)
    playback.set_end(False, 0)
    shown(playback, 0.3)
    playback.set_end(True, 9)
    assert playback.session.document.span is None, "all of them"


def test_chosen_frames_that_a_shorter_scan_has_not_are_left_out(started: Callable) -> None:
    playback, _ = started(count=4, all_read=True)
    playback.session.change("Choose", span=(2, 9))
    playback.toggle(0.0)
    assert [shown(playback, 0.05 + step / 10) for step in range(4)] in ([2, 3, 2, 3], [0, 2, 3, 2])
    playback.session.change("Choose", span=(6, 9))
    shown(playback, 1.0)
    assert playback.span == range(4)


def test_the_clock_waits_where_no_pose_comes_and_goes_on_from_the_one_that_does(started: Callable) -> None:
    playback, source = started(count=64)
    source.gate.release(1000)
    playback.timeline.prefetch(0)
    until(lambda: [*map(len, playback.timeline.cached())] == [64])
    prepared = {0}
    playback.is_prepared = lambda pose: pose.index in prepared
    assert shown(playback, 0.0) == 0
    playback.toggle(0.0)
    turns = np.arange(0.02, 12, 0.02)
    for now in turns:
        assert shown(playback, now) == 0
        assert playback.is_held == (now > 0.5)
    waited_for = playback.session.index
    assert waited_for <= 5, "the frames of half a second at most are past"
    assert playback.dropped == waited_for - 1

    prepared |= set(range(64))
    assert shown(playback, 12.0) == waited_for
    assert [shown(playback, 12.0 + 0.1 * step + 0.05) for step in (1, 2, 3)] == [
        waited_for + step for step in (1, 2, 3)
    ]
    assert not playback.is_held
    assert playback.dropped == waited_for - 1
