"""Corners of regions among the landmarks: they bear the name of their region, and not each its own."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from ....analysis.measures import Measure
from ....analysis.measures.kinds.regions import KINDS

_OF_REGIONS = frozenset(kind.name for kind in KINDS)


def regions_of(measures: Iterable[Measure]) -> Mapping[str, str]:
    """Find the landmarks that are corners of a region, and the region's name.

    They are those of a measure of an outline, and their names differ in their last number only: "lips.1",
    "lips.2". Landmarks with names of their own are none, though an outline goes through them.
    """
    found: dict[str, str] = {}
    for measure in measures:
        stems = {re.sub(r"[0-9]+$", "", name) for name in measure.landmarks}
        is_numbered = all(name[-1:].isdecimal() for name in measure.landmarks)
        if measure.kind in _OF_REGIONS and is_numbered and len(stems) == 1:
            for name in measure.landmarks:
                found.setdefault(name, measure.name.partition(", ")[0])
    return found
