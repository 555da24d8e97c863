"""Measurements in the panel: their list, and what to do with them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from ....analysis.measure import Reading
from ....analysis.spot import Spot
from ....scan.times import frame_in_words
from ....scan.units import Scale
from ... import widgets
from ...ui import Ui
from .words import distance_words, snap_words

if TYPE_CHECKING:
    from . import Tool


def draw(measuring: Tool, ui: Ui) -> None:
    """Declare the section of the panel."""
    words = "Stop measuring" if measuring.is_active else "Measure distance"
    if ui.row(widgets.labelled(words, "measure")).button():
        measuring.toggle()
    ui.tooltip("Click two points in the view to measure their distance", "measure")
    measuring.filled = imgui.checkbox("Allow clicks on filled holes", measuring.filled)[1]
    widgets.tooltip("Also measure where the renderer has filled a hole, and the scanner measured no point")
    if not measuring.made.all:
        widgets.faint("No distances yet. Press Measure distance, then click two places on the surface.")
    for number, reading in enumerate(measuring.readings()):
        imgui.push_id(number)
        if _draw_row(measuring, number, reading):
            measuring.delete(number)
        imgui.pop_id()
    if measuring.made.all:
        _draw_outlets(measuring, ui)


def _draw_row(measuring: Tool, number: int, reading: Reading) -> bool:
    """Number and distance, what the ends snapped to below; whether it is to be deleted."""
    right = imgui.get_cursor_start_pos().x + imgui.get_content_region_avail().x
    imgui.align_text_to_frame_padding()
    imgui.text(f"{number + 1}:  {distance_words(reading, measuring.context.scale)}")
    widgets.tooltip(_details(reading, measuring.context.scale))
    imgui.same_line(right - 1.3 * imgui.get_frame_height())
    is_deleted = widgets.icon_button(icons.ICON_FA_TRASH, "Delete")
    words = snap_words(reading)
    if len(measuring.context.timeline) > 1:
        words += f", {reading.motion}"
    imgui.text_disabled(widgets.fitted(words, imgui.get_content_region_avail().x))
    if reading.fixed and len(measuring.context.timeline) > 1:
        widgets.tooltip(f"Fixed in space: {reading.fixed}")
    return is_deleted


def _details(reading: Reading, scale: Scale) -> str:
    """A text that tells both ends in full."""
    ends = [_end_words(end, scale) for end in reading.measurement.ends]
    if reading.measurement.uncertainty is None:
        return "\n".join([*ends, "Its uncertainty is not known: measure it again"])
    return "\n".join(
        [
            *ends,
            "± covers the true distance in 95 % of cases. It includes point spacing, pixel size and tracking",
        ]
    )


def _end_words(end: Spot, scale: Scale) -> str:
    what = "surface" if end.id is None else f"at point {end.id}"
    place = ", ".join(f"{scale.factor * v:.9g}" for v in end.position)
    spacing = "unknown" if end.spacing is None else f"{scale.factor * end.spacing:.3g} {scale.unit}"
    seen = f", filled from level {end.level}" if end.level else ""
    seen += ", at an outline: it may lie on the surface in front or behind" if end.at_outline else ""
    sure = "" if end.uncertainty is None else f" ± {scale.factor * end.uncertainty:.2g}"
    return f"{what}, {frame_in_words(end.frame)}: {place}{sure} {scale.unit}, spacing {spacing}{seen}"


def _draw_outlets(measuring: Tool, ui: Ui) -> None:
    row = ui.row("Copy", "Export CSV...", "Clear")
    if row.button():
        measuring.copy()
    widgets.tooltip("Copy all distances as a table")
    if row.button():
        measuring.ask_to_save()
    widgets.tooltip("Save all distances to a file. Open or drop the file to load them again")
    if row.button():
        measuring.clear()
    widgets.tooltip("Delete all distances. Undo restores them")
