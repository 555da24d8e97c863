"""How precise the coordinates of a file are: whether float32 is enough to write them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..points import strided

_MOST_DECIMALS = 9
_ROUNDINGS = 8  # units in the last place that reading and moving coordinates may have cost
_HELD = 2.0**-46  # of the extent: what offsets and remainders may have cost
_CLEAR = 0.05  # of a step: roundings beyond do not tell decimals from chance
_SHARE = 1 / 4  # of a step: half of one would still round to the same decimals
_CHUNK = 1 << 18  # points looked at together


def is_enough(rounded: NDArray[np.floating], exact: NDArray[np.float64], slack: float = 0.0) -> bool:
    """Whether coordinates (N, 3) rounded to float32 are as good as the exact ones: within a quarter of the
    last decimal that these have, or float32 numbers themselves but for having been written as decimals, or
    all within a slack, scan units."""
    error = np.abs(rounded - exact)
    last_bit = float(np.spacing(np.float32(np.abs(exact).max(initial=0.0))))
    if error.max(initial=0.0) <= max(last_bit / 8, slack):
        return True
    return within_decimals(error, exact)


def within_decimals(error: NDArray[np.floating], exact: NDArray[np.float64]) -> bool:
    """Whether errors (N, 3) are within a quarter of the last decimal that coordinates (N, 3) have."""
    digits = decimals(exact)
    return digits is not None and bool((error <= _SHARE * 10.0**-digits).all())


def decimals(values: NDArray[np.float64]) -> int | None:
    """The most digits behind the decimal point that any of the values (N, 3) has; None where that is more
    than nine, or more than float64 could tell."""
    digits = _decimals_of(strided(values))
    for start in range(0, len(values), _CHUNK):
        if digits is None:
            return None
        digits = _decimals_of(values[start : start + _CHUNK], digits)
    return digits


def _decimals_of(values: NDArray[np.float64], least: int = 0) -> int | None:
    """Digits of all of the values, at least so many; None as `decimals` has it."""
    largest, extent = float(np.abs(values).max(initial=0.0)), float(np.ptp(values)) if len(values) else 0.0
    for digits in range(least, _MOST_DECIMALS + 1):
        scaled = values * 10.0**digits
        slack = _ROUNDINGS * np.spacing(largest * 10.0**digits) + _HELD * extent * 10.0**digits
        if slack > _CLEAR:
            return None
        if (np.abs(scaled - np.rint(scaled)) <= slack).all():
            return digits
    return None
