"""Curves of measures, in the unit that they are shown in: their speed, and the numbers of movements."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...scan.units import Scale
from ..curves import Movement, Repeats, Smoothing, correlation, movement_of, peaks_of, repeats_of, smoothed
from ..words import SURE
from . import Series

_Array = NDArray[np.float64]

PER_ORDER = ("", "/s", "/s²")  # what derivatives add to a unit, by their order
NUMBER_COLUMNS = (
    "measure", "unit", "rest", "amplitude", "amplitude ±", "onset [s]", "onset ± [s]", "peak [s]",
    "end [s]", "end ± [s]", "duration [s]", "duration ± [s]", "fastest per s", "note",
)  # fmt: skip
REPEAT_COLUMNS = ("measure", "repeat", "event [s]", "time [s]", "value", "deviation", "unit")
_POWERS = {"length": 1, "area": 2, "volume": 3}
_RAISED = {1: "", 2: "²", 3: "³"}
_DIGITS = 6  # of a number in a table


def power_of(quantity: str) -> int:
    """The power of a length that a quantity is; 0 for an angle."""
    return _POWERS.get(quantity, 0)


def unit_of(quantity: str, unit: str) -> str:
    """The unit of a quantity where lengths have this one."""
    power = power_of(quantity)
    return f"{unit}{_RAISED[power]}" if power else "°"


@dataclass(frozen=True, eq=False)
class MeasureCurve:
    """A measure over time as it is shown.

    unit: of the values, such as "mm". times, values, sigmas: (T,). smoothing: with a window wide enough for
    these times. movement: the largest one, None where there is none. fastest: the largest speed to either
    side, NaN where not known. notes: frame -> what to know about its value. warning: what to know about
    the movement, "" for nothing.
    """

    name: str
    unit: str
    times: NDArray[np.float64]
    values: NDArray[np.float64]
    sigmas: NDArray[np.float64]
    smoothing: Smoothing
    movement: Movement | None
    fastest: float
    notes: Mapping[int, str] = field(default_factory=dict)
    warning: str = ""

    @classmethod
    def of(cls, series: Series, scale: Scale, smoothing: Smoothing) -> Self:
        """The curve of a measure, at least one frame, in the unit that lengths are shown in."""
        factor = scale.factor ** power_of(series.quantity)
        times, values, sigmas = series.times, factor * series.values, factor * series.sigmas
        wide = smoothing.wide_enough(times)
        speeds = np.abs(smoothed(times, values, np.zeros(len(values)), wide, 1)[0])
        fastest = float(np.nanmax(speeds)) if np.isfinite(speeds).any() else math.nan
        movement = movement_of(times, values, sigmas, wide)
        unit = unit_of(series.quantity, scale.unit)
        notes = {frame: note for frame in range(len(times)) if (note := series.note(frame))}
        return cls(series.name, unit, times, values, sigmas, wide, movement, fastest, notes, series.warning)

    def derivative(self, order: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The values as they are, 0, or the speed, 1, or acceleration, 2, of the smoothed curve, and the
        standard deviations, (T,) each, per second (squared); NaN where not known."""
        if not order:
            return self.values, self.sigmas
        values, variances = smoothed(self.times, self.values, self.sigmas**2, self.smoothing, order)
        return values, np.sqrt(variances)


def numbers_file(table: Path) -> Path:
    """The file beside a table of values that holds the numbers of their movements: NAME_numbers.csv."""
    return table.with_name(f"{table.stem}_numbers{table.suffix}")


def number_rows(curves: Sequence[MeasureCurve], against: MeasureCurve | None = None) -> list[list[object]]:
    """The numbers of the movements, a row for each curve below NUMBER_COLUMNS; None for what is not known.
    Each ± covers 95 % (see `SURE`). against: one of the curves, whose correlation with the others then is
    one more column."""
    rows: list[list[object]] = [
        [curve.name, curve.unit, *map(_rounded, _numbers(curve)), curve.warning or None] for curve in curves
    ]
    if against is None:
        return rows
    found = correlations(curves, against)
    return [
        [*row, _rounded(found.get(curve.name, math.nan))] for row, curve in zip(rows, curves, strict=True)
    ]


def correlations(curves: Iterable[MeasureCurve], against: MeasureCurve) -> dict[str, float]:
    """How the values of each curve go with those of one among them: name of each other -> Pearson's
    correlation, NaN where not known."""
    return {curve.name: correlation(against.values, curve.values) for curve in curves if curve is not against}


def repeats_by_peaks(curve: MeasureCurve, least: float) -> Repeats | None:
    """The pieces of a curve around its peaks over one another; None where it has no peak. least: as of
    `peaks_of`."""
    events = peaks_of(curve.times, curve.values, curve.smoothing, least)
    return repeats_of(curve.times, curve.values, events) if len(events) else None


def repeats_beside(aligned: Repeats, times: _Array, values: _Array) -> Repeats:
    """Other values, (T,) at times (T,), cut around the events of repeats, as long as these."""
    before, after = -float(aligned.times[0]), float(aligned.times[-1])
    return repeats_of(times, values, aligned.events, before, after)


def repeat_rows(curves: Iterable[MeasureCurve], aligned: Repeats, order: int = 0) -> list[list[object]]:
    """The repeats of curves over one another, below REPEAT_COLUMNS: a row for each curve, repeat and time,
    then such for their mean, whose `repeat` is "mean" and which have a standard deviation. aligned: whose
    events they are cut around. order: of the derivative. None for what is not known."""
    rows: list[list[object]] = []
    for curve in curves:
        cut = repeats_beside(aligned, curve.times, curve.derivative(order)[0])
        unit, none = curve.unit + PER_ORDER[order], np.full(len(cut.times), np.nan)
        pieces = [
            (number, event, piece, none)
            for number, (event, piece) in enumerate(zip(cut.events.tolist(), cut.curves, strict=True), 1)
        ]
        for repeat, event, values, deviations in (*pieces, ("mean", np.nan, cut.mean, cut.deviation)):
            rows += [
                [curve.name, repeat, _rounded(event), *map(_rounded, numbers), unit]
                for numbers in zip(cut.times.tolist(), values.tolist(), deviations.tolist(), strict=True)
            ]
    return rows


def _numbers(curve: MeasureCurve) -> list[float]:
    one = curve.movement
    if one is None:
        return [*(math.nan,) * (len(NUMBER_COLUMNS) - 4), curve.fastest]
    return [
        one.rest, one.amplitude, SURE * one.amplitude_sigma, one.onset, SURE * one.onset_sigma, one.peak,
        one.end, SURE * one.end_sigma, one.duration, SURE * one.duration_sigma, curve.fastest,
    ]  # fmt: skip


def _rounded(number: float) -> float | None:
    return float(f"{number:.{_DIGITS}g}") if math.isfinite(number) else None
