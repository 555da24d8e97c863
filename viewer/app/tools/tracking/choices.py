"""What the user chooses about followed points, which is the scan's."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from ....document.part import Part
from .._painting import Sphere


@dataclass(frozen=True)
class DenseTracking(Part, name="dense_tracking"):
    """is_on: whether every point of a frame is followed. reference: that frame. spheres: that were painted in
    it, see `RigidRegion`, for their mean path."""

    is_on: bool = False
    reference: int = 0
    spheres: tuple[Sphere, ...] = ()

    def changed(self, **changes: Any) -> DenseTracking:
        """The choices with some others."""
        return replace(self, **changes)
