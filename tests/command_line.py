"""What became of a command line that ran in the test's own process."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple


class Done(NamedTuple):
    """What became of a command line."""

    code: int
    out: str
    err: str


Run = Callable[..., Done]
