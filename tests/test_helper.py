from __future__ import annotations

import gc
import os
import threading
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import viewer.helper as helper_module
from viewer.errors import InputError, Scan4DError
from viewer.helper import Helper
from viewer.task import Cancelled, Task, checkpoint, in_background


def doubled(values: np.ndarray, times: int = 1) -> dict[str, np.ndarray]:
    print("what is printed is no answer")
    checkpoint(0.25)
    return {"doubled": values * 2**times}


def process() -> int:
    return os.getpid()


def report_an_integer() -> str:
    checkpoint(1)
    return "done"


def wait_for_ever() -> None:
    checkpoint(0.5)
    while True:
        time.sleep(1)


def end_the_process() -> None:
    os._exit(3)


def refuse() -> None:
    raise InputError("is no scan", "x.ply", "Take another")


def divide() -> float:
    return 1 / 0


@pytest.fixture
def helper() -> Iterator[Helper]:
    helper = Helper()
    yield helper
    helper.close()


def test_arrays_come_back_from_another_process_bit_for_bit(helper: Helper) -> None:
    values = np.random.default_rng(0).normal(size=(500_000, 3))[::2]
    task = Task("Doubling")
    result = helper.call(task, doubled, values, times=2)
    np.testing.assert_array_equal(result["doubled"], values * 4)
    result["doubled"][0] = 0  # it is the caller's own
    assert task.progress == 0.25


def test_the_process_stays_for_the_next_call(helper: Helper) -> None:
    one, other = (helper.call(Task("Asking"), process) for _ in range(2))
    assert one == other != os.getpid()


@pytest.mark.slow
def test_cancelling_ends_the_work_at_once_and_the_next_call_works(helper: Helper) -> None:
    task = Task("Waiting")
    future = in_background(task, lambda: helper.call(task, wait_for_ever))
    while task.progress is None:
        time.sleep(0.001)
    task.cancel()
    with pytest.raises(Cancelled):
        future.result()
    assert helper.call(Task("Asking"), process) != os.getpid()


@pytest.mark.slow
def test_progress_is_no_answer_whatever_number_it_is(helper: Helper) -> None:
    task = Task("Reporting")
    assert helper.call(task, report_an_integer) == "done"
    assert task.progress == 1


@pytest.mark.slow
def test_a_cancel_while_the_process_starts_is_not_lost(
    helper: Helper, monkeypatch: pytest.MonkeyPatch
) -> None:
    task, start = Task("Asking"), helper_module.start_python

    def start_and_cancel(*args: Any, **kwargs: Any) -> Any:
        started = start(*args, **kwargs)
        task.cancel()
        return started

    monkeypatch.setattr(helper_module, "start_python", start_and_cancel)
    with pytest.raises(Cancelled):
        helper.call(task, process)
    assert helper.call(Task("Asking"), process) != os.getpid()


def test_failures_come_back_as_errors_with_one_message(helper: Helper) -> None:
    with pytest.raises(InputError, match=r"^x.ply: is no scan. Take another$"):
        helper.call(Task("Reading"), refuse)
    with pytest.raises(Scan4DError, match=r"^divide failed \(ZeroDivisionError: division by zero\)$"):
        helper.call(Task("Dividing"), divide)
    with pytest.raises(Scan4DError, match=r"^Ending failed: its process ended with code 3$"):
        helper.call(Task("Ending"), end_the_process)
    assert helper.call(Task("Asking"), process) != os.getpid()


@pytest.mark.slow
def test_modules_in_the_working_directory_are_not_taken_for_ours(
    helper: Helper, tmp_path: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = str(tmp_path)
    with open(os.path.join(folder, "numpy.py"), "w") as file:
        file.write("raise SystemExit('wrong numpy')")
    monkeypatch.chdir(folder)
    assert helper.call(Task("Asking"), process) != os.getpid()


def test_closing_leaves_no_process(helper: Helper) -> None:
    number = helper.call(Task("Asking"), process)
    threads = threading.active_count()
    helper.close()
    with pytest.raises(ProcessLookupError):
        os.kill(number, 0)
    assert threading.active_count() == threads
    helper.close()


def test_a_helper_that_nobody_closes_leaves_no_process_either() -> None:
    helper = Helper()
    number = helper.call(Task("Asking"), process)
    del helper
    gc.collect()
    with pytest.raises(ProcessLookupError):
        os.kill(number, 0)
