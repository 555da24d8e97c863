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
    """Bytes of poses to hold: 1 GiB, or what SCAN4D_CACHE_MB says."""
    stated = megabytes(BUDGET_VARIABLE)
    return _DEFAULT_BUDGET if stated is None else stated


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
    """Poses by index, never more than `budget` bytes of them when one comes in; the least recently used goes
    first.

    Poses grow when their points are merged, so that those which may are counted again. Not thread-safe: its
    owner holds a lock.
    """

    def __init__(self, budget: int) -> None:
        self.budget = budget
        self._poses: OrderedDict[int, Pose] = OrderedDict()  # least recently used first
        self._sizes: dict[int, int] = {}  # bytes of each
        self._unmerged: set[int] = set()  # that may have grown
        self._counted = 0

    @property
    def nbytes(self) -> int:
        """Bytes that the poses hold now."""
        for index in tuple(self._unmerged):
            self._count(index)
        return self._counted

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

    def peek(self, index: int) -> Pose | None:
        """The pose if it is here; it counts as used no later than before."""
        return self._poses.get(index)

    def put(self, pose: Pose, is_needed: Callable[[int], bool] = lambda _: False) -> bool:
        """Hold this pose and evict others for it, but none that `is_needed`; False where it does not fit."""
        self._drop(pose.index)
        room, needed, victims = self.budget - self.nbytes, pose.nbytes, []
        for index in self._poses:
            if room >= needed:
                break
            if not is_needed(index):
                victims.append(index)
                room += self._sizes[index]
        if room < needed:
            return False
        for index in victims:
            self._drop(index)
        self._poses[pose.index] = pose
        self._sizes[pose.index] = 0
        self._count(pose.index)
        return True

    def exchange(self, change: Callable[[Pose], Pose]) -> None:
        """Hold what a function makes of each pose instead of it; it has the same points."""
        for index, pose in self._poses.items():
            self._poses[index] = change(pose)

    def trim(self) -> None:
        """Evict the least recently used while the poses have grown beyond the budget."""
        while self.nbytes > self.budget:
            self._drop(next(iter(self._poses)))

    def size_of(self, index: int) -> int | None:
        """Bytes that a pose holds; None where it is not here."""
        return self._poses[index].nbytes if index in self._poses else None

    def touch(self, indices: Iterable[int]) -> None:
        """Count poses that are here as used, the last one as the most recent."""
        for index in indices:
            self._poses.move_to_end(index)

    def clear(self) -> None:
        """Drop all."""
        for index in tuple(self._poses):
            self._drop(index)

    def _count(self, index: int) -> None:
        pose, before = self._poses[index], self._sizes[index]
        is_merged = pose.is_merged and pose.raw.is_merged
        (self._unmerged.discard if is_merged else self._unmerged.add)(index)  # before what it grew by
        self._sizes[index] = pose.nbytes
        self._counted += self._sizes[index] - before

    def _drop(self, index: int) -> None:
        if index in self._poses:
            del self._poses[index]
            self._unmerged.discard(index)
            self._counted -= self._sizes.pop(index)
