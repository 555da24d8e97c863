"""Lens distortion as OpenCV has it: from where a pinhole sees a point to where the lens shows it, and back.

Places are x and y at depth 1, x to the right and y down. With r² = x² + y² and the coefficients
k1 k2 p1 p2 [k3 [k4 k5 k6]], the rest of which are 0:

    s  = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)
    x' = s x + 2 p1 x y + p2 (r² + 2 x²)
    y' = s y + 2 p2 x y + p1 (r² + 2 y²)
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

COUNTS = (4, 5, 8)  # of coefficients
_MOST_STEPS = 30  # of Newton's method; real lenses take 4
_EXACT = 1e-14  # the step, at depth 1, after which it ends
_ROUNDED = 1e-10  # how far what is found may be from what was looked for
_ALONG = 16  # positions tried between the middle of the picture and another

_Places = tuple[NDArray[np.float64], NDArray[np.float64]]


def distorted(x: NDArray[np.float64], y: NDArray[np.float64], coefficients: Sequence[float]) -> _Places:
    """Places as the lens shows them, any shape; NaN where it has folded the picture over."""
    with np.errstate(all="ignore"):
        seen_x, seen_y, *slopes = _seen(x, y, coefficients)
        folded = ~_upright(*slopes)
    return np.where(folded, np.nan, seen_x), np.where(folded, np.nan, seen_y)


def undistorted(x: NDArray[np.float64], y: NDArray[np.float64], coefficients: Sequence[float]) -> _Places:
    """The pinhole's position for what the lens shows at x and y, any shape; NaN where it shows nothing."""
    with np.errstate(all="ignore"):
        *_, (shown_x, shown_y, _) = _approached(x, y, coefficients, _EXACT)
        seen_x, seen_y, *slopes = _seen(shown_x, shown_y, coefficients)
        lost = ~((np.abs(seen_x - x) < _ROUNDED) & (np.abs(seen_y - y) < _ROUNDED) & _upright(*slopes))
    shown_x[lost] = shown_y[lost] = np.nan
    return shown_x, shown_y


def steps_to_undo(
    x: NDArray[np.float64], y: NDArray[np.float64], coefficients: Sequence[float], last: float
) -> int:
    """The number of steps of Newton's method, from what is seen, of which none at these positions is
    longer than `last` at the end: what is missing then is about the square of that."""
    with np.errstate(all="ignore"):
        return sum(1 for _ in _approached(x, y, coefficients, last))


def _approached(
    x: NDArray[np.float64], y: NDArray[np.float64], coefficients: Sequence[float], last: float
) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64], float]]:
    """The position after each of Newton's steps, and the longest step; until that is below `last`."""
    shown_x, shown_y = np.array(x, np.float64), np.array(y, np.float64)
    for _ in range(_MOST_STEPS):
        seen_x, seen_y, xx, xy, yy = _seen(shown_x, shown_y, coefficients)
        off_x, off_y, area = x - seen_x, y - seen_y, xx * yy - xy * xy
        step_x, step_y = (yy * off_x - xy * off_y) / area, (xx * off_y - xy * off_x) / area
        shown_x, shown_y = shown_x + step_x, shown_y + step_y
        longest = float(max(np.abs(step_x).max(initial=0), np.abs(step_y).max(initial=0)))
        yield shown_x, shown_y, longest
        if not longest > last:
            return


def can_be_undone(x: NDArray[np.float64], y: NDArray[np.float64], coefficients: Sequence[float]) -> bool:
    """Whether the lens shows one position at each of these, (N,), and between the middle and there."""
    shown_x, shown_y = undistorted(x, y, coefficients)
    part = np.linspace(0, 1, _ALONG + 1)[:, None]
    return bool(np.isfinite(distorted(part * shown_x, part * shown_y, coefficients)).all())


def _seen(
    x: NDArray[np.float64], y: NDArray[np.float64], coefficients: Sequence[float]
) -> tuple[NDArray[np.float64], ...]:
    """Places as they are shown, x' and y', and the slopes dx'/dx, dx'/dy = dy'/dx and dy'/dy."""
    k1, k2, p1, p2, k3, k4, k5, k6 = (*coefficients, *(0.0,) * (8 - len(coefficients)))
    r = x * x + y * y  # squared
    above, below = 1 + r * (k1 + r * (k2 + r * k3)), 1 + r * (k4 + r * (k5 + r * k6))
    scale = above / below
    # Twice the derivative by r².
    growth = 2 * (k1 + r * (2 * k2 + r * 3 * k3) - scale * (k4 + r * (2 * k5 + r * 3 * k6))) / below
    return (
        x * scale + 2 * p1 * x * y + p2 * (r + 2 * x * x),
        y * scale + 2 * p2 * x * y + p1 * (r + 2 * y * y),
        scale + growth * x * x + 2 * p1 * y + 6 * p2 * x,
        growth * x * y + 2 * (p1 * x + p2 * y),
        scale + growth * y * y + 2 * p2 * x + 6 * p1 * y,
    )


def _upright(xx: NDArray[np.float64], xy: NDArray[np.float64], yy: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether slopes keep the picture's sides, so that no two positions near each other are shown at one."""
    return (xx + yy > 0) & (xx * yy > xy * xy)
