"""The panel's rows on the automatic choice of the renderer: its bound, the choice, all configurations."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import ImVec2, ImVec4, imgui, implot

from ...backends import backend
from ...choice.goal import PIXELS, Goal
from .. import widgets
from ..scene.rendering import FIRST_GOAL

if TYPE_CHECKING:
    from ...choice.choose import Candidate, Choice, Comparison
    from ...choice.configurations import Configuration
    from ...scan.units import Scale
    from ..scene.choosing import Choosing
    from ..scene.rendering import Rendering
    from ..session import Session

_TIMES = 1.0, 1000.0  # ms that may be chosen
_ERRORS = 0.05, 4.0  # pixels, likewise
_FIRST_ERROR = 0.5
_HEIGHT = 8.0  # of the curve, in heights of the font
_DOT, _CHOSEN, _REACH = 0.2, 0.35, 0.8  # radius of points, and of where the mouse finds them, likewise
_ROOM, _MARGIN = 1.15, 0.1  # of an axis, in its largest number, and before 0 in all
_FARTHEST = 2.0  # times what the axis shows otherwise: a bound that is shown
_X, _Y = implot.ImAxis_.x1.value, implot.ImAxis_.y1.value
_PLOT = (
    implot.Flags_.no_title | implot.Flags_.no_mouse_text | implot.Flags_.no_legend | implot.Flags_.no_inputs
    | implot.Flags_.no_menus
).value  # fmt: skip


def draw(session: Session, rendering: Rendering, choosing: Choosing, scale: Scale) -> None:
    """Declare the rows. scale: of displayed lengths."""
    goal = session.document.goal
    imgui.begin_disabled(goal is None and bool(choosing.why_not))  # as of another device it can be ended
    imgui.begin_group()
    widgets.label(
        "Automatic",
        "Scan4D chooses the renderer for each view, so that the picture stays within a limit of time "
        "or error",
    )
    wanted = imgui.checkbox("##automatic", goal is not None)[1]
    imgui.end_group()
    imgui.end_disabled()
    if choosing.why_not:
        widgets.tooltip(choosing.why_not)
    if wanted != (goal is not None):
        rendering.switch_automatic()
    elif goal is not None and not choosing.why_not:
        shown = choosing.comparison
        footprint = None if shown is None else shown.footprint * scale.factor
        rendering.aim(_edit_goal(goal, scale.unit, footprint))
        _draw_choice(choosing)


def _edit_goal(goal: Goal, unit: str, footprint: float | None) -> Goal:
    """Declare what edits a goal. unit: of displayed lengths. footprint: the edge of a pixel where the
    scan is, in it; None while that is not known."""
    lengths = sorted({unit, goal.unit} - {PIXELS, "ms"})
    words = {"ms": "Time", PIXELS: "Error in pixels"} | {each: f"Error in {each}" for each in lengths}
    widgets.label("Limit", "Whether to limit the drawing time or the error of a picture")
    kind = widgets.combo("bound", goal.unit, list(words), words)
    if kind != goal.unit:
        first = _FIRST_ERROR if kind == PIXELS else float(f"{_FIRST_ERROR * (footprint or 1.0):.2g}")
        return FIRST_GOAL if kind == "ms" else Goal("error", first, kind)
    pixel = 1.0 if kind == PIXELS else footprint or goal.bound / _FIRST_ERROR
    low, high = _TIMES if kind == "ms" else (_ERRORS[0] * pixel, _ERRORS[1] * pixel)
    widgets.label(
        "Maximum", "Time to draw one full picture. While the view rests, Scan4D refines the picture further"
    )
    flags = imgui.SliderFlags_.logarithmic.value
    edited, bound = imgui.slider_float(
        "##most", goal.bound, low, high, widgets.number_format("%.3g", kind), flags
    )
    return Goal(goal.kind, float(f"{bound:.3g}"), goal.unit) if edited and bound > 0 else goal


def _draw_choice(choosing: Choosing) -> None:
    """Declare what was chosen, and what it is expected to take."""
    if choosing.problem:
        widgets.faint(f"Scan4D cannot choose a renderer: {choosing.problem}.")
    choice, comparison, measured = choosing.choice, choosing.comparison, choosing.measured_ms
    if choice is None or comparison is None:
        return
    widgets.fact("Using", configuration_in_words(choice.configuration))
    widgets.fact("Expected", _expected(choice))
    bounded = next(
        each.bounded for each in comparison.candidates if each.configuration == choice.configuration
    )
    widgets.fact("90 % within", f"{bounded:.2g} {comparison.goal.unit}")
    widgets.tooltip(
        "Nine of ten pictures should stay within this value. Scan4D compares this value with your limit"
    )
    if measured is not None:
        widgets.fact("Last picture", f"{measured:.3g} ms")
    if choosing.overrun:
        widgets.faint(choosing.overrun)
    if not choice.meets_limit:
        widgets.faint(
            "No renderer is sure to stay within the limit. Scan4D uses the renderer that comes closest."
        )
    _draw_curve(comparison, choice)


def configuration_in_words(configuration: Configuration) -> str:
    """A configuration as a user reads it, such as "Surfels, passes one"."""
    values = (f"{name.replace('_', ' ')} {value}" for name, value in configuration.values.items())
    return ", ".join([backend(configuration.backend).title, *values])


def _expected(choice: Choice) -> str:
    error, goal = choice.expected.error, choice.goal
    length = f" ({error * choice.footprint:.2g} {goal.unit})" if goal.unit not in ("ms", PIXELS) else ""
    return f"{choice.expected.ms:.3g} ms, error {error:.2g} px{length}"


def _draw_curve(comparison: Comparison, choice: Choice) -> None:
    """Plot the error of all configurations over their time, and the bound as a line. A tooltip names each."""
    candidates = sorted(comparison.candidates, key=lambda each: each.expected.ms)
    times, errors = (np.array(row) for row in zip(*map(_position, candidates), strict=True))
    goal, em = comparison.goal, imgui.get_font_size()
    text = imgui.get_style_color_vec4(imgui.Col_.text)
    accent = imgui.get_style_color_vec4(imgui.Col_.check_mark)
    if not implot.begin_plot("##configurations", ImVec2(-1, _HEIGHT * em), _PLOT):
        return
    is_time = goal.kind == "time"
    bound = goal.bound if goal.unit in ("ms", PIXELS) else goal.bound / comparison.footprint
    limits = [float(_ROOM * max(times.max(), _TIMES[0])), float(_ROOM * max(errors.max(), _ERRORS[0]))]
    if bound < _FARTHEST * limits[not is_time]:
        limits[not is_time] = max(limits[not is_time], _ROOM * bound)
    low = [-_MARGIN * limit for limit in limits]
    implot.setup_axes_limits(low[0], limits[0], low[1], limits[1], implot.Cond_.always.value)
    implot.setup_axis_format(_X, "%g ms")
    implot.setup_axis_format(_Y, "%g px")
    implot.setup_finish()
    along = np.array([bound, bound]), np.array([low[is_time], limits[is_time]])
    x, y = along if is_time else along[::-1]
    faint = imgui.get_style_color_vec4(imgui.Col_.text_disabled)
    implot.plot_line("##bound", x, y, implot.Spec(line_color=faint))
    implot.plot_scatter("##all", times, errors, _dot(text, _DOT * em))
    chosen = [number for number, each in enumerate(candidates) if each.configuration == choice.configuration]
    implot.plot_scatter("##chosen", times[chosen], errors[chosen], _dot(accent, _CHOSEN * em))
    pointed = _pointed(candidates, _REACH * em) if imgui.is_window_hovered() else None
    implot.end_plot()
    if pointed is not None:
        time, error = _position(pointed)
        imgui.set_tooltip(
            f"{configuration_in_words(pointed.configuration)}\n{time:.3g} ms, error {error:.2g} px"
        )


def _position(candidate: Candidate) -> tuple[float, float]:
    return candidate.expected.ms, candidate.expected.error


def _pointed(candidates: list[Candidate], reach: float) -> Candidate | None:
    """The one whose point in the plot the mouse is at."""
    mouse = imgui.get_mouse_pos()

    def distance(each: Candidate) -> float:
        at = implot.plot_to_pixels(*_position(each))
        return math.hypot(at.x - mouse.x, at.y - mouse.y)

    nearest = min(candidates, key=distance)
    return nearest if distance(nearest) <= reach else None


def _dot(color: ImVec4, radius: float) -> implot.Spec:
    return implot.Spec(
        marker=implot.Marker_.circle.value, marker_size=radius, marker_fill_color=color,
        marker_line_color=color,
    )  # fmt: skip
