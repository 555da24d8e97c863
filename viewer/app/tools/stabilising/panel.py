"""Stabilising in the panel: the switch, the reference frame, and what is known of the motions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import imgui

from ....scan.times import frame_in_words
from ... import widgets
from ...ui import Ui
from .._painting import length_field
from .choices import FOUND, LANDMARKS, PAINTED, REGION_WORDS, Settings

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
    _draw_region(tool, ui)
    _draw_state(tool, ui)


def _draw_region(tool: Tool, ui: Ui) -> None:
    """The choice of the region, and what it needs."""
    choices = tool.choices
    widgets.label("Rigid region", "The part of the subject whose motion Scan4D removes")
    region = widgets.combo("region", choices.region, list(REGION_WORDS), REGION_WORDS)
    if region != choices.region:
        radius = choices.radius or tool.painting.radius
        tool.choose("Choose region", region=region, radius=radius)
    if region == PAINTED:
        tool.painting.panel(ui, "Drag over the parts that stay rigid, in the reference frame")
    if region == LANDMARKS:
        _draw_landmarks(tool)


def _draw_landmarks(tool: Tool) -> None:
    """The landmarks in the reference frame, each with whether the region is around it, and its radius."""
    choices, placed = tool.choices, tool.placed
    if not placed:
        widgets.faint(f"No landmark is placed in {frame_in_words(choices.reference)}.")
    for number, name in enumerate(placed):
        label = widgets.labelled(name, f"landmark {number}")
        changed, is_on = imgui.checkbox(label, name in choices.landmarks)
        if changed:
            others = tuple(one for one in choices.landmarks if one != name)
            tool.choose("Choose region", landmarks=(*others, name) if is_on else others)
    about = "Radius of the region around each landmark"
    if (radius := length_field(tool.context, "Radius", about, choices.radius)) is not None:
        tool.choose("Set radius of region", merge=True, radius=radius)


def _draw_state(tool: Tool, ui: Ui) -> None:
    """Say how far the motions are known, and what is known of them."""
    motions, stabiliser = tool.stabiliser.motions, tool.stabiliser
    if tool.choices.is_empty:
        widgets.faint("The region is empty: paint it, or tick its landmarks.")
        return
    if motions is None:
        if tool.choices.region == FOUND:
            widgets.faint("Scan4D finds the part of the subject that keeps its shape in all frames.")
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
    for line in facts.lines:
        widgets.faint(line)
    for warning in facts.warnings:
        imgui.text_wrapped(warning)
    _draw_colors(tool, ui)


def _draw_colors(tool: Tool, ui: Ui) -> None:
    """The colours of motions on the subject, and the choice of their curves."""
    changed, _ = imgui.checkbox("Colour by distance", tool.is_colored)
    ui.tooltip("Colour the scan by its distance from the surface of the reference frame", "distance_colors")
    if changed:
        tool.toggle_colors()
    changed, _ = imgui.checkbox("Show region", tool.shows_region)
    widgets.tooltip("Colour the part of the subject that counts as rigid")
    if changed:
        tool.toggle_region()
    widgets.faint("Curves of the motion (V plots them):")
    tool.context.settings = widgets.edit(tool.context.settings, Settings())
