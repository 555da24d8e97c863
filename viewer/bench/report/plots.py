"""Plots of benchmark rows: time against error, against points and noise, and by passes.

Each function gives a figure, which `svg` puts into a page and `png` into a file.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...files import whole_file
from ..baselines import CEILING, FLOOR
from .results import METRICS, Metric, Row, rank

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_INK = "#26292e"  # of text and axes; in a page the text's own colour, light or dark
# Told apart in any kind of colour blindness together with the markers (Okabe and Ito; Tol), and
# against white as against black.
_COLORS = ("#1a7fc0", "#e07b00", "#009e73", "#cc6699", "#56b4e9", "#b35900", "#8a6fd1", "#8a8f98")
_MARKERS = "osD^vPXp<>h"
_PASS_COLORS = (
    "#4e79a7", "#f28e2b", "#59a14f", "#e15759", "#76b7b2", "#b07aa1",
    "#c9a227", "#9c755f", "#8cb4dc", "#8f8f94", "#f4a6b0", "#2f6b5e",
)  # fmt: skip
_COLUMNS = 3
_PANEL = (4.0, 2.9)  # inches
_WIDE = 20.0  # the ratio of values from which an axis is logarithmic

_STYLE: Any = {
    "svg.fonttype": "none",
    "text.parse_math": False,
    "svg.hashsalt": "scan4d",
    "font.family": "sans-serif",
    "font.size": 9,
    "axes.titlesize": 10,
    "text.color": _INK,
    "axes.labelcolor": _INK,
    "axes.edgecolor": _INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#8888884d",
    "grid.linewidth": 0.6,
    "xtick.color": _INK,
    "ytick.color": _INK,
    "legend.frameon": False,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "hatch.linewidth": 0.6,
}

# --- what is drawn --------------------------------------------------------------------


def time_against_error(rows: Sequence[Row], metric: Metric) -> Figure:
    """A panel for each scene: gpu_ms of its rows and the Pareto front, without other counts, noise or zooms.

    Defaults are large and have their 5th to 95th percentile as a bar; a thin line joins a sweep.
    """
    rows = [row for row in rows if metric.name in row["errors"]]  # others were timed alone
    scenes = {scene: [row for row in rows if row["scene"] == scene] for scene in distinct(rows, "scene")}
    looks = _looks(rows)

    def panel(axes: Axes, scene: str) -> None:
        shown = [row for row in scenes[scene] if row["sweep"] not in ("n", "noise", "zoom")]
        ceiling = [row for row in shown if row["backend"] == CEILING and row["sweep"] == ""]
        others = [row for row in shown if row["backend"] != CEILING]
        for backend in distinct(others, "backend"):
            _cloud(axes, [row for row in others if row["backend"] == backend], metric, looks[backend])
        _front(axes, [row for row in others if row["backend"] != FLOOR], metric)
        _logarithmic(axes, "x", [METRICS["gpu_ms"].of(row) for row in shown])
        _logarithmic(axes, "y", [magnitude(metric, row) for row in others], _WIDE)
        for row in ceiling:
            _at_edge(axes, row, metric, looks[CEILING])
        axes.set(title=scene, xlabel="gpu_ms [ms]", ylabel=metric.label)

    return _grid(list(scenes), panel, looks)


def along(rows: Sequence[Row], scene: str, sweep: str, metrics: Sequence[Metric]) -> Figure:
    """A panel for each metric against `sweep` ("n" or "noise") in a scene.

    Against the number of points both axes are logarithmic, and the legend has the exponents.
    """
    shown = swept(rows, scene, sweep)
    looks = _looks(rows)

    def panel(axes: Axes, metric: Metric) -> None:
        for backend in distinct(shown, "backend"):
            own = sorted((row for row in shown if row["backend"] == backend), key=lambda row: row[sweep])
            x, y = [row[sweep] for row in own], [magnitude(metric, row) for row in own]
            power = slope(x, y)
            label = f"N^{power:.2f} {backend}" if math.isfinite(power) else None
            over = 3 if backend == FLOOR else 2  # hollow, so that what it covers is seen
            axes.plot(x, y, **looks[backend], linewidth=1, markersize=5, label=label, zorder=over)
        if sweep == "n":
            _logarithmic(axes, "x", [row["n"] for row in shown])
        power_law = sweep == "n" and metric.best == "low"
        values = [magnitude(metric, row) for row in shown]
        logarithmic = _logarithmic(axes, "y", values, 1 if power_law else _WIDE)
        axes.set(title=metric.name, xlabel=_SWEEPS[sweep], ylabel=metric.label)
        if power_law and logarithmic:
            axes.legend(fontsize=7, handlelength=1.2, labelspacing=0.25)

    return _grid(list(metrics), panel, looks)


def passes(rows: Sequence[Row]) -> Figure:
    """A panel for each scene: the passes of each backend, one after the other, and gpu_ms as a line."""
    scenes = {scene: [row for row in rows if row["scene"] == scene] for scene in distinct(rows, "scene")}
    found = sorted({name for row in rows for name in row.get("passes", {})})
    looks: dict[str, dict[str, Any]] = {
        name: {
            "facecolor": _PASS_COLORS[i % len(_PASS_COLORS)],
            "hatch": ("", "////", "....", "xxxx")[i // len(_PASS_COLORS) % 4],
            "edgecolor": "#ffffff80",
        }
        for i, name in enumerate(found)
    }

    def panel(axes: Axes, scene: str) -> None:
        own = sorted(scenes[scene], key=lambda row: rank(row["backend"]), reverse=True)
        for y, row in enumerate(own):
            left = 0.0
            for name, times in row.get("passes", {}).items():
                axes.barh(y, times["median"], 0.7, left, **looks[name], linewidth=0.4)
                left += times["median"]
            axes.plot([METRICS["gpu_ms"].of(row)] * 2, [y - 0.45, y + 0.45], color=_INK, linewidth=1)
        axes.set_yticks(range(len(own)), [row["backend"] for row in own])
        axes.set(title=scene, xlabel="ms")
        axes.grid(axis="y", visible=False)

    return _grid(list(scenes), panel, looks, bars=True)


def swept(rows: Iterable[Row], scene: str, sweep: str) -> list[Row]:
    """The rows of a scene that vary `sweep`, and its defaults; each value once."""
    of_scene = [row for row in rows if row["scene"] == scene and row["sweep"] in ("", sweep)]
    if not any(row["sweep"] == sweep for row in of_scene):
        return []
    return list({(row["backend"], row[sweep]): row for row in of_scene}.values())


def sweeps(rows: Sequence[Row]) -> list[list[Row]]:
    """The rows of one backend that differ in one parameter alone, by its value, for each that is swept."""
    lines = []
    for sweep in sorted({row["sweep"] for row in rows} - {""}):
        alike: dict[str, list[Row]] = {}
        for row in rows:
            if row["sweep"] in ("", sweep) and sweep in row["params"]:
                others = {name: value for name, value in row["params"].items() if name != sweep}
                alike.setdefault(repr(others), []).append(row)
        for line in alike.values():
            line.sort(key=lambda row: (isinstance(row["params"][sweep], str), row["params"][sweep]))
        lines += [line for line in alike.values() if any(row["sweep"] for row in line)]
    return lines


def distinct(rows: Iterable[Row], column: str) -> list[str]:
    """Values of a column, each once: backends by name between floor and ceiling, else as they come."""
    found = list(dict.fromkeys(row[column] for row in rows))
    if column == "backend":
        found.sort(key=rank)
    return found


def magnitude(metric: Metric, row: Row) -> float:
    """The value of a metric as it is drawn: of a signed one the magnitude."""
    value = metric.of(row)
    return abs(value) if metric.best == "zero" else value


# --- what is computed -----------------------------------------------------------------


def pareto(times: Sequence[float], losses: Sequence[float]) -> list[int]:
    """The indices of the Pareto front, by time: what nothing beats in both time and loss, less is better.

    What is not a number is on no front; of equals the first is.
    """
    order = sorted(
        (i for i in range(len(times)) if not (math.isnan(times[i]) or math.isnan(losses[i]))),
        key=lambda i: (times[i], losses[i]),
    )
    front: list[int] = []
    for i in order:
        if not front or losses[i] < losses[front[-1]]:
            front.append(i)
    return front


def slope(x: Sequence[float], y: Sequence[float]) -> float:
    """The exponent p of y = c x^p, by least squares of the logarithms; NaN for fewer than two x."""
    pairs = [(a, b) for a, b in zip(x, y, strict=True) if 0 < a < math.inf and 0 < b < math.inf]
    if len({a for a, _ in pairs}) < 2:
        return math.nan
    log_x, log_y = np.log(np.array(pairs, np.float64)).T
    log_x -= log_x.mean()
    return float(log_x @ log_y / (log_x @ log_x))


# --- what is written ------------------------------------------------------------------


def svg(figure: Figure, name: str) -> str:
    """The figure as an element of a page, in the page's font and the text's colour; the same each time.

    name: comes before all ids, so that no two figures of a page share one.
    """
    import matplotlib

    stream = StringIO()
    with matplotlib.rc_context(_STYLE):
        figure.savefig(stream, format="svg", metadata=_NO_METADATA, transparent=True)
    text = stream.getvalue()
    text = re.sub(r'id="|href="#|url\(#', rf"\g<0>{name}-", text[text.index("<svg") :])
    return re.sub(r"font-family: [^;\"]*;? ?", "", text).replace(_INK, "currentColor")


def png(figure: Figure, path: Path, dpi: int = 110) -> None:
    """The figure as a file, on white; raises InputError where it cannot be written."""
    import matplotlib

    with matplotlib.rc_context(_STYLE), whole_file(path) as temporary:
        figure.savefig(temporary, format="png", dpi=dpi, facecolor="white", metadata={"Software": None})


# --- how --------------------------------------------------------------------------------

_NO_METADATA: Any = dict.fromkeys(("Date", "Creator", "Format", "Type"))
_SWEEPS = {"n": "points", "noise": "noise [pixel footprints of the scanner]"}


def _grid(
    panels: list[Any], draw: Callable[[Axes, Any], None], looks: dict[str, dict[str, Any]], bars: bool = False
) -> Figure:
    """Panels row by row below one legend."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    columns = max(1, min(_COLUMNS, len(panels)))
    rows = max(1, math.ceil(len(panels) / columns))
    handles = [
        Patch(label=name, **look) if bars else Line2D([], [], label=name, **look, linewidth=0)
        for name, look in looks.items()
    ]
    per_line = 8
    top = 0.1 + 0.22 * math.ceil(len(handles) / per_line)
    width, height = _PANEL
    part = columns / _COLUMNS, 1 - top / (height * rows + top)
    layout = ConstrainedLayoutEngine(h_pad=0.09, rect=(0, 0, *part))
    with matplotlib.rc_context(_STYLE):
        figure = Figure((width * _COLUMNS, height * rows + top), layout=layout)
        FigureCanvasAgg(figure)
        for number, panel in enumerate(panels):
            draw(figure.add_subplot(rows, columns, number + 1), panel)
        if handles:
            figure.legend(handles=handles, loc="upper left", ncols=per_line, fontsize=9, borderaxespad=0.1)
        figure.draw_without_rendering()
        figure.set_layout_engine("none")  # as it is now; else each file lays it out anew
    return figure


def _looks(rows: Iterable[Row]) -> dict[str, dict[str, Any]]:
    """Colour and marker of each backend; those of floor and ceiling do not depend on the others."""
    looks: dict[str, dict[str, Any]] = {}
    baselines = {
        FLOOR: {"color": _INK, "marker": "o", "markerfacecolor": "none"},
        CEILING: {"color": _INK, "marker": "*", "markerfacecolor": "none"},
    }
    found = distinct(rows, "backend")
    for number, name in enumerate(name for name in found if name not in baselines):
        looks[name] = {
            "color": _COLORS[number % len(_COLORS)],
            "marker": _MARKERS[number % len(_MARKERS)],
        }
    return {name: baselines.get(name) or looks[name] for name in found}


def _cloud(axes: Axes, rows: list[Row], metric: Metric, look: dict[str, Any]) -> None:
    """The rows of one backend: its default with its spread, and a line for each sweep."""
    time = METRICS["gpu_ms"]
    for line in sweeps(rows):
        x, y = [time.of(row) for row in line], [magnitude(metric, row) for row in line]
        axes.plot(x, y, **look, linewidth=0.6, markersize=3.5, alpha=0.75)
    for row in [row for row in rows if row["sweep"] == ""]:
        _default(axes, row, magnitude(metric, row), look)


def _default(axes: Axes, row: Row, y: float, look: dict[str, Any]) -> None:
    """A large mark at the time of a row, with a bar of its spread."""
    median, spread = METRICS["gpu_ms"].of(row), row["gpu_ms"]
    bar = [[median - spread["p5"]], [spread["p95"] - median]]
    axes.errorbar(median, y, xerr=bar, **look, markersize=8, elinewidth=0.8, linewidth=0, zorder=3)


def _at_edge(axes: Axes, row: Row, metric: Metric, look: dict[str, Any]) -> None:
    """A row that the error axis is not stretched for: beyond its end it is at the edge, with its number."""
    value, (low, high) = magnitude(metric, row), axes.get_ylim()
    axes.set_ylim(low, high)
    if low <= value <= high or math.isnan(value):
        _default(axes, row, value, look)
        return
    time, below = METRICS["gpu_ms"].of(row), value < low
    position: Any = {"xy": (time, 0 if below else 1), "xycoords": axes.get_xaxis_transform()}
    axes.plot(*position["xy"], **look, transform=position["xycoords"], markersize=8, clip_on=False, zorder=3)
    text, offset = f"{value:.2g} {'↓' if below else '↑'}", (0, 7 if below else -13)
    axes.annotate(
        text, **position, xytext=offset, textcoords="offset points", ha="center", fontsize=7, zorder=4
    )


def _front(axes: Axes, rows: list[Row], metric: Metric) -> None:
    """The Pareto front of some rows as a step line behind them."""
    times = [METRICS["gpu_ms"].of(row) for row in rows]
    values = [magnitude(metric, row) for row in rows]
    front = pareto(times, [metric.loss(metric.of(row)) for row in rows])
    x, y = [times[i] for i in front], [values[i] for i in front]
    axes.step(x, y, where="post", color=_INK, linewidth=1.2, linestyle=(0, (4, 2)), alpha=0.7, zorder=1)


def _logarithmic(axes: Axes, letter: str, values: Iterable[float], span: float = 1.0) -> bool:
    """Make the axis "x" or "y" logarithmic if its values span so much; whether all of it is.

    With a zero among the values it is linear below the decade of the least other one.
    """
    from matplotlib.scale import LogScale, SymmetricalLogScale
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    finite = [value for value in values if math.isfinite(value)]
    positive = [value for value in finite if value > 0]
    if not positive or max(positive) < span * min(positive):
        return False
    whole, least = min(finite) > 0, 10.0 ** math.floor(math.log10(min(positive)))
    axis = {"x": axes.xaxis, "y": axes.yaxis}[letter]
    scale = LogScale(axis) if whole else SymmetricalLogScale(axis, linthresh=least)
    axes.set(**{f"{letter}scale": scale})
    if whole:
        short = max(positive) < 100 * min(positive)
        axis.set_major_locator(LogLocator(subs=(1, 2, 5) if short else (1,)))
        axis.set_minor_formatter(NullFormatter())
    else:
        axes.set(**{f"{letter}lim": (-0.3 * least, 2 * max(positive))})
    axis.set_major_formatter(FuncFormatter(lambda value, _: _short(value)))
    return whole


def _short(value: float) -> str:
    """A number at a tick: 20k, 5M."""
    for unit, letter in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if abs(value) >= unit:
            return f"{value / unit:g}{letter}"
    return f"{value:g}"
