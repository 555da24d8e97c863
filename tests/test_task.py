from __future__ import annotations

import subprocess
import sys
import threading

import pytest

from viewer.task import Cancelled, Task, checkpoint, in_background


def test_without_a_task_a_checkpoint_does_nothing() -> None:
    checkpoint()
    checkpoint(0.5)


def test_work_reports_and_gives_its_result() -> None:
    task = Task("Counting")
    assert task.progress is None

    def work() -> int:
        checkpoint(0.5)
        return 7

    assert in_background(task, work).result() == 7
    assert task.progress == 0.5
    assert task.seconds >= 0


def test_cancelled_work_stops_at_its_next_checkpoint() -> None:
    task, begun, go_on = Task("Counting"), threading.Event(), threading.Event()
    passed = []

    def work() -> None:
        begun.set()
        go_on.wait()
        checkpoint()
        passed.append("the checkpoint")

    future = in_background(task, work)
    begun.wait()
    task.cancel()
    go_on.set()
    with pytest.raises(Cancelled):
        future.result()
    assert task.cancelled
    assert not passed


def test_work_that_is_cancelled_before_it_begins_does_not_begin() -> None:
    task = Task("Counting")
    task.cancel()
    began = []
    with pytest.raises(Cancelled):
        in_background(task, lambda: began.append(True)).result()
    assert not began


def test_readers_that_catch_exceptions_do_not_catch_a_cancellation() -> None:
    assert not issubclass(Cancelled, Exception)


def test_cancelling_calls_what_stops_the_work_while_it_runs() -> None:
    task, stopped = Task("Waiting"), []
    with task.stopped_by(lambda: stopped.append("early")):
        pass
    with task.stopped_by(lambda: stopped.append("now")):
        task.cancel()
    assert stopped == ["now"]
    with pytest.raises(Cancelled), task.stopped_by(lambda: stopped.append("late")):
        raise AssertionError("nothing begins")


def test_the_end_of_the_process_stops_what_is_in_the_background() -> None:
    program = """
import time
from viewer.task import Task, checkpoint, in_background
def work():
    print("begun", flush=True)
    try:
        while True:
            checkpoint()
            time.sleep(0.001)
    finally:
        print("stopped", flush=True)
in_background(Task("Counting"), work)
time.sleep(0.2)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout, done.stderr) == (0, "begun\nstopped\n", "")


def test_other_threads_are_not_part_of_a_task() -> None:
    task = Task("Counting")
    task.cancel()
    with task.current():
        other = threading.Thread(target=checkpoint)
        other.start()
        other.join()
        with pytest.raises(Cancelled):
            checkpoint()
    checkpoint()
