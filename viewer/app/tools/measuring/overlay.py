"""Distances over the 3D view: their ends, lines and labels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import ImVec2, imgui

from ....geometry import vector
from ....output.overlays import DIM_LINE, LINE_COLOR
from ...scene.canvas import Canvas, Label, ViewPlace
from .distances import Distance

if TYPE_CHECKING:
    from . import Tool


def draw(tool: Tool, distances: Sequence[Distance], canvas: Canvas, view: ViewPlace) -> None:
    """Draw the distances in the frame, and the one that was begun."""
    motion = tool.motion
    seen = tool.seen(distances)
    for one, is_seen in zip(distances, seen, strict=True):
        alpha = 1.0 if is_seen else DIM_LINE
        ends = [view.on_screen(vector(end)) for end in motion.points(one.positions)]
        there = [end for end in ends if end is not None]
        _draw_line(there, alpha, canvas)
        inside = view.box.clipped(there[0], there[-1]) if there else None
        if inside is not None:
            text = f"{one.label}: {one.words(tool.context.scale)}"
            line = np.array([(end.x, end.y) for end in inside])
            canvas.labels([Label([text], line, LINE_COLOR, faint=not is_seen)])
    if tool.begun is not None:
        position = vector(motion.points(np.array(tool.begun.position)))
        if (start := view.on_screen(position)) is not None:
            if view.is_hovered and tool.is_active:
                canvas.line(start, imgui.get_mouse_pos(), LINE_COLOR, 0.7)
            canvas.point(start, LINE_COLOR)


def _draw_line(ends: Sequence[ImVec2], alpha: float, canvas: Canvas) -> None:
    if len(ends) == 2:
        canvas.line(ends[0], ends[1], LINE_COLOR, alpha)
    for end in ends:
        canvas.point(end, LINE_COLOR, alpha)
