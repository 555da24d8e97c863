"""Distances in the panel: their list, and what to do with them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from ....analysis.surface_point import SurfacePoint
from ....scan.times import frame_in_words
from ....scan.units import Scale
from ... import widgets
from ...ui import Ui

if TYPE_CHECKING:
    from . import DistanceRow, Tool


def draw(tool: Tool, ui: Ui) -> None:
    """Declare the section of the panel."""
    words = "Stop measuring" if tool.is_active else "Measure distance"
    if ui.row(widgets.labelled(words, "measure")).button():
        tool.toggle()
    ui.tooltip("Click two points in the view to measure their distance", "measure")
    tool.filled = imgui.checkbox("Allow clicks on filled holes", tool.filled)[1]
    widgets.tooltip(
        "Also accept clicks where the renderer has filled a hole, because the scanner measured no points "
        "there"
    )
    if not tool.made.distances:
        widgets.faint("No distances yet. Press 'Measure distance', then click two points on the surface.")
        return
    for number, row_of in enumerate(tool.rows()):
        imgui.push_id(number)
        if _draw_row(tool, row_of):
            tool.delete(row_of.measure.name)
        imgui.pop_id()
    row = ui.row("Copy", "Export distances...", "Clear")
    if row.button():
        tool.copy()
    widgets.tooltip("Copy all distances as a table")
    if row.button():
        tool.ask_to_save()
    widgets.tooltip(
        "Save all distances to a file. To load the distances again, open the file or drop it onto the window"
    )
    if row.button():
        tool.clear()
    widgets.tooltip("Delete all distances. Undo restores them")


def _draw_row(tool: Tool, one: DistanceRow) -> bool:
    """Name and value, and below it what the ends are at; whether it is to be deleted."""
    right = imgui.get_cursor_start_pos().x + imgui.get_content_region_avail().x
    scale, button = tool.context.scale, right - 1.3 * imgui.get_frame_height()
    imgui.align_text_to_frame_padding()
    text = one.words(scale)
    imgui.text(widgets.fitted(text, button - imgui.get_cursor_pos_x()))
    about = (
        "In 95 % of cases, the true distance lies within ±. The value of ± includes point spacing, pixel "
        "size and tracking"
    )
    if any(end.covariance is None for end in one.ends):
        about = (
            "The uncertainty of this distance is unknown. Measure the distance again to compute its "
            "uncertainty"
        )
    widgets.tooltip("\n".join([text, *(_end_words(end, scale) for end in one.ends), about]))
    imgui.same_line(button)
    is_deleted = widgets.icon_button(icons.ICON_FA_TRASH, "Delete")
    words = snap_words(one.ends) + (f", {one.state}" if len(tool.context.timeline) > 1 else "")
    imgui.text_disabled(widgets.fitted(words, imgui.get_content_region_avail().x))
    return is_deleted


def snap_words(ends: Sequence[SurfacePoint]) -> str:
    """The points that the ends are at, or the surface, such as "at points 12 and 345"."""
    ids = [end.id for end in ends if end.id is not None]
    if len(ids) == 2:
        return f"at points {ids[0]} and {ids[1]}"
    return f"at point {ids[0]} and on the surface" if ids else "on the surface"


def _end_words(end: SurfacePoint, scale: Scale) -> str:
    """The key of an end, in full."""
    what = "surface" if end.id is None else f"at point {end.id}"
    position = ", ".join(f"{scale.factor * v:.9g}" for v in end.position)
    spacing = "unknown" if end.spacing is None else f"{scale.factor * end.spacing:.3g} {scale.unit}"
    seen = f", in a hole that the renderer filled from level {end.level}" if end.level else ""
    seen += f", on an average of {end.averaged} frames" if end.averaged else ""
    seen += ", may be the surface in front or behind" if end.at_outline else ""
    sure = "" if end.uncertainty is None else f" ± {scale.factor * end.uncertainty:.2g}"
    return f"{what}, {frame_in_words(end.frame)}: {position}{sure} {scale.unit}, spacing {spacing}{seen}"
