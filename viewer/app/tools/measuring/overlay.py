"""Measurements over the 3D view: their ends, lines and labels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import ImVec2, imgui

from ....analysis.measure import Reading
from ....analysis.spot import Spot
from ....output.overlays import DIM_LINE, LINE_COLOR
from ...scene.canvas import Canvas, Label, ViewPlace
from .words import distance_words

if TYPE_CHECKING:
    from . import Tool


def draw(measuring: Tool, readings: Sequence[Reading], canvas: Canvas, view: ViewPlace) -> None:
    """Draw measurements as they stand in the frame, and the one that was begun."""
    drawn = [
        _draw_one(measuring, number, reading, canvas, view) for number, reading in enumerate(readings, 1)
    ]
    canvas.labels([label for label in drawn if label is not None])
    if measuring.begun is not None and (place := view.on_screen(measuring.begun.position)) is not None:
        if view.is_hovered and measuring.is_active:
            canvas.line(place, imgui.get_mouse_pos(), LINE_COLOR, 0.7)
        _draw_end(measuring.begun, place, 1.0, canvas)


def _draw_one(
    measuring: Tool, number: int, reading: Reading, canvas: Canvas, view: ViewPlace
) -> Label | None:
    """Draw ends and line of a measurement; returns its label, None where nothing of it is in the view."""
    ends = reading.measurement.ends
    alpha = 1.0 if all([measuring.is_seen(end) for end in ends]) else DIM_LINE
    places = [view.on_screen(end.position) for end in ends]
    there = [place for place in places if place is not None]
    if len(there) == 2:
        canvas.line(there[0], there[1], LINE_COLOR, alpha)
    for end, place in zip(ends, places, strict=True):
        if place is not None:
            _draw_end(end, place, alpha, canvas)
    seen = view.box.clipped(there[0], there[-1]) if there else None
    if seen is None:
        return None
    text = f"{number}:  {distance_words(reading, measuring.context.scale)}"
    line = np.array([(place.x, place.y) for place in seen])
    return Label([text], line, LINE_COLOR, faint=alpha < 1)


def _draw_end(end: Spot, place: ImVec2, alpha: float, canvas: Canvas) -> None:
    """A disc where points are followed, a ring on the surface alone."""
    draw_place = canvas.ring if end.id is None else canvas.point
    draw_place(place, LINE_COLOR, alpha)
