"""Measures of landmarks and surfaces, and their values over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...mesh.geodesic import Line

Quantity = Literal["length", "angle", "area", "volume"]


@dataclass(frozen=True)
class Measure:
    """A measure of a kind, of these landmarks by name, in their order.

    options: choices of the kind, by name, as words.
    """

    name: str
    kind: str
    landmarks: tuple[str, ...] = ()
    options: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Series:
    """The values of a measure over time.

    times: (T,) seconds. values: (T,) scan units, their square or cube, or degrees, by quantity; NaN where not
    known. sigmas: (T,) standard deviations of the values; NaN where not known. known: (T,) uint8, the least
    of what is `Known` of its landmarks. lines: frame -> lines along the surface that are measured there, or
    are around what is, each (P, 3), to be drawn; none of measures of landmarks alone. reasons: frame -> why
    it is a gap. shares: (T,) of the area within a region's outline that has surface, the rest being openings;
    NaN where not known, and of other measures; empty: of none.
    """

    name: str
    quantity: Quantity
    times: NDArray[np.float64]
    values: NDArray[np.float64]
    sigmas: NDArray[np.float64]
    known: NDArray[np.uint8]
    lines: Mapping[int, tuple[Line, ...]] = field(default_factory=dict)
    reasons: Mapping[int, str] = field(default_factory=dict)
    shares: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
