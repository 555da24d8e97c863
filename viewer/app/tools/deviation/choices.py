"""What the user chooses about deviations, which is the scan's."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from ....analysis.deviation.chosen import ReferenceChoice
from ....document.part import Part
from .._painting import Sphere

FRAME, MEAN, FILE = "frame", "mean", "file"
KIND_WORDS = {FRAME: "A frame", MEAN: "Mean of frames", FILE: "Scan or mesh file"}


@dataclass(frozen=True)
class Deviating(Part, name="deviation"):
    """is_on: whether deviations are measured. kind: of the reference. first: the frame that is the reference,
    or the first one of the mean, whose surface is painted. last: of the mean. file: the other scan, "" before
    it is chosen. spheres: that were painted, see `RigidRegion`.
    """

    is_on: bool = False
    kind: str = FRAME
    first: int = 0
    last: int = 0
    file: str = ""
    spheres: tuple[Sphere, ...] = ()

    def changed(self, **changes: Any) -> Deviating:
        """The choices with some others."""
        return replace(self, **changes)

    @property
    def reference(self) -> ReferenceChoice | None:
        """The reference; None while the other scan has yet to be chosen."""
        if self.kind == FILE:
            return ReferenceChoice(self.first, self.first, self.file) if self.file else None
        return ReferenceChoice(self.first, self.last if self.kind == MEAN else self.first)
