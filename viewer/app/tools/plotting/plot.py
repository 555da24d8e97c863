"""Curves under the timeline: a bar of choices, the plot, and the numbers beside it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import ImVec2, ImVec4, imgui, implot
from imgui_bundle import icons_fontawesome_6 as icons

from ....analysis.measures.curves import correlations
from ....analysis.words import with_note, with_uncertainty
from ....output.overlays import BAND_OPACITY
from ....output.plots import CurvePlot, PlotLine
from ... import widgets
from ...ui import Ui
from .choices import AGAINST, MODE_WORDS, ORDER_WORDS, REPEATS, TIME
from .shown import Curve, chosen_of
from .words import NUMBERS_HELP, WARNING

if TYPE_CHECKING:
    from . import Tool

_COMBO, _SLIDER, _TABLE = 9.0, 10.0, 38.0  # widths, in heights of the font
_TABLE_SHARE = 0.5  # of the width, at most
_LOWEST = 6.5  # height of the plot, likewise
_LINE, _POINTED, _THIN = 0.1, 0.2, 0.05  # thickness of lines, likewise
_DOT, _NOW = 0.15, 0.3  # radius of points, likewise
_PADDING = 0.4
_FIT_PADDING = 0.02, 0.08  # shares of the axes' lengths
_MOST_SMOOTHING = 2.0  # seconds
_X, _Y = (
    implot.ImAxis_.x1.value,
    tuple(axis.value for axis in (implot.ImAxis_.y1, implot.ImAxis_.y2, implot.ImAxis_.y3)),
)
_PLOT = implot.Flags_.no_title | implot.Flags_.no_mouse_text | implot.Flags_.no_legend
_TABLE_FLAGS = (
    imgui.TableFlags_.scroll_x | imgui.TableFlags_.scroll_y | imgui.TableFlags_.row_bg
    | imgui.TableFlags_.sizing_fixed_fit
).value  # fmt: skip


def draw(tool: Tool, ui: Ui) -> None:
    """Declare what is under the timeline."""
    _draw_bar(tool, ui)
    tool.update()
    plot = tool.shown.plot
    if plot is None or not plot.is_known:
        widgets.faint(_why_none(tool))
        return
    room, em = imgui.get_content_region_avail(), imgui.get_font_size()
    room.y = max(room.y, _LOWEST * em)  # in less, the drawer scrolls
    table = min(_TABLE * em, _TABLE_SHARE * room.x)
    size = ImVec2(room.x - table - imgui.get_style().item_spacing.x, room.y)
    frame = _draw_plot(tool, plot, size)
    imgui.same_line()
    _draw_table(tool, tool.context.index if frame is None else frame, ImVec2(table, room.y))


def _why_none(tool: Tool) -> str:
    settings, mode = tool.settings, tool.settings.mode
    if tool.shown.plot is not None:
        if tool.context.followed.is_busy:
            return "Scan4D is computing the measures in all frames."
        if not settings.derivative:
            return "No measure has a value in any frame."
        words, count = ORDER_WORDS[settings.order], settings.smoothing.degree + 1
        return f"{words} needs values in {count} frames in a row."
    if not tool.landmarks.measures:
        return "No measures yet: add one in the panel, such as the distance between two landmarks."
    if not tool.context.followed.series:
        return (
            "Scan4D is computing the measures in all frames."
            if tool.context.followed.is_busy
            else "No measure has a value yet: place the landmarks of a measure."
        )
    if not tool.shown.curves:
        return "All measures are hidden: tick a measure in the panel."
    if mode == REPEATS and len(tool.times) == 1:
        return "Repeats need several frames."
    return (
        "A plot of one measure against another needs two measures."
        if mode == AGAINST
        else "No peak is high enough: reduce the smallest peak height at the left."
    )


def _draw_bar(tool: Tool, ui: Ui) -> None:
    """The bar of choices: what is plotted, and where it goes."""
    settings, em, curves = tool.settings, imgui.get_font_size(), tool.shown.curves
    mode = _combo("mode", settings.mode, MODE_WORDS)
    widgets.same_line(_COMBO * em)
    order = _combo("order", settings.order, ORDER_WORDS)
    names = {curve.name: curve.name for curve in curves}
    if curves and mode in (AGAINST, REPEATS):
        field, words = ("abscissa", "Against ") if mode == AGAINST else ("aligned", "Peaks of ")
        old = chosen_of(curves, getattr(tool.choices, field)).name
        widgets.same_line(_COMBO * em)
        new = _combo(field, old, {name: words + name for name in names})
        if new != old:
            tool.choose("Choose measure", **{field: new})
    least = settings.least
    if mode == REPEATS:
        widgets.same_line(_COMBO * em)
        imgui.set_next_item_width(_COMBO * em)
        share = imgui.slider_float("##least", 100 * least, 5, 100, "at least %.0f %%")[1]
        least = round(share) / 100
        widgets.tooltip("Smallest peak that counts as a repeat, in percent of the curve's range")
    widgets.same_line(widgets.check_width("±"))
    bands = imgui.checkbox("±", settings.bands)[1]
    widgets.tooltip(
        "Band around each curve, which contains the true value in 95 % of cases. For repeats, the band "
        "extends one standard deviation to each side"
    )
    widgets.same_line(_SLIDER * em)
    imgui.set_next_item_width(_SLIDER * em)
    points = (
        f", {settings.smoothing.wide_enough(tool.times).points(tool.times)} frames"
        if len(tool.times) > 1
        else ""
    )
    low, logarithmic = 0.02, imgui.SliderFlags_.logarithmic.value
    seconds = imgui.slider_float(
        "##smoothing",
        settings.seconds,
        low,
        _MOST_SMOOTHING,
        widgets.number_format("%.2f", f"s{points}"),
        logarithmic,
    )[1]
    widgets.tooltip(
        "Width of the window, in seconds, that smooths speed, acceleration and the numbers under the "
        "plot (Savitzky-Golay)"
    )
    tool.settings = replace(
        settings, mode=mode, order=order, bands=bands, least=least, seconds=float(f"{seconds:.3g}")
    )
    for words, act, about, is_there in (
        ("Fit", tool.fit, "Show the whole plot (double click)", tool.shown.plot is not None),
        ("Copy", tool.copy, "Copy the plotted values as a table", tool.shown.plot is not None),
        (
            "Copy numbers",
            tool.copy_numbers,
            "Copy amplitude, onset, peak and duration as a table",
            bool(curves),
        ),
        (
            "Export plot...",
            tool.ask_to_save,
            "Export a table (CSV) or a picture (PNG, SVG)",
            tool.shown.plot is not None,
        ),
    ):
        widgets.same_line(widgets.button_width(words))
        imgui.begin_disabled(not is_there)
        if imgui.button(words):
            act()
        imgui.end_disabled()
        widgets.tooltip(about)
    close = imgui.get_frame_height()
    widgets.same_line(close)
    imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + imgui.get_content_region_avail().x - close)
    if widgets.flat_button(icons.ICON_FA_XMARK, "Close"):
        tool.toggle()


def _combo(name: str, current: str, words: dict[str, str]) -> str:
    imgui.set_next_item_width(_COMBO * imgui.get_font_size())
    return widgets.combo(name, current, list(words), words)


# --- the plot -------------------------------------------------------------------------


@contextmanager
def _plot_begun(name: str, size: ImVec2) -> Iterator[bool]:
    """A plot, which ends whatever goes wrong in it; whether it is to be filled."""
    padding = _PADDING * imgui.get_font_size()
    implot.push_style_var(implot.StyleVar_.plot_padding.value, ImVec2(padding, padding))
    implot.push_style_var(implot.StyleVar_.fit_padding.value, ImVec2(*_FIT_PADDING))
    is_begun = implot.begin_plot(name, size, _PLOT.value)
    try:
        yield is_begun
    finally:
        if is_begun:
            implot.end_plot()
        implot.pop_style_var(2)


def _draw_plot(tool: Tool, plot: CurvePlot, size: ImVec2) -> int | None:
    """Draw the plot; returns the frame under the mouse, None where there is none."""
    mode = tool.settings.mode
    if tool.takes_fit(plot):
        implot.set_next_axes_to_fit()
    frame = None
    with _plot_begun(f"##{mode}", size) as is_begun:
        if is_begun:
            _set_axes(plot)
            for number, line in enumerate(plot.drawn):
                implot.set_axes(_X, _Y[plot.units.index(line.unit)])
                _draw_line(tool, plot, line, number)
            implot.set_axes(_X, _Y[0])
            if mode == TIME:
                frame = _draw_playhead(tool, plot)
            elif mode == AGAINST:
                _draw_now(tool, plot)
    return frame


def _set_axes(plot: CurvePlot) -> None:
    implot.setup_axis(_X, None if plot.x_unit == "s" else widgets.unhidden(f"{plot.x_label} [{plot.x_unit}]"))
    if plot.x_unit == "s":
        implot.setup_axis_format(_X, "%g s")
    for number, unit in enumerate(plot.units):
        flags = implot.AxisFlags_.aux_default.value if number else 0
        implot.setup_axis(_Y[number], widgets.unhidden(unit), flags)
    implot.setup_finish()


def _draw_line(tool: Tool, plot: CurvePlot, line: PlotLine, number: int) -> None:
    """A line with its band; values that stand alone as points."""
    em, color = imgui.get_font_size(), _color(line.color)
    is_pointed = tool.pointed is not None and line.label.startswith(tool.pointed)
    if line.edges is not None:
        spec = implot.Spec(fill_color=color, fill_alpha=BAND_OPACITY)
        implot.plot_shaded(f"##band {number}", plot.x, *line.edges, spec)
    thick = _THIN if line.is_thin else _POINTED if is_pointed else _LINE
    spec = implot.Spec(line_color=color, line_weight=thick * em)
    implot.plot_line(f"##line {number}", plot.x, line.values, spec)
    if len(line.lone):
        implot.plot_scatter(
            f"##alone {number}", plot.x[line.lone], line.values[line.lone], _dot(color, color, _DOT)
        )


def _draw_playhead(tool: Tool, plot: CurvePlot) -> int | None:
    """The line at the frame that is shown, which a drag or a click moves; returns the frame that is pointed
    at."""
    times, context, em = plot.x, tool.context, imgui.get_font_size()
    index = min(context.index, len(times) - 1)
    color = imgui.get_style_color_vec4(imgui.Col_.text)
    flags = implot.DragToolFlags_.no_fit.value
    moved, x, _, is_over, is_held = implot.drag_line_x(
        0, float(times[index]), color, _LINE * em, flags, False, False, False
    )
    is_hovered = implot.is_plot_hovered()
    at = nearest(times, implot.get_plot_mouse_pos().x)
    is_clicked = is_hovered and imgui.is_mouse_released(0) and widgets.is_click()
    wanted = nearest(times, x) if moved else at if is_clicked else index
    if wanted != context.index:
        context.seek(wanted)
    return at if is_hovered and not (is_over or is_held) else None


def nearest(times: np.ndarray, time: float) -> int:
    """The frame whose time is nearest."""
    return int(np.argmin(np.abs(times - time)))


def _draw_now(tool: Tool, plot: CurvePlot) -> None:
    """A point on each line at the frame that is shown."""
    index = min(tool.context.index, len(plot.x) - 1)
    for number, line in enumerate(plot.drawn):
        implot.set_axes(_X, _Y[plot.units.index(line.unit)])
        here = slice(index, index + 1)
        spec = _dot(_color(line.color), imgui.get_style_color_vec4(imgui.Col_.text), _NOW)
        implot.plot_scatter(f"##now {number}", plot.x[here], line.values[here], spec)


def _dot(fill: ImVec4, edge: ImVec4, size: float) -> implot.Spec:
    """How a point is drawn. size: its radius, in heights of the font."""
    return implot.Spec(
        marker=implot.Marker_.circle.value, marker_size=size * imgui.get_font_size(), marker_fill_color=fill,
        marker_line_color=edge,
    )  # fmt: skip


def _color(color: int) -> ImVec4:
    return ImVec4((color >> 16) / 255, (color >> 8 & 255) / 255, (color & 255) / 255, 1.0)


# --- the numbers ----------------------------------------------------------------------


def _draw_table(tool: Tool, frame: int, size: ImVec2) -> None:
    """A row for each curve: its value in a frame, and its numbers; a row under the mouse marks the curve."""
    curves, is_against = tool.shown.curves, tool.settings.mode == AGAINST
    help = (
        {"r": "Pearson's correlation with the measure on the horizontal axis"} if is_against else NUMBERS_HELP
    )
    related = correlations(curves, chosen_of(curves, tool.choices.abscissa)) if is_against else {}
    tool.pointed = None
    if not imgui.begin_table("numbers", 2 + len(help), _TABLE_FLAGS, size):
        return
    imgui.table_setup_scroll_freeze(1, 1)
    for words in ("", f"{tool.times[frame]:.2f} s###now", *help):
        imgui.table_setup_column(words)
    imgui.table_next_row(imgui.TableRowFlags_.headers.value)
    imgui.table_set_column_index(1)
    imgui.table_header(f"{tool.times[frame]:.2f} s")
    for number, (words, about) in enumerate(help.items(), 2):
        imgui.table_set_column_index(number)
        imgui.table_header(words)
        widgets.tooltip(about)
    for curve in curves:
        imgui.table_next_row()
        _draw_name(tool, curve)
        now = with_uncertainty(float(curve.values[frame]), float(curve.sigmas[frame]), curve.unit)
        now = with_note(now, curve.notes.get(frame, ""))
        correlated = (f"{related[curve.name]:.3f}" if curve.name in related else "",)
        for words in (now, *(correlated if is_against else tool.words_of(curve))):
            imgui.table_next_column()
            imgui.text(words)
            if words.startswith(WARNING):
                widgets.tooltip(curve.warning)
    imgui.end_table()


def _draw_name(tool: Tool, curve: Curve) -> None:
    """The curve's colour and name; a click goes to its peak."""
    imgui.table_next_column()
    imgui.push_style_color(imgui.Col_.text, _color(curve.color))
    imgui.text(icons.ICON_FA_MINUS)
    imgui.pop_style_color()
    imgui.same_line()
    is_clicked, _ = imgui.selectable(
        widgets.unhidden(curve.name), False, imgui.SelectableFlags_.span_all_columns.value
    )
    if is_clicked and curve.movement:
        tool.context.seek(nearest(curve.times, curve.movement.peak))
    if imgui.is_item_hovered():
        tool.pointed = curve.name
    widgets.tooltip("Click to go to the frame of the peak")
