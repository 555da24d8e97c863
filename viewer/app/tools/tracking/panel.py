"""Dense tracking in the panel: the reference frame, the colours, and how far points are followed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import imgui

from ....analysis.motion.dense import PointState
from ....analysis.motion.quantities import AREA, DISPLACEMENT, FIRST, NORMAL, SECOND, SPEED, TANGENTIAL
from ....scan.times import frame_in_words
from ... import widgets
from ...ui import Ui

if TYPE_CHECKING:
    from . import Tool

_NONE = "none"
_COLORS = {
    _NONE: "Not by motion",
    DISPLACEMENT: "Displacement",
    SPEED: "Speed",
    NORMAL: "Normal part",
    TANGENTIAL: "Tangential part",
    FIRST: "First principal strain",
    SECOND: "Second principal strain",
    AREA: "Area change",
}


def draw(tool: Tool, ui: Ui) -> None:
    """Declare the section of the panel."""
    choices = tool.choices
    if not choices.is_on:
        imgui.begin_disabled(len(tool.context.timeline) < 2)
        if ui.row("Follow points").button():
            tool.follow()
        imgui.end_disabled()
        ui.tooltip("Find where each point of the reference frame is in all other frames", "follow_points")
    widgets.fact("Reference", frame_in_words(choices.reference).capitalize())
    imgui.begin_disabled(tool.frame == choices.reference)
    if ui.row(widgets.labelled("Use this frame", "reference of points")).button():
        tool.choose("Set reference frame", reference=tool.frame)
    imgui.end_disabled()
    widgets.tooltip("Follow the points of this frame")
    if not choices.is_on:
        return
    widgets.label("Colour by", "What the colours show of the motion of each point")
    now = tool.color or _NONE
    name = widgets.combo("motion color", now, list(_COLORS), _COLORS)
    if name != now:
        tool.color_by("" if name == _NONE else name)
    _draw_state(tool, ui)
    _draw_region(tool, ui)


def _draw_region(tool: Tool, ui: Ui) -> None:
    """The region whose mean path is plotted."""
    widgets.label("Region", "The part of the subject whose mean path Scan4D plots")
    tool.painting.panel(ui, "Drag over the part whose mean path you want, in the reference frame")
    if tool.painting.is_empty:
        return
    if tool.region_path.path is None:
        widgets.faint("The path of the region follows once the points are known in all frames.")
    else:
        widgets.faint("V plots the mean path of the region.")


def _draw_state(tool: Tool, ui: Ui) -> None:
    """Say how far points are followed, and what is known of them in the frame that is shown."""
    work, follower = tool.follower.work, tool.follower
    if work is None:
        return
    known, count = len(follower.known), len(tool.context.timeline)
    if work.problem:
        imgui.text_wrapped(work.problem)
    if known < count:
        widgets.faint(f"The points are known in {known} of {count} frames, {count - known} left.")
    stops = follower.is_stopped or work.problem
    if stops and ui.row(widgets.labelled("Continue", "continue following")).button():
        follower.resume()
    facts = tool.colors.facts(tool.frame)
    if facts is not None and facts.is_exact:
        widgets.faint(f"The file names its {facts.points:,} points in this frame: their motion is exact.")
    elif facts is not None:
        seen, hidden, lost = (facts.shares[state] for state in PointState)
        words = f"{seen:.0%} are seen in this frame, {hidden:.0%} hidden, {lost:.0%} lost."
        widgets.faint(f"Of {facts.points:,} points, {words}")
    is_still = tool.context.followed.still is not None
    words = "the stabilised scan" if is_still else "the scan as recorded"
    widgets.faint(f"Colours show the motion of {words}. Points that are hidden or lost are grey.")
