"""Work of compiled loops, shared out among threads where there is enough of it."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context

import numpy as np
from numpy.typing import NDArray

_SHARE = 100_000  # points that a thread is worth beginning for


def threads_for(points: int) -> int:
    """How many threads to use for so many points."""
    return max(1, min(os.cpu_count() or 1, points // _SHARE))


def together(points: int, works: Iterable[Callable[[], object]]) -> None:
    """Do all of some work on `points` points, on as many threads as that is worth; in any order."""
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
    """(first, last + 1) of a share of the points for each thread."""
    return ranges(np.linspace(0, points, threads_for(points) + 1).astype(np.int64))
