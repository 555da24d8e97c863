"""Signals that end a program: raised at once, or when it may be."""

from __future__ import annotations

import signal
import sys
import threading

import pytest

from viewer.signals import ending_as_interrupts, held_interrupts

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX's")
ENDING = [signal.SIGTERM, signal.SIGHUP] if sys.platform != "win32" else []


@pytest.mark.parametrize("number", ENDING)
def test_signals_that_end_are_interrupts(number: int) -> None:
    with pytest.raises(KeyboardInterrupt), ending_as_interrupts():
        signal.raise_signal(number)
    assert signal.getsignal(number) is signal.SIG_DFL


def test_what_is_ignored_stays_so() -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with ending_as_interrupts():
            signal.raise_signal(signal.SIGHUP)
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)


def test_on_other_threads_nothing_changes() -> None:
    found = []

    def look() -> None:
        with ending_as_interrupts(), held_interrupts():
            found.append(signal.getsignal(signal.SIGTERM))

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    assert found == [signal.SIG_DFL]


@pytest.mark.parametrize("number", [signal.SIGINT, *ENDING])
def test_held_interrupts_are_raised_where_they_are_let_in(number: int) -> None:
    with ending_as_interrupts(), held_interrupts() as interrupts:
        signal.raise_signal(number)
        done = "whole"  # in spite of it
        with pytest.raises(KeyboardInterrupt), interrupts.let_in():
            done = "begun"
        assert done == "whole"
        with pytest.raises(KeyboardInterrupt), interrupts.let_in():
            signal.raise_signal(number)


def test_a_second_interrupt_waits_until_all_is_kept() -> None:
    kept = False
    with pytest.raises(KeyboardInterrupt), held_interrupts() as interrupts:  # noqa: PT012
        try:
            with interrupts.let_in():
                signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            signal.raise_signal(signal.SIGINT)
        kept = True
    assert kept
