"""The deviations of a frame in a few numbers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class DeviationStatistics(NamedTuple):
    """Statistics of deviations, scan units, over the points that have one.

    mean: with signs. rms: root mean square. p95, max: of absolute values; 95 % are below the one. share: of
    the points that have a value. Without any value, all but the share are NaN.
    """

    mean: float
    rms: float
    p95: float
    max: float
    share: float

    @classmethod
    def of(cls, values: NDArray[np.floating]) -> DeviationStatistics:
        """The statistics of values (N,), NaN where a point has none."""
        known = values[np.isfinite(values)].astype(np.float64)
        share = len(known) / max(len(values), 1)
        if not len(known):
            return cls(np.nan, np.nan, np.nan, np.nan, share)
        sizes = np.abs(known)
        rms = np.sqrt(np.square(known).mean())
        return cls(
            float(known.mean()), float(rms), float(np.quantile(sizes, 0.95)), float(sizes.max()), share
        )


def detected_share(value: NDArray[np.floating], detectable: NDArray[np.floating]) -> float:
    """The share of values (N,) that exceed the least detectable one (N,); of all that are known, NaN if none
    is."""
    known = np.isfinite(value)
    return float((np.abs(value[known]) > detectable[known]).mean()) if known.any() else np.nan
