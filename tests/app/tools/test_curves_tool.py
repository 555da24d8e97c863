"""What the tool of curves plots and says, of measures whose movement is known."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from viewer.analysis.measures import Quantity, Series
from viewer.analysis.measures.curves import NUMBER_COLUMNS, number_rows, numbers_file, unit_of
from viewer.analysis.words import SURE
from viewer.app.tools.plotting.choices import AGAINST, REPEATS, CurveChoices, Settings
from viewer.app.tools.plotting.lines import value_in_words
from viewer.app.tools.plotting.shown import Shown
from viewer.app.tools.plotting.words import numbers_in_words
from viewer.scan.units import Scale

TIMES = np.arange(240) / 30
PEAKS = (1.5, 4.0, 6.5)
CHOICES, SETTINGS, MM = CurveChoices(), Settings(), Scale("mm")


def series(name: str, height: float, quantity: Quantity = "length", sigma: float = 0.1) -> Series:
    values = 40 + height * sum(np.exp(-0.5 * ((TIMES - peak) / 0.3) ** 2) for peak in PEAKS)
    return Series(name, quantity, TIMES, values, np.full(240, sigma), np.full(240, 2, np.uint8))


def taken(
    *measures: Series, choices: CurveChoices = CHOICES, settings: Settings = SETTINGS, scale: Scale = MM
) -> Shown:
    shown = Shown()
    shown.take({one.name: one for one in measures}, choices, settings, scale)
    return shown


def test_values_are_told_in_the_unit_that_the_user_sees_and_by_quantity() -> None:
    shown = taken(series("a", 10), series("b", 10, "area"), series("c", 10, "angle"), scale=Scale("cm", 0.1))
    assert shown.plot is not None
    assert shown.plot.units == ("cm", "cm²", "°")
    for line, factor in zip(shown.plot.lines, (0.1, 0.01, 1), strict=True):
        assert line.values[0] == pytest.approx(40 * factor)
        assert line.band[0] == pytest.approx(SURE * 0.1 * factor)
    assert unit_of("volume", "mm") == "mm³"


def test_speed_and_acceleration_have_their_units_and_bands_can_be_left_out() -> None:
    for order, unit in (("speed", "mm/s"), ("acceleration", "mm/s²")):
        plot = taken(series("a", 10), settings=replace(SETTINGS, order=order)).plot
        assert plot is not None
        assert plot.lines[0].unit == unit
        assert abs(plot.lines[0].values[45]) < 1 if order == "speed" else plot.lines[0].values[45] < -90
    plain = taken(series("a", 10), settings=replace(SETTINGS, bands=False)).plot
    assert plain is not None
    assert plain.lines[0].edges is None


def test_what_is_hidden_is_not_plotted_and_keeps_the_colours_of_others() -> None:
    both = taken(series("a", 10), series("b", 5))
    one = taken(series("a", 10), series("b", 5), choices=CurveChoices(hidden=("a",)))
    assert [curve.name for curve in one.curves] == ["b"]
    assert one.curves[0].color == both.curves[1].color
    assert taken(series("a", 10), choices=CurveChoices(hidden=("a",))).plot is None
    assert taken().plot is None


def test_two_measures_are_plotted_against_each_other() -> None:
    choices = CurveChoices(abscissa="b")
    plot = taken(
        series("a", 10), series("b", 5), choices=choices, settings=replace(SETTINGS, mode=AGAINST)
    ).plot
    assert plot is not None
    assert (plot.x_label, plot.x_unit) == ("b", "mm")
    (line,) = plot.lines
    np.testing.assert_allclose(line.values - 40, 2 * (plot.x - 40))
    assert plot.rows()[0] == ["frame", "b [mm]", "a [mm]", "a ± [mm]"]
    assert taken(series("a", 10), settings=replace(SETTINGS, mode=AGAINST)).plot is None


def test_repeats_lie_over_one_another() -> None:
    settings = replace(SETTINGS, mode=REPEATS)
    plot = taken(series("a", 10), series("b", 5), settings=settings).plot
    assert plot is not None
    assert [line.label for line in plot.lines] == [
        "a 1",
        "a 2",
        "a 3",
        "a, mean",
        "b 1",
        "b 2",
        "b 3",
        "b, mean",
    ]
    middle = int(np.argmin(np.abs(plot.x)))
    assert plot.lines[3].values[middle] == pytest.approx(50, abs=0.1)
    assert np.nanmax(plot.lines[3].band) < 0.1
    assert plot.rows()[0][0] == "time from the peak [s]"
    flat = replace(series("a", 10), values=np.linspace(0, 1, 240))
    assert taken(flat, settings=settings).plot is None


def test_only_what_has_changed_is_found_again() -> None:
    shown, a, b = Shown(), series("a", 10), series("b", 5)
    shown.take({"a": a, "b": b}, CHOICES, SETTINGS, MM)
    plot, (curve_a, curve_b) = shown.plot, shown.curves
    shown.take({"a": a, "b": b}, CHOICES, SETTINGS, MM)
    assert shown.plot is plot
    shown.take({"a": a, "b": series("b", 6)}, CHOICES, SETTINGS, MM)
    assert shown.plot is not plot
    assert shown.curves[0] is curve_a
    assert shown.curves[1] is not curve_b
    shown.take({"a": a}, CHOICES, replace(SETTINGS, seconds=0.5), MM)
    assert shown.curves[0] is not curve_a


def test_a_scan_of_one_frame_and_one_that_nothing_is_known_of_are_plotted() -> None:
    one = Series("a", "length", np.zeros(1), np.ones(1), np.zeros(1), np.full(1, 2, np.uint8))
    nothing = Series(
        "b", "length", TIMES, np.full(240, np.nan), np.full(240, np.nan), np.zeros(240, np.uint8)
    )
    for measure in (one, nothing):
        for mode in ("time", AGAINST, REPEATS):
            for order in ("value", "speed", "acceleration"):
                shown = taken(
                    measure, replace(measure, name="c"), settings=replace(SETTINGS, mode=mode, order=order)
                )
                assert numbers_in_words(shown.curves[0])[1] == "-"
                assert number_rows(shown.curves)[0][0] == measure.name
                if shown.plot is not None:
                    is_told = measure is one and order == "value"
                    assert shown.plot.is_known == is_told, "else the window says why there is no line"


def test_numbers_are_told_with_how_sure_they_are() -> None:
    (curve,) = taken(series("a", 10, sigma=0.05)).curves
    amplitude, onset, peak, duration, fastest = numbers_in_words(curve)
    assert amplitude.startswith(("10.0", "9.9"))
    assert " ± 0." in amplitude
    assert amplitude.endswith(" mm")
    assert onset.startswith(f"{PEAKS[0] - 0.3 * math.sqrt(2 * math.log(10)):.2f} s ± 0.0")
    assert peak == "1.50 s"
    assert duration.startswith("1.29 s")
    assert fastest.endswith(" mm/s")
    (row,) = number_rows([curve])
    told = dict(zip(NUMBER_COLUMNS, row, strict=True))
    assert told["duration [s]"] == pytest.approx(0.6 * math.sqrt(2 * math.log(10)), abs=5e-3)
    assert told["fastest per s"] == pytest.approx(10 / 0.3 * math.exp(-0.5), rel=0.02)


def test_what_is_missing_is_told_with_values_and_warns_of_numbers(tmp_path: Path) -> None:
    """A frame without a value says why, one with openings how much has surface; amplitude and tables warn."""
    whole = series("lips", 10, "area")
    values, shares = whole.values.copy(), np.ones(240)
    values[100:104], shares[[30, 31]] = np.nan, 0.7
    why = "the path from r5 to r6 goes around an opening"
    lips = replace(whole, values=values, reasons=dict.fromkeys(range(100, 104), why), shares=shares)
    shown = taken(lips, replace(whole, name="other"))
    first, second = shown.curves
    assert value_in_words(lips, 100, MM) == f"- ({why})"
    assert value_in_words(lips, 30, MM).endswith(" mm² (95 %) (the surface fills 70 % of the outline)")
    assert value_in_words(whole, 30, MM).endswith("mm² (95 %)")
    assert numbers_in_words(first)[0].startswith("(!) ")
    assert not numbers_in_words(second)[0].startswith("(!)")
    assert first.warning.startswith(
        f"no value in 4 of 240 frames: {why}; the surface has openings in 2 of 240 frames"
    )
    assert shown.plot is not None
    shown.plot.save(tmp_path / "lips.csv")
    with open(tmp_path / "lips.csv", encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [rows[frame]["lips: note"] for frame in (30, 99, 100)] == [first.notes[30], "", why]
    assert rows[100]["lips [mm²]"] == ""
    assert numbers_file(tmp_path / "lips.csv") == tmp_path / "lips_numbers.csv"
    assert [row[-1] for row in number_rows(shown.curves)] == [first.warning, None]
