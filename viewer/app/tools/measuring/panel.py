"""Distances in the panel: their list, and what to do with them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from ... import widgets
from ...ui import Ui
from .distances import Distance, end_words, snap_words

if TYPE_CHECKING:
    from . import Tool


def draw(tool: Tool, ui: Ui) -> None:
    """Declare the section of the panel."""
    words = "Stop measuring" if tool.is_active else "Measure distance"
    if ui.row(widgets.labelled(words, "measure")).button():
        tool.toggle()
    ui.tooltip("Click two points in the view to measure their distance", "measure")
    tool.filled = imgui.checkbox("Allow clicks on filled holes", tool.filled)[1]
    widgets.tooltip("Also measure where the renderer has filled a hole, and the scanner measured no point")
    if not tool.made.distances:
        widgets.faint("No distances yet. Press Measure distance, then click two points on the surface.")
        return
    for one in tool.shown:
        imgui.push_id(one.measure.name)
        if _draw_row(tool, one):
            tool.delete(one.measure.name)
        imgui.pop_id()
    row = ui.row("Copy", "Export CSV...", "Clear")
    if row.button():
        tool.copy()
    widgets.tooltip("Copy all distances as a table")
    if row.button():
        tool.ask_to_save()
    widgets.tooltip("Save all distances to a file. Open or drop the file to load them again")
    if row.button():
        tool.clear()
    widgets.tooltip("Delete all distances. Undo restores them")


def _draw_row(tool: Tool, one: Distance) -> bool:
    """Name and value, and below it what the ends are at; whether it is to be deleted."""
    right = imgui.get_cursor_start_pos().x + imgui.get_content_region_avail().x
    scale, button = tool.context.scale, right - 1.3 * imgui.get_frame_height()
    imgui.align_text_to_frame_padding()
    text = f"{one.label}: {one.words(scale)}"
    imgui.text(widgets.fitted(text, button - imgui.get_cursor_pos_x()))
    about = "± covers the true distance in 95 % of cases. It includes point spacing, pixel size and tracking"
    if any(end.covariance is None for end in one.ends):
        about = "Its uncertainty is not known: measure it again"
    widgets.tooltip("\n".join([text, *(end_words(end, scale) for end in one.ends), about]))
    imgui.same_line(button)
    is_deleted = widgets.icon_button(icons.ICON_FA_TRASH, "Delete")
    words = snap_words(one.ends) + (f", {one.state}" if len(tool.context.timeline) > 1 else "")
    imgui.text_disabled(widgets.fitted(words, imgui.get_content_region_avail().x))
    return is_deleted
