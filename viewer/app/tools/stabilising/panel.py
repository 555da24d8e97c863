"""Stabilising in the panel: the switch, the reference frame, and what is known of the motions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import imgui

from ....scan.times import frame_in_words
from ... import widgets
from ...ui import Ui
from .choices import Settings

if TYPE_CHECKING:
    from . import Tool


def draw(tool: Tool, ui: Ui) -> None:
    """Declare the section of the panel."""
    choices = tool.choices
    words = "Show as recorded" if choices.is_shown else "Stabilise"
    if ui.row(widgets.labelled(words, "stabilise")).button():
        tool.toggle()
    ui.tooltip("Remove the motion of the head, or of another part that stays rigid", "stabilise")
    widgets.fact("Reference", frame_in_words(choices.reference).capitalize())
    imgui.begin_disabled(tool.frame == choices.reference)
    if ui.row("Use this frame").button():
        tool.choose("Set reference frame", reference=tool.frame)
    imgui.end_disabled()
    widgets.tooltip("Have the region in all frames stand as it stands in this frame")
    _draw_state(tool, ui)


def _draw_state(tool: Tool, ui: Ui) -> None:
    """Say how far the motions are known, and what is known of them."""
    motions, stabiliser = tool.stabiliser.motions, tool.stabiliser
    if motions is None:
        widgets.faint("Scan4D finds the part of the subject that keeps its shape, and removes its motion.")
        return
    if motions.problem:
        widgets.faint(motions.problem)
        return
    known, count = len(stabiliser.known), len(tool.context.timeline)
    if known < count:
        widgets.faint(f"The motion of {known} of {count} frames is known.")
        if stabiliser.is_stopped and ui.row("Continue").button():
            stabiliser.resume()
    facts = tool.facts
    changed, _ = imgui.checkbox("Colour by distance", tool.is_colored)
    ui.tooltip("Colour the scan by its distance from the surface of the reference frame", "distance_colors")
    if changed:
        tool.toggle_colors()
    widgets.faint("Curves of the motion (V plots them):")
    tool.context.settings = widgets.edit(tool.context.settings, Settings())
    for line in facts.lines:
        widgets.faint(line)
    for warning in facts.warnings:
        imgui.text_wrapped(warning)
