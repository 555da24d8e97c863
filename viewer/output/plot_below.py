"""The plot of measures below a picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..look import rgba
from .image_painter import ImagePainter
from .labels import Box
from .legend import number
from .marks import INK, MARGIN, PAD, PLATE
from .overlays import LINE_THICK, DrawnCurve, DrawnPlot

PLOT_HEIGHT = 0.24  # of a plot, in shares of the picture, which becomes smaller by that above it


def draw_plot(painter: ImagePainter, size: tuple[float, float], plot: DrawnPlot, pose: int) -> bool:
    """Draw a plot at the bottom of a picture, with a line at a frame; whether it has any values."""
    em, x = painter.em, _numbers(plot.x)
    curves = [(curve, _numbers(curve.values)) for curve in plot.curves if len(curve.values) == len(x)]
    curves = [(curve, values) for curve, values in curves if np.isfinite(x + values).any()]
    if not curves:
        return False
    left, right = round(MARGIN * em), round(size[0] - MARGIN * em)
    top, bottom = round((1 - PLOT_HEIGHT) * size[1]), round(size[1] - MARGIN * em)
    painter.box((left, top, right, bottom), PLATE)
    start, stop, high, low = left + PAD * em, right - PAD * em, top + 2 * em, bottom - 2 * em
    across = _scaled(x, x, start, stop)
    for curve, values in curves:
        of_unit = np.concatenate([others for other, others in curves if other.unit == curve.unit])
        places = np.stack([across, _scaled(values, of_unit, low, high)], axis=1)
        count = len(places)
        inks, none = [curve.color] * count, np.zeros(count, bool)
        painter.polyline(places, LINE_THICK * em, inks, np.ones(count), none, 0.0)
    if pose < len(across) and np.isfinite(across[pose]):
        half = max(0.5, 0.05 * em)
        painter.box((across[pose] - half, high, across[pose] + half, low), INK)
    _draw_words(painter, (start, low + 0.4 * em, stop, top + 0.45 * em), plot, curves, pose)
    return True


def _draw_words(
    painter: ImagePainter,
    room: Box,
    plot: DrawnPlot,
    curves: Sequence[tuple[DrawnCurve, NDArray[np.float64]]],
    pose: int,
) -> None:
    """Write the names of a plot's curves with their values at a frame, and its abscissa. room: from the left
    to the right; the tops of the abscissa's numbers and of the names."""
    em, (start, below, stop, above), x = painter.em, room, _numbers(plot.x)
    at = start
    for curve, values in curves:
        now = values[pose] if pose < len(values) else np.nan
        words = f"{now:.4g} {curve.unit}" if np.isfinite(now) else "-"
        text = f"{curve.name}: {words}" if curve.name else words
        if at + em + painter.width(text) > stop:
            break
        painter.box(
            (at, above + 0.15 * em, at + 0.7 * em, above + 0.85 * em), (*rgba(f"#{curve.color:06x}")[:3], 255)
        )
        painter.text(at + em, above, text)
        at += painter.width(text) + 2 * em
    least, most = float(np.nanmin(x)), float(np.nanmax(x))
    for text, share in (
        (number(least, most - least), 0.0),
        (plot.x_label, 0.5),
        (number(most, most - least), 1.0),
    ):
        painter.text(start + share * (stop - start - painter.width(text)), below, text)


def _numbers(values: Sequence[float | None]) -> NDArray[np.float64]:
    return np.array([np.nan if value is None else value for value in values])


def _scaled(
    values: NDArray[np.float64], span: NDArray[np.float64], start: float, stop: float
) -> NDArray[np.float64]:
    """Find where values are between start and stop, at which the least and the largest of a span lie."""
    least, most = np.nanmin(span), np.nanmax(span)
    return np.asarray(start + (stop - start) * (values - least) / (most - least or 1.0))
