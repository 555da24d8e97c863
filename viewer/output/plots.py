"""Curves as they are plotted, whether in the window or in a file: PNG, SVG, or a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..analysis.measures.curves import PER_ORDER, MeasureCurve
from ..analysis.trajectories import Trajectory
from ..analysis.words import SURE
from ..csv_text import save_rows
from ..files import whole_file
from ..imports import require
from ..scan.units import Scale
from .overlays import BAND_OPACITY, DrawnCurve, DrawnPlot

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Seen on light and on dark, and distinct with colour-blindness: of Okabe and Ito (2008), and lighter ones.
PLOT_COLORS = (
    0x3D9BE0, 0xE69F00, 0x1FA783, 0xD55E00, 0xCC79A7, 0x8C7AE6, 0xB59F00, 0x56B4E9, 0xE06C75, 0x7F8C9A,
)  # fmt: skip
PLOT_SUFFIXES = (".csv", ".png", ".svg")
_STYLE: Any = {
    "svg.fonttype": "none", "svg.hashsalt": "scan4d", "axes.spines.top": False, "axes.grid": True,
    "grid.alpha": 0.3, "text.parse_math": False,
}  # fmt: skip
_INCHES, _DPI = (8.0, 4.5), 200
_MOST_UNITS = 3
_APART = 55.0  # points between axes at the right
_DIGITS = 9  # of a number in a table


@dataclass(frozen=True, eq=False)
class PlotLine:
    """A line of a plot. label: its name. unit: of its values, which says whose axis it goes by. values: (N,),
    NaN where not known. band: (N,) how far to either side it is filled, NaN for not at all. color: 0xRRGGBB.
    is_thin: whether it is one of many that stand behind another. notes: by number of the value, what to know
    about it."""

    label: str
    unit: str
    values: NDArray[np.float64]
    band: NDArray[np.float64]
    color: int
    is_thin: bool = False
    notes: Mapping[int, str] = field(default_factory=dict)

    @cached_property
    def lone(self) -> NDArray[np.intp]:
        """The values that stand by themselves between gaps, where no line can show them."""
        there = np.concatenate([[False], np.isfinite(self.values), [False]])
        return np.flatnonzero(there[1:-1] & ~there[:-2] & ~there[2:])

    @cached_property
    def edges(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """The lower and the upper edge of the band, (N,) each; None where it is filled nowhere."""
        low, high = self.values - self.band, self.values + self.band
        return (low, high) if np.isfinite(low).any() else None


@dataclass(frozen=True, eq=False)
class CurvePlot:
    """Lines over one abscissa. x_label: its name. x_unit: its unit. x: (N,). lines: all (N,). frames: (N,)
    from 0, where each x is of a frame, which the table then tells; None where they are not."""

    x_label: str
    x_unit: str
    x: NDArray[np.float64]
    lines: tuple[PlotLine, ...]
    frames: NDArray[np.intp] | None = None

    @property
    def units(self) -> tuple[str, ...]:
        """The units of the axes: of the lines, in their order, as many as axes are drawn."""
        return tuple(dict.fromkeys(line.unit for line in self.lines))[:_MOST_UNITS]

    @property
    def drawn(self) -> tuple[PlotLine, ...]:
        """The lines for whose unit there is an axis."""
        return tuple(line for line in self.lines if line.unit in self.units)

    @property
    def is_known(self) -> bool:
        """Whether any line has a value."""
        return any(np.isfinite(line.values).any() for line in self.lines)

    def drawn_below(self) -> DrawnPlot | None:
        """Find the plot that saved pictures and films have; None where its abscissa is not known by frame."""
        if self.frames is None:
            return None
        curves = (
            DrawnCurve(
                line.label, line.unit, line.color, _rounded(line.values),
                () if line.edges is None else _rounded(line.band),
            )
            for line in self.drawn if not line.is_thin
        )  # fmt: skip
        return DrawnPlot(f"{self.x_label} [{self.x_unit}]", _rounded(self.x), tuple(curves))

    def rows(self) -> list[list[object]]:
        """A table: a row for each x, a column for each line, and for its band and its notes where it has
        some. Cells are empty where a value is not known; frames count from 1."""
        head: list[object] = [] if self.frames is None else ["frame"]
        head.append(f"{self.x_label} [{self.x_unit}]")
        columns: list[Sequence[object]] = [] if self.frames is None else [(self.frames + 1).tolist()]
        columns.append(_cells(self.x))
        for line in self.lines:
            head.append(f"{line.label} [{line.unit}]")
            columns.append(_cells(line.values))
            if line.edges is not None:
                head.append(f"{line.label} ± [{line.unit}]")
                columns.append(_cells(line.band))
            if line.notes:
                head.append(f"{line.label}: note")
                columns.append([line.notes.get(row, "") for row in range(len(self.x))])
        return [head, *(list(row) for row in zip(*columns, strict=True))]

    def save(self, path: Path) -> None:
        """Write a table, PNG or SVG by the file's suffix, in one step.

        Raises InputError where it cannot be written, or a picture is wanted and matplotlib is not there.
        """
        if path.suffix.lower() == ".csv":
            save_rows(path, self.rows())
        else:
            self._save_picture(path)

    def _save_picture(self, path: Path) -> None:
        check_plot(path)
        import matplotlib
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        with matplotlib.rc_context(_STYLE), whole_file(path) as temporary:
            figure = Figure(_INCHES, layout="constrained")
            FigureCanvasAgg(figure)
            self._draw(figure)
            suffix = path.suffix.lower().removeprefix(".")
            figure.savefig(
                temporary, format=suffix, dpi=_DPI, metadata={"Date": None} if suffix == "svg" else None
            )

    def _draw(self, figure: Figure) -> None:
        """The lines on axes, of which those of the second and third unit stand at the right."""
        axes = figure.subplots()
        of_unit = {unit: axes if not number else axes.twinx() for number, unit in enumerate(self.units)}
        for number, (unit, own) in enumerate(of_unit.items()):
            own.set_ylabel(unit)
            if number:
                own.spines["right"].set_visible(True)
                own.spines["right"].set_position(("outward", _APART * (number - 1)))
                own.grid(visible=False)
        axes.set_xlabel(f"{self.x_label} [{self.x_unit}]")
        handles = []
        for line in self.drawn:
            own, color = of_unit[line.unit], f"#{line.color:06x}"
            if line.edges is not None:
                own.fill_between(self.x, *line.edges, color=color, alpha=BAND_OPACITY, linewidth=0)
            style: dict[str, Any] = {"linewidth": 0.7, "alpha": 0.5} if line.is_thin else {"linewidth": 1.6}
            handles += own.plot(self.x, line.values, color=color, label=line.label, **style)
            own.plot(self.x[line.lone], line.values[line.lone], ".", color=color)
        named = [handle for handle, line in zip(handles, self.drawn, strict=True) if not line.is_thin]
        if named:
            axes.legend(handles=named, frameon=False, fontsize="small", loc="best")


def check_plot(path: Path) -> None:
    """Raise MissingPackageError where a picture is wanted, by the suffix, and matplotlib is missing."""
    if path.suffix.lower() != ".csv":
        require("matplotlib")


def color_of_curve(number: int) -> int:
    """The colour of a measure by its number among all, 0xRRGGBB."""
    return PLOT_COLORS[number % len(PLOT_COLORS)]


def color_of_path(number: int) -> int:
    """The colour of a landmark by its number among those whose trajectories are shown, 0xRRGGBB."""
    return PLOT_COLORS[-1 - number % len(PLOT_COLORS)]


def line_of_curve(curve: MeasureCurve, color: int, order: int, has_band: bool = True) -> PlotLine:
    """The line of a measure: its values, 0, speed, 1, or acceleration, 2, with its ±."""
    values, sigmas = curve.derivative(order)
    unit, band = curve.unit + PER_ORDER[order], _band(sigmas, has_band)
    return PlotLine(curve.name, unit, values, band, color, notes=curve.notes)


def line_of_path(
    name: str, trajectory: Trajectory, scale: Scale, color: int, order: int, has_band: bool = True
) -> PlotLine:
    """The line of a landmark's speed, 1, or acceleration, 2, with its ±."""
    values, sigmas = (scale.factor * part for part in trajectory.pace(order))
    return PlotLine(name, scale.unit + PER_ORDER[order], values, _band(sigmas, has_band), color)


def plot_over_time(
    times: NDArray[np.float64], frames: NDArray[np.intp], lines: Sequence[PlotLine]
) -> CurvePlot:
    """Lines over the times of frames, (T,) seconds each of a frame, (T,) from 0."""
    return CurvePlot("time", "s", times, tuple(lines), frames)


def plot_against(x: PlotLine, frames: NDArray[np.intp], lines: Sequence[PlotLine]) -> CurvePlot:
    """Lines over the values of another one, in frames (T,) from 0."""
    return CurvePlot(x.label, x.unit, x.values, tuple(lines), frames)


def _band(sigmas: NDArray[np.float64], has_band: bool) -> NDArray[np.float64]:
    return SURE * sigmas if has_band else np.full(len(sigmas), np.nan)


def _rounded(values: NDArray[np.float64]) -> tuple[float | None, ...]:
    return tuple(float(f"{v:.{_DIGITS}g}") if np.isfinite(v) else None for v in values.tolist())


def _cells(values: NDArray[np.float64]) -> list[object]:
    return ["" if np.isnan(value) else float(f"{value:.{_DIGITS}g}") for value in values]
