"""Landmarks over the 3D view: where they are and how sure that is, what is proposed, a loupe."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import ImVec2, imgui
from numpy.typing import NDArray

from ....analysis.track import Known
from ....geometry import vector
from ....output.overlays import DIM_LANDMARK, STATE_MARKS
from ...scene.canvas import Canvas, Label, ViewPlace

if TYPE_CHECKING:
    from . import Tool

_CHOSEN, _GHOST = 0xFFFFFF, 0xC9B8FF


def draw(tool: Tool, places: NDArray[np.float64], canvas: Canvas, view: ViewPlace) -> None:
    """Draw the landmarks at their places on the screen, (N, 2), and what a click or a drag would do."""
    shown = tool.shown
    low, high = view.box.low, view.box.high
    with np.errstate(invalid="ignore"):  # NaN is not in the view
        inside = ((places >= (low.x, low.y)) & (places <= (high.x, high.y))).all(axis=1)
    drawn = np.flatnonzero(shown.is_there & inside)
    alphas = np.where(tool.seen, 1.0, DIM_LANDMARK)
    reaches = shown.sure * view.lengths_on_screen(tool.positions)
    for known in (Known.PLACED, Known.TRACKED):
        at = drawn[shown.known[drawn] == known]
        rings = np.nan_to_num(reaches[at]) if known is Known.TRACKED else np.zeros(len(at))
        canvas.marks(places[at], STATE_MARKS[known], alphas[at], rings)
    selected = shown.number(tool.selected)
    if selected is not None and selected in drawn:
        canvas.ring(ImVec2(*places[selected].tolist()), _CHOSEN, float(alphas[selected]))
    if tool.desk.settings.names and len(drawn):
        order = drawn[np.argsort(drawn != selected, kind="stable")]  # the selected one's before all others
        canvas.names([shown.landmarks[n].name for n in order.tolist()], places[order], alphas[order])
    if tool.is_active:
        _draw_under_way(tool, canvas, view)


def _draw_under_way(tool: Tool, canvas: Canvas, view: ViewPlace) -> None:
    """The mirrored place of the next one, the one that is dragged, and the loupe."""
    pose, proposal = tool.desk.pose, tool.proposal
    if proposal is not None and pose is not None:
        there = view.on_screen(vector(tool.desk.motion(pose).points(proposal.position)))
        if there is not None:
            canvas.ring(there, _GHOST, 0.9)
            label = Label(["mirror place: A sets it"], np.array([(there.x, there.y)]), _GHOST, faint=True)
            canvas.labels([label])
    if tool.dragged is not None and (there := view.on_screen(tool.dragged)) is not None:
        canvas.ring(there, _CHOSEN)
    is_placing = tool.target is not None or tool.is_free or tool.dragged is not None
    if view.is_hovered and is_placing and tool.desk.settings.loupe:
        canvas.loupe(imgui.get_mouse_pos())
