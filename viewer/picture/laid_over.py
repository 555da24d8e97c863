"""Numbers of layers over a pose, as texels."""

from __future__ import annotations

import weakref
from dataclasses import dataclass, field

from numpy.typing import NDArray

from ..gpu.arrays import GpuArray
from ..gpu.pose import GpuPose
from ..scan.points import strided
from ..scan.ranges import robust_range


def laid_over(pose: GpuPose, values: NDArray) -> LaidOver:
    """The entry of numbers over a pose, (N,), one for each point of the scan. It lasts as long as somebody
    holds the array."""
    return pose.cached(_Entries).of(values)


@dataclass(eq=False)
class LaidOver:
    """Numbers that lie over a pose.

    range: their 2 % and 98 % quantiles. arrays: on the GPU, by the kind of rows that they belong to.
    """

    values: weakref.ref[NDArray]
    range: tuple[float, float]
    arrays: dict[type, GpuArray] = field(default_factory=dict)


class _Entries:
    def __init__(self, _: GpuPose) -> None:
        self._by_id: dict[int, LaidOver] = {}

    def of(self, values: NDArray) -> LaidOver:
        for key in [key for key, entry in self._by_id.items() if entry.values() is None]:
            del self._by_id[key]
        if id(values) not in self._by_id:
            self._by_id[id(values)] = LaidOver(weakref.ref(values), robust_range(strided(values)))
        return self._by_id[id(values)]

    @property
    def nbytes(self) -> int:
        return sum(array.nbytes for entry in self._by_id.values() for array in entry.arrays.values())

    def release(self) -> None:
        self._by_id.clear()
