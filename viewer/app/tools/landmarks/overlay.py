"""Landmarks over the 3D view: where they are and how sure that is, what is proposed, a loupe."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import ImVec2, imgui
from numpy.typing import NDArray

from ....analysis.track import Known
from ....geometry import vector
from ....output.overlays import DIM_LANDMARK, MOST_NAMED, STATE_MARKS
from ...scene.canvas import Canvas, Label, ScreenView
from .shown import names_over

if TYPE_CHECKING:
    from . import Tool

_CHOSEN, _GHOST = 0xFFFFFF, 0xC9B8FF


def draw(tool: Tool, positions: NDArray[np.float64], canvas: Canvas, view: ScreenView) -> None:
    """Draw the landmarks at their positions on the screen, (N, 2), and what a click or a drag would do."""
    shown = tool.shown
    low, high = view.box.low, view.box.high
    with np.errstate(invalid="ignore"):  # NaN is not in the view
        inside = ((positions >= (low.x, low.y)) & (positions <= (high.x, high.y))).all(axis=1)
    drawn = np.flatnonzero(shown.is_there & inside)
    alphas = np.where(tool.seen, 1.0, DIM_LANDMARK)
    reaches = shown.sure * view.lengths_on_screen(tool.positions)
    regions = tool.regions
    are_corners = np.array([one.name in regions for one in shown.landmarks], bool)
    for known, is_corner in product((Known.PLACED, Known.CARRIED, Known.TRACKED), (False, True)):
        at = drawn[(shown.known[drawn] == known) & (are_corners[drawn] == is_corner)]
        rings = np.nan_to_num(reaches[at]) if known is not Known.PLACED else np.zeros(len(at))
        canvas.marks(positions[at], STATE_MARKS[known], alphas[at], rings, are_corners=is_corner)
    selected = shown.number(tool.selected)
    if selected is not None and selected in drawn:
        canvas.ring(ImVec2(*positions[selected].tolist()), _CHOSEN, float(alphas[selected]))
    if tool.context.settings.names and len(drawn):
        _draw_names(tool, drawn, positions, alphas, canvas, view)
    if tool.is_active:
        _draw_under_way(tool, canvas, view)


def _draw_names(
    tool: Tool,
    drawn: NDArray[np.intp],
    positions: NDArray[np.float64],
    alphas: NDArray[np.float64],
    canvas: Canvas,
    view: ScreenView,
) -> None:
    """Names beside the subject, of many landmarks beside their marks; that of a corner of a region while it
    is selected or under the mouse."""
    shown, names = tool.shown, names_over(tool.shown, tool.regions)
    named = [number for number in drawn.tolist() if number in names]
    hovered = tool.under(imgui.get_mouse_pos()) if view.is_hovered else ""
    pointed = {shown.number(name) for name in (tool.selected, hovered) if name in tool.regions}
    beside = [number for number in drawn.tolist() if number in pointed]
    texts = [shown.landmarks[number].name for number in beside]
    if len(named) <= MOST_NAMED:
        canvas.labels([_label(tool, number, names[number], positions, alphas) for number in named])
    else:
        selected = shown.number(tool.selected)
        beside += sorted(named, key=lambda number: number != selected)  # the selected one's before all others
        texts += [names[number] for number in beside[len(texts) :]]
    canvas.names(texts, positions[beside], alphas[beside])


def _label(
    tool: Tool, number: int, name: str, positions: NDArray[np.float64], alphas: NDArray[np.float64]
) -> Label:
    color = STATE_MARKS[Known(int(tool.shown.known[number]))].color
    return Label([name], positions[[number]], color, faint=alphas[number] < 1)


def _draw_under_way(tool: Tool, canvas: Canvas, view: ScreenView) -> None:
    """The mirrored position of the next one, the one that is dragged, and the loupe."""
    pose, proposal = tool.context.pose, tool.proposal
    if proposal is not None and pose is not None:
        there = view.on_screen(vector(tool.context.motion(pose).points(proposal.position)))
        if there is not None:
            canvas.ring(there, _GHOST, 0.9)
            label = Label(
                ["mirror position: press A to place the landmark here"],
                np.array([(there.x, there.y)]),
                _GHOST,
                faint=True,
            )
            canvas.labels([label])
    if tool.dragged is not None and (there := view.on_screen(tool.dragged)) is not None:
        canvas.ring(there, _CHOSEN)
    is_placing = tool.target is not None or tool.is_free or tool.dragged is not None
    if view.is_hovered and is_placing and tool.context.settings.loupe:
        canvas.loupe(imgui.get_mouse_pos())
