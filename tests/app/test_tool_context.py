"""Work that runs beside the window for a tool, and what becomes of it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import pytest
from moving_hills import MovingHills

from viewer.app.tool_context import Work
from viewer.errors import InputError
from viewer.scan.timeline import Timeline
from viewer.task import Task, checkpoint, in_background


def finished(work: Callable[[], object]) -> list[object]:
    """The results that work hands over."""
    taken: list[object] = []
    task = Task("work")
    future = in_background(task, work)
    future.exception(timeout=60)
    Work(task, future, taken.append).finish()
    return taken


def test_work_hands_over_its_result_or_raises() -> None:
    def fails() -> None:
        raise InputError("is damaged")

    assert finished(lambda: 3) == [3]
    with pytest.raises(InputError):
        finished(fails)
    with pytest.raises(ZeroDivisionError):
        finished(lambda: 1 / 0)


@pytest.mark.parametrize("way", [Timeline.pose, Timeline.visit])
def test_work_on_a_scan_that_another_one_has_followed_ends_without_a_word(
    way: Callable[[Timeline, int], object],
) -> None:
    source = MovingHills(2)
    timeline = Timeline(source, source.times(), "mm")
    timeline.close()
    assert finished(lambda: way(timeline, 0)) == []


def test_work_that_waits_for_reading_ends_without_a_word_where_closing_ends_that() -> None:
    source, is_reading = MovingHills(2), threading.Event()
    timeline = Timeline(source, source.times(), "mm")

    def load(index: int) -> None:
        is_reading.set()
        while True:
            checkpoint()
            time.sleep(0.01)

    def work() -> object:
        threading.Timer(0.1, timeline.close).start()
        return timeline.pose(0)

    source.load = load  # type: ignore[assignment,method-assign]
    timeline.request(0)
    assert is_reading.wait(60)
    assert finished(work) == []
