"""Signals close the window, and end it where closing does not come to an end."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

CODE = """
import signal, sys
from viewer.app import closing
closing._PATIENCE = float(sys.argv[1])
with closing.Signals() as signals:
    signal.raise_signal(int(sys.argv[2]))
    assert signals.came
    signal.raise_signal(int(sys.argv[2]))
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize(("patience", "ends"), [("1000", False), ("-1", True)])
def test_a_second_signal_ends_a_window_that_does_not_close(number: int, patience: str, ends: bool) -> None:
    words = [sys.executable, "-c", CODE, patience, str(int(number))]
    assert subprocess.run(words, check=False).returncode == (-number if ends else 0)
