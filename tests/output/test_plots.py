"""Plots of curves as tables, PNG and SVG, read again by others."""

from __future__ import annotations

import csv
import math
import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from missing import leave_out
from PIL import Image

from viewer.errors import InputError
from viewer.output.plots import PLOT_COLORS, CurvePlot, PlotLine

X = np.arange(50) / 25


def plot(units: tuple[str, ...] = ("mm", "°", "mm²")) -> CurvePlot:
    lines = []
    for number, unit in enumerate(units):
        values = 10.0 * (number + 1) + np.sin(5 * X + number)
        values[10:15] = np.nan
        values[[20, 22]] = np.nan  # 21 stands alone
        band = np.full(50, 0.5 if number else np.nan)
        lines.append(PlotLine(f"Öffnung {number} & mehr", unit, values, band, PLOT_COLORS[number]))
    return CurvePlot("time", "s", X, tuple(lines), np.arange(50))


def test_the_table_has_all_values_and_none_for_gaps(tmp_path: Path) -> None:
    plot().save(tmp_path / "curves.csv")
    with open(tmp_path / "curves.csv", newline="", encoding="utf-8") as stream:
        rows = list(csv.reader(stream))
    assert rows[0][:4] == ["frame", "time [s]", "Öffnung 0 & mehr [mm]", "Öffnung 1 & mehr [°]"]
    assert rows[0][4] == "Öffnung 1 & mehr ± [°]"
    assert len(rows) == 51
    assert rows[1][:2] == ["1", "0.0"]
    for row, time, value in zip(rows[1:], X, plot().lines[0].values, strict=True):
        assert float(row[1]) == pytest.approx(time)
        assert row[2] == "" if np.isnan(value) else float(row[2]) == pytest.approx(value, rel=1e-8)


def test_the_svg_has_text_and_one_line_for_each_run(tmp_path: Path) -> None:
    plot(("mm",)).save(tmp_path / "curves.svg")
    text = (tmp_path / "curves.svg").read_text(encoding="utf-8")
    root = ElementTree.fromstring(text)
    words = [part.text for part in root.iter("{http://www.w3.org/2000/svg}text")]
    assert {"mm", "time [s]", "Öffnung 0 & mehr"} <= set(words)
    (path,) = re.findall(r'<path d="([^"]*)"[^>]*style="[^"]*stroke: #3d9be0[^"]*stroke-width: 1.6', text)[:1]
    assert path.count("M") == 4, "up to the gap, the two sides of it, and the one that stands alone"
    plot(("mm",)).save(tmp_path / "again.svg")
    assert (tmp_path / "again.svg").read_text(encoding="utf-8") == text


def test_the_png_shows_every_line_and_axis(tmp_path: Path) -> None:
    plot().save(tmp_path / "curves.png")
    with Image.open(tmp_path / "curves.png") as image:
        pixels = np.array(image.convert("RGB")).reshape(-1, 3)
    for color in PLOT_COLORS[:3]:
        rgb = [color >> 16, color >> 8 & 255, color & 255]
        assert (np.abs(pixels.astype(int) - rgb).sum(axis=1) < 12).sum() > 500


def test_what_films_have_of_a_plot() -> None:
    drawn = plot(("mm",)).drawn_below()
    assert drawn is not None
    assert drawn.x_label == "time [s]"
    (curve,) = drawn.curves
    for told, value in zip(curve.values, plot(("mm",)).lines[0].values.tolist(), strict=True):
        assert told is None if math.isnan(value) else told == pytest.approx(value)
    assert replace(plot(), frames=None).drawn_below() is None


def test_lines_of_a_fourth_unit_are_in_the_table_alone() -> None:
    many = plot(("mm", "°", "mm²", "mm³"))
    assert many.units == ("mm", "°", "mm²")
    assert len(many.drawn) == 3
    assert "Öffnung 3 & mehr [mm³]" in many.rows()[0]
    assert many.lines[0].lone.tolist() == [21]


def test_without_matplotlib_tables_are_saved_and_pictures_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plot().save(tmp_path / "first.png")
    leave_out(monkeypatch, "matplotlib")
    plot().save(tmp_path / "curves.csv")
    with pytest.raises(InputError, match="-m pip install matplotlib"):
        plot().save(tmp_path / "curves.png")
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["curves.csv", "first.png"]
