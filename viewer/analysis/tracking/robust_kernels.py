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
    count, channels = matches.color_steps.shape
    residuals, rows = np.empty(count), np.flatnonzero(matches.is_matched)
    for n in range(len(rows)):
        residuals[n] = matches.distances[rows[n]]
    residuals = residuals[: len(rows)]
    scale = max(robust_scale(residuals, 0.0), least[0])
    matches.scales[0] = scale
    for n in range(len(rows)):
        matches.weights[rows[n], 0] = tukey_weight(residuals[n], scale)
    for c in range(channels):
        for n in range(len(rows)):
            residuals[n] = matches.color_steps[rows[n], c]
        shift = np.median(residuals)
        scale = max(robust_scale(residuals, shift), least[1 + c])
        matches.scales[1 + c] = scale
        for n in range(len(rows)):
            matches.color_steps[rows[n], c] -= shift
            matches.weights[rows[n], 1 + c] = tukey_weight(residuals[n] - shift, scale)
