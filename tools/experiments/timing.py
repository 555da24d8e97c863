"""Times of works that take turns, so that a change of the machine's speed affects all of them alike."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Literal, NamedTuple

import numpy as np

from viewer.bench.run import undisturbed

CORES = 2  # over which processor time is spread, as if the work splits evenly


class Taken(NamedTuple):
    """What a work takes, ms. wall: wall time. busy: processor time of all threads, the driver's included."""

    wall: float
    busy: float


def by_turns(
    works: Mapping[str, Callable[[], object]],
    rounds: int,
    finish: Callable[[], object] = int,
    of: Literal["median", "least"] = "median",
    warm: int = 1,
) -> dict[str, Taken]:
    """The median or least time of each work over some rounds, after `warm` rounds that do not count.

    finish: waits for what a work has begun, before and after it.
    """
    taken: dict[str, list[tuple[float, float]]] = {name: [] for name in works}
    with undisturbed():
        for turn in range(warm + rounds):
            for name, work in works.items():
                finish()
                wall, busy = time.perf_counter(), time.process_time()
                work()
                finish()
                if turn >= warm:
                    taken[name].append((time.perf_counter() - wall, time.process_time() - busy))
    pick = np.median if of == "median" else np.min
    return {name: Taken(*(1e3 * pick(times, axis=0)).tolist()) for name, times in taken.items()}
