"""A pose: one moment of a scan."""

from __future__ import annotations

from dataclasses import dataclass

from .points import PointCloud


@dataclass(frozen=True, eq=False)
class Pose:
    """One moment of a scan, on the CPU.

    index: its place on the timeline. time: seconds. label: the file or frame it came from.
    """

    index: int
    time: float
    label: str
    cloud: PointCloud

    @property
    def nbytes(self) -> int:
        """Bytes held by its arrays."""
        return self.cloud.nbytes
