"""What is said of a measurement."""

from __future__ import annotations

from ....analysis.measure import Reading, distance_in_words
from ....scan.units import Scale


def distance_words(reading: Reading, scale: Scale) -> str:
    """The distance and its uncertainty."""
    measurement = reading.measurement
    return distance_in_words(measurement.distance, measurement.uncertainty, scale.unit, scale.factor)


def snap_words(reading: Reading) -> str:
    """The points that the ends are at, or the surface, such as "at points 12 and 345"."""
    ids = [end.id for end in reading.measurement.ends if end.id is not None]
    if len(ids) == 2:
        return f"at points {ids[0]} and {ids[1]}"
    return f"at point {ids[0]} and on the surface" if ids else "on the surface"
