"""The benchmark's report: one page that needs no network, and its plots as files."""

from __future__ import annotations

import base64
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import InputError
from ...files import output_folder, whole_file
from ...resources import resource_path
from .. import goals
from ..baselines import CEILING, FLOOR
from . import plots
from .pictures import PANELS, picture_path
from .results import (
    COSTS,
    METRICS,
    NOTES,
    NUMERICS,
    RESULTS,
    SURFACE,
    Metric,
    Row,
    error_metrics,
    rank,
    read_rows,
    row_title,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE = "report.html"
# What the summary shows of each default row; then what is plotted besides.
_SUMMARY = (
    "gpu_ms", "cpu_ms", "same_ms", "first_ms", "prepare_ms", "bytes_gpu",
    "hole_percent", "through_percent", "closed_percent",
    "spill_percent", "depth_median_px", "wrong_layer_percent", "normal_mean", "psnr", "ssim", "flip",
    "visibility_error_percent",
)  # fmt: skip
_JUDGED = _SUMMARY[6:]
_PLOTTED = (
    *_JUDGED, "spill_p95", "boundary_mean", "depth_bias_px", "depth_rmse_px",
    "depth_p95_px", "normal_signed_mean",
    "flicker_orbit_color", "flicker_orbit_normal", "flicker_pose_color", "flicker_pose_normal",
)  # fmt: skip
_SWEPT_COSTS = ("gpu_ms", "prepare_ms", "bytes_gpu")
_SWEPT_ERRORS = (
    "hole_percent", "through_percent", "depth_median_px", "wrong_layer_percent", "normal_mean", "psnr",
    "visibility_error_percent",
)  # fmt: skip

_DASH, _MINUS = "\N{EN DASH}", "\N{MINUS SIGN}"
_MANY = 2000  # marks in a figure from which a page holds it as pixels: less to load, and to draw
_PICTURES = 4 << 20  # bytes of pictures in a page; more stay in their files


@dataclass(frozen=True)
class Cell:
    """A cell of a table: a text, a CSS class and a tooltip."""

    text: str
    kind: str = ""
    note: str = ""


@dataclass(frozen=True)
class Plot:
    """A figure of the page: its heading, a line about it, and the element."""

    title: str
    note: str
    body: str


@dataclass(frozen=True)
class BackendPanels:
    """Side-by-side panels of a backend. source: a data URI, or empty where only the file has it."""

    scene: str
    backend: str
    file: str
    source: str


def write_report(folder: Path) -> Path:
    """Make report.html and plots/*.png of the results, numerics and pictures in a folder; gives the page.

    The same rows give the same page. Raises InputError where there is nothing to report, where a file is
    broken or cannot be written.
    """
    rows, numerics, surface = (
        read_rows(folder / name) if (folder / name).exists() else [] for name in (RESULTS, NUMERICS, SURFACE)
    )
    if not (rows or numerics or surface):
        raise InputError("no results to report", folder, "Run scan4d bench first")
    for stale in (folder / "plots").glob("*.png"):
        stale.unlink()
    metrics, scenes = error_metrics(rows), _defaults(rows)
    shown = COSTS + metrics
    page = _template().render(
        about=about(rows),
        columns=[METRICS[name] for name in _SUMMARY],
        notes=_notes(folder),
        judged=[METRICS[name] for name in _JUDGED],
        overall=overall(list(scenes.values())) if len(scenes) > 1 else [],
        scenes=[(scene, summary_rows(own)) for scene, own in scenes.items()],
        against=list(_against(rows, metrics, folder)),
        swept=list(_swept(rows, folder)),
        passes=_passes(rows, folder),
        pictures=list(_pictures(folder, rows)),
        panels=PANELS,
        numerics=stability(numerics),
        goals=goals_met(surface),
        metrics=shown,
        every=[(row_title(row), [three_digits(metric.of(row)) for metric in shown]) for row in rows],
    )
    path = folder / PAGE
    with whole_file(path) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return path


def three_digits(value: float) -> str:
    """Three significant digits, without an exponent where that is short."""
    if math.isnan(value):
        return _DASH
    if math.isinf(value):
        return "∞" if value > 0 else f"{_MINUS}∞"
    if value == 0 or 1e-3 <= abs(value) < 1e6:
        digits = 0 if value == 0 else max(0, 2 - math.floor(math.log10(abs(value))))
        text = f"{value:.{digits}f}"
    else:
        text = f"{value:.2e}"
    return text.replace("-", _MINUS)


# --- tables ---------------------------------------------------------------------------


def about(rows: Sequence[Row]) -> list[tuple[str, str]]:
    """Circumstances of the measuring: names and values, several where the rows differ."""
    fields = ("device", "driver", "timer", "size", "views", "seed", "version")
    return [
        (field, "; ".join(dict.fromkeys(_text(row.get(field, "unknown")) for row in rows)))
        for field in fields
    ]


def summary_rows(rows: Sequence[Row]) -> list[tuple[str, str, list[Cell]]]:
    """The default rows of a scene: backend, kind ("floor", "ceiling" or empty), a cell for each column.

    The best of each column, floor and ceiling aside, has the kind "best"; other errors that nothing faster
    beats have the kind "front".
    """
    contest, on_front = _contest(rows), fronts(rows)
    best = {}
    for name in _SUMMARY:
        losses = {METRICS[name].loss(METRICS[name].of(row)) for row in contest}
        known = [loss for loss in losses if not math.isnan(loss)]
        best[name] = min(known) if len(known) > 1 else math.nan
    kinds = {FLOOR: "floor", CEILING: "ceiling"}

    def cell(row: Row, metric: Metric) -> Cell:
        value = metric.of(row)
        named = f"{metric.name} of {row['backend']}"
        if len(contest) > 1 and row in contest and metric.loss(value) == best[metric.name]:
            return Cell(_shown(metric, row), "best", named)
        stands = len(contest) > 1 and row["backend"] in on_front.get(metric.name, ())
        return Cell(_shown(metric, row), "front" if stands else "", named)

    return [
        (row["backend"], kinds.get(row["backend"], ""), [cell(row, METRICS[name]) for name in _SUMMARY])
        for backend in plots.distinct(rows, "backend")
        for row in rows
        if row["backend"] == backend
    ]


def fronts(rows: Sequence[Row]) -> dict[str, list[str]]:
    """Pareto fronts of the default rows of a scene: for each judged error the backends that none beats in
    both time and error, by time. Floor and ceiling have no part."""
    time, contest = METRICS["gpu_ms"], _contest(rows)
    times = [time.of(row) for row in contest]
    losses = {name: [METRICS[name].loss(METRICS[name].of(row)) for row in contest] for name in _JUDGED}
    return {
        name: [contest[i]["backend"] for i in plots.pareto(times, values)] for name, values in losses.items()
    }


def _contest(rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row["backend"] not in (FLOOR, CEILING)]


def overall(scenes: Sequence[Sequence[Row]]) -> list[tuple[str, str, list[str]]]:
    """Over the default rows of several scenes, for each backend: name, time against gl-points, fronts.

    The time is the geometric mean of the ratios of gpu_ms. Fronts: for each judged error, in how many of
    the scenes where it is known nothing else is both faster and better.
    """
    time = METRICS["gpu_ms"]
    ratios: dict[str, list[float]] = {}
    known: Counter[tuple[str, str]] = Counter()
    won: Counter[tuple[str, str]] = Counter()
    for rows in scenes:
        floor = [time.of(row) for row in rows if row["backend"] == FLOOR]
        contest, on_front = _contest(rows), fronts(rows)
        for row in contest:
            ratios.setdefault(row["backend"], []).extend(time.of(row) / other for other in floor if other > 0)
        for name in _JUDGED:
            known.update((row["backend"], name) for row in contest if _known([row], METRICS[name]))
            won.update((backend, name) for backend in on_front[name])

    def won_of(backend: str) -> list[str]:
        of = [(won[backend, name], known[backend, name]) for name in _JUDGED]
        return [f"{some} of {all_}" if all_ else _DASH for some, all_ in of]

    return [(name, three_digits(_geometric_mean(ratios[name])), won_of(name)) for name in sorted(ratios)]


def stability(lines: Sequence[Row]) -> dict[str, Any]:
    """The table of numerics: backends, rows of (name, cells, reasons), and how many are of each kind."""
    backends = plots.distinct(lines, "backend")
    cells = {(line["row"], line["backend"]): _outcome(line) for line in lines}
    table = []
    for name in dict.fromkeys(line["row"] for line in lines):
        of_row = [line for line in lines if line["row"] == name]
        reasons = {f"tolerance: {line['reason']}": None for line in of_row if line.get("reason")}
        for line in of_row:
            if line.get("limit"):
                reasons.setdefault(f"limit: {line['limit']}")
        table.append((name, [cells.get((name, backend), Cell(_DASH)) for backend in backends], list(reasons)))
    counts = {kind: sum(cell.kind == kind for cell in cells.values()) for kind in ("held", "failed", "limit")}
    limits = {line["limit"] for line in lines if line.get("limit")}
    return {"backends": backends, "rows": table, "counts": counts, "limits": len(limits)}


def goals_met(rows: Sequence[Row]) -> dict[str, Any]:
    """The table of the suite "surface": backends, and rows of (goal, bound, cells)."""
    lines = goals.table(rows)
    backends = list(dict.fromkeys(name for line in lines for name in line.found))

    def cell(line: goals.Line, name: str) -> Cell:
        if name not in line.found:
            return Cell(_DASH)
        value = line.found[name]
        kind = "" if math.isinf(line.goal.high) else "held" if line.goal.meets(value) else "failed"
        return Cell(three_digits(value), kind)

    table = [
        (f"{line.goal.title}: {line.condition}", line.goal.bound, [cell(line, name) for name in backends])
        for line in lines
    ]
    return {"backends": backends, "rows": table}


def _outcome(line: Row) -> Cell:
    """Whether a row of numerics was held; where not, what went beyond its bound."""
    bound = line.get("bound") or {}
    units = {"pixels": (100, "% of pixels"), "depth": (1, "px of depth"), "color": (1, "levels of colour")}
    found = {name: float(line.get(name, math.nan)) for name in units}
    texts = {name: f"{three_digits(found[name] * scale)} {unit}" for name, (scale, unit) in units.items()}
    note = ", ".join(
        f"{text} (bound {three_digits(bound.get(name, math.nan) * units[name][0])})"
        for name, text in texts.items()
    )
    if line["held"]:
        return Cell("held", "held", note)
    beyond = [texts[name] for name, value in found.items() if value > bound.get(name, math.inf)]
    kind = "limit" if line.get("limit") else "failed"
    return Cell(f"{kind}: {', '.join(beyond)}" if beyond else kind, kind, note)


def _defaults(rows: Iterable[Row]) -> dict[str, list[Row]]:
    """The rows with default parameters of each scene, by its heading."""
    scenes: dict[str, list[Row]] = {}
    for row in rows:
        if row["sweep"] == "":
            noise = f", noise {three_digits(row['noise'])}" if row["noise"] else ""
            count = f"{row['n']:,}".replace(",", "\N{NARROW NO-BREAK SPACE}")
            heading = f"{row['scene']}: {count} points{noise}"
            scenes.setdefault(heading, []).append(row)
    return scenes


def _geometric_mean(values: Sequence[float]) -> float:
    known = [math.log(value) for value in values if value > 0]
    return math.exp(sum(known) / len(known)) if known else math.nan


def _shown(metric: Metric, row: Row) -> str:
    """The value of a metric; of a spread all three numbers, of bytes millions."""
    value, spread = metric.of(row), row.get(metric.name)
    if metric.unit == "bytes":
        return f"{three_digits(value / 1e6)} MB"
    if isinstance(spread, dict):
        return f"{three_digits(value)} [{three_digits(spread['p5'])}{_DASH}{three_digits(spread['p95'])}]"
    return three_digits(value)


def _notes(folder: Path) -> list[str]:
    """Notes of the run that the numbers do not tell: scenes left out, that it was stopped."""
    path = folder / NOTES
    return path.read_text(encoding="utf-8").splitlines() if path.exists() else []


def _text(value: Any) -> str:
    return "\N{MULTIPLICATION SIGN}".join(map(str, value)) if isinstance(value, list) else str(value)


# --- plots ----------------------------------------------------------------------------


def _against(rows: Sequence[Row], metrics: Sequence[Metric], folder: Path) -> Iterator[Plot]:
    """Time against each metric that any row knows."""
    for metric in metrics:
        known = sum(math.isfinite(metric.of(row)) for row in rows)
        if metric.name in _PLOTTED and known:
            figure = plots.time_against_error(rows, metric)
            yield _plot(figure, f"time-{metric.name}", metric.name, metric.help, folder, known)


def _swept(rows: Sequence[Row], folder: Path) -> Iterator[Plot]:
    """Costs and errors against the number of points, errors against noise, scene by scene."""
    for sweep, word, names in (
        ("n", "points", _SWEPT_COSTS + _SWEPT_ERRORS),
        ("noise", "noise", _SWEPT_ERRORS),
    ):
        for scene in plots.distinct(rows, "scene"):
            of_scene = plots.swept(rows, scene, sweep)
            known = [METRICS[name] for name in names if _known(of_scene, METRICS[name])]
            if known:
                figure = plots.along(rows, scene, sweep, known)
                yield _plot(figure, f"{word}-{_slug(scene)}", f"{scene}: against {word}", "", folder)


def _passes(rows: Sequence[Row], folder: Path) -> Plot | None:
    defaults = [row for row in rows if row["sweep"] == "" and row.get("passes")]
    if not defaults:
        return None
    marks = 3 * sum(len(row["passes"]) for row in defaults)  # a bar is drawn by more than a mark
    return _plot(plots.passes(defaults), "passes", "Passes", "", folder, marks)


def _known(rows: Iterable[Row], metric: Metric) -> bool:
    return any(not math.isnan(metric.of(row)) for row in rows)


def _plot(figure: Figure, name: str, heading: str, note: str, folder: Path, marks: int = 0) -> Plot:
    """Write the figure as plots/NAME.png, and give it for the page."""
    from markupsafe import Markup, escape

    path = folder / "plots" / f"{name}.png"
    output_folder(path.parent)
    plots.png(figure, path)
    if marks > _MANY:
        body = f'<img class="plot" alt="{escape(heading)}" src="{_inline(path)}">'
    else:
        body = plots.svg(figure, name)
    return Plot(heading, note, Markup(body))


def _slug(name: str) -> str:
    return "".join(letter if letter.isalnum() else "-" for letter in name)


# --- pictures -------------------------------------------------------------------------


def _pictures(folder: Path, rows: Iterable[Row]) -> Iterator[BackendPanels]:
    """The pictures of the rows; of too many for a page the last are left in their files."""
    room = _PICTURES
    shown = {(row["scene"], row["backend"]) for row in rows}
    for scene, backend in sorted(shown, key=lambda each: (each[0], rank(each[1]))):
        path = picture_path(folder, scene, backend)
        if path.is_file():
            source = _inline(path) if room > 0 else ""
            room -= len(source)
            yield BackendPanels(scene, backend, f"pictures/{path.name}", source)


def _inline(path: Path) -> str:
    """A picture as a data URI, in WebP: a fraction of the size. Raises InputError for what is no picture."""
    from PIL import Image

    stream = BytesIO()
    try:
        with Image.open(path) as image:
            image.convert("RGB").save(stream, "webp", quality=75, method=4)
    except OSError as error:
        raise InputError(
            f"is not a picture: {error}", path, "Delete this file, or run the benchmark again"
        ) from error
    return f"data:image/webp;base64,{base64.b64encode(stream.getvalue()).decode()}"


def _template() -> Any:
    from jinja2 import Environment, StrictUndefined

    environment = Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined
    )
    return environment.from_string(resource_path("assets", "report.html").read_text(encoding="utf-8"))
