"""Deviation in the panel: the reference, the numbers of the frame that is shown, and their histogram."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import ImVec2, ImVec4, imgui

from ....analysis.deviation.reference import ESTIMATED
from ....look import color_table
from ....scan.times import frame_in_words
from ... import widgets
from ...ui import Ui
from .choices import FILE, FRAME, KIND_WORDS, MEAN

if TYPE_CHECKING:
    from . import Tool

_BARS = 41  # of the histogram: one in the middle is at 0
_HEIGHT = 4.0  # of the histogram, in heights of the font
_ROWS = (
    ("Mean", "mean", "Mean of the deviations, with their signs"),
    ("RMS", "rms", "Root mean square of the deviations"),
    ("95 %", "p95", "95 % of the deviations are smaller, whatever their signs"),
    ("Maximum", "max", "The largest deviation, whatever its sign"),
)


def draw(tool: Tool, ui: Ui) -> None:
    """Declare the section of the panel."""
    is_on = tool.choices.is_on
    if ui.row(widgets.labelled("Hide deviation" if is_on else "Show deviation", "show deviation")).button():
        tool.toggle()
    ui.tooltip("Measure how far each frame is from a reference, and colour the scan by it", "deviation")
    _draw_reference(tool, ui)
    if not is_on:
        return
    if not tool.colored.name:
        if ui.row("Colour by deviation").button():
            tool.show_colors()
        widgets.tooltip("Colour the scan by its deviation again")
    _draw_state(tool, ui)
    _draw_numbers(tool)
    _draw_histogram(tool)
    widgets.label("Region", "Scan4D also shows the numbers of a painted region")
    about = f"Drag over the part whose deviations you want, in {frame_in_words(tool.choices.first)}"
    tool.painting.panel(ui, about)
    widgets.faint("V plots the numbers over time.")


def _draw_reference(tool: Tool, ui: Ui) -> None:
    """The choice of the reference, and what it needs."""
    choices, last = tool.choices, len(tool.context.timeline) - 1
    widgets.label("Reference", "Scan4D measures the distances of all frames from its surface")
    kind = widgets.combo("reference kind", choices.kind, list(KIND_WORDS), KIND_WORDS)
    if kind != choices.kind:
        tool.choose("Choose reference", kind=kind, last=max(choices.last, min(choices.first + 1, last)))
        if kind == FILE and not choices.file:
            tool.ask_for_file()
    if kind == FRAME:
        widgets.fact("Frame", frame_in_words(choices.first).capitalize())
        imgui.begin_disabled(tool.frame == choices.first)
        if ui.row(widgets.labelled("Use this frame", "reference of deviations")).button():
            tool.choose("Set reference frame", first=tool.frame)
        imgui.end_disabled()
        widgets.tooltip("Measure distances from this frame")
    if kind == MEAN:
        for title, name, about in (
            ("First frame", "first", "First frame of the mean. In these frames, the subject should rest"),
            ("Last frame", "last", "Last frame of the mean"),
        ):
            widgets.label(title, about)
            changed, number = imgui.slider_int(f"##{name}", getattr(choices, name) + 1, 1, last + 1)
            if changed:
                new = min(max(number - 1, 0), last)
                ends = {"first": min(choices.first, new), "last": max(choices.last, new)} | {name: new}
                tool.choose("Set frames of the mean", merge=True, **ends)
    if kind == FILE:
        widgets.fact("File", Path(choices.file).name or "none")
        if ui.row("Choose file...").button():
            tool.ask_for_file()
        widgets.tooltip("Choose another scan, such as that of an earlier visit, or a mesh")


def _draw_state(tool: Tool, ui: Ui) -> None:
    """Say how far deviations are known, and what they are of."""
    work, finder = tool.finder.work, tool.finder
    if work is None:
        if tool.choices.reference is None:
            widgets.faint("No reference is chosen: choose a file.")
        return
    if work.problem:
        imgui.text_wrapped(work.problem)
    known, count = len(finder.known), len(work.places)
    if known < count:
        widgets.faint(f"The deviations of {known} of {count} frames are known.")
    stops = finder.is_stopped or work.problem
    if stops and ui.row(widgets.labelled("Continue", "continue deviations")).button():
        finder.resume()
    if work.deviations is not None and work.deviations.reference.outside_by == ESTIMATED:
        widgets.faint("The reference has no normals: Scan4D estimates which side is outside.")
    if work.deviations is not None and work.deviations.assumes_unit:
        unit = work.timeline.unit
        widgets.faint(f"The reference states no unit: Scan4D assumes {unit}, the unit of the scan.")
    is_still = tool.context.followed.still is not None
    words = "The scan is stabilised." if is_still else "The scan is as recorded. U stabilises it."
    widgets.faint(words)


def _draw_numbers(tool: Tool) -> None:
    """The statistics of the frame that is shown, of all points and of the region."""
    found = tool.finder.known.get(tool.frame)
    if found is None:
        return
    columns = {"Whole": found.whole} | ({} if found.region is None else {"Region": found.region})
    if imgui.begin_table("deviations", 1 + len(columns), imgui.TableFlags_.sizing_stretch_same.value):
        imgui.table_next_column()
        for title in columns:
            imgui.table_next_column()
            imgui.text_disabled(title)
        for title, name, about in _ROWS:
            imgui.table_next_column()
            imgui.text_disabled(title)
            widgets.tooltip(about)
            for one in columns.values():
                imgui.table_next_column()
                imgui.text(_length(tool, getattr(one, name), found.whole.max))
        imgui.table_next_column()
        imgui.text_disabled("Has a value")
        widgets.tooltip("Share of the points that lie above or below the reference. Other points are grey")
        for one in columns.values():
            imgui.table_next_column()
            imgui.text(f"{one.share:.1%}")
        imgui.end_table()


def _length(tool: Tool, value: float, largest: float) -> str:
    """A length in words, with as many decimals as give the largest one three digits."""
    scale = tool.context.scale
    if not np.isfinite(value):
        return "-"
    top = scale.factor * largest
    decimals = max(2 - math.floor(math.log10(top)), 0) if top > 0 else 0
    return f"{scale.factor * value:.{decimals}f} {scale.unit}"


def _draw_histogram(tool: Tool) -> None:
    """The histogram of the frame that is shown, in the colours of the map, between its ends."""
    values, look = tool.values(), tool.context.document.look
    low, high = look.low, look.high
    if values is None or low is None or high is None or not low < high:
        return
    counts = tool.cached.of("histogram", (values, look), lambda: np.histogram(values, _BARS, (low, high))[0])
    most, em = int(counts.max()), imgui.get_font_size()
    if not most:
        return
    corner, room = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail().x
    step, table = room / _BARS, color_table(look.color_map)
    for number, count in enumerate(counts.tolist()):
        red, green, blue, _ = (table[round(255 * number / (_BARS - 1))] / 255).tolist()
        ink = imgui.color_convert_float4_to_u32(ImVec4(red, green, blue, 1))
        top = corner + ImVec2(number * step, _HEIGHT * em * (1 - count / most))
        end = corner + ImVec2((number + 1) * step, (_HEIGHT + 0.3) * em)
        imgui.get_window_draw_list().add_rect_filled(top, end, ink)
    imgui.dummy(ImVec2(room, (_HEIGHT + 0.3) * em))
    widgets.tooltip("Histogram of the deviations in this frame. Colours are those of the scan")
    scale = tool.context.scale
    ends = [f"{scale.factor * end:+.3g} {scale.unit}" for end in (low, high)]
    imgui.text_disabled(ends[0])
    middle = imgui.calc_text_size("0").x / 2
    imgui.same_line(imgui.get_cursor_start_pos().x + room / 2 - middle)
    imgui.text_disabled("0" if low == -high else "")
    imgui.same_line(imgui.get_cursor_start_pos().x + room - imgui.calc_text_size(ends[1]).x)
    imgui.text_disabled(ends[1])
