"""The measurements of a document, in the order they were made."""

from __future__ import annotations

from dataclasses import dataclass

from ..analysis.measure import Measurement
from .part import Part


@dataclass(frozen=True)
class Measurements(Part, name="measurements"):
    """all: in the order they were made."""

    all: tuple[Measurement, ...] = ()

    def added(self, measurement: Measurement) -> Measurements:
        """The measurements and one more at the end."""
        return Measurements((*self.all, measurement))

    def without(self, number: int) -> Measurements:
        """All but the one at this place, counted from 0."""
        return Measurements(self.all[:number] + self.all[number + 1 :])
