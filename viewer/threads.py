"""Threads for kernels, where there are enough points."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context

import numpy as np
from numpy.typing import NDArray

_SHARE = 25_000  # points that pay for the start of a thread


_GIVE_WAY = 0.0005  # seconds that a thread works in Python while another waits


def give_way() -> None:
    """Let threads that work in Python give way to others sooner: the thread that draws waits for them at each
    call of OpenGL. For programs that draw while others work, such as a window's."""
    sys.setswitchinterval(_GIVE_WAY)


def threads_for(points: int) -> int:
    """The number of threads for so many points."""
    return max(1, min(os.cpu_count() or 1, points // _SHARE))


def together(points: int, works: Iterable[Callable[[], object]]) -> None:
    """Run all works on `points` points, in any order, on as many threads as pay."""
    count = threads_for(points)
    if count == 1:
        for work in works:
            work()
        return
    with ThreadPoolExecutor(count) as pool:
        for done in [pool.submit(copy_context().run, work) for work in works]:  # of the same task
            done.result()


def ranges(borders: NDArray[np.integer]) -> list[tuple[int, int]]:
    """(first, last + 1) between each two borders."""
    return list(zip(borders[:-1].tolist(), borders[1:].tolist(), strict=True))


def shares(points: int) -> list[tuple[int, int]]:
    """(first, last + 1) of the points of each thread."""
    return ranges(np.linspace(0, points, threads_for(points) + 1).astype(np.int64))
