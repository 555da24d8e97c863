"""The curves that are plotted, made of measures over time; each is found once, until its measure changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import TypeVar

import numpy as np

from ....analysis.curves import Repeats, Smoothing
from ....analysis.measures import Series
from ....analysis.measures.curves import MeasureCurve, repeats_beside, repeats_by_peaks
from ....analysis.trajectories import Trajectory
from ....output.plots import (
    CurvePlot,
    PlotLine,
    color_of_curve,
    color_of_path,
    line_of_curve,
    line_of_path,
    plot_against,
    plot_over_time,
)
from ....scan.units import Scale
from .._cached import Cached
from .choices import AGAINST, REPEATS, TIME, CurveChoices, Settings

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Curve(MeasureCurve):
    """A measure over time as it is plotted. color: 0xRRGGBB."""

    color: int = 0


class Shown:
    """The curves that are plotted now. plot: of them, None where there is nothing to plot."""

    def __init__(self) -> None:
        self.curves: tuple[Curve, ...] = ()
        self.plot: CurvePlot | None = None
        self._cached = Cached()
        self._asked: tuple[object, ...] | None = None

    def take(
        self,
        series: Mapping[str, Series],
        choices: CurveChoices,
        settings: Settings,
        scale: Scale,
        trajectories: Mapping[str, Trajectory] = MappingProxyType({}),
    ) -> None:
        """Find what is to be plotted; the same objects as before where nothing in them has changed.

        trajectories: of landmarks, whose speed or acceleration is plotted beside that of measures.
        """
        asked = series, choices, settings, scale, trajectories
        if asked == self._asked:  # a series equals itself alone
            return
        smoothing, keys, curves = settings.smoothing, set[object](), []
        for number, (name, one) in enumerate(series.items()):
            color = color_of_curve(number)
            key = name, color, smoothing, scale
            keys.add(key)
            if name not in choices.hidden and len(one.times):
                make = partial(curve_of, one, color, scale, smoothing)
                curves.append(self._cached.of(key, (one,), make))
        self._cached.forget_others(keys)
        self._asked, self.curves, self.plot = asked, tuple(curves), plot_of(curves, choices, settings)
        if settings.mode == TIME and settings.derivative and trajectories:
            order, bands, times = settings.derivative, settings.bands, next(iter(trajectories.values())).times
            lines = [
                line_of_path(name, trajectory, scale, color_of_path(number), order, bands)
                for number, (name, trajectory) in enumerate(trajectories.items())
            ]
            before = () if self.plot is None else self.plot.lines
            self.plot = plot_over_time(times, np.arange(len(times)), (*before, *lines))


def curve_of(series: Series, color: int, scale: Scale, smoothing: Smoothing) -> Curve:
    """The curve of a measure, in the unit that lengths are shown in."""
    return replace(Curve.of(series, scale, smoothing), color=color)


def plot_of(curves: Sequence[Curve], choices: CurveChoices, settings: Settings) -> CurvePlot | None:
    """The plot of curves; None where there are too few for it, or no repeats."""
    if not curves:
        return None
    lines = [line_of_curve(curve, curve.color, settings.derivative, settings.bands) for curve in curves]
    frames = np.arange(len(curves[0].times))
    if settings.mode == REPEATS:
        repeats = repeats_in(curves, choices, settings)
        return None if repeats is None else _plot_of_repeats(curves, lines, repeats)
    if settings.mode == AGAINST:
        chosen = curves.index(chosen_of(curves, choices.abscissa))
        x = lines.pop(chosen)
        return plot_against(x, frames, lines) if lines else None
    return plot_over_time(curves[0].times, frames, lines)


def chosen_of(curves: Sequence[Curve], name: str) -> Curve:
    """The curve of a name, or the first."""
    return next((curve for curve in curves if curve.name == name), curves[0])


def repeats_in(curves: Sequence[Curve], choices: CurveChoices, settings: Settings) -> Repeats | None:
    """The repeats of the curve that others are aligned by; None where it has no peak."""
    return repeats_by_peaks(chosen_of(curves, choices.aligned), settings.least)


def _plot_of_repeats(curves: Sequence[Curve], lines: Sequence[PlotLine], aligned: Repeats) -> CurvePlot:
    """Each curve's repeats, thin, and their mean with a band of one standard deviation."""
    drawn: list[PlotLine] = []
    for curve, line in zip(curves, lines, strict=True):
        cut = repeats_beside(aligned, curve.times, line.values)
        none = np.full(len(cut.times), np.nan)
        drawn += [
            PlotLine(f"{line.label} {number}", line.unit, one, none, line.color, is_thin=True)
            for number, one in enumerate(cut.curves, 1)
        ]
        drawn.append(PlotLine(f"{line.label}, mean", line.unit, cut.mean, cut.deviation, line.color))
    return CurvePlot("time from the peak", "s", aligned.times, tuple(drawn))
