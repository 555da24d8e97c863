"""A pose: one moment of a scan."""

from __future__ import annotations

from dataclasses import dataclass

from .points import PointCloud
from .range_view import RangeView, merge

Scanned = PointCloud | tuple[RangeView, ...]  # what a frame holds


@dataclass(frozen=True, eq=False)
class Pose:
    """One moment of a scan, on the CPU.

    index: its place on the timeline. time: seconds. label: the file or frame it came from.
    cloud: its points; those of the range views where it was scanned as such.
    """

    index: int
    time: float
    label: str
    cloud: PointCloud
    views: tuple[RangeView, ...] = ()

    @classmethod
    def of(cls, index: int, time: float, label: str, scanned: Scanned) -> Pose:
        """The pose of what a frame holds. Raises InputError where range views see nothing."""
        if isinstance(scanned, PointCloud):
            return cls(index, time, label, scanned)
        return cls(index, time, label, merge(scanned), scanned)

    @property
    def nbytes(self) -> int:
        """Bytes held by its arrays."""
        return self.cloud.nbytes + sum(view.nbytes for view in self.views)
