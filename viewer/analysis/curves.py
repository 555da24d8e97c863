"""Curves of values over time: smoothed, their speed and acceleration, movements and repeats in them.

Values are NaN where they are not known. Nothing is smoothed, interpolated or searched across such a gap: each
run of frames that follow one another without one is a curve of its own.

Savitzky and Golay's filter (1964), for times that need not be evenly spaced: in a window around each time a
polynomial is fitted by least squares, and its value or derivative there is the result. At the ends of a run
the window is that of the frame half a window from the end, and the polynomial is read off its middle (scipy's
mode 'interp'). Errors
are taken as independent from frame to frame and go through as the fit is linear: var = sum of c_j^2 var_j.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]

ORDERS = ("value", "speed", "acceleration")  # by how often a curve is differentiated
_EDGE = 1e-9  # relative: a point at the very edge of the window is in it, whatever rounding says
_ALIKE = 1e-9  # relative: peaks that rounding alone tells apart
_CERTAIN = 2.0  # standard deviations, from which on an amplitude stands out of noise
_AT_FRAME = 1e-6  # of the time from one frame to the next
_SAME = 1e-12  # relative to values: an amplitude that rounding makes


@dataclass(frozen=True)
class Smoothing:
    """How curves are smoothed. seconds: width of the window. degree: of the polynomial that is fitted in it.

    Evenly spaced, it lets frequencies pass up to about (degree + 1) / (3.2 m - 4.6) of half the rate, where
    2 m + 1 points are in the window (Schafer 2011, "What is a Savitzky-Golay filter?"): by default 7 Hz at 30
    frames a second.
    """

    seconds: float = 0.3
    degree: int = 3

    def points(self, times: _Array) -> int:
        """How many points of evenly spaced times are in the window."""
        return 1 + 2 * math.floor(self.seconds / 2 / _step(times) * (1 + _EDGE))

    def wide_enough(self, times: _Array) -> Smoothing:
        """This smoothing, or one with the least window that holds points enough for its polynomial."""
        least = 2 * math.ceil(self.degree / 2) * _step(times)
        return Smoothing(max(self.seconds, least), self.degree)


def smoothed(
    times: _Array, values: _Array, variances: _Array, smoothing: Smoothing, order: int = 0
) -> tuple[_Array, _Array]:
    """Values, or their derivatives, of the smoothed curve, and their variances.

    times: (T,) seconds, ascending. values: (T,), or (T, K) of vectors, NaN where not known. variances: (T,),
    or (T, K, K) covariances. order: 0 the values, 1 the speed, 2 the acceleration. NaN where values are not
    known, and where fewer of its run are in the window than the polynomial has coefficients.
    """
    found, spread = np.full(values.shape, np.nan), np.full(variances.shape, np.nan)
    known = np.isfinite(values.reshape(len(values), -1))
    for start, stop in runs(np.logical_and.reduce(known, axis=1)):
        rows, weights = _fit(np.ascontiguousarray(times[start:stop]).tobytes(), smoothing, order)
        found[start:stop] = np.einsum("tw,tw...->t...", weights, values[start:stop][rows])
        spread[start:stop] = np.einsum("tw,tw...->t...", weights**2, variances[start:stop][rows])
    return found, spread


@lru_cache(maxsize=16)  # curves of a scan share their times
def _fit(run: bytes, smoothing: Smoothing, order: int) -> tuple[NDArray[np.intp], _Array]:
    """Find for each time of a run the points in its window, (T, W), and weights that give the derivative of
    the polynomial through them, (T, W), NaN where there are too few. run: the times, (T,) float64."""
    if order > smoothing.degree:
        raise ValueError(
            f"smoothing with a polynomial of degree {smoothing.degree} gives no derivative of order {order}"
        )
    times = np.frombuffer(run)
    half, count = smoothing.seconds / 2, len(times)
    reach = half * (1 + _EDGE) + _EDGE * _step(times)
    if times[-1] - times[0] > 2 * half:
        low = times[np.searchsorted(times, times[0] + reach, "right") - 1]
        high = times[np.searchsorted(times, times[-1] - reach, "left")]
        middles = np.clip(times, min(low, high), max(low, high))
    else:  # all of the run
        middles = np.full(count, (times[0] + times[-1]) / 2)
    first = np.searchsorted(times, middles - reach, "left")
    behind = np.searchsorted(times, middles + reach, "right")
    rows = first[:, None] + np.arange((behind - first).max())
    is_in = rows < behind[:, None]
    rows = np.minimum(rows, count - 1)
    scale = min(half, float(times[-1] - times[0])) or 1.0
    offsets = (times[rows] - times[:, None]) / scale
    powers = offsets[..., None] ** np.arange(smoothing.degree + 1) * is_in[..., None]
    weights = np.linalg.pinv(powers)[:, order].astype(np.float64) * (math.factorial(order) / scale**order)
    weights[is_in.sum(axis=1) <= smoothing.degree] = np.nan
    return rows, weights


def runs(known: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """The runs of True: (first, behind the last) of each."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], known.astype(np.int8), [0]])))
    return [(int(start), int(stop)) for start, stop in edges.reshape(-1, 2)]


def _step(times: _Array) -> float:
    """The usual time from one frame to the next, seconds; 1 where there is but one."""
    return float(np.median(np.diff(times))) if len(times) > 1 else 1.0


# --- a movement -----------------------------------------------------------------------


@dataclass(frozen=True)
class Movement:
    """The largest movement of a curve. Times are in seconds; what is not known is NaN.

    rest: the mean of the values in the first window's width of the smoothing. peak: where the smoothed curve
    is farthest from rest, above or below. amplitude: from rest to peak, negative where it goes down. onset:
    before the peak, where the smoothed curve last was within the share of the amplitude from rest; end: after
    it, where it first is again. Where a gap or the end of the scan is met before, or the amplitude is within
    two standard deviations, they are not known.
    duration: from onset to end. The sigmas are standard deviations: of times, that of the value over the
    slope.
    """

    rest: float
    amplitude: float
    amplitude_sigma: float
    peak: float
    onset: float
    onset_sigma: float
    end: float
    end_sigma: float

    @property
    def duration(self) -> float:
        """The time from onset to end, seconds."""
        return self.end - self.onset

    @property
    def duration_sigma(self) -> float:
        """The standard deviation of the duration, seconds."""
        return math.hypot(self.onset_sigma, self.end_sigma)


def movement_of(
    times: _Array, values: _Array, sigmas: _Array, smoothing: Smoothing, share: float = 0.1
) -> Movement | None:
    """The largest movement of a curve; None where its smoothed values are nowhere known, or all the same.

    times, values, sigmas: (T,); values NaN in gaps, sigmas NaN where not known. share: of the amplitude.
    """
    variances = sigmas**2
    curve, spread = smoothed(times, values, variances, smoothing)
    known = np.flatnonzero(np.isfinite(curve))
    if not len(known):
        return None
    at_rest = (
        np.isfinite(values) & (times - times[known[0]] <= smoothing.seconds) & (times >= times[known[0]])
    )
    rest = float(values[at_rest].mean())
    rest_variance = float(variances[at_rest].sum()) / int(at_rest.sum()) ** 2
    away = np.abs(curve[known] - rest)
    top = known[np.argmax(away >= (1 - _ALIKE) * away.max())]  # the first of several
    peak, height = _vertex(times, curve, int(top))
    amplitude = height - rest
    if abs(amplitude) <= _SAME * max(abs(height), abs(rest)):
        return None
    sigma = math.sqrt(spread[top] + rest_variance)
    if abs(amplitude) <= _CERTAIN * sigma:
        unknown = math.nan
        return Movement(rest, amplitude, sigma, peak, unknown, unknown, unknown, unknown)
    relative = (curve - rest) / amplitude
    slopes = smoothed(times, values, variances, smoothing, 1)[0]
    onset, onset_sigma = _crossing(times, relative, slopes, spread, int(top), -1, share)
    end, end_sigma = _crossing(times, relative, slopes, spread, int(top), 1, share)
    return Movement(rest, amplitude, sigma, peak, onset, onset_sigma, end, end_sigma)


def _vertex(times: _Array, curve: _Array, top: int) -> tuple[float, float]:
    """Time and value of the vertex of the parabola through a point and its neighbours; those of the point
    where one of them is not known, or the point is no extreme."""
    near = slice(top - 1, top + 2)
    if not 0 < top < len(curve) - 1 or not np.isfinite(curve[near]).all():
        return float(times[top]), float(curve[top])
    before, after = times[top] - times[top - 1], times[top + 1] - times[top]
    left, right = (curve[top] - curve[top - 1]) / before, (curve[top + 1] - curve[top]) / after
    bend = (right - left) / (before + after)
    if bend == 0 or left * right > 0:
        return float(times[top]), float(curve[top])
    slope = left + bend * before
    moved = -slope / (2 * bend)
    return float(times[top] + moved), float(curve[top] + moved * (slope + bend * moved))


def _crossing(
    times: _Array, relative: _Array, slopes: _Array, spread: _Array, top: int, step: int, share: float
) -> tuple[float, float]:
    """Time at which a curve, going from its peak by steps of a frame, comes down to a share of that, and its
    standard deviation; NaN where it is not known before."""
    way = relative[top:] if step > 0 else relative[top::-1]
    stops = np.flatnonzero(~(way > share))  # NaN as well
    if not len(stops) or not np.isfinite(way[stops[0]]) or stops[0] == 0:
        return math.nan, math.nan
    low, high = top + step * int(stops[0]), top + step * (int(stops[0]) - 1)
    part = (share - relative[low]) / (relative[high] - relative[low])
    time, slope, variance = ((1 - part) * of[low] + part * of[high] for of in (times, slopes, spread))
    return float(time), math.sqrt(variance) / abs(slope) if slope else math.nan


# --- repeats --------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Repeats:
    """Repeats of a movement, one over the other. times: (G,) seconds from each one's event. events: (R,) when
    they were, seconds. curves: (R, G), NaN where not known."""

    times: _Array
    events: _Array
    curves: _Array

    @property
    def mean(self) -> _Array:
        """(G,) the mean of those that are known at each time."""
        counts = np.isfinite(self.curves).sum(axis=0)
        return np.where(counts > 0, np.nansum(self.curves, axis=0) / np.maximum(counts, 1), np.nan)

    @property
    def deviation(self) -> _Array:
        """(G,) their standard deviation about the mean (by n - 1); NaN of fewer than two."""
        counts = np.isfinite(self.curves).sum(axis=0)
        squares = np.nansum((self.curves - self.mean) ** 2, axis=0)
        return np.where(counts > 1, np.sqrt(squares / np.maximum(counts - 1, 1)), np.nan)


def peaks_of(times: _Array, values: _Array, smoothing: Smoothing, least: float = 0.5) -> _Array:
    """Times of the peaks of a curve, (R,); of its lowest points where its largest movement goes down.

    A peak is where the smoothed curve is higher than in both frames beside it, and stands out by a share
    `least` of the curve's whole range: that far it goes down on either side before it rises above the peak
    (prominence, as in topography). values: (T,), NaN in gaps, beside which there is no peak.
    """
    curve = smoothed(times, values, np.zeros(len(values)), smoothing)[0]
    movement = movement_of(times, values, np.zeros(len(values)), smoothing)
    if movement is None:
        return np.zeros(0)
    if movement.amplitude < 0:
        curve = -curve
    wanted = least * float(np.nanmax(curve) - np.nanmin(curve))
    with np.errstate(invalid="ignore"):
        tops = 1 + np.flatnonzero((curve[1:-1] > curve[:-2]) & (curve[1:-1] >= curve[2:]))
    found = [top for top in tops if _prominence(curve, int(top)) >= wanted]
    return np.array([_vertex(times, curve, int(top))[0] for top in found])


def _prominence(curve: _Array, top: int) -> float:
    """How far a curve goes down on either side of a peak before it is higher; NaN counts as not there."""
    height, lows = curve[top], []
    for side in (curve[top::-1], curve[top:]):
        higher = np.flatnonzero(side > height)
        lows.append(np.nanmin(side[: higher[0] if len(higher) else None]))
    return float(height - max(lows))


def repeats_of(
    times: _Array, values: _Array, events: _Array, before: float | None = None, after: float | None = None
) -> Repeats:
    """Cut a curve around events and lay the pieces over one another. Raises ValueError without an event.

    times, values: (T,). events: (R,) seconds, such as `peaks_of`. before, after: seconds around each; None:
    half of the least time from one event to the next, or all where there is one. Values between frames are
    interpolated linearly, and not known where one of the two frames is not.
    """
    if not len(events):
        raise ValueError("the curve has no peak by which to align the repeats")
    apart = float(np.diff(np.sort(events)).min()) / 2 if len(events) > 1 else float(times[-1] - times[0])
    before, after, step = before or apart, after or apart, _step(times)
    steps = range(-_steps_in(before / step), _steps_in(after / step) + 1)
    offsets = np.array(steps, np.float64) * step
    return Repeats(offsets, events, np.array([_between(times, values, event + offsets) for event in events]))


def _steps_in(steps: float) -> int:
    """How many whole steps there are, whatever rounding says."""
    return math.floor(steps + _AT_FRAME)


def _between(times: _Array, values: _Array, wanted: _Array) -> _Array:
    """Values between frames, NaN outside and where one of the two frames beside is not known."""
    after = np.clip(np.searchsorted(times, wanted), 1, len(times) - 1)
    part = (wanted - times[after - 1]) / (times[after] - times[after - 1])
    mixed = values[after - 1] * (1 - part) + values[after] * part
    for whole, of in ((0, after - 1), (1, after)):  # at a frame the other one does not matter
        mixed = np.where(np.abs(part - whole) < _AT_FRAME, values[of], mixed)
    return np.where((part > -_AT_FRAME) & (part < 1 + _AT_FRAME), mixed, np.nan)


def correlation(one: _Array, other: _Array) -> float:
    """Pearson's correlation of two curves over the frames that know both; NaN of fewer than three, or where
    one does not change."""
    known = np.isfinite(one) & np.isfinite(other)
    if known.sum() < 3:
        return math.nan
    x, y = (values[known] - values[known].mean() for values in (one, other))
    length = math.sqrt(float(x @ x) * float(y @ y))
    return float(x @ y) / length if length else math.nan
