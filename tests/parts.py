"""A pytest plugin that runs a part of the tests: --tenth chooses it by a commit, --seconds ends the run."""

from __future__ import annotations

import math
import signal
import time
import zlib
from collections.abc import Iterator
from typing import NoReturn

import pytest

_LATEST = pytest.StashKey[float]()  # when the time is over, by the monotonic clock
_LATE = "the time of --seconds is over"


def pytest_addoption(parser: pytest.Parser) -> None:
    """The options of this plugin."""
    parser.addoption("--tenth", metavar="COMMIT", help="run the tenth of the tests that a commit chooses")
    parser.addoption("--seconds", type=float, default=math.inf, help="run no test after this time")


def pytest_sessionstart(session: pytest.Session) -> None:
    """Start the clock."""
    session.config.stash[_LATEST] = time.monotonic() + session.config.getoption("--seconds")


@pytest.hookimpl(trylast=True)  # once -m has chosen
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep a tenth of the tests, a file at a time, in an order of files that differs between commits.

    Each test belongs to one of ten parts. The first digits of the commit's hash choose the part.
    """
    commit = config.getoption("--tenth")
    if commit is None:
        return
    part = int(commit[:8], 16) % 10
    chosen = [item for item in items if zlib.crc32(item.nodeid.encode()) % 10 == part]
    config.hook.pytest_deselected(items=[item for item in items if item not in chosen])
    items[:] = sorted(
        chosen, key=lambda item: zlib.crc32(f"{commit} {item.nodeid.partition('::')[0]}".encode())
    )


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Leave a test before its fixtures are made, once the time is over."""
    if time.monotonic() >= item.config.stash[_LATEST]:
        pytest.skip(_LATE)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Leave a running test when the time is over."""
    left = item.config.stash[_LATEST] - time.monotonic()
    if left == math.inf:
        return (yield)

    def leave(*_: object) -> NoReturn:
        pytest.skip(_LATE)

    before = signal.signal(signal.SIGALRM, leave)
    signal.setitimer(signal.ITIMER_REAL, max(left, 1e-3))
    try:
        return (yield)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Report how many tests the time was enough for."""
    if terminalreporter.config.getoption("--seconds") == math.inf:
        return
    ends = [
        report for kind in ("passed", "failed", "skipped") for report in terminalreporter.stats.get(kind, [])
    ]
    late = sum(_LATE in str(report.longrepr) for report in ends)
    terminalreporter.write_line(f"{len(ends) - late} tests ran, {late} were left for lack of time")
