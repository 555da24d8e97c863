"""The points of range views, which are merged when something asks for them and not before."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .points import PointCloud, stride
from .range_view import RangeView, merge


@dataclass(eq=False)
class RangePoints:
    """The points that range views see.

    overview: some thousands of them, spread evenly, with the origin and the attributes that all have: what is
    known without merging. count: the valid pixels; each is a point unless float32 cannot hold its place.
    """

    views: tuple[RangeView, ...]
    overview: PointCloud
    count: int
    _merge: Callable[[], PointCloud]
    _merged: PointCloud | None = None
    _lock: threading.Lock = field(default_factory=threading.Lock, repr=False)

    @classmethod
    def of(cls, views: tuple[RangeView, ...]) -> RangePoints:
        """The points of these views. Raises InputError where no view sees a point."""
        overview, count = _overview(views)
        return cls(views, overview, count, partial(merge, views, origin=overview.origin))

    @property
    def cloud(self) -> PointCloud:
        """All points as `merge` gives them: merged by whoever asks first, on any thread, and kept."""
        if self._merged is None:
            with self._lock:
                if self._merged is None:
                    self._merged = self._merge()
        return self._merged

    @property
    def is_merged(self) -> bool:
        """Whether `cloud` is there."""
        return self._merged is not None

    @property
    def nbytes(self) -> int:
        """Bytes held by all arrays; those of the cloud once it is there."""
        merged = self._merged
        held = self.overview.nbytes + sum(view.nbytes for view in self.views)
        return held if merged is None else held + merged.nbytes

    def with_cloud(self, cloud: PointCloud) -> RangePoints:
        """Put a cloud that has more attributes of the same points in place of `cloud`."""
        return RangePoints(self.views, self.overview, self.count, self._merge, cloud)

    def moved(self, views: tuple[RangeView, ...], by: NDArray[np.float64]) -> RangePoints:
        """Move the origin, from which the offsets of the points stay. views: those moved likewise.

        by: (3,) scan units.
        """
        overview = _moved(self.overview, by)
        return RangePoints(views, overview, self.count, partial(_merged_and_moved, self, by))

    def __getstate__(self) -> dict[str, Any]:
        """All that another process needs: not the lock, nor what is merged already."""
        state = {name: value for name, value in self.__dict__.items() if name != "_lock"}
        return state | {"_merge": None} if self.is_merged else state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__ |= {**state, "_lock": threading.Lock()}


def _overview(views: Sequence[RangeView]) -> tuple[PointCloud, int]:
    """The points of valid pixels of an even stride, and the number of all.

    It is the stride at which clouds are looked at, so that what is found by either is the same.
    """
    seen = [view.valid().ravel() for view in views]
    counts = [int(np.count_nonzero(pixels)) for pixels in seen]
    step, first, thinned = stride(sum(counts)), 0, []
    for view, pixels, count in zip(views, seen, counts, strict=True):
        mask = np.zeros(len(pixels), bool)
        mask[np.flatnonzero(pixels)[first::step]] = True
        thinned.append(replace(view, mask=mask.reshape(view.depth.shape)))
        first = (first - count) % step
    return merge(thinned), sum(counts)


def _merged_and_moved(points: RangePoints, by: NDArray[np.float64]) -> PointCloud:
    return _moved(points.cloud, by)


def _moved(cloud: PointCloud, by: NDArray[np.float64]) -> PointCloud:
    return replace(cloud, origin=cloud.origin + by)
