"""A cache of poses, bounded in bytes."""

from __future__ import annotations

import os
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator

from ..errors import InputError
from .pose import Pose

BUDGET_VARIABLE = "SCAN4D_CACHE_MB"
_DEFAULT_BUDGET = 1 << 30


def default_budget() -> int:
    """Bytes of poses to keep: 1 GiB, or what SCAN4D_CACHE_MB says."""
    told = megabytes(BUDGET_VARIABLE)
    return _DEFAULT_BUDGET if told is None else told


def megabytes(variable: str) -> int | None:
    """The bytes that an environment variable tells in megabytes; None where it is not there.

    Raises InputError where it is no number.
    """
    text = os.environ.get(variable)
    if text is None:
        return None
    if not text.isdecimal():
        raise InputError(f"'{text}' is not a number of megabytes", variable, "For example 1024")
    return int(text) << 20


class PoseCache:
    """Poses by index, never more than `budget` bytes of them; the least recently used goes first.

    Not thread-safe: its owner holds a lock.
    """

    def __init__(self, budget: int) -> None:
        self.budget = budget
        self.nbytes = 0
        self._poses: OrderedDict[int, Pose] = OrderedDict()  # least recently used first

    def __contains__(self, index: int) -> bool:
        return index in self._poses

    def __iter__(self) -> Iterator[int]:
        """The indices held, least recently used first."""
        return iter(self._poses)

    def get(self, index: int) -> Pose | None:
        """The pose if it is here; it then counts as just used."""
        pose = self._poses.get(index)
        if pose is not None:
            self._poses.move_to_end(index)
        return pose

    def put(self, pose: Pose, keep: Callable[[int], bool] = lambda _: False) -> bool:
        """Hold this pose and evict others for it, but none to `keep`; False where it does not fit."""
        self._drop(pose.index)
        room, victims = self.budget - self.nbytes, []
        for index, held in self._poses.items():
            if room >= pose.nbytes:
                break
            if not keep(index):
                victims.append(index)
                room += held.nbytes
        if room < pose.nbytes:
            return False
        for index in victims:
            self._drop(index)
        self._poses[pose.index] = pose
        self.nbytes += pose.nbytes
        return True

    def touch(self, indices: Iterable[int]) -> None:
        """Count poses that are here as used, the last one as the most recent."""
        for index in indices:
            self._poses.move_to_end(index)

    def _drop(self, index: int) -> None:
        if index in self._poses:
            self.nbytes -= self._poses.pop(index).nbytes

    def clear(self) -> None:
        """Drop all."""
        self._poses.clear()
        self.nbytes = 0
