"""Robust kernels of registration: residuals far beyond the usual ones count for nothing.

Compiled by numba; see `register_kernels`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, inlined
from .correspondence_kernels import Correspondences

_TUKEY = 4.685  # standard deviations at which Tukey's weight is zero: 95 % efficient for Gaussian residuals
_DEVIATION = 1.4826  # standard deviation of Gaussian residuals, by their median absolute deviation

Float = NDArray[np.float64]


@inlined
def tukey_weight(residual: float, scale: float) -> float:
    """Tukey's bisquare weight of a residual, 0..1. scale: the standard deviation of residuals."""
    share = residual / (_TUKEY * scale)
    return (1.0 - share * share) ** 2 if abs(share) < 1.0 else 0.0


@compiled
def robust_scale(residuals: Float, shift: float) -> float:
    """The standard deviation of residuals (n,) about a shift, from the median of their sizes."""
    sizes = np.empty(len(residuals))
    for i in range(len(residuals)):
        sizes[i] = abs(residuals[i] - shift)
    return _DEVIATION * np.median(sizes)


@compiled
def weigh(matches: Correspondences, least: Float) -> None:
    """Fill scales and weights of correspondences; steps of colour become relative to their median.

    least: (1 + C,), deviations that residuals have at least.
    """
    is_matched, _, residuals, _, _, scales, weights = matches
    rows = np.flatnonzero(is_matched)
    values = np.empty(len(rows))
    for term in range(len(scales)):
        for n in range(len(rows)):
            values[n] = residuals[rows[n], term]
        shift = np.median(values) if term > 0 else 0.0
        scales[term] = max(robust_scale(values, shift), least[term])
        for n in range(len(rows)):
            residuals[rows[n], term] = values[n] - shift
            weights[rows[n], term] = tukey_weight(values[n] - shift, scales[term])
