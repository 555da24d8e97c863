"""Measures of landmarks and surfaces, and their values over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...mesh.geodesic import Line

WHOLE = 0.95  # of the area within an outline: with less surface, a region has openings
Quantity = Literal["length", "angle", "area", "volume"]


@dataclass(frozen=True)
class Measure:
    """A measure of a kind, of these landmarks by name, in their order.

    options: choices of the kind, by name, as words. owns_landmarks: whether its landmarks are its own, as the
    ends of a distance that was clicked: no list of landmarks shows them, and they go with it.
    """

    name: str
    kind: str
    landmarks: tuple[str, ...] = ()
    options: Mapping[str, str] = field(default_factory=dict)
    owns_landmarks: bool = False

    @property
    def label(self) -> str:
        """The name over pictures: of "Distance 1" that owns its landmarks, the number alone."""
        return self.name.removeprefix("Distance ") if self.owns_landmarks else self.name


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

    def in_frames(self, frames: Sequence[int]) -> Series:
        """The series of these frames alone, in their order."""
        rows = list(frames)
        there = {frame: row for row, frame in enumerate(rows)}
        return replace(
            self,
            times=self.times[rows],
            values=self.values[rows],
            sigmas=self.sigmas[rows],
            known=self.known[rows],
            lines={there[frame]: lines for frame, lines in self.lines.items() if frame in there},
            reasons={there[frame]: reason for frame, reason in self.reasons.items() if frame in there},
            shares=self.shares[rows] if len(self.shares) else self.shares,
        )

    def note(self, frame: int) -> str:
        """A remark on the value in a frame: why there is none, or how much of a region has surface, or of a
        line lies on it, where that is not all; "" for nothing."""
        if frame in self.reasons and np.isnan(self.values[frame]):
            return self.reasons[frame]
        share = self.shares[frame] if len(self.shares) else np.nan
        return self._filled(share) if share < WHOLE else ""

    def _filled(self, share: float, least: str = "") -> str:
        if self.quantity == "length":
            return f"{least}{100 * share:.0f} % of the line lies on the surface"
        return f"the surface fills {least}{100 * share:.0f} % of the outline"

    @property
    def warning(self) -> str:
        """A remark on all values together, such as a movement: in how many frames there are none, and
        why; in how many a region has openings. "" for nothing."""
        count, remarks = len(self.times), []
        gaps = [frame for frame in sorted(self.reasons) if np.isnan(self.values[frame])]
        if gaps:
            reasons = "; ".join(dict.fromkeys(self.reasons[frame] for frame in gaps))
            remarks.append(f"no value in {len(gaps)} of {count} frames: {reasons}")
        open_ = self.shares < WHOLE if len(self.shares) else np.zeros(count, bool)
        if open_.any():
            filled = self._filled(float(self.shares[open_].min()), "as little as ")
            remarks.append(f"the surface has openings in {int(open_.sum())} of {count} frames: {filled}")
        return "; ".join(remarks)
