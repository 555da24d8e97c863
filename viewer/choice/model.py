"""What a configuration takes, and how wrong it is: sums of simple terms, fitted to measurements.

Time: a base, so much for each point and each pixel, and for what splats overlap. Error: what holes, coarse
pixels and edges cost, each growing as points lie farther apart or pixels are larger. No term is negative,
so more work never takes less time, and sparser points are never better.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .seen import ScanInView

CAP = 4.0  # pixels: what is farther off is wrong, and how far is all the same
_HOLES = (0.5, 1.0, 2.0, 4.0)  # spacings, drawn pixels, about which surfaces open
_BENDS = (2.0, 8.0, 32.0)  # spacings, pixels, about which what lies between points is missed
_BUMPS = (0.1, 0.3, 1.0, 3.0, 10.0)  # how rough points are, pixels, about which that shows
_SPLAT = 3.0  # width of a splat, in spacings
_TILES = (8.0, 32.0)  # edges of tiles that splats are listed for, pixels
TIME_TERMS, ERROR_TERMS = 8 + len(_TILES), 4 + 2 * len(_HOLES) + 2 * len(_BENDS) + len(_BUMPS)
_LEAST_ERROR = 0.1  # pixels: smaller ones are as good as this
_ROUNDS, _APART = 20, 100.0  # of fitting; and a ratio from which on numbers are no farther apart
_SURE = 0.9  # of the measurements that are as expected, or little more
_COARSE = 1  # the term of the error that goes by the scale alone
_SMALL = 0.5  # pixels, from which on errors count as large


@dataclass(frozen=True)
class Law:
    """Time and error of one configuration, for any view. time, error: factors of the terms (`time_terms`,
    `error_terms`). late: how many times as long as expected nine of ten pictures take at most. wrong: by how
    much they are farther off, pixels, see `most_error`."""

    time: tuple[float, ...]
    error: tuple[float, ...]
    late: float
    wrong: float

    def expect(self, seen: ScanInView, scale: float) -> Expected:
        """Time and error that are expected of a view, drawn on a scale of width and height."""
        ms = time_terms(seen, scale) @ np.array(self.time)
        parts = error_terms(seen, scale) * np.array(self.error)
        known = float(parts[_COARSE])
        return Expected(float(ms), float(np.sqrt(parts.sum() - known)), float(np.sqrt(known)))

    def most_ms(self, expected: Expected) -> float:
        """The time that few pictures exceed, ms."""
        return expected.ms * self.late

    def most_error(self, expected: Expected) -> float:
        """The error that few pictures exceed, pixels: small ones may be some times as large, large ones so
        much larger; what coarse pixels do is known."""
        most = expected.off * (1 + self.wrong / (expected.off + _SMALL))
        return min(float(np.hypot(most, expected.coarse)), CAP)


@dataclass(frozen=True)
class Expected:
    """Time that a picture is expected to take, ms, and its error, pixels (see docs/guide/automatic.md):
    coarse: as its pixels are larger; off: otherwise."""

    ms: float
    off: float
    coarse: float = 0.0

    @property
    def error(self) -> float:
        """How far off it is in all, pixels."""
        return min(float(np.hypot(self.off, self.coarse)), CAP)


@dataclass(frozen=True)
class Measured:
    """One picture that was measured: what was seen, the scale of its width and height, and what it took."""

    seen: ScanInView
    scale: float
    ms: float
    error: float


Model = Mapping[str, Law]  # of each configuration, by its key


def time_terms(seen: ScanInView, scale: float) -> NDArray[np.float64]:
    """Terms of the time: one for all; in millions, whole pixels that fewer are shown on, pixels drawn and
    covered, points that are looked at, in view, and those of a file in no order, and what splats overlap:
    pixels, and tiles of them."""
    drawn = seen.at(scale)
    edge = max(drawn.spacing, 1.0)
    counts = np.array(
        [
            float(scale < 1) * seen.pixels,
            drawn.pixels,
            drawn.covered,
            drawn.listed,
            drawn.in_view,
            drawn.in_view * drawn.scattered,
            drawn.in_view * edge**2,
            *(drawn.in_view * (1 + _SPLAT * edge / tile) ** 2 for tile in _TILES),
        ]
    )
    return np.array([1.0, *(counts / 1e6)])


def error_terms(seen: ScanInView, scale: float) -> NDArray[np.float64]:
    """Terms of the squared error, each of which grows with the spacing of the points, with how rough they
    are, and as pixels are larger."""
    drawn = seen.at(scale)
    edge = 1 / np.sqrt(max(seen.covered, 1.0))
    return np.array(
        [
            1.0,
            1 / scale**2 - 1,
            edge / scale,
            edge * seen.spacing,
            *(1 - np.exp(-((drawn.spacing / opening) ** 2)) for opening in _HOLES),
            *(1 - np.exp(-((drawn.sparse / opening) ** 2)) for opening in _HOLES),
            *(_saturated(seen.spacing, bend) for bend in _BENDS),
            *(_saturated(seen.sparse, bend) for bend in _BENDS),
            *(_saturated(seen.rough, bump) for bump in _BUMPS),
        ]
    )


def _saturated(length: float, half: float) -> float:
    """The square of a length in squares of another, which grows to 1 at most."""
    return length**2 / (length**2 + half**2)


def fit(rows: Sequence[Measured]) -> Law:
    """The law of one configuration: non-negative least squares of relative differences. Needs scipy."""
    times = np.array([row.ms for row in rows])
    errors = np.maximum([row.error for row in rows], _LEAST_ERROR)
    time = _factors(np.array([time_terms(row.seen, row.scale) for row in rows]), times)
    error = _factors(np.array([error_terms(row.seen, row.scale) for row in rows]), errors**2)
    law = Law(time, error, 1.0, 0.0)
    expected = [law.expect(row.seen, row.scale) for row in rows]
    late = times / [each.ms for each in expected]
    predicted = np.maximum([each.off for each in expected], _LEAST_ERROR)
    coarse = np.array([each.coarse for each in expected])
    off = np.sqrt(np.maximum(errors**2 - coarse**2, 0))
    wrong = (off / predicted - 1) * (predicted + _SMALL)
    return Law(
        time, error, max(float(np.quantile(late, _SURE)), 1.0), max(float(np.quantile(wrong, _SURE)), 0.0)
    )


def _factors(terms: NDArray[np.float64], values: NDArray[np.float64]) -> tuple[float, ...]:
    """Factors (T,) of terms (N, T) whose sums are nearest to values (N,) above 0 by their ratio.

    The difference of two numbers in parts of their geometric mean is 2 sinh of half the logarithm of their
    ratio; sums of the round before stand in for those of the next.
    """
    from scipy.optimize import nnls

    sums = values
    for _ in range(_ROUNDS):
        weights = 1 / np.sqrt(values * np.maximum(sums, values / _APART))
        factors, _ = nnls(terms * weights[:, None], values * weights)
        sums = terms @ factors
    return tuple(float(factor) for factor in factors)
