"""The plot of measures below a picture: axes with values and units, bands, a legend."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..analysis.words import SURE, with_uncertainty
from ..look import rgba
from .image_painter import ImagePainter
from .labels import Box
from .legend import round_length
from .marks import INK, MARGIN, PAD, PLATE, fitted_text
from .overlays import BAND_OPACITY, LINE_THICK, DrawnCurve, DrawnPlot

PLOT_HEIGHT = 0.3  # of a plot, in shares of the picture, which becomes smaller by that above it
_GRID = (*INK[:3], 45)
_SPREAD = 0.04  # of the span of values, that an axis goes beyond them

# In heights of the text:
_ROW, _GAP, _TICK = 1.3, 0.4, 0.3
_NOW_THICK = 0.1  # of the line at the frame
_APART = 1.7, 2.5  # values on an axis upward, at least; to the right, between their texts
_MOST_ROWS, _LEAST = 3, 3.0  # of the legend; height that it leaves to the curves at least


class _Axis(NamedTuple):
    """An axis. low, high: values at its ends. values: at which a text stands, increasing. unit: of them."""

    low: float
    high: float
    values: list[float]
    unit: str

    def at(self, values: NDArray[np.float64], start: float, stop: float) -> NDArray[np.float64]:
        """Find where values are between start and stop, pixels."""
        return np.asarray(start + (stop - start) * (values - self.low) / (self.high - self.low))

    @property
    def texts(self) -> list[str]:
        """The texts of its values, with as many decimals as their step has."""
        step = self.values[1] - self.values[0] if len(self.values) > 1 else self.high - self.low
        decimals = max(-math.floor(math.log10(step) + 1e-9), 0)
        is_plain = decimals <= 4 and max(map(abs, self.values), default=0.0) < 1e6
        return [f"{value + 0.0:.{decimals}f}" if is_plain else f"{value:.6g}" for value in self.values]


@dataclass(frozen=True, eq=False)
class _Line:
    """A curve with its numbers. values, band: (N,), NaN where not known."""

    curve: DrawnCurve
    values: NDArray[np.float64]
    band: NDArray[np.float64]


def draw_plot(painter: ImagePainter, size: tuple[float, float], plot: DrawnPlot, pose: int) -> bool:
    """Draw a plot at the bottom of a picture, with a line at a frame; whether it has any values."""
    em, x = painter.em, _numbers(plot.x)
    lines = [
        _Line(curve, _numbers(curve.values), _numbers(curve.band or (None,) * len(x)))
        for curve in plot.curves if len(curve.values) == len(x)
    ]  # fmt: skip
    lines = [line for line in lines if np.isfinite(x + line.values).any()]
    if not lines:
        return False
    left, right = round(MARGIN * em), round(size[0] - MARGIN * em)
    top, bottom = round((1 - PLOT_HEIGHT) * size[1]), round(size[1] - MARGIN * em)
    painter.box((left, top, right, bottom), PLATE)
    inner = room = left + PAD * em, top + _GAP * em, right - PAD * em, bottom - _GAP * em
    low, high = room[3] - 2 * _ROW * em, room[1] + _ROW * em
    rows = min(int((low - high - _LEAST * em) / (_ROW * em)), _MOST_ROWS)  # of the legend
    if rows > 0:
        high = _draw_legend(painter, room, lines, pose, rows) + _ROW * em
    most = max(int((low - high) / (_APART[0] * em)), 2)
    axes = [_axis_of(lines, unit, most) for unit in dict.fromkeys(line.curve.unit for line in lines)]
    if rows >= 0:  # else the picture is too small for words
        inner = _draw_axes(painter, (room[0], high, room[2], low), axes)
        _draw_abscissa(painter, inner, plot.x_label, x)
    across = _abscissa(x).at(x, inner[0], inner[2])
    for line in lines:
        axis = next(axis for axis in axes if axis.unit == line.curve.unit)
        _draw_line(painter, inner, across, line, axis)
    if pose < len(across) and np.isfinite(across[pose]):
        half = max(0.5, 0.5 * _NOW_THICK * em)
        painter.box((across[pose] - half, inner[1], across[pose] + half, inner[3]), INK)
    return True


def _draw_legend(
    painter: ImagePainter, room: Box, lines: Sequence[_Line], pose: int, most_rows: int
) -> float:
    """Write the names of curves with their values at a frame; returns where what is below begins."""
    em, (left, at_top, stop, _) = painter.em, room
    at, row = left, 0
    for number, line in enumerate(lines):
        curve, now = line.curve, line.values[pose] if pose < len(line.values) else np.nan
        band = line.band[pose] if pose < len(line.band) else np.nan
        words = with_uncertainty(float(now), float(band) / SURE, curve.unit)
        text = fitted_text(painter, f"{curve.name}: {words}" if curve.name else words, stop - left - em)
        is_last = row == most_rows - 1 and number < len(lines) - 1
        more = f"and {len(lines) - number} more"
        if at > left and at + em + painter.width(text) + is_last * painter.width(more) > stop:
            if row == most_rows - 1:
                painter.text(at, at_top + row * _ROW * em, more)
                break
            at, row = left, row + 1
        above = at_top + row * _ROW * em
        ink = (*rgba(f"#{curve.color:06x}")[:3], 255)
        painter.box((at, above + 0.15 * em, at + 0.7 * em, above + 0.85 * em), ink)
        painter.text(at + em, above, text)
        at += painter.width(text) + 2 * em
    return at_top + (row + 1) * _ROW * em


def _draw_axes(painter: ImagePainter, room: Box, axes: Sequence[_Axis]) -> Box:
    """Draw the axes of the units, the first at the left, others at the right, each below its unit; returns
    where the curves are. room: between legend and abscissa."""
    em, (left, high, right, low) = painter.em, room
    for number, axis in enumerate(axes):
        texts = axis.texts
        width = max(map(painter.width, (*texts, axis.unit)))
        x = left + width + _GAP * em if number == 0 else right - width - _GAP * em
        title = x - _GAP * em - painter.width(axis.unit) if number == 0 else x + _GAP * em
        painter.text(title, high - _ROW * em - 0.2 * em, axis.unit)
        for value, text in zip(axis.at(np.array(axis.values), low, high).tolist(), texts, strict=True):
            at = x - _GAP * em - painter.width(text) if number == 0 else x + _GAP * em
            painter.text(at, value - 0.5 * em, text)
        left, right = (x, right) if number == 0 else (left, x - _GAP * em * (number < len(axes) - 1))
    for value in axes[0].at(np.array(axes[0].values), low, high).tolist():
        painter.box((left, round(value), right, round(value) + 1), _GRID)
    return left, high, right, low


def _draw_abscissa(painter: ImagePainter, inner: Box, label: str, x: NDArray[np.float64]) -> None:
    """Draw the axis below the curves, with its name and unit."""
    em, (left, high, right, low) = painter.em, inner
    axis = _abscissa(x)
    for most in (10, 5, 2):
        axis = _abscissa(x, most)
        if sum(painter.width(text) + _APART[1] * em for text in axis.texts) < right - left:
            break
    painter.box((left, low, right, low + 1), INK)
    places = axis.at(np.array(axis.values), left, right).tolist()
    for place, text in zip(places, axis.texts, strict=True):
        painter.box((round(place), high, round(place) + 1, low), _GRID)
        painter.box((round(place), low, round(place) + 1, low + _TICK * em), INK)
        at = min(max(place - painter.width(text) / 2, left - em), right + em - painter.width(text))
        painter.text(at, low + _TICK * em, text)
    label = fitted_text(painter, label, right - left)
    painter.text((left + right - painter.width(label)) / 2, low + (_TICK + _ROW) * em, label)


def _draw_line(
    painter: ImagePainter, inner: Box, across: NDArray[np.float64], line: _Line, axis: _Axis
) -> None:
    """Draw a curve in its band; values without neighbours as dots. across: (N,), where its values are."""
    em, (_, high, _, low), count = painter.em, inner, len(across)
    edges = [axis.at(line.values + side * line.band, low, high) for side in (-1, 1)]
    painter.band(np.stack([across, *edges], axis=1), line.curve.color, BAND_OPACITY)
    places = np.stack([across, axis.at(line.values, low, high)], axis=1)
    there = np.concatenate([[False], np.isfinite(places).all(axis=1), [False]])
    lone = there[1:-1] & ~there[:-2] & ~there[2:]
    inks = [line.curve.color] * count
    painter.polyline(places, LINE_THICK * em, inks, np.ones(count), lone, 3 * LINE_THICK * em)


def _axis_of(lines: Sequence[_Line], unit: str, most: int) -> _Axis:
    """The axis of the curves of a unit with their bands. most: values on it, at most."""
    own = [line for line in lines if line.curve.unit == unit]
    spans = [line.values + side * np.nan_to_num(line.band) for line in own for side in (-1, 1)]
    low, high = float(np.nanmin(spans)), float(np.nanmax(spans))
    more = _SPREAD * (high - low) or 0.5 * abs(high) or 0.5
    return _Axis(low - more, high + more, round_values(low - more, high + more, most), unit)


def _abscissa(x: NDArray[np.float64], most: int = 2) -> _Axis:
    low, high = float(np.nanmin(x)), float(np.nanmax(x))
    high = high if high > low else low + 1.0
    return _Axis(low, high, round_values(low, high, most), "")


def round_values(low: float, high: float, most: int) -> list[float]:
    """The multiples of 1, 2 or 5 times a power of ten from low to high, which is more: as many as there are
    up to `most`, which is at least 2."""
    step = round_length((high - low) / most)
    for factor in (1, 2, 2.5, 5, 10):
        first, last = math.ceil(low / (step * factor) - 1e-9), math.floor(high / (step * factor) + 1e-9)
        if last - first < most and is_round(step * factor):
            return [number * step * factor for number in range(first, last + 1)]
    return []


def is_round(value: float) -> bool:
    """Whether a positive number is 1, 2 or 5 times a power of ten."""
    return math.isclose(round_length(value * (1 + 1e-9)), value, rel_tol=1e-6)


def _numbers(values: Sequence[float | None]) -> NDArray[np.float64]:
    return np.array([np.nan if value is None else value for value in values], float)
