"""Signals that end a program: raised at once, or when it may be."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from viewer.signals import ending_as_interrupts, held_interrupts

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX's")
ENDING = [signal.SIGTERM, signal.SIGHUP] if sys.platform != "win32" else []
ROOT = Path(__file__).resolve().parents[1]


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


STOPPED_AGAIN = """
import atexit, signal, sys
from viewer import cli
from viewer.commands import _line as line
from viewer.commands import info

def stop(*_):
    signal.raise_signal(signal.{first})

def told(text, complain=line.complain):
    again()
    complain(text)

def again():
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.raise_signal(number)

info.scan_facts, line.complain = stop, told
atexit.register(again)
sys.argv[1:] = ["info", "demo"]
sys.exit(cli.main())
"""


@pytest.mark.parametrize("first", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_who_says_that_it_is_stopped_ends_with_its_code(first: str) -> None:
    code = STOPPED_AGAIN.format(first=first)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "scan4d: stopped\n")
